"""Every message as it is stored, under ``/ulog/{topic}/{multi_id}``, in a type made from the log's formats."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from ...schemas import Channel, Columns
from ...schemas.columns import Table
from ...schemas.passthrough import ros_type_name
from ...schemas.texts import clean, replaced
from .clock import Clock, time_us
from .formats import Definition
from .log import Topic

FOREIGN: Final = re.compile(r"[^A-Za-z0-9_]")


def columns(topics: Iterable[Topic], clock: Clock) -> Iterator[Columns]:
    """One channel per topic and instance. Another definition of the same type's name is a type of its own."""
    versions: dict[str, list[Definition]] = defaultdict(list)
    taken: set[str] = set()
    for topic in topics:
        known = versions[ros_type_name(topic.name)]
        if topic.definition not in known:
            known.append(topic.definition)
        number = known.index(topic.definition) + 1
        yield _channel(topic, clock, topic.name if number == 1 else f"{topic.name}_{number}", taken)


def _channel(topic: Topic, clock: Clock, type_name: str, taken: set[str]) -> Columns:
    message = topic.definition.type if type_name == topic.name else topic.definition.type_named(type_name)
    place = f"/ulog/{FOREIGN.sub('_', topic.name) or '_'}/{topic.multi_id}"
    while place in taken:
        place += "_2"
    taken.add(place)
    metadata = {"source": topic.name, "multi_id": str(topic.multi_id), **_stamped_by(topic, clock)}
    return Columns(Channel(place, message, metadata), clock.stamps(topic), _stored(topic))


def _stamped_by(topic: Topic, clock: Clock) -> dict[str, str]:
    """What the stamps are, where they are not all the messages' own."""
    own = int(np.count_nonzero(clock.own[topic.order])) if time_us(topic) is not None else 0
    if own == len(topic):
        return {}
    return {"stamped_by": "arrival"} if own == 0 else {"stamped_on_arrival": str(len(topic) - own)}


def _stored(topic: Topic) -> Table:
    """The messages' own bytes, except where a value has no ROS form: a bool that is neither 0 nor 1, text that is not
    UTF-8 or goes on behind its NUL."""
    data = topic.data
    flags = topic.definition.flags
    if flags:
        stored = data.view(np.uint8).reshape(len(data), -1)
        if np.any(stored[:, flags] > 1):
            data = data.copy()
            stored = data.view(np.uint8).reshape(len(data), -1)
            stored[:, flags] = stored[:, flags] != 0
    cleaned = {name: clean(data[name]) for name in topic.definition.texts}
    changed = {name: values for name, values in cleaned.items() if values is not None}
    return replaced(data, changed)
