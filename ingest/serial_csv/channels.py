"""The columns of a table as channels: sensors in SI, attitudes in ENU, and all that is left as it stands."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import PurePath
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Channel, Columns
from ...schemas.csv_options import AttitudeColumns, CsvOptions, World
from ...schemas.errors import InputError
from ...schemas.finding import Finding, Kind, Severity
from ...schemas.passthrough import SourceField, generated_type
from ...schemas.sensors import SensorProfile
from ...schemas.unified import attitude_columns, imu_columns, mag_columns
from . import attitude, scales
from .arrow import BILLIONTHS
from .guesses import Guess
from .layout import Group, Layout
from .names import split_unit
from .scales import Floats, Scale, in_body, vectors
from .units import Quantity

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

PACKAGE: Final = "csv_msgs"
HELD: Final = 0.3
"""A magnetometer that repeats itself more often than this is read less often than it is printed."""


@dataclass(eq=False)
class Rows:
    """The rows that have a time: columns (n,) each, stamps (n,), the number of each row's line."""

    columns: tuple[NDArray[Any], ...]
    time_ns: Ints
    line: Ints
    source: str
    options: CsvOptions
    sensor: SensorProfile | None
    guesses: list[Guess] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    used: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.sampled = np.zeros(len(self.time_ns), np.bool_)
        """Rows that gave a message."""

    @cached_property
    def time_s(self) -> Floats:
        """Seconds (n,) from the first row on."""
        return np.asarray((self.time_ns - self.time_ns[0]) * 1e-9)

    def found(self, kind: Kind, topic: str, value: float, unit: str, advice: str, where: Mask | None = None) -> None:
        """Note a finding over the rows (n,) that are marked."""
        at = self.time_ns if where is None else self.time_ns[where]
        self.findings.append(Finding(int(at[0]), int(at[-1]), Severity.WARN, kind, topic, value, unit, advice))

    def scale(self, group: Group, values: Floats, accel: tuple[Floats, str] | None = None) -> Scale:
        """What one of the group's numbers is; a guess is noted."""
        known = scales.known(group, self.sensor, self.source)
        if known is None:
            known = scales.guessed(group, values, self.time_s, accel, self.source)
            assert known.guess is not None
            self.guesses.append(known.guess)
        return known

    def take(self, group: Group, rows: Mask) -> None:
        """Mark the group's columns as published in the rows (n,) that are marked."""
        self.used.update(group.columns)
        self.sampled |= rows

    def about(self, group: Group, known: Scale | None = None) -> dict[str, str]:
        """Metadata of a channel made of the group."""
        said = {"frame": "sensor", "columns": " ".join(str(column + 1) for column in group.columns)}
        if known is not None:
            said["unit"] = known.unit
        if known is not None and known.guess is not None:
            said["guess"] = known.guess.text
        return said


def imu(rows: Rows, layout: Layout) -> Iterator[Columns]:
    """``/imu{n}/data_raw`` of every accelerometer with its gyroscope."""
    for accel, gyro in zip(layout.of(Quantity.ACCEL), layout.of(Quantity.GYRO), strict=False):
        force, rate = vectors(rows.columns, accel), vectors(rows.columns, gyro)
        force_scale = rows.scale(accel, force)
        rate_scale = rows.scale(gyro, rate, (force, force_scale.unit))
        force, rate = in_body(force, force_scale, rows.options.axes), in_body(rate, rate_scale, rows.options.axes)
        good = _finite(force, rate)
        rows.take(accel, good)
        rows.take(gyro, good)
        topic = _topic(rows.options, "imu", f"/imu{accel.instance}/data_raw", accel.instance)
        about = _both(rows.about(accel, force_scale), rows.about(gyro, rate_scale))
        if not bool(np.all(good)):
            yield imu_columns(topic, rows.time_ns[good], rate[good], force[good], source="csv", metadata=about)
        else:
            yield imu_columns(topic, rows.time_ns, rate, force, source="csv", metadata=about)


def _finite(*vectors: Floats) -> Mask:
    """Rows (n,) in which all numbers are; a sum tells at once where all are."""
    if np.isfinite(sum(float(vector.sum()) for vector in vectors)):
        return np.ones(len(vectors[0]), np.bool_)
    return np.asarray(np.logical_and.reduce([np.isfinite(vector).all(axis=1) for vector in vectors]))


def _both(accel: dict[str, str], gyro: dict[str, str]) -> dict[str, str]:
    """Metadata of two groups in one: ``accel_unit``, ``gyro_unit``; the frame is the same."""
    named = {"accel": accel, "gyro": gyro}
    told = {f"{name}_{key}": value for name, about in named.items() for key, value in about.items() if key != "frame"}
    return {"frame": accel["frame"], **told}


def mag(rows: Rows, layout: Layout) -> Iterator[Columns]:
    """``/mag{n}/field``: each measurement once, where the same one is printed again and again."""
    for group in layout.of(Quantity.MAG):
        values = vectors(rows.columns, group)
        known = rows.scale(group, values)
        good = _finite(values)
        fresh = good & _changes([rows.columns[column] for column in group.columns])
        held = 1.0 - int(np.count_nonzero(fresh)) / max(int(np.count_nonzero(good)), 1)
        chosen = fresh if held > HELD else good
        rows.take(group, good)
        about = rows.about(group, known) | {"repeated": str(int(np.count_nonzero(good & ~chosen)))}
        topic = _topic(rows.options, "mag", f"/mag{group.instance}/field", group.instance)
        whole = bool(np.all(chosen))
        field_t = in_body(values if whole else values[chosen], known, rows.options.axes)
        yield mag_columns(topic, rows.time_ns if whole else rows.time_ns[chosen], field_t, source="csv", metadata=about)


def _changes(columns: list[NDArray[Any]]) -> Mask:
    """Rows (n,) in which any column differs from the row before; the first one does."""
    changed = np.ones(len(columns[0]), np.bool_)
    changed[1:] = columns[0][1:] != columns[0][:-1]
    for column in columns[1:]:
        changed[1:] |= column[1:] != column[:-1]
    return changed


def attitudes(rows: Rows, layout: Layout, imu0: Columns | None) -> Iterator[Columns]:
    """``/reference/attitude`` of what is declared as the truth, ``/onboard/csv/attitude`` of what the device says."""
    groups = [*layout.of(Quantity.QUATERNION), *layout.of(Quantity.EULER)]
    force = _force(rows, imu0) if groups else None
    taken: set[str] = set()
    for group in groups:
        truth = _is_truth(group, rows.options.attitude)
        name = "reference" if truth else _onboard_name(group)
        topic = _topic(rows.options, "attitude", "/reference/attitude" if truth else f"/onboard/{name}/attitude", 0)
        if topic in taken:
            continue
        made = _attitude(rows, group, force, topic, "reference" if truth else f"onboard_{name}")
        if made is not None:
            taken.add(topic)
            yield made


def _is_truth(group: Group, said: AttitudeColumns) -> bool:
    """Declared as the reference: by its name, by the user, or by the user's saying its axes."""
    declared = group.truth or said.world is not None
    return group.instance == 0 and (declared if said.reference is None else said.reference)


def _onboard_name(group: Group) -> str:
    base = "csv" if group.quantity is Quantity.QUATERNION else "csv_euler"
    return f"{base}{group.instance or ''}"


def _force(rows: Rows, imu0: Columns | None) -> Floats | None:
    """Specific force (n, 3) of every row, NaN where there is none."""
    if imu0 is None:
        return None
    force = np.full((len(rows.time_ns), 3), np.nan)
    at = np.searchsorted(rows.time_ns, imu0.time_ns)
    for axis, name in enumerate("xyz"):
        force[at, axis] = imu0["linear_acceleration"][name]
    return force


def _attitude(rows: Rows, group: Group, force: Floats | None, topic: str, child: str) -> Columns | None:
    values = vectors(rows.columns, group)
    said, about = rows.options.attitude, rows.about(group)
    if group.quantity is Quantity.QUATERNION:
        checked = attitude.quaternions(values, rows.options.normalize, rows.line, rows.source)
        q, good = checked.orientation, checked.present
        _report_missing(rows, topic, checked)
        usual = World.ENU
    else:
        known = rows.scale(group, values)
        q = attitude.from_euler(values * known.factor, said.euler)
        good = np.asarray(np.isfinite(q).all(axis=1))
        about |= rows.about(group, known) | {"euler": said.euler}
        usual = World.NED
    if not np.any(good):
        return None
    if said.world is None:
        part = slice(None) if len(q) < 200_000 else slice(0, 200_000)
        said, guess = attitude.guess_axes(
            q[part][good[part]], None if force is None else force[part][good[part]], usual, said
        )
        rows.guesses.append(guess)
        about["guess"] = guess.text
        if said.world is None:
            return None
    about |= {"axes": f"{said.world}{' inverse' if said.inverse else ''}", "north": said.north}
    rows.take(group, good)
    orientation = attitude.in_enu(q[good], World(said.world), said.inverse)
    return attitude_columns(topic, rows.time_ns[good], orientation, child_frame_id=child, source="csv", metadata=about)


def _report_missing(rows: Rows, topic: str, checked: attitude.Checked) -> None:
    refused = int(np.count_nonzero(checked.refused))
    if refused:
        text = f"{refused:,} quaternions are off unit norm by over 1 % and left out (--normalize keeps them)"
        rows.found(Kind.SKIPPED, topic, refused, "samples", text, checked.refused)
    absent = ~checked.present & ~checked.refused
    missing = int(np.count_nonzero(absent))
    if missing:
        rows.found(
            Kind.SKIPPED,
            topic,
            missing,
            "samples",
            f"{missing:,} rows have no quaternion (zero or not a number)",
            absent,
        )


def others(rows: Rows, layout: Layout) -> Iterator[Columns]:
    """``/csv/{name}``: every column that went into no other channel, as it was printed."""
    kept = [
        c for c in range(len(layout.names)) if c not in rows.used and c != layout.time and _has_values(rows.columns[c])
    ]
    if not kept:
        return
    stem = PurePath(rows.source).stem
    name = re.sub(r"\W+", "_", stem, flags=re.ASCII).strip("_") or "line"
    fields = [_source_field(layout.names[column], rows.columns[column]) for column in kept]
    message = generated_type(PACKAGE, name, _distinct(fields))
    ros = [known.name for known in message.fields[1:]]
    data = np.zeros(len(rows.time_ns), [(n, _stored(rows.columns[c]).dtype) for n, c in zip(ros, kept, strict=True)])
    for spelled, column in zip(ros, kept, strict=True):
        data[spelled] = _stored(rows.columns[column])
        rows.sampled |= present(rows.columns[column])
    topic = _topic(rows.options, "csv", f"/csv/{name}", 0)
    yield Columns(Channel(topic, message, {"source": rows.source}), rows.time_ns, data)


def _distinct(fields: list[SourceField]) -> list[SourceField]:
    """Fields whose source's names differ, so that each can be asked for by it."""
    seen: dict[str, int] = {}
    result = []
    for known in fields:
        seen[known.name] = seen.get(known.name, 0) + 1
        number = seen[known.name]
        result.append(known if number == 1 else SourceField(f"{known.name}_{number}", known.type, unit=known.unit))
    return result


def _source_field(name: str, column: NDArray[Any]) -> SourceField:
    plain, unit = split_unit(name)
    kind = "string" if column.dtype == object else "int64" if column.dtype == np.int64 else "float64"
    return SourceField(re.sub(r"\s+", "_", plain.strip()) or "column", kind, unit=unit)


def _stored(column: NDArray[Any]) -> NDArray[Any]:
    if column.dtype == BILLIONTHS:
        return np.asarray(column.astype(np.int64) * 1e-9)
    if column.dtype == object:
        clean = [bytes(value).strip().decode("utf-8", "replace").encode() for value in column.tolist()]
        return np.array(clean, dtype=np.bytes_)
    return column


def present(column: NDArray[Any]) -> Mask:
    """Rows (n,) that have a value."""
    if column.dtype.kind == "f":
        return np.asarray(np.isfinite(column))
    return (
        np.ones(len(column), np.bool_)
        if column.dtype != object
        else np.array([bool(v.strip()) for v in column.tolist()])
    )


def _has_values(column: NDArray[Any]) -> bool:
    """A column that is empty all the way down is none: the line ends with a delimiter."""
    return bool(np.any(present(column)))


def _topic(options: CsvOptions, kind: str, usual: str, instance: int) -> str:
    """The channel's topic, unless the user puts it elsewhere (the first of its kind alone)."""
    topic = options.topics.get(kind, usual) if instance == 0 else usual
    if not topic.startswith("/"):
        raise InputError(f"{topic!r} is no topic: it begins with a slash")
    return topic
