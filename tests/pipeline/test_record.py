"""Live recording: real pseudo-terminals, real UDP on loopback, kills, signals, rotation, lost ports."""

import json
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from pymavlink.dialects.v20 import ardupilotmega

import attlog
from attlog.pipeline.record import Status

pty = pytest.importorskip("pty", reason="this system has no pseudo-terminals")
import tty  # noqa: E402 - as pty, of POSIX alone

ATTLOG = str(Path(sys.executable).with_name("attlog"))
HEADER = b"t_us,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n"
Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start ``attlog record`` and wait until it listens."""
    running: list[subprocess.Popen[str]] = []

    def call(*words: str) -> "subprocess.Popen[str]":
        command = [ATTLOG, "-v", "record", *words]
        process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        running.append(process)
        assert process.stderr is not None
        while line := process.stderr.readline():
            if line.startswith("recording "):
                break
        return process

    yield call
    for process in running:
        if process.poll() is None:
            process.kill()
        process.communicate()


class Terminal:
    """A pseudo-terminal that prints samples as a sensor would; ``name`` is where it is opened."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.name = os.ttyname(self.slave)

    def print(self, first: int, count: int, rate_hz: float) -> None:
        """Samples number ``first`` and on, in real time."""
        begin = time.monotonic()
        for k in range(count):
            wait = begin + k / rate_hz - time.monotonic()
            if wait > 0:
                time.sleep(wait)
            number = first + k
            os.write(self.master, b"%d,0.0,%d,1.0,1.5,0.5,-2\n" % (1_000_000 + 1000 * number, number % 7))

    def close(self) -> None:
        os.close(self.master)
        os.close(self.slave)


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    """An open pseudo-terminal."""
    made = Terminal()
    yield made
    made.close()


def free_port() -> int:
    """A UDP port of loopback that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def frames_of(path: Path) -> list[bytes]:
    """The frames of a telemetry log that begin where its records say."""
    data, at, found = path.read_bytes(), 0, []
    while at + 18 < len(data):
        magic = data[at + 8]
        if magic not in (0xFE, 0xFD):
            at += 1
            continue
        size = 8 + data[at + 9] if magic == 0xFE else 12 + data[at + 9] + 13 * (data[at + 10] & 1)
        found.append(data[at + 8 : at + 8 + size])
        at += 8 + size
    return found


def send(frames: list[bytes], port: int, rate_hz: float) -> None:
    """Send datagrams to a port of loopback at a steady rate."""
    begin = time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for number, frame in enumerate(frames):
            wait = begin + number / rate_hz - time.monotonic()
            if wait > 0:
                time.sleep(wait)
            out.sendto(frame, ("127.0.0.1", port))


def stop(process: "subprocess.Popen[str]", number: int = signal.SIGINT) -> tuple[int, str, str]:
    """End a recording after what was sent has arrived: exit code, stdout, stderr."""
    time.sleep(0.5)
    process.send_signal(number)
    out, err = process.communicate(timeout=120)
    return process.returncode, out, err


def official(path: Path) -> dict[str, int]:
    """Messages by topic, from the official reader with all its checks."""
    counts: dict[str, int] = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for _, channel, _ in reader.iter_messages():
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
        summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == sum(counts.values())
    return counts


def imu_frames(count: int) -> list[bytes]:
    """HIGHRES_IMU at 1 kHz by the sensor's clock, and a heartbeat each second."""
    link = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
    frames = []
    for number in range(count):
        messages = [link.highres_imu_encode(1000 * number, 0, 0, -9.8, 0.1, 0, 0, 0.2, 0, 0.4, 0, 0, 0, 20, 63)]
        if number % 1000 == 0:
            messages.insert(0, link.heartbeat_encode(2, 3, 81, 0, 4))
        for message in messages:
            frames.append(message.pack(link))
            link.seq = (link.seq + 1) % 256
    return frames


def test_udp_gives_what_convert_gives(start: Start, root: Path, tmp_path: Path) -> None:
    source = root / "data" / "demo_flight.tlog"
    attlog.convert(source, tmp_path / "converted.mcap")
    port = free_port()
    process = start(f"mavlink:udpin:127.0.0.1:{port}", "-o", "live.mcap", "--json")
    send(frames_of(source), port, 4000.0)
    code, out, err = stop(process)
    assert code == 0, err
    told = json.loads(out)
    assert told["missing"] == 0
    assert told["units"] == len(frames_of(source))
    counts, expected = official(tmp_path / "live.mcap"), official(tmp_path / "converted.mcap")
    assert {t: n for t, n in counts.items() if t.startswith("/mavlink")} == {
        t: n for t, n in expected.items() if t.startswith("/mavlink")
    }
    with attlog.open(tmp_path / "live.mcap") as live, attlog.open(tmp_path / "converted.mcap") as converted:
        for topic in ("/imu0/data_raw", "/mag0/field", "/reference/attitude"):
            ours, theirs = live[topic], converted[topic]
            assert len(ours) == len(theirs)
            for name in set(ours.data.dtype.names or ()) - {"header"}:
                assert np.array_equal(ours[name], theirs[name]), name
        # The link ran 30 times too fast, so the fit of the clock differs, but not by much.
        assert abs(np.diff(live["/imu0/data_raw"].time_ns - converted["/imu0/data_raw"].time_ns)).max() < 10**6
        assert live.metadata["source"]["format"] == "mavlink"


@pytest.mark.parametrize("name", ["copter_sitl_mavlink2.tlog", "copter_radio_2015.tlog"])
def test_real_logs_over_udp(start: Start, logs: Path, tmp_path: Path, name: str) -> None:
    frames = frames_of(logs / name)[:8000]
    port = free_port()
    process = start(f"mavlink:udpin:127.0.0.1:{port}", "-o", "live.mcap", "--json")
    send(frames, port, 4000.0)
    code, out, err = stop(process)
    assert code == 0, err
    assert json.loads(out)["bytes"] == sum(map(len, frames))
    (tmp_path / "same.tlog").write_bytes(
        b"".join(struct.pack(">Q", 1_700_000_000_000_000 + 250 * k) + frame for k, frame in enumerate(frames))
    )
    attlog.convert(tmp_path / "same.tlog")
    counts, expected = official(tmp_path / "live.mcap"), official(tmp_path / "same.mcap")
    assert {t: n for t, n in counts.items() if t.startswith("/mavlink")} == {
        t: n for t, n in expected.items() if t.startswith("/mavlink")
    }
    with attlog.open(tmp_path / "live.mcap") as log:
        assert b"".join(bytes(part) for part in log["/recording/stream"]["data"]) == b"".join(frames)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "sigterm"])
def test_a_serial_imu_at_1_khz_loses_nothing(start: Start, terminal: Terminal, tmp_path: Path, number: int) -> None:
    process = start(f"serial:{terminal.name}:115200", "-o", "imu.mcap")
    began = time.time_ns()
    os.write(terminal.master, HEADER)
    terminal.print(0, 4000, 1000.0)
    code, out, err = stop(process, number)
    assert code == 0, err
    assert "4,001 lines" in out
    assert official(tmp_path / "imu.mcap")["/imu0/data_raw"] == 4000
    with attlog.open(tmp_path / "imu.mcap") as log:
        imu = log["/imu0/data_raw"]
        assert np.array_equal(np.diff(imu.time_ns), np.full(3999, 1_000_000))
        assert abs(int(imu.time_ns[0]) - began) < 10**9
    assert "\r" not in err  # no status line in a pipe


def record_until_killed(start: Start, terminal: Terminal, name: str, seconds: float) -> int:
    """The number of the last sample that was printed before the kill."""
    process = start(f"serial:{terminal.name}:115200", "-o", name, "--force")
    os.write(terminal.master, HEADER)
    printing = threading.Thread(target=terminal.print, args=(0, round(seconds * 1000), 1000.0))
    printing.start()
    printing.join()
    process.kill()
    process.communicate()
    return round(seconds * 1000) - 1


def kill_often(start: Start, folder: Path, times: int) -> None:
    draw = random.Random(11)
    for attempt in range(times):
        terminal = Terminal()
        name = f"killed{attempt}.mcap"
        last = record_until_killed(start, terminal, name, draw.uniform(1.2, 3.0))
        terminal.close()
        done = attlog.recover(folder / name)
        assert Path(done.output).name == f"killed{attempt}.recovered.mcap"
        counts = official(Path(done.output))
        assert last - 1000 <= counts["/imu0/data_raw"] - 1 <= last
        with attlog.open(done.output) as log:
            assert np.array_equal(np.diff(log["/imu0/data_raw"].time_ns), np.full(counts["/imu0/data_raw"] - 1, 10**6))


def test_killed_a_few_times_it_misses_the_last_second_at_most(start: Start, tmp_path: Path) -> None:
    kill_often(start, tmp_path, 5)


@pytest.mark.parametrize("delay_s", [0.05, 0.4, 0.8])
def test_killed_while_it_finishes(start: Start, terminal: Terminal, tmp_path: Path, delay_s: float) -> None:
    process = start(f"serial:{terminal.name}:115200", "-o", "imu.mcap")
    os.write(terminal.master, HEADER)
    terminal.print(0, 1000, 1000.0)
    time.sleep(0.3)
    process.send_signal(signal.SIGTERM)
    time.sleep(delay_s)
    process.kill()
    process.communicate()
    counts = official(Path(attlog.recover(tmp_path / "imu.mcap").output))
    assert counts["/imu0/data_raw"] == 1000
    assert counts["/recording/stream"] > 1


@pytest.mark.long
def test_killed_50_times_it_misses_the_last_second_at_most(start: Start, tmp_path: Path) -> None:
    kill_often(start, tmp_path, 50)


def test_rotation_by_time_keeps_every_line_and_the_header(start: Start, terminal: Terminal, tmp_path: Path) -> None:
    process = start(f"serial:{terminal.name}", "-o", "imu.mcap", "--rotate-time", "1s")
    os.write(terminal.master, HEADER)
    terminal.print(0, 3000, 1000.0)
    code, out, err = stop(process)
    assert code == 0, err
    files = sorted(tmp_path.glob("imu_*.mcap"))
    assert [path.name for path in files[:2]] == ["imu_0001.mcap", "imu_0002.mcap"]
    assert not (tmp_path / "imu.mcap").exists()
    assert sum(official(path)["/imu0/data_raw"] for path in files) == 3000
    for path in files:
        assert path.name in out
        with attlog.open(path) as log:
            assert np.allclose(log["/imu0/data_raw"]["linear_acceleration"]["z"], 9.80665)


def test_no_file_of_a_row_is_overwritten_unasked(tmp_path: Path) -> None:
    (tmp_path / "imu_0003.mcap").write_bytes(b"mine")
    with pytest.raises(attlog.StorageError, match="imu_0003"):
        attlog.record(f"mavlink:udpin:127.0.0.1:{free_port()}", tmp_path / "imu.mcap", rotate_s=1.0, duration_s=0.1)


def test_rotation_by_size(start: Start, tmp_path: Path) -> None:
    frames, port = imu_frames(3000), free_port()
    process = start(f"mavlink:udpin:127.0.0.1:{port}", "-o", "imu.mcap", "--rotate-size", "60kB", "--drop-stream")
    send(frames, port, 2000.0)
    code, _, err = stop(process)
    assert code == 0, err
    files = sorted(tmp_path.glob("imu_*.mcap"))
    assert len(files) >= 3
    counts = [official(path) for path in files]
    assert sum(count["/imu0/data_raw"] for count in counts) == 3000
    assert not any("/recording/stream" in count for count in counts)


def test_a_lost_port_is_opened_again(start: Start, tmp_path: Path) -> None:
    first, place = Terminal(), tmp_path / "port"
    place.symlink_to(first.name)
    process = start(f"serial:{place}:115200", "-o", "imu.mcap", "--json")
    os.write(first.master, HEADER)
    first.print(0, 500, 1000.0)
    os.write(first.master, b"1500000,0.0,")  # half a line
    time.sleep(0.6)
    place.unlink()
    first.close()
    time.sleep(1.0)
    second = Terminal()
    place.symlink_to(second.name)
    time.sleep(1.5)
    second.print(3000, 500, 1000.0)
    code, out, err = stop(process)
    second.close()
    assert code == 0, err
    told = json.loads(out)
    assert told["reconnections"] == 1
    assert official(tmp_path / "imu.mcap")["/imu0/data_raw"] == 1000
    with attlog.open(tmp_path / "imu.mcap") as log:
        kinds = [bytes(kind) for kind in log["/findings"]["kind"].tolist()]
        words = [bytes(text) for text in log["/annotations"]["msg"].tolist()]
    assert b"gap" in kinds
    assert any(text.startswith(b"lost") for text in words)
    assert b"connected again" in words


def test_tcp_that_closes_is_opened_again(start: Start, tmp_path: Path) -> None:
    frames = imu_frames(400)
    with socket.create_server(("127.0.0.1", 0)) as server:
        process = start(f"mavlink:tcp:127.0.0.1:{server.getsockname()[1]}", "-o", "imu.mcap", "--json")
        for part in (frames[:200], frames[200:]):
            link, _ = server.accept()
            for at in range(0, sum(map(len, part)), 50):  # frames in pieces, as TCP delivers them
                link.sendall(b"".join(part)[at : at + 50])
            time.sleep(0.5)
            link.close()
        code, out, err = stop(process)
    assert code == 0, err
    assert json.loads(out)["reconnections"] >= 1
    assert official(tmp_path / "imu.mcap")["/imu0/data_raw"] == 400


def test_a_terminal_gets_a_status_line(tmp_path: Path) -> None:
    screen, port = Terminal(), free_port()
    command = [ATTLOG, "record", f"mavlink:udpin:127.0.0.1:{port}", "-o", "imu.mcap", "--duration", "4s"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=screen.slave)
    while process.poll() is None:
        send(imu_frames(100), port, 1000.0)
    shown = os.read(screen.master, 1 << 16).decode()
    screen.close()
    assert "\r" in shown
    assert "Hz" in shown
    assert "imu.mcap" in shown


def test_nothing_arrives_nothing_is_written(start: Start, tmp_path: Path) -> None:
    process = start(f"mavlink:udpin:127.0.0.1:{free_port()}", "-o", "none.mcap")
    code, out, err = stop(process)
    assert (code, out) == (130, "")
    assert "nothing arrived" in err
    process = start(f"mavlink:udpin:127.0.0.1:{free_port()}", "-o", "none.mcap", "--duration", "0.5s")
    assert process.wait(timeout=60) == 1
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_read_is_kept_and_read_later(start: Start, terminal: Terminal, tmp_path: Path) -> None:
    process = start(f"serial:{terminal.name}:115200", "-o", "odd.mcap", "--strict")
    for number in range(300):
        os.write(terminal.master, b"%d;16384;0;0;131;0;0\n" % (1000 * number))
        time.sleep(0.002)
    code, out, err = stop(process)
    assert code == 3, err
    assert "attlog recover odd.mcap" in out.replace(str(tmp_path) + "/", "")
    assert official(tmp_path / "odd.mcap").keys() == {"/recording/stream"}
    command = [ATTLOG, "recover", "odd.mcap", "--columns", "t_us,ax,ay,az,gx,gy,gz", "--sensor", "mpu9250"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr + done.stdout
    with attlog.open(tmp_path / "odd.recovered.mcap") as log:
        imu = log["/imu0/data_raw"]
    assert len(imu) == 300
    assert np.allclose(imu["linear_acceleration"]["x"], 9.80665)


def test_from_python_with_a_status(tmp_path: Path) -> None:
    frames, port = imu_frames(1500), free_port()
    seen: list[str] = []
    sending = threading.Thread(target=send, args=(frames, port, 1000.0))

    def watch(status: Status) -> None:
        if sending.ident is None:
            sending.start()
        seen.append(status.to_text())

    def arrived() -> bool:
        return len(seen) > 2 and not sending.is_alive() and f"{len(frames):,} messages" in seen[-1]

    done = attlog.record(
        f"mavlink:udpin:127.0.0.1:{port}", tmp_path / "imu.mcap", duration_s=60, stop=arrived, watch=watch
    )
    assert done.complete
    assert done.status.units == len(frames)
    assert any(" 1,0" in text or " 9" in text for text in seen)
    assert "imu.mcap" in seen[-1]
    with pytest.raises(attlog.StorageError, match="exists"):
        attlog.record(f"mavlink:udpin:127.0.0.1:{port}", tmp_path / "imu.mcap")


@pytest.mark.parametrize(
    "words",
    [
        ["cable", "-o", "x.mcap"],
        ["mavlink:udpin:127.0.0.1", "-o", "x.mcap"],
        ["mavlink:usb:0", "-o", "x.mcap"],
        ["serial:", "-o", "x.mcap"],
        ["mavlink:udpin:127.0.0.1:99999", "-o", "x.mcap"],
        ["mavlink:udpin:127.0.0.1:14550", "-o", "x.mcap", "--duration", "soon"],
        ["mavlink:udpin:127.0.0.1:14550", "-o", "x.mcap", "--rotate-size", "many"],
        ["mavlink:udpin:127.0.0.1:14550", "-o", "x.mcap", "--sensor", "abacus"],
        ["mavlink:udpin:127.0.0.1:14550"],
    ],
)
def test_wrong_usage_is_2(words: list[str], tmp_path: Path) -> None:
    done = subprocess.run([ATTLOG, "record", *words], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "source", ["serial:no-such-port:9600", "mavlink:serial:no-such-port:9600", "mavlink:tcp:127.0.0.1:1"]
)
def test_a_port_that_cannot_be_opened_is_one_line(source: str, tmp_path: Path) -> None:
    done = subprocess.run([ATTLOG, "record", source, "-o", "x.mcap"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1
    assert len(done.stderr.strip().splitlines()) == 1
    assert "cannot be opened" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_ten_minutes_at_1_khz_lose_nothing(start: Start, tmp_path: Path) -> None:
    frames, port = imu_frames(600_000), free_port()
    process = start(f"mavlink:udpin:127.0.0.1:{port}", "-o", "imu.mcap", "--json")
    send(frames, port, len(frames) / 600.0)
    code, out, err = stop(process)
    assert code == 0, err
    assert json.loads(out)["missing"] == 0
    assert official(tmp_path / "imu.mcap")["/imu0/data_raw"] == 600_000
