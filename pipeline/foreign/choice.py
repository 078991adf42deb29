"""What a recording takes from channels that attlog did not write."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ... import storage
from ...schemas.columns import Columns
from ...schemas.errors import InputError, UsageError
from ...schemas.recording import Attitude, Recording
from . import readers
from .clocks import Stamped, sample_times
from .kinds import ATTITUDES, Kind, Shape, shape_of
from .readers import Turned
from .roles import REFERENCE, TOPICS, Place, automatic, is_truth, onboard_name, parse, placed

STATIC = "tf_static"
FIELD_T = (1e-6, 1e-3)
FORCE = (5.0, 20.0)


@dataclass(frozen=True, eq=False)
class Adopted:
    """The recording with what was taken; ``chosen`` is what ``--topic`` said, role -> place; lines to be told."""

    recording: Recording
    chosen: Mapping[str, str]
    remarks: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Taken:
    """One channel in a role, read: an attitude is turned, a sensor is not."""

    role: str
    place: Place
    columns: Columns
    shape: Shape
    turned: Turned | None = None

    @property
    def stamped(self) -> Stamped:
        return readers.stamped(self.columns) if self.turned is None else self.turned.stamped


def adopt(log: storage.LogFile, recording: Recording, own: frozenset[str], topics: Sequence[str] = ()) -> Adopted:
    """Add to a recording what other software's channels hold.

    ``own`` are attlog's channels, which are left out; ``topics`` say ROLE=TOPIC, before what the file remembers of an
    earlier such choice. Sensors are taken unasked where exactly one channel fits; every attitude becomes an onboard
    one, or the reference where its name alone says so. UsageError for a choice that cannot be.
    """
    said = parse(topics)
    remembered = {r: p for r, p in log.metadata.get(TOPICS, {}).items() if r not in said and _there(log, p)}
    asked = {role: placed(log, role, place) for role, place in (remembered | said).items()}
    shapes = {
        topic: shape
        for topic, info in log.topics.items()
        if topic not in own and info.count and (shape := shape_of(info)) and STATIC not in topic
    }
    if not asked and not shapes:
        return Adopted(recording, {}, ())
    sensors, remarks = automatic(shapes, _filled(recording) | frozenset(asked))
    asked |= {role: (Place(topic), shapes[topic]) for role, topic in sensors.items()}
    needed = {place.topic for place, _ in asked.values()} | {t for t, s in shapes.items() if s.kind in ATTITUDES}
    columns = log.read(sorted(needed))
    taken = [_take(role, place, shape, columns[place.topic]) for role, (place, shape) in asked.items()]
    turned = {taken_.place.topic for taken_ in taken if taken_.turned is not None}
    truths = [topic for topic, shape in shapes.items() if shape.kind in ATTITUDES and is_truth(topic)]
    truth = truths[0] if len(truths) == 1 and recording.reference is None and REFERENCE not in asked else None
    for topic, shape in sorted(shapes.items()):
        if shape.kind in ATTITUDES and topic not in turned:
            role = REFERENCE if topic == truth else f"onboard_{onboard_name(topic)}"
            taken += _unasked(role, topic, shape, columns[topic])
    return _put(recording, taken, remembered | said, remarks)


def _there(log: storage.LogFile, place: str) -> bool:
    return place in log.topics or place.rpartition(":")[0] in log.topics


def _filled(recording: Recording) -> frozenset[str]:
    sensors = {"imu": recording.imu, "mag": recording.mag, "gnss": recording.gnss}
    return frozenset(f"{name}{number}" for name, kind in sensors.items() for number in kind)


def _take(role: str, place: Place, shape: Shape, columns: Columns) -> _Taken:
    """A channel in the role that was asked for; InputError where it has not what that takes."""
    where = f"{place} as {role}"
    if len(columns) == 0:
        raise InputError(f"{where}: the channel has no messages")
    if role.startswith(("imu", "mag", "gnss")):
        return _Taken(role, place, columns, shape)
    try:
        frames = readers.turned(columns, shape)
    except KeyError as error:
        raise InputError(f"{where}: its messages have no field {error}") from error
    if place.child and place.child not in frames:
        raise UsageError(f"{where}: no such frame; there are {', '.join(sorted(frames))}")
    if not place.child and len(frames) > 1:
        raise UsageError(f"{where}: it has several frames: say which, as in {place.topic}:{min(frames)}")
    found = frames[place.child] if place.child else next(iter(frames.values()))
    if not found.valid:
        raise InputError(f"{where}: it holds no orientation")
    return _Taken(role, place, columns, shape, found)


def _unasked(role: str, topic: str, shape: Shape, columns: Columns) -> list[_Taken]:
    """The attitude of a channel that nobody named, where it has exactly one."""
    try:
        frames = list(readers.turned(columns, shape).values())
    except KeyError:
        return []
    return [_Taken(role, Place(topic), columns, shape, frames[0])] if len(frames) == 1 and frames[0].valid else []


def _put(recording: Recording, taken: Sequence[_Taken], chosen: Mapping[str, str], remarks: list[str]) -> Adopted:
    if not taken:
        return Adopted(recording, dict(chosen), tuple(remarks))
    imu, mag, gnss = dict(recording.imu), dict(recording.mag), dict(recording.gnss)
    onboard, reference = dict(recording.onboard), recording.reference
    lines = []
    for each, (time_ns, about) in zip(taken, sample_times([each.stamped for each in taken]), strict=True):
        lines.append(f"{each.place} is {each.role}{_in_words(about)}")
        if each.turned is not None:
            name = each.role.removeprefix("onboard_")
            attitude = readers.attitude(each.turned, time_ns, name, str(each.place), about)
            onboard, reference = _placed(onboard, reference, attitude)
            continue
        number = int(each.role.lstrip("imuagns"))
        try:
            if each.shape.kind is Kind.IMU:
                imu[number] = readers.imu(each.columns, time_ns, about)
                lines += _unit(each, imu[number].specific_force, FORCE, "m/s^2", "accelerations", "g")
            elif each.shape.kind is Kind.MAG:
                mag[number] = readers.magnetometer(each.columns, time_ns, about)
                lines += _unit(each, mag[number].field, FIELD_T, "tesla", "magnetic fields", "microtesla or gauss")
            else:
                gnss[number] = readers.fix(each.columns, time_ns, about)
        except KeyError as error:
            raise InputError(f"{each.place} as {each.role}: its messages have no field {error}") from error
    whole = dataclasses.replace(recording, imu=imu, mag=mag, gnss=gnss, onboard=onboard, reference=reference)
    return Adopted(whole, dict(chosen), (*lines, *remarks))


def _placed(
    onboard: dict[str, Attitude], reference: Attitude | None, attitude: Attitude
) -> tuple[dict[str, Attitude], Attitude | None]:
    return (onboard, attitude) if attitude.name == REFERENCE else (onboard | {attitude.name: attitude}, reference)


def _in_words(about: Mapping[str, str]) -> str:
    said = []
    if "stamped_by" in about:
        said.append("timed by log time")
    if "stamp_offset_ns" in about:
        said.append(f"its stamps count from elsewhere: {int(about['stamp_offset_ns']) / 1e9:+.3f} s")
    if "stamps_replaced" in about:
        said.append(f"{about['stamps_replaced']} of its stamps, hours from the others, replaced by the log time")
    return f" ({'; '.join(said)})" if said else ""


def _unit(
    each: _Taken, values: "np.ndarray[tuple[int, int], np.dtype[np.float64]]", usual: tuple[float, float], unit: str,
    what: str, instead: str,
) -> list[str]:  # fmt: skip
    size = float(np.nanmedian(np.linalg.norm(values, axis=1)))
    if usual[0] <= size <= usual[1]:
        return []
    return [f"{each.place}: {what} of about {size:.3g} cannot be {unit}; are they {instead}? ROS wants {unit}"]
