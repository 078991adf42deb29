"""The command line as a process, from source logs to tables."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

ATTLOG = str(Path(sys.executable).with_name("attlog"))
Attlog = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def attlog(tmp_path: Path) -> Attlog:
    """Run the program in an empty folder."""

    def call(*words: str | Path, cwd: Path = tmp_path) -> "subprocess.CompletedProcess[str]":
        command = [ATTLOG, *map(str, words)]
        return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False, timeout=300)

    return call


@pytest.fixture
def flight(attlog: Attlog, root: Path, tmp_path: Path) -> Path:
    """The demo flight as an MCAP."""
    done = attlog("convert", root / "data" / "demo_flight.tlog", "-o", "flight.mcap")
    assert done.returncode == 0, done.stderr
    return tmp_path / "flight.mcap"


def _topics(path: Path) -> dict[str, int]:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        counts: dict[str, int] = {}
        for _, channel, _, _ in reader.iter_decoded_messages():
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
    return counts


def test_help_imports_nothing_heavy() -> None:
    code = "import sys; from attlog.cli import cli; cli(['--help'], standalone_mode=False); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numpy", "numba", "scipy", "pandas", "pymavlink"} & set(done.stdout.split())


def test_run_makes_one_file_and_a_table(attlog: Attlog, root: Path, tmp_path: Path) -> None:
    done = attlog("run", root / "data" / "demo_flight.tlog", "-o", "out/flight.mcap")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    for name in ("ecf", "ekf9", "gyro", "onboard_attitude"):
        assert name in done.stdout
    assert "error against /reference/attitude" in done.stdout
    counts = _topics(tmp_path / "out" / "flight.mcap")
    for topic in (
        "/imu0/data_raw",
        "/mag0/field",
        "/reference/attitude",
        "/estimate/ekf9/attitude",
        "/error/ekf9/attitude",
    ):
        assert counts[topic] > 100
    assert counts["/tf"] > 100
    assert counts["/bodies"] == 1


def test_in_steps_it_is_the_same_as_run(attlog: Attlog, root: Path, flight: Path, tmp_path: Path) -> None:
    source = root / "data" / "demo_flight.tlog"
    assert attlog("run", source, "-o", "whole.mcap", "-e", "ecf", "-e", "ekf9").returncode == 0
    assert attlog("estimate", flight, "-e", "ecf", "-e", "ekf9").returncode == 0
    stepwise = attlog("analyze", flight, "--json")
    whole = attlog("analyze", "whole.mcap", "--json")
    ours, theirs = (json.loads(done.stdout)[0]["errors"] for done in (stepwise, whole))
    assert [row["statistics"] for row in ours] == [row["statistics"] for row in theirs]
    assert _topics(flight) == _topics(tmp_path / "whole.mcap")


def test_estimating_again_replaces(attlog: Attlog, flight: Path) -> None:
    assert attlog("estimate", flight, "-e", "ecf").returncode == 0
    before = _topics(flight)
    assert attlog("estimate", flight, "-e", "ecf:kp=0.7").returncode == 0
    assert attlog("estimate", flight, "-e", "ecf:kp=0.7,as=soft").returncode == 0
    after = _topics(flight)
    assert after["/estimate/ecf/attitude"] == before["/estimate/ecf/attitude"] == after["/estimate/soft/attitude"]
    assert after["/tf"] > before["/tf"]
    told = json.loads(attlog("info", flight, "--json").stdout)[0]
    metadata = {channel["topic"]: channel["metadata"] for channel in told["channels"]}
    assert metadata["/estimate/ecf/attitude"]["parameter.kp"] == "0.7"
    assert len(metadata["/estimate/ecf/attitude"]["input_sha256./imu0/data_raw"]) == 64


def test_info_tells_what_the_official_reader_counts(attlog: Attlog, flight: Path) -> None:
    told = json.loads(attlog("info", flight, "--json").stdout)[0]
    assert {channel["topic"]: channel["messages"] for channel in told["channels"]} == _topics(flight)
    assert told["metadata"]["source"]["name"] == "demo_flight.tlog"
    text = attlog("info", flight).stdout
    assert "/imu0/data_raw" in text
    assert "sensor_msgs/msg/Imu" in text


def test_annotations_can_be_added_listed_and_removed(attlog: Attlog, flight: Path) -> None:
    vehicles_own = _topics(flight)["/annotations"]
    assert attlog("annotate", flight, "--at", "12.3s", "--severity", "warn", "compass swings here").returncode == 0
    done = attlog("annotate", flight, "--at", "3s", "--to", "4.5s", "take-off")
    assert done.returncode == 0
    listed = attlog("annotate", flight, "--list").stdout
    assert listed == done.stdout
    assert listed.index("take-off") < listed.index("compass swings here")
    assert _topics(flight)["/annotations"] == vehicles_own + 2
    assert attlog("annotate", flight, "--remove", "1").returncode == 0
    assert "take-off" not in attlog("annotate", flight, "--list").stdout
    beyond = attlog("annotate", flight, "--at", "3h", "too late")
    assert beyond.returncode == 1
    assert "outside the log" in beyond.stderr


def test_nothing_is_overwritten_unasked(attlog: Attlog, root: Path, flight: Path) -> None:
    before = flight.read_bytes()
    done = attlog("convert", root / "data" / "demo_flight.tlog", "-o", flight)
    assert done.returncode == 1
    assert "--force" in done.stderr
    assert flight.read_bytes() == before
    assert attlog("convert", root / "data" / "demo_flight.tlog", "-o", flight, "--force").returncode == 0
    assert flight.read_bytes() == before


def test_one_bad_log_stops_no_other(attlog: Attlog, root: Path, tmp_path: Path) -> None:
    (tmp_path / "logs" / "deep").mkdir(parents=True)
    shutil.copy(root / "data" / "demo_flight.tlog", tmp_path / "logs" / "deep" / "good.tlog")
    (tmp_path / "bad.tlog").write_bytes(b"\x00" * 1000)
    done = attlog("run", "logs", "bad.tlog", "missing.bin", "-j", "2")
    assert done.returncode == 3
    assert (tmp_path / "logs" / "deep" / "good.mcap").exists()
    assert len(done.stderr.splitlines()) == 2
    assert "Traceback" not in done.stderr


BAD = {
    "empty": b"",
    "zeros": bytes(4096),
    "text": b"hello, this is no log at all\n" * 50,
    "picture": b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 20,
    "cut.mcap": b"\x89MCAP0\r\n\x01\x0c",
}


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("verb", ["run", "convert", "info", "estimate", "analyze"])
def test_a_bad_input_is_one_clear_line(attlog: Attlog, verb: str, name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(BAD[name])
    done = attlog(verb, name)
    assert done.returncode == 1, done.stdout
    assert done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1
    assert name in done.stderr
    assert "Traceback" not in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == [name]


@pytest.mark.parametrize(
    "words",
    [
        ["fly", "x"],
        ["convert"],
        ["run", "x.tlog", "--vehicle", "first"],
        ["run", "x.tlog", "--sensor", "abacus"],
        ["analyze", "x.mcap", "--exclude", "1-2"],
        ["annotate", "x.mcap", "--at", "soon", "text"],
    ],
)
def test_wrong_usage_is_2(attlog: Attlog, words: list[str], flight: Path) -> None:
    done = attlog(*[str(flight) if word == "x.mcap" else word for word in words])
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("selection", ["nonsense", "ecf:nonsense=1", "ecf:kp=high", "ecf:imu=-1"])
def test_a_wrong_selection_is_2_and_changes_nothing(attlog: Attlog, selection: str, flight: Path) -> None:
    before = flight.read_bytes()
    assert attlog("estimate", flight, "-e", selection).returncode == 2
    assert flight.read_bytes() == before


def test_a_missing_sensor_is_skipped_with_a_line(attlog: Attlog, flight: Path) -> None:
    done = attlog("estimate", flight, "-e", "ecf:imu=5", "-e", "ekf6")
    assert done.returncode == 0
    assert "skipped ecf_imu5" in done.stdout
    assert attlog("estimate", flight, "-e", "ecf:imu=5").returncode == 1


def test_the_copter_with_truth(attlog: Attlog, logs: Path, readcheck: Callable[[Path], None], tmp_path: Path) -> None:
    done = attlog("run", logs / "copter_sitl_truth.BIN", "-o", "sitl.mcap", "--start", "5", "--json")
    assert done.returncode == 3, done.stderr  # its last record is torn
    errors = {row["name"]: row["statistics"] for row in json.loads(done.stdout)[0]["errors"]}
    rmse = {name: [errors[name][axis]["rmse"] for axis in ("roll", "pitch", "yaw")] for name in ("ecf", "ekf9")}
    assert all(value < bound for value, bound in zip(rmse["ecf"], (0.8, 2.3, 2.0), strict=True)), rmse
    assert all(value < bound for value, bound in zip(rmse["ekf9"], (0.8, 1.5, 2.0), strict=True)), rmse
    assert _topics(tmp_path / "sitl.mcap")
    readcheck(tmp_path / "sitl.mcap")


REAL = {
    "copter_radio_2015.tlog": (3, "difference from attitude", "17,082 bytes"),
    "copter_sitl_mavlink2.tlog": (0, "error against /reference/attitude", ""),
    "plane_crash_3imu.bin": (0, "difference from att", ""),
    "px4_flight.ulg": (0, "difference from vehicle_attitude", ""),
    "ximu3_100hz.csv": (0, "not compared", ""),
}


@pytest.mark.parametrize("name", REAL)
def test_real_logs(attlog: Attlog, logs: Path, readcheck: Callable[[Path], None], name: str, tmp_path: Path) -> None:
    code, *told = REAL[name]
    done = attlog("run", logs / name, "-o", "out.mcap")
    assert done.returncode == code, done.stderr
    for text in told:
        assert text in done.stdout
    assert _topics(tmp_path / "out.mcap")
    readcheck(tmp_path / "out.mcap")


def test_a_log_from_stdin(root: Path, tmp_path: Path, attlog: Attlog) -> None:
    with (root / "data" / "demo_flight.tlog").open("rb") as log:
        done = subprocess.run([ATTLOG, "convert", "-", "-o", "a.mcap"], cwd=tmp_path, stdin=log, check=False)
    assert done.returncode == 0
    assert attlog("convert", root / "data" / "demo_flight.tlog", "-o", "b.mcap").returncode == 0
    assert _topics(tmp_path / "a.mcap") == _topics(tmp_path / "b.mcap")
    with (tmp_path / "a.mcap").open("rb") as mcap:
        told = subprocess.run([ATTLOG, "info", "-"], stdin=mcap, capture_output=True, check=False)
    assert told.returncode == 0
    assert b"/imu0/data_raw" in told.stdout
    assert attlog("convert", "-").returncode == 2


def test_a_terminal_sees_a_bar_and_a_pipe_does_not(root: Path, tmp_path: Path) -> None:
    command = [ATTLOG, "convert", str(root / "data" / "demo_flight.tlog"), "-o", str(tmp_path / "a.mcap")]
    screen, terminal = os.openpty()
    try:
        subprocess.run(command, stdout=subprocess.DEVNULL, stderr=terminal, check=True)
    finally:
        os.close(terminal)
    shown = b""
    while True:
        try:
            piece = os.read(screen, 65536)
        except OSError:  # the last writer is gone
            break
        if not piece:
            break
        shown += piece
    os.close(screen)
    assert b"kB" in shown or b"MB" in shown
    silent = subprocess.run([*command, "--force"], capture_output=True, check=True)
    assert silent.stderr == b""


def test_colour_and_width_do_not_change_what_a_pipe_gets(root: Path, tmp_path: Path, flight: Path) -> None:
    narrow = subprocess.run(
        [ATTLOG, "info", str(flight)], env={**os.environ, "COLUMNS": "20"}, capture_output=True, check=True
    )
    plain = subprocess.run(
        [ATTLOG, "info", str(flight)], env={**os.environ, "NO_COLOR": "1"}, capture_output=True, check=True
    )
    assert narrow.stdout == plain.stdout
    assert b"\x1b[" not in plain.stdout


@pytest.mark.parametrize(
    "span", [["--start", "nan"], ["--end", "inf"], ["--start", "5", "--end", "2"], ["--exclude", "5:1"]]
)
def test_what_is_no_span_is_wrong_usage(attlog: Attlog, flight: Path, span: list[str]) -> None:
    done = attlog("analyze", flight, *span)
    assert done.returncode == 2
    assert "seconds" in done.stderr


def test_a_span_without_samples_is_told(attlog: Attlog, flight: Path) -> None:
    done = attlog("analyze", flight, "--start", "1000", "--json")
    assert done.returncode == 1
    assert "lasts from 0.0 to 95.0 s" in done.stderr
    assert json.loads(done.stdout)[0]["error"]


@pytest.mark.parametrize("degrees", ["nan", "inf", "-400"])
def test_a_declination_that_is_none_changes_nothing(attlog: Attlog, flight: Path, degrees: str) -> None:
    before = flight.read_bytes()
    assert attlog("estimate", flight, "--declination", degrees).returncode == 2
    assert flight.read_bytes() == before


def test_a_device_is_not_replaced(attlog: Attlog, root: Path, tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    done = attlog("convert", root / "data" / "demo_flight.tlog", "-o", pipe, "--force")
    assert done.returncode == 1
    assert "no regular file" in done.stderr
    assert pipe.is_fifo()
    assert attlog("convert", pipe).returncode == 1


def test_a_forgotten_text_is_told(attlog: Attlog, flight: Path) -> None:
    done = attlog("annotate", flight, flight, "--at", "1s")
    assert done.returncode == 2
    assert "text" in done.stderr
