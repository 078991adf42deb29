"""Units and columns that nobody names: guessed from the motion, told, and refused where guesses are."""

import numpy as np
import pytest

from attlog.schemas import InputError, UsageError
from attlog.schemas.sensors import PROFILES

G = 9.80665
SPELLED = {"accel": {"g": 1 / G, "m/s^2": 1.0, "mg": 1000 / G}, "gyro": {"deg/s": 180 / np.pi, "rad/s": 1.0}}
NAMES = "t,ax,ay,az,gx,gy,gz"


@pytest.mark.parametrize("accel", ["g", "m/s^2", "mg"])
@pytest.mark.parametrize("gyro", ["deg/s", "rad/s"])
def test_units_are_those_in_which_gravity_turns_as_the_gyroscope_says(
    read, table, motion, accel: str, gyro: str
) -> None:
    text = table(NAMES, motion.time_s, motion.force * SPELLED["accel"][accel], motion.rate * SPELLED["gyro"][gyro])
    result = read(text)
    np.testing.assert_allclose(result.force(), motion.force, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(result.rate(), motion.rate, rtol=1e-7, atol=1e-7)
    assert f"gyroscope: guessed {gyro}" in result.guesses[2]
    assert "correlation" in result.guesses[2]


@pytest.mark.parametrize(("unit", "scale"), [("uT", 1e6), ("G", 1e4), ("mG", 1e7), ("nT", 1e9), ("T", 1.0)])
def test_unit_of_the_magnetometer(read, table, motion, unit: str, scale: float) -> None:
    text = table(
        "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,mx,my,mz",
        motion.time_s,
        motion.force / G,
        np.degrees(motion.rate),
        motion.field * scale,
    )
    result = read(text)
    assert f"guessed {unit}" in result.guesses[0]
    np.testing.assert_allclose(result.field(), motion.field, rtol=1e-6, atol=1e-12)


def test_a_magnetometer_in_no_unit_gives_directions(read, table, motion) -> None:
    text = table(
        "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,mx,my,mz",
        motion.time_s,
        motion.force / G,
        np.degrees(motion.rate),
        motion.field * 6e4,
    )
    result = read(text)
    ratio = np.linalg.norm(result.field(), axis=1) / np.linalg.norm(motion.field, axis=1)
    assert np.ptp(ratio) < 1e-6
    assert np.median(np.linalg.norm(result.field(), axis=1)) == pytest.approx(50e-6, rel=1e-3)
    assert "fits no unit" in result.guesses[0]


@pytest.mark.parametrize("order", ["t a w", "t w a", "t a w m", "t a m w", "a w"])
def test_columns_without_names_are_found_by_what_they_do(read, table, motion, order: str) -> None:
    columns = {"t": motion.time_s * 1000, "a": motion.force / G, "w": np.degrees(motion.rate), "m": motion.field * 1e6}
    text = table(None, *(columns[part] for part in order.split()))
    result = read(text, rate_hz=None if "t" in order else 100.0)
    np.testing.assert_allclose(result.force(), motion.force, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(result.rate(), motion.rate, rtol=1e-6, atol=1e-6)
    if "m" in order:
        np.testing.assert_allclose(result.field(), motion.field, rtol=1e-6, atol=1e-12)
    assert "columns: guessed" in result.guesses[0]


def test_words_between_columns_without_names_are_no_hindrance(read, table, motion) -> None:
    rows = table(None, motion.time_s * 1000, motion.force / G, np.degrees(motion.rate)).splitlines()
    result = read("\n".join(f"IMU,{row},ok" for row in rows))
    np.testing.assert_allclose(result.rate(), motion.rate, rtol=1e-6, atol=1e-6)
    assert result["/csv/log"]["column1"][0] == b"IMU"


def test_strict_takes_no_guess_and_says_what_is_missing(read, table, motion) -> None:
    text = table(NAMES, motion.time_s, motion.force / G, np.degrees(motion.rate))
    with pytest.raises(InputError, match=r"--strict.*time.*accelerometer.*gyroscope"):
        read(text, strict=True)
    result = read(text, strict=True, time_unit="s", units={"accel": "g", "gyro": "deg/s"})
    assert result.guesses == []
    np.testing.assert_allclose(result.rate(), motion.rate, rtol=1e-7, atol=1e-7)


def test_strict_takes_no_columns_without_names(read, table, motion) -> None:
    text = table(None, motion.time_s, motion.force / G, np.degrees(motion.rate))
    with pytest.raises(InputError, match="columns: guessed"):
        read(text, strict=True)
    said = ("t_s", "ax_g", "ay_g", "az_g", "gx_dps", "gy_dps", "gz_dps")
    assert read(text, strict=True, columns=said).guesses == []


def test_what_the_user_names_goes_before_the_header(read, table, motion) -> None:
    text = table("a,b,c,d,e,f,g", motion.time_s * 1e6, motion.force / G, motion.rate)
    said = ("t_us", "ax_g", "ay_g", "az_g", "gx_rad/s", "gy_rad/s", "gz_rad/s")
    np.testing.assert_allclose(read(text, columns=said).rate(), motion.rate, rtol=1e-7, atol=1e-7)


def test_names_of_one_file_given_another_meaning(read, table, motion) -> None:
    text = table("clk,p1,p2,p3,s1,s2,s3", motion.time_s, motion.force, motion.rate)
    names = {"clk": "t_s", **{f"p{k + 1}": f"a{axis}_m/s2" for k, axis in enumerate("xyz")}}
    names |= {f"s{k + 1}": f"g{axis}_rad/s" for k, axis in enumerate("xyz")}
    np.testing.assert_allclose(read(text, names=names).force(), motion.force, rtol=1e-7, atol=1e-7)


def test_raw_counts_need_a_sensor(read, table, motion) -> None:
    counts = (
        np.rint(motion.force / G * 16384),
        np.rint(np.degrees(motion.rate) * 131),
        np.rint(motion.field * 1e6 / 0.15),
    )
    # The AK8963's x and y are swapped, and its z points down.
    ak8963 = counts[2][:, [1, 0, 2]] * [1, 1, -1]
    text = table("t_ms,ax,ay,az,gx,gy,gz,mx,my,mz", motion.time_s * 1000, counts[0], counts[1], ak8963)
    with pytest.raises(InputError, match="--sensor mpu9250"):
        read(text)
    result = read(text, sensor=PROFILES["mpu9250"])
    np.testing.assert_allclose(result.force(), motion.force, atol=0.51 * G / 16384)
    np.testing.assert_allclose(result.rate(), motion.rate, atol=0.51 * np.pi / 180 / 131)
    np.testing.assert_allclose(result.field(), motion.field, atol=0.51 * 0.15e-6)
    assert result.guesses == []


def test_units_in_the_header_go_before_the_sensor(read, table, motion) -> None:
    text = table("t_ms,ax_g,ay_g,az_g,gx,gy,gz", motion.time_s * 1000, motion.force / G, np.degrees(motion.rate) * 131)
    result = read(text, sensor=PROFILES["mpu9250"])
    np.testing.assert_allclose(result.force(), motion.force, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(result.rate(), motion.rate, rtol=1e-6, atol=1e-6)


def test_axes_that_point_down_are_turned_up(read, table, motion) -> None:
    down = np.array([1.0, -1.0, -1.0])
    text = table(
        "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps",
        motion.time_s,
        motion.force / G * down,
        np.degrees(motion.rate) * down,
    )
    result = read(text, axes="frd")
    np.testing.assert_allclose(result.force(), motion.force, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(result.rate(), motion.rate, rtol=1e-6, atol=1e-6)


def test_a_magnetometer_that_is_read_less_often(read, table, motion) -> None:
    held = motion.field[(np.arange(motion.n) // 5) * 5] * 1e6
    text = table(
        "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,mx_uT,my_uT,mz_uT",
        motion.time_s,
        motion.force / G,
        np.degrees(motion.rate),
        held,
    )
    mag = read(text)["/mag0/field"]
    assert len(mag) == motion.n // 5
    assert mag.channel.metadata["repeated"] == str(motion.n - motion.n // 5)
    assert set(np.diff(mag.time_ns)) == {50_000_000}


def test_other_topics(read, table, motion) -> None:
    text = table(
        "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,p_hPa", motion.time_s, motion.force, motion.rate, motion.time_s
    )
    result = read(text, topics={"imu": "/imu3/data_raw", "csv": "/csv/baro"})
    assert result.topics == ["/imu3/data_raw", "/csv/baro"]


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ({"columns": tuple("abcdefghijk")}, "names 11 columns"),
        ({"columns": ("t", *"abcdef")}, "names no sensor"),
        ({"units": {"accel": "furlong"}}, "no unit of accel"),
        ({"time_unit": "min"}, "no unit of time"),
        ({"axes": "ned"}, "no axes"),
    ],
)
def test_options_that_do_not_fit(read, table, motion, said, told: str) -> None:
    text = table(NAMES, motion.time_s, motion.force, motion.rate)
    with pytest.raises(UsageError, match=told):
        read(text, **said)


def test_nothing_that_is_known(read) -> None:
    rows = [f"{k % 3},{k % 5},{k % 7},{k % 2}" for k in range(50)]
    with pytest.raises(InputError, match="--columns"):
        read("\n".join(["red,green,blue,alpha", *rows]))
