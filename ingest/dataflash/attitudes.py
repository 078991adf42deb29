"""Attitudes that the log holds: the simulator's truth, and what the autopilot's filters made of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.frames import enu_flu_from_ned_frd, orientation_from_rpy_ned, remove_trim
from ...geometry.quaternions import normalize
from ...schemas import Columns, Finding, Kind, Severity
from ...schemas.unified import attitude_columns
from .clock import Clock
from .log import Log, Records
from .parameters import over_time

Floats = NDArray[np.float64]

EULER: Final = ("Roll", "Pitch", "Yaw")
"""Degrees."""
QUATERNION: Final = ("Q1", "Q2", "Q3", "Q4")
"""w x y z, body FRD to NED."""
TRIM: Final = ("AHRS_TRIM_X", "AHRS_TRIM_Y", "AHRS_TRIM_Z")


class Trim(Enum):
    """What AHRS_TRIM did to an attitude before it was logged."""

    NONE = "none"
    ROTATION = "rotation"
    """R_logged = R R(trim)^T (AP_AHRS, rotation_autopilot_body_to_vehicle_body)."""
    SUBTRACTION = "subtraction"
    """The trim was subtracted from roll and pitch (NavEKF getEulerAngles)."""
    OF_ACTIVE = "of the active filter"
    """As the filter that was in charge does it: an EKF subtracts, the others rotate."""


@dataclass(frozen=True)
class Kept:
    """A type of record with an attitude: how the trim is in it, and whether its quaternion is the one to take."""

    trim: Trim
    quaternion: bool = False


ONBOARD: Final = {
    "ATT": Kept(Trim.OF_ACTIVE),
    "AHR2": Kept(Trim.ROTATION),
    "DCM": Kept(Trim.ROTATION),
    "XKQ": Kept(Trim.NONE, quaternion=True),
    "NKQ": Kept(Trim.NONE, quaternion=True),
    "XKQ1": Kept(Trim.NONE, quaternion=True),
    "XKQ2": Kept(Trim.NONE, quaternion=True),
    "NKQ1": Kept(Trim.NONE, quaternion=True),
    "NKQ2": Kept(Trim.NONE, quaternion=True),
    "XKF1": Kept(Trim.SUBTRACTION),
    "NKF1": Kept(Trim.SUBTRACTION),
    "XKF6": Kept(Trim.SUBTRACTION),
    "NKF6": Kept(Trim.SUBTRACTION),
    "EKF1": Kept(Trim.SUBTRACTION),
    "EAHR": Kept(Trim.NONE),
}
"""NKF6 and XKF6 are the second core of logs older than the column C."""

TRUTH: Final = ("SIM", Kept(Trim.NONE, quaternion=True))
CORE_COLUMN: Final = "C"
ACTIVE_COLUMN: Final = "AEKF"
EKFS: Final = (1, 2, 3)
"""Values of AEKF that are EKFs; 0 is DCM, 10 the simulator, 11 an external AHRS."""
ACTIVE_PARAMETERS: Final = ("AHRS_EKF_TYPE", "AHRS_EKF_USE")
"""What says so in logs without AEKF."""


def reference(log: Log, clock: Clock) -> Iterator[Columns]:
    """``/reference/attitude`` of SIM: its quaternion where it has one, else its Euler angles."""
    name, kept = TRUTH
    for records in log.named(name):
        if len(records) and (orientation := _orientation(records, kept)) is not None:
            yield attitude_columns(
                "/reference/attitude", clock.stamps(records), orientation, child_frame_id="reference", source=name
            )
            return


def onboard(log: Log, clock: Clock, findings: list[Finding]) -> Iterator[Columns]:
    """``/onboard/{source}/attitude`` of every filter, in the autopilot's own frame: AHRS_TRIM is taken out again."""
    trim_known = any(_trimmed(log))
    for name, kept in ONBOARD.items():
        for records in _cores(log.named(name)):
            orientation = _orientation(records, kept) if len(records) else None
            if orientation is None:
                continue
            source = f"{name.lower()}{'' if records.instance is None else records.instance}"
            topic = f"/onboard/{source}/attitude"
            metadata: dict[str, str] = {}
            if kept.trim is not Trim.NONE and trim_known:
                orientation, metadata = _untrimmed(log, records, kept, orientation)
            elif kept.trim is not Trim.NONE:
                metadata = {"trim": "unknown"}
                findings.append(_trim_unknown(topic, clock.stamps(records)))
            yield attitude_columns(
                topic,
                clock.stamps(records),
                orientation,
                child_frame_id=f"onboard_{source}",
                source=name,
                metadata=metadata,
            )


def _trimmed(log: Log) -> Iterator[bool]:
    for records in log.named("PARM"):
        if records.format.has("Name"):
            yield bool(np.any(records.data["Name"] == TRIM[0].encode()))


def _cores(found: Sequence[Records]) -> Iterator[Records]:
    """The records apart by EKF core, where a log without FMTU has not told them apart yet."""
    for records in found:
        if records.instance is None and records.format.has(CORE_COLUMN):
            yield from records.by_column(CORE_COLUMN)
        else:
            yield records


def _orientation(records: Records, kept: Kept) -> Floats | None:
    """Body FLU to ENU (n, 4), trim still in it; None if the columns are missing or were never filled."""
    if kept.quaternion and records.format.has(*QUATERNION):
        w, x, y, z = (records.scaled(name) for name in QUATERNION)
        q = np.stack([x, y, z, w], axis=-1)
        return enu_flu_from_ned_frd(normalize(q)) if np.any(q) else None
    if not records.format.has(*EULER):
        return None
    rpy = _euler_rad(records)
    return orientation_from_rpy_ned(rpy) if np.any(rpy) else None


def _euler_rad(records: Records) -> Floats:
    return np.radians(np.stack([records.scaled(name) for name in EULER], axis=-1))


def _untrimmed(log: Log, records: Records, kept: Kept, orientation: Floats) -> tuple[Floats, dict[str, str]]:
    """Attitudes without the trim that was in force at each record, and what to say of it."""
    trim = over_time(log, TRIM, records.order)
    constant = bool(np.all(trim == trim[0]))
    metadata = {"trim_rad": " ".join(f"{value:.9g}" for value in trim[-1])}
    if not constant:
        metadata["trim_changed"] = "true"
    subtracted = _subtracted(log, records, kept)
    rotated_back = remove_trim(orientation, trim[0] if constant else trim)
    if not np.any(subtracted):
        return rotated_back, metadata
    added_back = orientation_from_rpy_ned(_euler_rad(records) + trim)
    return np.where(subtracted[:, np.newaxis], added_back, rotated_back), metadata


def _subtracted(log: Log, records: Records, kept: Kept) -> NDArray[np.bool_]:
    """Which records had the trim subtracted from their angles; the others were rotated by it."""
    if kept.trim is not Trim.OF_ACTIVE:
        return np.full(len(records), kept.trim is Trim.SUBTRACTION)
    if records.format.has(ACTIVE_COLUMN):
        return np.isin(records.data[ACTIVE_COLUMN], EKFS)
    return np.asarray(np.any(over_time(log, ACTIVE_PARAMETERS, records.order) > 0.0, axis=1))


def _trim_unknown(topic: str, stamps: NDArray[np.int64]) -> Finding:
    advice = "the log has no parameter AHRS_TRIM_X/Y: this attitude may be tilted against the IMU by the level trim"
    start, end = int(stamps.min()), int(stamps.max())
    return Finding(start, end, Severity.WARN, Kind.TRIM, topic, float("nan"), "rad", advice)
