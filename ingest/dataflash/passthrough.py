"""Every record as it is stored, under ``/dataflash/{TYPE}[/{instance}]``, in a type made from the log's definitions."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...schemas import Channel, Columns
from ...schemas.columns import Table
from ...schemas.definition import MessageType
from ...schemas.passthrough import SourceField, generated_type, source_names
from ...schemas.texts import clean
from .clock import Clock
from .formats import Format
from .log import Records

PACKAGE: Final = "dataflash_msgs"

PRIMITIVE: Final = {
    "i1": "int8",
    "u1": "uint8",
    "i2": "int16",
    "u2": "uint16",
    "i4": "int32",
    "u4": "uint32",
    "i8": "int64",
    "u8": "uint64",
    "f2": "float32",
    "f4": "float32",
    "f8": "float64",
}
"""numpy type -> ROS 2 type; half precision has none of its own."""

BYTES: Final = {("FILE", "Data")}
"""Columns of a text format that hold the bytes of a file."""


def columns(all_records: Iterable[Records], clock: Clock) -> Iterator[Columns]:
    """One channel per type and instance. A type that is defined anew in another layout is a type of its own."""
    versions: dict[str, list[Format]] = defaultdict(list)
    for records in all_records:
        form = records.format
        if form not in versions[form.name]:
            versions[form.name].append(form)
        number = versions[form.name].index(form) + 1
        yield _channel(records, clock, form.name if number == 1 else f"{form.name}_{number}")


def _channel(records: Records, clock: Clock, name: str) -> Columns:
    message = message_type(records.format, name)
    topic = f"/dataflash/{_topic_part(name)}"
    metadata = {"source": records.format.name}
    if records.instance is not None:
        topic += f"/{_topic_part(str(records.instance))}"
        metadata |= {"instance": str(records.instance), "instance_field": str(records.format.instance)}
    return Columns(Channel(topic, message, metadata), clock.stamps(records), _stored(records, message))


def _topic_part(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]", "_", name.strip()) or "_"


@lru_cache(maxsize=2048)
def message_type(form: Format, name: str) -> MessageType:
    """The ROS 2 type of a format's records."""
    return generated_type(PACKAGE, name, [_field(form, position) for position in range(len(form.columns))])


def _field(form: Format, position: int) -> SourceField:
    column, unit = form.columns[position], form.units[position]
    dtype = form.dtype[column]
    multiplier = form.multipliers[position]
    if (form.name, column) in BYTES:
        return SourceField(column, "uint8", dtype.itemsize, unit)
    if dtype.kind == "S":
        return SourceField(column, "string", None, unit)
    length = dtype.shape[0] if dtype.shape else None
    return SourceField(column, PRIMITIVE[dtype.base.str[1:]], length, unit, multiplier)


def _stored(records: Records, message: MessageType) -> Table:
    """The records under their ROS names: the same bytes, except where a value has no ROS form."""
    form = records.format
    names = source_names(message)
    replaced: dict[str, NDArray[np.generic]] = {}
    for column, character in zip(form.columns, form.characters, strict=True):
        if character == "g":
            replaced[column] = records.data[column].astype(np.float32)
        elif form.dtype[column].kind == "S" and (form.name, column) not in BYTES:
            text = clean(records.data[column])
            if text is not None:
                replaced[column] = text
    dtype = _renamed(records, names)
    if not replaced:
        return records.data.view(dtype)
    types = [(names[c], replaced[c].dtype if c in replaced else dtype[names[c]]) for c in form.columns]
    result = np.zeros(len(records), types)
    plain = records.data.view(dtype)
    for column in form.columns:
        result[names[column]] = replaced[column] if column in replaced else plain[names[column]]
    return result


def _renamed(records: Records, names: Mapping[str, str]) -> "np.dtype[np.void]":
    types = []
    for column in records.format.columns:
        stored = records.data.dtype[column]
        as_bytes = (records.format.name, column) in BYTES
        types.append((names[column], np.dtype(("u1", (stored.itemsize,))) if as_bytes else stored))
    return np.dtype(types)
