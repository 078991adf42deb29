"""The messages of a scan by what they say: data, texts, parameters, information, dropouts."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Final

import numpy as np

from .information import Entry, entry, text
from .kernels import HEADER
from .log import Log, Said, Topic
from .scan import Head, Scan

AFTER_DEFINITIONS: Final = frozenset(b"ALC")
"""Letters that end the definitions; data do, too."""
ENTRIES: Final = {ord("I"): False, ord("P"): False, ord("M"): True, ord("Q"): True}
"""Letters of keys with values -> whether a byte stands before the key."""
LOGGED, TAGGED, DROPOUT = (ord(letter) for letter in "LCO")
FIRST_LEVEL: Final = ord("0")


def collected(begin: Head, scanned: Scan) -> Log:
    """The log in memory."""
    topics = tuple(
        Topic(subscribed.name, subscribed.multi_id, subscribed.definition, data, order)
        for subscribed, data, order in scanned.rows()
    )
    entries: dict[int, list[Entry]] = defaultdict(list)
    said: list[Said] = []
    dropouts: list[tuple[int, int]] = []
    dropped = dict(scanned.reasons)
    data_begins = min((int(topic.order[0]) for topic in topics), default=scanned.count)
    for number, letter, payload in _others(scanned):
        if letter in ENTRIES:
            found = entry(payload, number, ENTRIES[letter])
            if found is not None:
                entries[letter].append(found)
            else:
                dropped["unreadable entries"] = dropped.get("unreadable entries", 0) + 1
        elif letter in (LOGGED, TAGGED):
            said.append(_said(payload, number, letter == TAGGED))
        elif letter == DROPOUT:
            dropouts.append((number, int.from_bytes(payload, "little")))
        if letter in AFTER_DEFINITIONS:
            data_begins = min(data_begins, number)
    return Log(
        version=begin.version,
        start_us=begin.start_us,
        compatible_flags=begin.compatible,
        appended=begin.appended,
        topics=topics,
        count=scanned.count,
        data_begins=data_begins,
        said=said,
        parameters=entries[ord("P")],
        defaults=entries[ord("Q")],
        single=entries[ord("I")],
        multiple=entries[ord("M")],
        dropouts=dropouts,
        bytes_skipped=scanned.skipped,
        dropped=dropped,
    )


def _others(scanned: Scan) -> Iterator[tuple[int, int, bytes]]:
    """Number, letter and payload of every message that is not data."""
    numbers = scanned.others()
    places = scanned.places[numbers]
    heads = scanned.raw[places + np.arange(HEADER)[:, np.newaxis]].astype(np.int64)
    ends = places + HEADER + (heads[0] | heads[1] << 8)
    whole = memoryview(scanned.raw.data)
    for number, letter, start, end in zip(
        numbers.tolist(), heads[2].tolist(), (places + HEADER).tolist(), ends.tolist(), strict=True
    ):
        yield number, letter, whole[start:end].tobytes()


def _said(payload: bytes, number: int, tagged: bool) -> Said:
    at = 3 if tagged else 1
    tag = int.from_bytes(payload[1:3], "little") if tagged else None
    time_us = int.from_bytes(payload[at : at + 8], "little")
    return Said(payload[0] - FIRST_LEVEL, tag, time_us, text(payload[at + 8 :]), number)
