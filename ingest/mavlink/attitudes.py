"""Attitudes: what the autopilot estimated, and what a simulator knows."""

from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from typing import Final

import numpy as np

from ...geometry.frames import enu_flu_from_ned_frd, orientation_from_rpy_ned, remove_trim
from ...schemas.columns import Columns, Table
from ...schemas.finding import Finding, Kind, Severity
from ...schemas.recording import Floats
from ...schemas.unified import attitude_columns
from .frames import Frames, Group
from .times import Timeline
from .vehicles import Vehicle, sent_by


def _fields(rows: Table, names: str) -> Floats:
    result = np.empty((len(rows), len(names.split())))
    for i, name in enumerate(names.split()):
        result[:, i] = rows[name]
    return result


class Trim(Enum):
    """How ArduPilot applies AHRS_TRIM to a message's attitude."""

    SUBTRACTED = "subtracted from roll and pitch"
    ROTATED = "R_sent = R R(trim)^T"


def _euler(group: Group, trim: Floats | None = None) -> Floats:
    """roll, pitch, yaw in rad; ``trim`` (3,) is added, where it had been subtracted."""
    angles = _fields(group.rows, "roll pitch yaw")
    return orientation_from_rpy_ned(angles if trim is None else angles + trim)


def _quaternion(group: Group, trim: Floats | None = None) -> Floats:
    """q1 to q4 are w x y z, body FRD to NED."""
    assert trim is None
    return enu_flu_from_ned_frd(_fields(group.rows, "q2 q3 q4 q1"))


def _hil_quaternion(group: Group, trim: Floats | None = None) -> Floats:
    """w x y z, body FRD to NED."""
    assert trim is None
    return enu_flu_from_ned_frd(group.rows["attitude_quaternion"][:, [1, 2, 3, 0]])


Reader = Callable[..., Floats]
# message -> (reader, trim where an EKF is in charge, trim where DCM is). The EKFs give Euler angles less the trim, DCM
# rotates; AHRS2 is the filter that is not in charge; AP_AHRS::get_quaternion rotates whatever the filter.
ONBOARD: Final[Mapping[str, tuple[Reader, Trim, Trim]]] = {
    "ATTITUDE": (_euler, Trim.SUBTRACTED, Trim.ROTATED),
    "ATTITUDE_QUATERNION": (_quaternion, Trim.ROTATED, Trim.ROTATED),
    "AHRS2": (_euler, Trim.ROTATED, Trim.SUBTRACTED),
    "AHRS3": (_euler, Trim.SUBTRACTED, Trim.SUBTRACTED),
}
# The first that a log holds is the reference.
REFERENCES: Final[Mapping[str, Reader]] = {
    "HIL_STATE_QUATERNION": _hil_quaternion,
    "SIM_STATE": _quaternion,
    "SIMSTATE": _euler,
}
TRIM: Final = ("AHRS_TRIM_X", "AHRS_TRIM_Y")


def channels(
    frames: Frames, line: Timeline, vehicle: Vehicle, parameters: Mapping[str, float]
) -> tuple[list[Columns], list[Finding]]:
    """``/reference/attitude`` and ``/onboard/{source}/attitude`` of a vehicle.

    ArduPilot turns its attitudes by AHRS_TRIM before it sends them: they are turned back, or, where the log does not
    hold the trim, left as they are, with a finding.
    """
    columns = list(_reference(frames, line, vehicle))
    findings: list[Finding] = []
    trim = np.array([parameters.get(name, np.nan) for name in TRIM]) if vehicle.is_ardupilot else np.zeros(2)
    for name, (read, with_ekf, with_dcm) in ONBOARD.items():
        group = sent_by(frames, vehicle, name)
        if group is None:
            continue
        orientation = _untrimmed(group, read, with_ekf if _ekf_in_charge(parameters) else with_dcm, trim)
        about = {}
        if vehicle.is_ardupilot:
            known = bool(np.isfinite(trim).all())
            about = {"trim_rad": " ".join(f"{value:.9g}" for value in trim)} if known else {"trim": "unknown"}
        made = _made(line, vehicle, group, f"onboard/{name.lower()}", orientation, about)
        if made is not None:
            columns.append(made)
            findings += [_unknown_trim(made)] if "trim" in about else []
    return columns, findings


def _ekf_in_charge(parameters: Mapping[str, float]) -> bool:
    return parameters.get("AHRS_EKF_TYPE", parameters.get("AHRS_EKF_USE", 1.0)) != 0.0


def _untrimmed(group: Group, read: Reader, how: Trim, trim: Floats) -> Floats:
    """The attitudes of the board, as far as the trim (roll, pitch) is known."""
    if not (np.isfinite(trim).all() and trim.any()):
        return read(group)
    whole = np.array([*trim, 0.0])
    return read(group, whole) if how is Trim.SUBTRACTED else remove_trim(read(group), whole)


def _reference(frames: Frames, line: Timeline, vehicle: Vehicle) -> Iterator[Columns]:
    for name, read in REFERENCES.items():
        group = sent_by(frames, vehicle, name)
        made = None if group is None else _made(line, vehicle, group, "reference", read(group), {})
        if made is not None:
            yield made
            return


def _made(
    line: Timeline, vehicle: Vehicle, group: Group, place: str, orientation: Floats, about: dict[str, str]
) -> Columns | None:
    """The channel, without rows that hold no attitude; None where no row does."""
    times = line.of(group)
    square = np.einsum("ij,ij->i", orientation, orientation)
    keep = np.abs(square - 1.0) < 0.1
    if not keep.all():
        times, orientation, square = times[keep], orientation[keep], square[keep]
    if len(times) == 0:
        return None
    return attitude_columns(
        f"{vehicle.prefix}/{place}/attitude",
        times,
        orientation / np.sqrt(square)[:, np.newaxis],
        child_frame_id=f"{vehicle.prefix}/{place.replace('/', '_')}".lstrip("/"),
        source=group.name,
        metadata={"system": str(vehicle.system), **line.stamped_by(group), **about},
    )


def _unknown_trim(columns: Columns) -> Finding:
    text = "AHRS_TRIM_X and _Y are not in the log: this attitude may be turned against the IMU by some degrees"
    span = int(columns.time_ns[0]), int(columns.time_ns[-1])
    return Finding(*span, Severity.WARN, Kind.TRIM, columns.channel.topic, float("nan"), "rad", text)
