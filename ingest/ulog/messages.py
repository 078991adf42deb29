"""The messages of a scan by what they say: data, texts, parameters, information, dropouts."""

from collections import defaultdict
from typing import Final

import numpy as np

from .information import Entry, entry, text
from .kernels import HEADER
from .log import Log, Said, Topic
from .scan import Head, Scan

BEGIN_DATA: Final = frozenset(b"ALCD")
"""Letters that definitions do not have."""
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
    unreadable = 0
    others = scanned.others()
    places = scanned.places[others]
    letters = scanned.raw[places + 2].tolist()
    sizes = (scanned.raw[places].astype(np.int64) | scanned.raw[places + 1].astype(np.int64) << 8).tolist()
    whole = memoryview(scanned.raw.data)
    for number, place, letter, size in zip(others.tolist(), places.tolist(), letters, sizes, strict=True):
        payload = whole[place + HEADER : place + HEADER + size].tobytes()
        if letter in ENTRIES:
            found = entry(payload, number, ENTRIES[letter])
            if found is None:
                unreadable += 1
            else:
                entries[letter].append(found)
        elif letter in (LOGGED, TAGGED):
            said.append(_said(payload, number, letter == TAGGED))
        elif letter == DROPOUT:
            dropouts.append((number, int.from_bytes(payload, "little")))
    begins = (n for n, letter in zip(others.tolist(), letters, strict=True) if letter in BEGIN_DATA)
    first_data = min((int(topic.order[0]) for topic in topics), default=scanned.count)
    dropped = dict(scanned.reasons) | ({"unreadable entries": unreadable} if unreadable else {})
    return Log(
        version=begin.version,
        start_us=begin.start_us,
        compatible_flags=begin.compatible,
        appended=begin.appended,
        topics=topics,
        count=scanned.count,
        data_begins=min(next(begins, scanned.count), first_data),
        said=said,
        parameters=entries[ord("P")],
        defaults=entries[ord("Q")],
        single=entries[ord("I")],
        multiple=entries[ord("M")],
        dropouts=dropouts,
        bytes_skipped=scanned.skipped,
        dropped=dropped,
    )


def _said(payload: bytes, number: int, tagged: bool) -> Said:
    at = 3 if tagged else 1
    tag = int.from_bytes(payload[1:3], "little") if tagged else None
    time_us = int.from_bytes(payload[at : at + 8], "little")
    return Said(payload[0] - FIRST_LEVEL, tag, time_us, text(payload[at + 8 :]), number)
