"""BROAD trials: IMU with magnetometer at 285.7 Hz, and optical motion capture as the reference.

D. Laidig, M. Caruso, A. Cereatti, T. Seel, Data 6(7):72, 2021, doi:10.3390/data6070072. A file holds, sample by sample,
imu_gyr [rad/s], imu_acc [m/s^2], imu_mag [uT], opt_quat (w x y z, sensor to ENU, NaN where the markers were hidden),
opt_pos [m] and movement (whether the sample counts in the benchmark), and sampling_rate [Hz].
"""

import io
import zlib
from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.quaternions import normalize, rotate
from ...schemas import (
    Channel,
    Columns,
    Completeness,
    Finding,
    Ingested,
    IngestOptions,
    InputError,
    Kind,
    Severity,
    Source,
)
from ...schemas.columns import Time
from ...schemas.passthrough import SourceField, generated_type
from ...schemas.recording import Segment
from ...schemas.unified import attitude_columns, imu_columns, mag_columns

Floats = NDArray[np.float64]

FORMAT: Final = "broad"
NEEDED: Final = {"imu_gyr": 3, "imu_acc": 3, "imu_mag": 3, "opt_quat": 4}
"""Variable -> its columns."""
KEPT: Final = (SourceField("opt_pos", "float64", 3, "m"), SourceField("movement", "uint8"))
MATLAB: Final = b"MATLAB 5.0 MAT-file"
HDF5: Final = b"\x89HDF\r\n\x1a\n"
_MAT_HEADER: Final = 128
_NAME_WITHIN: Final = 96
"""Bytes of a MAT-file's first variable in which its name stands."""


def recognizes(head: bytes) -> bool:
    """Whether a file that begins with ``head`` is HDF5, or a MAT-file whose first variable is one of BROAD's."""
    if head.startswith(HDF5):
        return True
    if not head.startswith(MATLAB):
        return False
    element = head[_MAT_HEADER:]
    if element[:4] == b"\x0f\x00\x00\x00":
        try:
            element = zlib.decompressobj().decompress(element[8:], 2 * _NAME_WITHIN)
        except zlib.error:
            return False
    return any(
        name.encode() in element[: 2 * _NAME_WITHIN] for name in (*NEEDED, "opt_pos", "movement", "sampling_rate")
    )


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """The trial as columns; InputError where it is another kind of MAT or HDF5 file, or damaged."""
    trial = _checked(_variables(source), source.name)
    rate_hz = float(trial["sampling_rate"].ravel()[0])
    count = len(trial["imu_gyr"])
    time_ns = np.rint(np.arange(count) * (1e9 / rate_hz)).astype(np.int64)
    reference, findings = _reference(trial, time_ns)
    sensor = {"frame": "sensor", "sampling_rate_hz": f"{rate_hz:.10g}"}
    columns = [
        imu_columns("/imu0/data_raw", time_ns, trial["imu_gyr"], trial["imu_acc"], source=FORMAT, metadata=sensor),
        mag_columns("/mag0/field", time_ns, trial["imu_mag"] * 1e-6, source=FORMAT, metadata=sensor),
        *([reference] if len(reference) else []),
        *_passed(trial, time_ns),
    ]
    return Ingested(
        format=FORMAT,
        columns=tuple(columns),
        completeness=Completeness(source.size, source.size, count),
        segments=(Segment("", 0, int(time_ns[0]), int(time_ns[-1]), 0, "start of the log"),),
        findings=tuple(findings),
        metadata={FORMAT: _about(trial, time_ns)},
    )


def _variables(source: Source) -> Mapping[str, NDArray[Any]]:
    data = source.data.tobytes()
    try:
        return _from_hdf5(data) if data.startswith(HDF5) else _from_mat(data)
    except (OSError, ValueError, TypeError, KeyError, zlib.error) as error:
        raise InputError(f"{source.name}: is damaged, or no trial of BROAD: {error}") from error


def _from_mat(data: bytes) -> Mapping[str, NDArray[Any]]:
    from scipy.io import loadmat

    file: Any = io.BytesIO(data)
    loaded: dict[str, Any] = loadmat(file)
    return {name: np.asarray(value) for name, value in loaded.items() if not name.startswith("__")}


def _from_hdf5(data: bytes) -> Mapping[str, NDArray[Any]]:
    try:
        h5py: Any = import_module("h5py")
    except ImportError as error:
        raise InputError("HDF5 files need the package h5py: pip install h5py") from error
    with h5py.File(io.BytesIO(data), "r") as file:
        return {name: np.asarray(file[name]) for name in file}


def _checked(trial: Mapping[str, NDArray[Any]], name: str) -> Mapping[str, NDArray[Any]]:
    """The variables, sample first; InputError where one is missing or of another shape."""
    missing = [needed for needed in (*NEEDED, "sampling_rate") if needed not in trial]
    if missing:
        held = ", ".join(sorted(trial)) or "nothing"
        raise InputError(f"{name}: lacks {', '.join(missing)} of a BROAD trial (it holds {held})")
    count = max(trial["imu_gyr"].shape)
    for variable, width in NEEDED.items():
        if trial[variable].shape != (count, width) or count == 0:
            raise InputError(f"{name}: {variable} has the shape {trial[variable].shape}, not ({count}, {width})")
    if not float(np.asarray(trial["sampling_rate"]).ravel()[0]) > 0:
        raise InputError(f"{name}: the sampling rate is not above 0")
    return trial


def _reference(trial: Mapping[str, NDArray[Any]], time_ns: Time) -> tuple[Columns, list[Finding]]:
    """``/reference/attitude`` where the markers were seen, and a finding that says for how many samples not."""
    q = normalize(trial["opt_quat"][:, [1, 2, 3, 0]])
    seen = np.asarray(np.isfinite(q).all(axis=1))
    about = {"north": "magnetic", "axes": "enu", "frame": "sensor", "aligned": "as published"}
    topic = "/reference/attitude"
    columns = attitude_columns(
        topic, time_ns[seen], q[seen], child_frame_id="reference", source="opt_quat", metadata=about
    )
    hidden = int(np.count_nonzero(~seen))
    if not hidden:
        return columns, []
    at = time_ns[~seen]
    advice = f"{hidden:,} of {len(seen):,} samples have no reference: the markers were hidden"
    return columns, [Finding(int(at[0]), int(at[-1]), Severity.INFO, Kind.GAP, topic, hidden, "samples", advice)]


def _passed(trial: Mapping[str, NDArray[Any]], time_ns: Time) -> list[Columns]:
    """``/broad/trial``: the marker's position, and which samples count."""
    if any(field.name not in trial for field in KEPT):
        return []
    message = generated_type("broad_msgs", "trial", KEPT)
    data = np.zeros(len(time_ns), [("opt_pos", "<f8", (3,)), ("movement", "u1")])
    data["opt_pos"] = trial["opt_pos"]
    data["movement"] = np.asarray(trial["movement"]).ravel()
    return [Columns(Channel("/broad/trial", message, {"source": FORMAT}), time_ns, data)]


def _about(trial: Mapping[str, NDArray[Any]], time_ns: Time) -> dict[str, str]:
    """What the benchmark counts, and how well its world is ENU by the trial's own field and specific force."""
    q = normalize(trial["opt_quat"][:, [1, 2, 3, 0]])
    seen = np.isfinite(q).all(axis=1)
    about = {"doi": "10.3390/data6070072", "licence": "CC BY 4.0"}
    if np.any(seen):
        force, field = (rotate(q[seen], trial[name][seen]) for name in ("imu_acc", "imu_mag"))
        east, north = np.median(field[:, 0]), np.median(field[:, 1])
        tilt = np.degrees(np.arccos(force.mean(axis=0)[2] / np.linalg.norm(force.mean(axis=0))))
        about |= {
            "field_heading_deg": f"{np.degrees(np.arctan2(east, north)):.2f}",
            "mean_force_tilt_deg": f"{tilt:.2f}",
        }
    if "movement" in trial:
        about["counted_s"] = " ".join(f"{a:.4f}:{b:.4f}" for a, b in _spans(trial["movement"], time_ns))
        about["not_counted_s"] = " ".join(f"{a:.4f}:{b:.4f}" for a, b in _spans(trial["movement"] == 0, time_ns))
    return about


def _spans(marked: NDArray[Any], time_ns: Time) -> list[tuple[float, float]]:
    """Runs of marked samples, seconds from the first sample, half open."""
    flags = np.concatenate([[False], np.asarray(marked).ravel() != 0, [False]])
    turns = np.flatnonzero(np.diff(flags)).reshape(-1, 2)
    stamps = np.append(time_ns, time_ns[-1] + 1) - time_ns[0]
    return [(float(stamps[a]) / 1e9, float(stamps[b]) / 1e9) for a, b in turns]
