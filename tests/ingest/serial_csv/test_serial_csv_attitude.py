"""Attitudes that a file holds: what is declared as the truth, and what the device says."""

import numpy as np
import pytest

from attlog.geometry.frames import ned_frd_from_enu_flu, rpy_ned_deg
from attlog.geometry.quaternions import angle_rad, conjugate, multiply
from attlog.schemas import AttitudeColumns, InputError, World

G = 9.80665
SENSORS = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"


def printed(table, motion, names: str, *more) -> str:
    return table(f"{SENSORS},{names}", motion.time_s, motion.force / G, np.degrees(motion.rate), *more, form="%.12g")


def wxyz(q):
    return q[:, [3, 0, 1, 2]]


def apart_deg(a, b) -> float:
    return float(np.degrees(angle_rad(multiply(conjugate(a), b)).max()))


def test_a_quaternion_named_reference_is_the_truth(read, table, motion) -> None:
    result = read(printed(table, motion, "ref_qw,ref_qx,ref_qy,ref_qz", wxyz(motion.q)))
    assert apart_deg(result.attitude(), motion.q) < 1e-6
    about = result["/reference/attitude"].channel.metadata
    assert (about["north"], about["axes"], about["frame"]) == ("arbitrary", "enu", "sensor")
    assert "enu" in result.guesses[0]


def test_a_quaternion_with_axes_declared_is_the_truth(read, table, motion) -> None:
    text = printed(table, motion, "qw,qx,qy,qz", wxyz(ned_frd_from_enu_flu(motion.q)))
    result = read(text, attitude=AttitudeColumns(World.NED), strict=True)
    assert apart_deg(result.attitude(), motion.q) < 1e-6


def test_a_plain_quaternion_is_what_the_device_says(read, table, motion) -> None:
    result = read(printed(table, motion, "q0,q1,q2,q3", wxyz(motion.q)))
    assert "/onboard/csv/attitude" in result.topics
    assert "/reference/attitude" not in result.topics
    assert apart_deg(result.attitude("/onboard/csv/attitude"), motion.q) < 1e-6


def test_it_is_the_truth_where_the_user_says_so(read, table, motion) -> None:
    text = printed(table, motion, "q0,q1,q2,q3", wxyz(motion.q))
    assert "/reference/attitude" in read(text, attitude=AttitudeColumns(reference=True)).topics
    declared = AttitudeColumns(World.ENU, reference=False)
    assert "/reference/attitude" not in read(text, attitude=declared).topics


@pytest.mark.parametrize(
    ("world", "inverse", "as_printed"),
    [
        ("enu", False, lambda q: q),
        ("ned", False, ned_frd_from_enu_flu),
        ("enu", True, conjugate),
        ("ned", True, lambda q: conjugate(ned_frd_from_enu_flu(q))),
    ],
)
def test_axes_are_those_in_which_gravity_points_up(read, table, motion, world, inverse, as_printed) -> None:
    result = read(printed(table, motion, "qw,qx,qy,qz", wxyz(as_printed(motion.q))))
    about = result["/onboard/csv/attitude"].channel.metadata
    assert about["axes"] == world + (" inverse" if inverse else "")
    assert apart_deg(result.attitude("/onboard/csv/attitude"), motion.q) < 1e-6


def test_axes_in_which_gravity_points_nowhere_are_not_believed(read, table, motion) -> None:
    scrambled = np.random.default_rng(3).normal(size=(motion.n, 4))
    scrambled /= np.linalg.norm(scrambled, axis=1, keepdims=True)
    result = read(printed(table, motion, "qw,qx,qy,qz", scrambled))
    assert result.topics == ["/imu0/data_raw", "/csv/log"]
    assert set(result["/csv/log"].data.dtype.names) == {"qw", "qx", "qy", "qz"}
    assert "guessed none" in result.guesses[0]


def test_euler_angles_in_degrees(read, table, motion) -> None:
    result = read(printed(table, motion, "roll (deg),pitch (deg),yaw (deg)", rpy_ned_deg(motion.q)))
    assert apart_deg(result.attitude("/onboard/csv_euler/attitude"), motion.q) < 1e-6
    assert result["/onboard/csv_euler/attitude"].channel.metadata["axes"] == "ned"


def test_euler_angles_in_radians_of_another_order(read, table, motion) -> None:
    from scipy.spatial.transform import Rotation

    angles = Rotation.from_quat(motion.q).as_euler("XYZ")
    declared = AttitudeColumns(World.ENU, euler="xyz")
    result = read(printed(table, motion, "ref_roll_rad,ref_pitch_rad,ref_yaw_rad", angles), attitude=declared)
    assert apart_deg(result.attitude(), motion.q) < 1e-6


def test_north_west_up(read, table, motion) -> None:
    nwu = multiply([0.0, 0.0, -np.sqrt(0.5), np.sqrt(0.5)], motion.q)
    text = printed(table, motion, "qw,qx,qy,qz", wxyz(nwu))
    result = read(text, attitude=AttitudeColumns(World.NWU, north="true"))
    assert apart_deg(result.attitude(), motion.q) < 1e-6
    assert result["/reference/attitude"].channel.metadata["north"] == "true"


@pytest.mark.parametrize("scale", [1.02, 0.9])
def test_a_norm_off_by_over_one_percent_is_refused(read, table, motion, scale: float) -> None:
    text = printed(table, motion, "ref_qw,ref_qx,ref_qy,ref_qz", scale * wxyz(motion.q))
    with pytest.raises(InputError, match=r"line 2: a quaternion has the norm .* --normalize"):
        read(text)
    assert apart_deg(read(text, normalize=True).attitude(), motion.q) < 1e-6


def test_a_norm_within_one_percent_is_taken(read, table, motion) -> None:
    text = printed(table, motion, "ref_qw,ref_qx,ref_qy,ref_qz", 1.009 * wxyz(motion.q))
    assert np.linalg.norm(read(text).attitude(), axis=1) == pytest.approx(1.0)


def test_one_stray_quaternion_among_thousands_is_left_out_and_told(read, table, motion) -> None:
    values = wxyz(motion.q).copy()
    values[77] *= 1.5
    result = read(printed(table, motion, "ref_qw,ref_qx,ref_qy,ref_qz", values))
    assert len(result["/reference/attitude"]) == motion.n - 1
    assert [finding.value for finding in result.whole.findings if finding.kind == "skipped"] == [1.0]


def test_rows_without_a_quaternion_have_none(read, table, motion) -> None:
    values = wxyz(motion.q).copy()
    values[100:150] = 0.0
    values[150:180] = np.nan
    result = read(printed(table, motion, "ref_qw,ref_qx,ref_qy,ref_qz", values).replace("nan", ""))
    assert len(result["/reference/attitude"]) == motion.n - 80
    assert len(result["/imu0/data_raw"]) == motion.n
