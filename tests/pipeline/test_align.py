"""`align` on files: what it stores, and that estimate and analyze apply it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

import attlog
from attlog import storage
from attlog.ingest.simulation import SimulatedRun, simulate
from attlog.ingest.simulation.columns import run_columns
from attlog.schemas import InputError, UsageError
from attlog.schemas.clock import ALIGNMENT, parse_alignments

LATE_NS = 137_000_000
TRUTH = "/reference/attitude"


@pytest.fixture(scope="module")
def flown() -> SimulatedRun:
    return simulate("flight", 4)


def _write(run: SimulatedRun, path: Path, keep: tuple[str, ...] = ("/",), late: tuple[str, ...] = ()) -> Path:
    """The run's channels that begin with ``keep``, those of ``late`` 0.137 s behind and 50 ppm off."""
    columns = [c for c in run_columns(run) if c.channel.topic.startswith(keep)]
    zero = int(run.reference.time_ns[0])
    moved = [
        dataclasses.replace(c, time_ns=np.round((c.time_ns - LATE_NS - zero) / (1 + 50e-6)).astype(np.int64) + zero)
        if c.channel.topic.startswith(late or ("none",))
        else c
        for c in columns
    ]
    storage.write(path, moved)
    return path


def _payloads(path: Path) -> list[tuple[str, int, bytes]]:
    with path.open("rb") as file:
        return [(c.topic, m.log_time, m.data) for _, c, m in make_reader(file).iter_messages()]


def test_what_is_found_is_stored_and_applied(flown: SimulatedRun, tmp_path: Path) -> None:
    right = _write(flown, tmp_path / "right.mcap")
    path = _write(flown, tmp_path / "late.mcap", late=(TRUTH,))
    for each in (right, path):
        attlog.estimate(each, ["ecf"])
    spoiled = attlog.analyze(path).table["ecf"].statistics["total"].rmse
    aligned = attlog.align(path)
    found = aligned.alignment
    zero = int(flown.reference.time_ns[0])
    error = found.offset_s - 0.137 - 50e-6 * (found.epoch_ns - zero) * 1e-9
    assert abs(error) < 3 * found.offset_sigma_s
    assert abs(found.drift_ppm - 50.0) < 3 * found.drift_sigma_ppm
    assert len(found.sha256) == 64
    with storage.open(path) as log:
        assert parse_alignments(log.metadata[ALIGNMENT]) == {TRUTH: found}
    analyzed = attlog.analyze(path)
    assert "clock aligned: /reference/attitude" in analyzed.to_text()
    assert "clock aligned: /reference/attitude" in attlog.estimate(path, ["ecf"]).to_text()
    ideal = attlog.analyze(right).table["ecf"].statistics["total"].rmse
    assert analyzed.table["ecf"].statistics["total"].rmse == pytest.approx(ideal, abs=1e-3)
    assert spoiled > ideal + 0.1
    again = attlog.align(path).alignment
    assert dataclasses.replace(again, software=found.software) == found


def test_two_logs_of_one_flight(flown: SimulatedRun, tmp_path: Path) -> None:
    flight = _write(flown, tmp_path / "flight.mcap", ("/imu0", "/mag0", "/gnss0"))
    capture = _write(flown, tmp_path / "capture.mcap", (TRUTH,), late=(TRUTH,))
    attlog.estimate(flight, ["ecf"])
    found = attlog.align(flight, str(capture)).alignment
    assert found.clock == "capture.mcap"
    assert abs(found.offset_s - 0.137) < 0.01
    analyzed = attlog.analyze(flight, reference=str(capture))
    assert "clock aligned: capture.mcap" in analyzed.to_text()
    whole = _write(flown, tmp_path / "whole.mcap")
    attlog.estimate(whole, ["ecf"])
    ideal = attlog.analyze(whole).table["ecf"].statistics["total"].rmse
    assert analyzed.table["ecf"].statistics["total"].rmse == pytest.approx(ideal, abs=1e-3)


def test_other_channels_and_records_stay(flown: SimulatedRun, tmp_path: Path) -> None:
    path = _write(flown, tmp_path / "log.mcap")
    storage.annotate(path, metadata={"mine": {"a": "b"}})
    before = _payloads(path)
    attlog.align(path, output=tmp_path / "copy.mcap")
    assert _payloads(tmp_path / "copy.mcap") == before
    with storage.open(tmp_path / "copy.mcap") as log:
        assert log.metadata["mine"] == {"a": "b"}
        assert ALIGNMENT in log.metadata
    with storage.open(path) as log:
        assert ALIGNMENT not in log.metadata


def test_what_cannot_be_aligned_is_told(flown: SimulatedRun, tmp_path: Path) -> None:
    path = _write(flown, tmp_path / "log.mcap", ("/imu0", "/mag0"))
    with pytest.raises(InputError, match="no attitude to compare with"):
        attlog.align(path)
    with pytest.raises(UsageError, match="no IMU 3"):
        attlog.align(path, imu=3)
    blind = _write(flown, tmp_path / "blind.mcap", (TRUTH,))
    with pytest.raises(InputError, match="no IMU"):
        attlog.align(blind)
    still = tmp_path / "still.mcap"
    storage.write(still, [c.select(c.time_ns < flown.imu.time_ns[500]) for c in run_columns(flown)])
    with pytest.raises(InputError, match="no motion"):
        attlog.align(still)
