"""The program on CSVs: options, profiles, exit codes, what is printed."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import attlog
from attlog.ingest.serial_csv import csv_options
from attlog.schemas import InputError, UsageError, World
from attlog.schemas.unified import vectors

G = 9.80665
PROFILE = """
columns = ["t_us", "ax", "ay", "az", "gx", "gy", "gz"]
[units]
accel = "g"
gyro = "deg/s"
"""


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    program = str(Path(sys.executable).with_name("attlog"))
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)


@pytest.fixture
def unnamed(table, motion, tmp_path: Path) -> Path:
    path = tmp_path / "unnamed.csv"
    path.write_text(table(None, motion.time_s * 1e6, motion.force / G, np.degrees(motion.rate)))
    return path


def test_guesses_are_printed_and_kept(unnamed: Path) -> None:
    done = run("convert", unnamed)
    assert (done.returncode, done.stderr) == (0, "")
    assert "columns: guessed time first, accel from column 2, gyro from column 5" in done.stdout
    with attlog.open(unnamed.with_suffix(".mcap")) as log:
        told = log.metadata["csv"]
        assert {"guess.1", "guess.2", "guess.3", "guess.4"} <= told.keys()
        assert "/findings" in log.topics
        assert "/annotations" in log.topics


def test_strict_refuses_in_one_line(unnamed: Path) -> None:
    done = run("convert", unnamed, "--strict")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.count("\n") == 1
    assert "--strict takes no guesses" in done.stderr
    assert not unnamed.with_suffix(".mcap").exists()


def test_named_columns_need_no_guess(unnamed: Path, motion) -> None:
    done = run("convert", unnamed, "--strict", "--columns", "t_us,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps")
    assert done.returncode == 0
    with attlog.open(unnamed.with_suffix(".mcap")) as log:
        np.testing.assert_allclose(vectors(log["/imu0/data_raw"].data, "angular_velocity"), motion.rate, atol=1e-9)
        assert "/findings" not in log.topics


def test_a_profile_says_it_once(unnamed: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(PROFILE)
    assert run("convert", unnamed, "--strict", "--profile", tmp_path / "mine.toml").returncode == 0


def test_a_fixed_rate_and_json(unnamed: Path) -> None:
    done = run("convert", unnamed, "--rate", "50", "--json", "--columns", "-,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps")
    (result,) = json.loads(done.stdout)
    assert result["format"] == "csv"
    assert result["end_ns"] - result["start_ns"] == 1999 * 20_000_000


def test_bad_lines_make_exit_code_three_and_comments_do_not(unnamed: Path) -> None:
    text = unnamed.read_text()
    unnamed.write_text("# from my desk\n\n" + text)
    assert run("convert", unnamed).returncode == 0
    unnamed.write_text(text + "20000000,0.1,0.")
    done = run("convert", unnamed, "--force")
    assert done.returncode == 3
    assert "1 wrong number of fields" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--columns", "t,u,v"], "names no sensor"),
        (["--rate", "0"], "not above 0"),
        (["--sensor", "mpu1"], "no sensor profile"),
        (["--profile", "nowhere.toml"], "nowhere.toml: cannot be read"),
        (["--time-unit", "days"], "time-unit"),
    ],
)
def test_options_that_do_not_fit(unnamed: Path, arguments: list[str], told: str) -> None:
    done = run("convert", unnamed, *arguments)
    assert done.returncode in (1, 2)
    assert told in done.stderr
    assert "Traceback" not in done.stderr


def test_raw_counts_from_one_command(table, motion, tmp_path: Path) -> None:
    path = tmp_path / "raw.csv"
    counts = np.rint(motion.force / G * 16384), np.rint(np.degrees(motion.rate) * 131)
    path.write_text(table("millis,ax,ay,az,gx,gy,gz", np.rint(motion.time_s * 1000), *counts))
    done = run("convert", path)
    assert done.returncode == 1
    assert "--sensor mpu9250" in done.stderr
    assert run("convert", path, "--sensor", "mpu9250", "--strict").returncode == 0


def test_run_on_a_csv_scores_against_its_reference(table, motion, tmp_path: Path) -> None:
    path = tmp_path / "with_truth.csv"
    names = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,ref_qw,ref_qx,ref_qy,ref_qz"
    wxyz = motion.q[:, [3, 0, 1, 2]]
    path.write_text(table(names, motion.time_s, motion.force / G, np.degrees(motion.rate), wxyz))
    result = attlog.run(path, estimators=["gyro"])
    assert result.analysis is not None
    assert "/reference/attitude" in result.analysis.to_text()


def test_every_entry_of_a_profile(tmp_path: Path) -> None:
    (tmp_path / "all.toml").write_text(
        """
        columns = ["t_ms", "ax", "-"]
        rate_hz = 100.0
        time_unit = "ms"
        axes = "frd"
        strict = true
        normalize = true
        [names]
        "Accel X" = "ax_g"
        [attitude]
        reference = true
        world = "ned"
        euler = "xyz"
        inverse = true
        north = "true"
        [topics]
        imu = "/imu4/data_raw"
        [sensor]
        accel_lsb_per_g = 8192
        gyro_lsb_per_dps = 65.5
        mag_ut_per_lsb = 0.15
        mag_axes = ["y", "x", "-z"]
        """
    )
    said = csv_options(tmp_path / "all.toml", rate_hz=50.0)
    assert (said.columns, said.rate_hz, said.axes, said.strict) == (("t_ms", "ax", "-"), 50.0, "frd", True)
    assert (said.attitude.world, said.attitude.euler, said.attitude.inverse) == (World.NED, "xyz", True)
    assert said.sensor is not None
    assert (said.sensor.name, said.sensor.mag_axes) == ("all", ("y", "x", "-z"))
    assert said.topics == {"imu": "/imu4/data_raw"}


@pytest.mark.parametrize(
    ("text", "error", "told"),
    [
        ("colums = []", UsageError, "no entry 'colums'"),
        ("[attitude]\nworld = 'up'", UsageError, "enu, nwu, ned"),
        ("[sensor]\naccel_lsb_per_g = 1", UsageError, "needs accel_lsb_per_g"),
        ("sensor = 'bno'", UsageError, "mpu9250"),
        ("axes = 'ned'", UsageError, "flu, frd"),
        ("x = ", InputError, "is no TOML"),
    ],
)
def test_a_profile_that_is_wrong(tmp_path: Path, text: str, error: type[Exception], told: str) -> None:
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(error, match=told):
        csv_options(tmp_path / "p.toml")
