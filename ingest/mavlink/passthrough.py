"""Every message as it was sent, under ``/mavlink/{system}/{component}/{MESSAGE}``."""

from collections.abc import Iterator

from ...schemas.columns import Channel, Columns, Table
from ...schemas.texts import clean, replaced
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
    cleaned = {name: clean(rows[name]) for name in rows.dtype.names or () if rows.dtype[name].kind == "S"}
    return replaced(rows, {name: texts for name, texts in cleaned.items() if texts is not None})
