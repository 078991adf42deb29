"""EuRoC and TUM-VI sequences: folders with the IMU's CSV and a ground truth as CSV or as a TUM trajectory.

M. Burri et al., IJRR 35(10), 2016, doi:10.1177/0278364915620033; D. Schubert et al., IROS 2018,
doi:10.1109/IROS.2018.8593419. imu0/data.csv: stamp [ns], angular rate [rad/s], specific force [m/s^2] in the sensor's
axes. Ground truth: stamp, position [m], quaternion w x y z of the sensor in a world whose z is up, perhaps velocity and
biases; a TUM trajectory: stamp [s], position, quaternion x y z w.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from ...geometry.quaternions import conjugate, from_matrix, multiply
from ...schemas import (
    AttitudeColumns,
    Columns,
    Completeness,
    CsvOptions,
    Ingested,
    IngestOptions,
    InputError,
    Source,
    World,
)
from ...schemas.unified import attitude_columns, quaternions
from .. import serial_csv

FORMAT: Final = "euroc"
REFERENCE: Final = "/reference/attitude"
IMU_FILES: Final = ("mav0/imu0/data.csv", "imu0/data.csv", "dso/imu.txt")
"""Looked for in this order, in the folder."""
REFERENCE_FOLDERS: Final = ("state_groundtruth_estimate0", "groundtruth", "gt", "mocap0", "vicon0")
"""Looked for in this order, beside the IMU's folder."""
REFERENCE_FILES: Final = ("dso/gt_imu.csv", "*groundtruth*.txt", "*groundtruth*.tum", "*groundtruth*.csv", "gt*.txt")
UNITS: Final = {"accel": "m/s^2", "gyro": "rad/s"}
TUM_COLUMNS: Final = ("t_s", "-", "-", "-", "qx", "qy", "qz", "qw")
_EXTRINSICS: Final = re.compile(r"T_BS:.*?data:\s*\[([^\]]*)\]", re.DOTALL)


def members(folder: Path) -> tuple[Path, ...]:
    """The IMU's file and, where there is one, that of the ground truth; none where the folder is no sequence."""
    imu = next((folder / name for name in IMU_FILES if (folder / name).is_file()), None)
    if imu is None:
        return ()
    reference = next(_references(folder, imu), None)
    return (imu,) if reference is None else (imu, reference)


def _references(folder: Path, imu: Path) -> Iterator[Path]:
    base = imu.parent.parent
    for name in REFERENCE_FOLDERS:
        if (base / name / "data.csv").is_file():
            yield base / name / "data.csv"
    for place in dict.fromkeys((folder, base)):
        for pattern in REFERENCE_FILES:
            yield from sorted(path for path in place.glob(pattern) if path.is_file())


def recognizes(head: bytes) -> bool:
    """Never: a sequence is a folder."""
    return False


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """The sequence as columns; InputError where a file of it cannot be read."""
    said = options or IngestOptions()
    if not source.parts:
        raise InputError(f"{source.name}: is no folder of an EuRoC sequence")
    parts = [_read_imu(source.parts[0], said), *(_read_reference(part, said) for part in source.parts[1:])]
    columns = [columns for part in parts for columns in part.columns]
    return replace(
        parts[0],
        format=FORMAT,
        columns=tuple(columns),
        completeness=_sum(parts),
        findings=tuple(finding for part in parts for finding in part.findings),
        notes=tuple(note for part in parts for note in part.notes),
        metadata={_stem(p): {**r.metadata["csv"], "file": p.name} for p, r in zip(source.parts, parts, strict=True)},
    )


def _stem(part: Source) -> str:
    """A name for the part: that of its folder, where the file is only called data."""
    path = Path(part.name)
    return path.parent.name if path.stem == "data" and path.parent.name else path.stem


def _as_csv(part: Source) -> Source:
    return replace(part, name=f"{_stem(part)}.csv")


def _read_imu(part: Source, said: IngestOptions) -> Ingested:
    csv = CsvOptions(units=UNITS, time_unit="ns", strict=said.csv.strict)
    return serial_csv.read(_as_csv(part), replace(said, csv=csv, sensor=None))


def _read_reference(part: Source, said: IngestOptions) -> Ingested:
    """The ground truth as ``/reference/attitude``, its heading counted from nowhere; all else under ``/csv``."""
    tum = Path(part.name).suffix in (".txt", ".tum")
    attitude = AttitudeColumns(World.ENU, reference=True)
    csv = CsvOptions(
        columns=TUM_COLUMNS if tum else (),
        time_unit="s" if tum else "ns",
        normalize=said.csv.normalize,
        attitude=attitude,
    )
    done = serial_csv.read(_as_csv(part), replace(said, csv=csv, sensor=None))
    turned = [
        _from_marker(columns, part) if columns.channel.topic == REFERENCE else columns for columns in done.columns
    ]
    return replace(done, columns=tuple(turned))


def _from_marker(reference: Columns, part: Source) -> Columns:
    """The sensor's attitude from that of a Vicon body, by the rotation of T_BS in the sensor.yaml beside the file."""
    settings = part.path.parent / "sensor.yaml" if part.path is not None else None
    if settings is None or _stem(part) != "vicon0" or not settings.is_file():
        return reference
    match = _EXTRINSICS.search(settings.read_text(encoding="utf-8", errors="replace"))
    values = np.array([float(value) for value in match[1].split(",")]) if match else np.zeros(0)
    if values.size != 16:
        raise InputError(f"{settings}: its T_BS is no matrix of 4 x 4 numbers")
    body_from_marker = from_matrix(values.reshape(4, 4)[:3, :3])
    q = multiply(quaternions(reference.data), conjugate(body_from_marker))
    about = {**reference.channel.metadata, "aligned": "T_BS of sensor.yaml taken out"}
    about.pop("source")
    return attitude_columns(
        REFERENCE, reference.time_ns, q, child_frame_id="reference", source=_stem(part), metadata=about
    )


def _sum(parts: list[Ingested]) -> Completeness:
    """The parts' counts together."""
    each = [part.completeness for part in parts]
    dropped: Counter[str] = Counter()
    for one in each:
        dropped.update(one.dropped)
    total, read, messages, skipped = (
        sum(getattr(one, name) for one in each) for name in ("bytes_total", "bytes_read", "messages", "bytes_skipped")
    )
    return Completeness(total, read, messages, skipped, dict(dropped))
