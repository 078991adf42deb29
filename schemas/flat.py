"""Nested columns as flat ones: ``angular_velocity.x``, ``rpy_ned_deg[0]``, ``transforms[1].child_frame_id``."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .columns import Columns
from .definition import TEXT_TYPES, Field, MessageType
from .units import unit_of

TIME: Final = "time_ns"
LONGEST: Final = 64
"""Arrays of more elements than this stay one column of lists."""


@dataclass(frozen=True, eq=False)
class FlatColumn:
    """One flat column: ``values`` (n,) of a number, bool, bytes (``text`` says that they are UTF-8) or object, or
    (n, k) for a column of lists."""

    name: str
    values: NDArray[Any]
    unit: str = ""
    text: bool = False


def flat(columns: Columns) -> list[FlatColumn]:
    """The log time and then every leaf of the messages, in the order of the type, native byte order."""
    own = list(_fields(columns.channel.type, columns.data, "", ""))
    return [FlatColumn(TIME, columns.time_ns, "ns"), *own]


def _fields(message: MessageType, data: NDArray[Any], above: str, unit: str) -> Iterator[FlatColumn]:
    for field in message.fields:
        if field.name in (data.dtype.names or ()):
            name = f"{above}.{field.name}" if above else field.name
            yield from _field(field, data[field.name], name, unit_of(message, field) or unit)


def _field(field: Field, values: NDArray[Any], name: str, unit: str) -> Iterator[FlatColumn]:
    if field.length is None or values.dtype == object:
        yield from _one(field.type, values, name, unit)
    elif values.shape[1] > LONGEST:
        yield FlatColumn(name, _native(values), unit, field.type in TEXT_TYPES)
    else:
        for number in range(values.shape[1]):
            yield from _one(field.type, values[:, number], f"{name}[{number}]", unit)


def _one(kind: str | MessageType, values: NDArray[Any], name: str, unit: str) -> Iterator[FlatColumn]:
    if isinstance(kind, MessageType) and values.dtype != object:
        yield from _fields(kind, values, name, unit)
    else:
        yield FlatColumn(name, _native(values), unit, kind in TEXT_TYPES)


def _native(values: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("="))
