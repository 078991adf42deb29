"""A CSV of 500,000 samples to columns, every line accounted for, against ``pandas.read_csv`` on the same file."""

import io
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from attlog.ingest import serial_csv
from attlog.schemas import IngestOptions, Source

from .row import Row, cpu_seconds

SAMPLES = 500_000
TARGET = 1.5
HEADER = "t_us,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,mx_uT,my_uT,mz_uT\n"


def rows() -> Iterator[Row]:
    """One row for a clean file, one for a file with lines that are no samples."""
    clean = synthetic(SAMPLES)
    yield _row("CSV to columns", clean, {})
    yield _row("CSV with bad lines", damaged(clean), {"comment": "#", "on_bad_lines": "skip", "low_memory": False})


def _row(work: str, text: str, options: dict[str, object]) -> Row:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_text(text)
        result = serial_csv.read(Source.from_path(path), IngestOptions())
        assert result.completeness.messages >= 0.99 * SAMPLES
        ours = cpu_seconds(lambda: serial_csv.read(Source.from_path(path), IngestOptions()), 5)
        theirs = cpu_seconds(lambda: pd.read_csv(path, **options), 5)  # type: ignore[call-overload]
        size = path.stat().st_size / 1e6
    named = f"{work} ({SAMPLES // 1000} k lines, {size:.0f} MB), share of the peer's time"
    return Row(named, "pandas.read_csv", ours / theirs, TARGET, at_most=True)


def synthetic(count: int, seed: int = 1) -> str:
    """What a nine-axis logger prints at 1 kHz."""
    rng = np.random.default_rng(seed)
    time_us = np.cumsum(rng.integers(950, 1050, count))
    noise = np.repeat([0.1, 20.0, 10.0], 3)
    mean = np.array([0, 0, 1, 0, 0, 0, 20, 0, -40])
    values = rng.normal(mean, noise, (count, 9))
    frame = pd.DataFrame(np.round(values, 5))
    frame.insert(0, "t", time_us)
    out = io.StringIO()
    frame.to_csv(out, header=False, index=False)
    return HEADER + out.getvalue()


def damaged(text: str, seed: int = 2) -> str:
    """The same with a comment, a blank line or half a line after every thousandth."""
    rng = np.random.default_rng(seed)
    lines = text.splitlines()
    for number in range(1000, len(lines), 1000):
        junk = ("# still running", "", lines[number][: int(rng.integers(5, 30))])[number // 1000 % 3]
        lines[number] = f"{lines[number]}\n{junk}"
    return "\n".join(lines) + "\n"
