"""Every message as it was sent, under ``/mavlink/{system}/{component}/{MESSAGE}``."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Channel, Columns, Table
from .frames import Frames, Group
from .times import Timeline


def channels(frames: Frames, line: Timeline) -> Iterator[Columns]:
    """One channel per message and component; values as stored."""
    for group in frames.groups:
        rows = with_clean_texts(group)
        about = {"source": group.name, "system": str(group.system), "component": str(group.component)}
        about |= line.stamped_by(group)
        topic = f"/mavlink/{group.system}/{group.component}/{group.name}"
        yield Columns(Channel(topic, group.definition.type, about), line.of(group), rows)


def with_clean_texts(group: Group) -> Table:
    """The rows with texts that end at their first NUL and are valid UTF-8."""
    rows: Table = group.rows
    names = [n for n in rows.dtype.names or () if rows.dtype[n].kind == "S"]
    for name in names:
        _cut_at_nul(rows, name)
    foreign = [name for name in names if np.any(_bytes(rows, name) >= 0x80)]
    return _recoded(rows, foreign) if foreign else rows


def _bytes(rows: Table, name: str) -> NDArray[np.uint8]:
    """A text field as (n, length) bytes, a view."""
    assert rows.dtype.fields is not None
    dtype, offset = rows.dtype.fields[name][:2]
    shape = (len(rows), dtype.itemsize)
    return np.ndarray(shape, np.uint8, rows, offset, (rows.strides[0], 1))


def _cut_at_nul(rows: Table, name: str) -> None:
    text = _bytes(rows, name)
    zero = text == 0
    if np.any(zero[:, :-1] & ~zero[:, 1:]):
        text[np.logical_or.accumulate(zero, axis=1)] = 0


def _recoded(rows: Table, foreign: list[str]) -> Table:
    """The rows with these texts in UTF-8; bytes that are none become the replacement character, one each."""
    texts = {name: np.array([_utf8(value) for value in rows[name]]) for name in foreign}
    names = list(rows.dtype.names or ())
    fields = [(name, texts[name].dtype if name in texts else rows.dtype[name]) for name in names]
    result = np.zeros(len(rows), fields)
    for name in names:
        result[name] = texts.get(name, rows[name])
    return result


def _utf8(value: bytes) -> bytes:
    try:
        value.decode("utf-8")
    except UnicodeDecodeError:
        return value.decode("ascii", "replace").encode("utf-8")
    return value
