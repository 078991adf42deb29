"""EuRoC and TUM-VI on folders built as the published ones are laid out, also as a spreadsheet saves them."""

from pathlib import Path

import numpy as np
import pytest

import attlog
from attlog import ingest
from attlog.geometry.quaternions import angle_rad, conjugate, from_rotation_vector, multiply, to_matrix
from attlog.schemas import InputError
from attlog.schemas.unified import quaternions, vectors

START_NS = 1403636579758555392
IMU = "#timestamp [ns]," + ",".join(
    f"{quantity}_RS_S_{axis} [{unit}]" for quantity, unit in (("w", "rad s^-1"), ("a", "m s^-2")) for axis in "xyz"
)
POSE = " p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"
STATE = f"#timestamp,{POSE}, v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], " + ", ".join(
    f"b_{kind}_RS_S_{axis} [{unit}]" for kind, unit in (("w", "rad s^-1"), ("a", "m s^-2")) for axis in "xyz"
)


def table(header: str, stamps, values, separator: str = ",") -> str:
    rows = [
        separator.join([str(stamp), *(f"{v:.10g}" for v in row)]) for stamp, row in zip(stamps, values, strict=True)
    ]
    return "\n".join([header, *rows, ""])


def put(folder: Path, name: str, text: str) -> None:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text)


@pytest.fixture
def stamps(motion) -> np.ndarray:
    return motion.time_ns + START_NS


@pytest.fixture
def poses(motion) -> np.ndarray:
    position = np.column_stack([np.sin(motion.time_s), np.cos(motion.time_s), motion.time_s])
    return np.column_stack([position, motion.q[:, [3, 0, 1, 2]]])


@pytest.fixture
def sequence(motion, stamps, poses, tmp_path: Path) -> Path:
    folder = tmp_path / "V1_01_easy"
    put(folder, "mav0/imu0/data.csv", table(IMU, stamps, np.column_stack([motion.rate, motion.force])))
    state = np.column_stack([poses, np.zeros((motion.n, 9))])
    put(folder, "mav0/state_groundtruth_estimate0/data.csv", table(STATE, stamps[200:-200], state[200:-200]))
    put(folder, "mav0/cam0/data.csv", "#timestamp [ns],filename\n1403636579763555584,1403636579763555584.png\n")
    return folder


def read(folder: Path):
    result = ingest.read(ingest.source_of(folder))
    return result, {columns.channel.topic: columns for columns in result.columns}


def test_a_sequence_is_one_log(sequence: Path, motion, stamps) -> None:
    result, channels = read(sequence)
    assert result.format == "euroc"
    imu, reference = channels["/imu0/data_raw"], channels["/reference/attitude"]
    np.testing.assert_array_equal(imu.time_ns, stamps)
    np.testing.assert_allclose(vectors(imu.data, "angular_velocity"), motion.rate, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(vectors(imu.data, "linear_acceleration"), motion.force, rtol=1e-9)
    np.testing.assert_array_equal(reference.time_ns, stamps[200:-200])
    q = quaternions(reference.data)
    assert np.degrees(angle_rad(multiply(conjugate(q), motion.q[200:-200])).max()) < 1e-6
    assert reference.channel.metadata["north"] == "arbitrary"
    assert result.findings == ()
    assert result.completeness.complete


def test_position_velocity_and_biases_are_kept(sequence: Path, poses) -> None:
    _, channels = read(sequence)
    state = channels["/csv/state_groundtruth_estimate0"]
    np.testing.assert_allclose(state["p_rs_r_z"], poses[200:-200, 2], rtol=1e-9)
    assert {"v_rs_r_x", "b_w_rs_s_y", "b_a_rs_s_z"} <= set(state.data.dtype.names)


@pytest.mark.parametrize("inner", ["", "mav0"])
def test_either_folder_may_be_named(sequence: Path, inner: str) -> None:
    result, channels = read(sequence / inner)
    assert {"/imu0/data_raw", "/reference/attitude"} <= channels.keys()
    assert result.format == "euroc"


def test_the_source_is_both_files(sequence: Path) -> None:
    import hashlib

    source = ingest.source_of(sequence)
    files = [sequence / f"mav0/{name}/data.csv" for name in ("imu0", "state_groundtruth_estimate0")]
    assert [part.name for part in source.parts] == [file.relative_to(sequence).as_posix() for file in files]
    data = b"".join(file.read_bytes() for file in files)
    assert (source.size, source.sha256) == (len(data), hashlib.sha256(data).hexdigest())


def test_stamps_and_rows_that_a_spreadsheet_left(motion, stamps, tmp_path: Path) -> None:
    """Fifteen digits in the stamps, a comma for every cell, and notes below the table."""
    spelled = [f"{stamp / 1e18:.14f}E+018" for stamp in stamps]
    junk = [",,,,,,", "1403636763.853,,,,,,", "1403636763.848,,,,,,", ",,,,,,", "Step: 0.005 = 1/200,,,,,,"]
    text = table(IMU, spelled, np.column_stack([motion.rate, motion.force])) + "\n".join([*junk, ""])
    put(tmp_path, "mav0/imu0/data.csv", text)
    result, channels = read(tmp_path)
    imu = channels["/imu0/data_raw"]
    assert len(imu) == motion.n
    assert np.abs(imu.time_ns - stamps).max() <= 5_000  # what fifteen digits can hold
    assert np.abs(np.diff(imu.time_ns) - 5_000_000).max() <= 10_000
    assert dict(result.completeness.dropped) == {"header": 1, "no value": 4, "text": 1}
    assert result.completeness.messages + 6 == text.count("\n")
    assert len(result.segments) == 1


def test_tum_vi_with_motion_capture(motion, stamps, poses, tmp_path: Path) -> None:
    folder = tmp_path / "dataset-room1_512_16"
    put(folder, "mav0/imu0/data.csv", table(IMU, stamps, np.column_stack([motion.rate, motion.force])))
    put(folder, "mav0/mocap0/data.csv", table(f"#timestamp [ns],{POSE}", stamps[::2] + 137, poses[::2]))
    _, channels = read(folder)
    np.testing.assert_array_equal(channels["/reference/attitude"].time_ns, stamps[::2] + 137)


def test_tum_vi_in_the_layout_for_dso(motion, stamps, poses, tmp_path: Path) -> None:
    folder = tmp_path / "dataset-room1_512_16"
    imu = table("# timestamp[ns] w.x w.y w.z a.x a.y a.z", stamps, np.column_stack([motion.rate, motion.force]), " ")
    put(folder, "dso/imu.txt", imu)
    put(folder, "dso/gt_imu.csv", table("# timestamp[ns],tx,ty,tz,qw,qx,qy,qz", stamps[::2], poses[::2]))
    _, channels = read(folder)
    np.testing.assert_array_equal(channels["/imu0/data_raw"].time_ns, stamps)
    q = quaternions(channels["/reference/attitude"].data)
    assert np.degrees(angle_rad(multiply(conjugate(q), motion.q[::2])).max()) < 1e-6


@pytest.mark.parametrize("header", ["# timestamp tx ty tz qx qy qz qw\n", ""])
def test_a_trajectory_as_tum_writes_it(motion, stamps, poses, tmp_path: Path, header: str) -> None:
    put(tmp_path, "imu0/data.csv", table(IMU, stamps, np.column_stack([motion.rate, motion.force])))
    seconds = [f"{stamp // 10**9}.{stamp % 10**9:09d}" for stamp in stamps.tolist()]
    put(tmp_path, "groundtruth.txt", header + table("", seconds, poses[:, [0, 1, 2, 4, 5, 6, 3]], " ").lstrip("\n"))
    _, channels = read(tmp_path)
    reference = channels["/reference/attitude"]
    np.testing.assert_array_equal(reference.time_ns, stamps)
    assert np.degrees(angle_rad(multiply(conjugate(quaternions(reference.data)), motion.q)).max()) < 1e-6


def test_a_vicon_body_is_turned_into_the_sensor(motion, stamps, tmp_path: Path) -> None:
    mounting = from_rotation_vector([0.2, -0.5, 1.0])
    put(tmp_path, "mav0/imu0/data.csv", table(IMU, stamps, np.column_stack([motion.rate, motion.force])))
    marker = multiply(motion.q, mounting)
    values = np.column_stack([np.zeros((motion.n, 3)), marker[:, [3, 0, 1, 2]]])
    put(tmp_path, "mav0/vicon0/data.csv", table(f"#timestamp [ns],{POSE}", stamps, values))
    matrix = np.eye(4)
    matrix[:3, :3] = to_matrix(mounting)
    numbers = ", ".join(f"{value:.12g}" for value in matrix.ravel())
    put(
        tmp_path,
        "mav0/vicon0/sensor.yaml",
        f"sensor_type: position\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{numbers}]\n",
    )
    _, channels = read(tmp_path)
    q = quaternions(channels["/reference/attitude"].data)
    assert np.degrees(angle_rad(multiply(conjugate(q), motion.q)).max()) < 1e-6


def test_a_sequence_without_ground_truth(sequence: Path) -> None:
    (sequence / "mav0/state_groundtruth_estimate0/data.csv").unlink()
    _, channels = read(sequence)
    assert list(channels) == ["/imu0/data_raw"]


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    assert ingest.recognize_folder(tmp_path) is None
    with pytest.raises(InputError, match="is a directory"):
        ingest.source_of(tmp_path)


def test_one_command_on_a_sequence_and_on_the_folder_above(sequence: Path) -> None:
    done = attlog.convert(sequence)
    assert Path(done.output) == sequence.with_suffix(".mcap")
    Path(done.output).unlink()
    outcomes = attlog.convert([sequence.parent], jobs=1)
    assert [Path(outcome.source) for outcome in outcomes] == [sequence]
    assert outcomes.exit_code == 0
    with attlog.open(outcomes.results[0].output) as log:
        assert log.metadata["source"]["format"] == "euroc"
        assert log.metadata["imu0"]["file"] == "mav0/imu0/data.csv"
