"""Binary DataFlash logs: bytes to one structured array per type of record and instance."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Table
from . import units
from .formats import FMT, HEADER_BYTES, STORED, Format, text
from .kernels import BAD_FORMATS, FMT_LENGTH, RUNS, SKIPPED, TAIL, TORN_INSIDE, TORN_LAST, Kinds, grouped, scan
from .log import Log, Records

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

SIZES: Final[Ints] = np.zeros(256, np.int64)
for _character, _stored in STORED.items():
    SIZES[ord(_character)] = np.dtype(_stored).itemsize

FMT_RECORD: Final = np.dtype([("header", f"V{HEADER_BYTES}"), *((name, FMT.dtype[name]) for name in FMT.columns)])


def parse(data: Bytes) -> Log:
    """Every record of a binary log (uint8, shape (n,)); what is none is skipped and counted."""
    raw = read_only(data)
    places, kinds, definitions, counts = _scanned(raw)
    order, starts = grouped(kinds, len(definitions))
    formats, numbers = _formats(raw, definitions)
    groups = [(kind, order[starts[kind] : starts[kind + 1]]) for kind in range(len(definitions))]
    described = _described(raw, places, formats, numbers, groups)
    records = _merged(
        [part for kind, group in groups if len(group) for part in _split(raw, places, described[kind], group)]
    )
    skipped, dropped = _completeness(raw, counts)
    return Log(tuple(records), len(places), skipped, dropped)


def read_only(data: Bytes) -> Bytes:
    """A plain read-only array over the same bytes: the one type that the kernels are compiled for."""
    plain = np.ascontiguousarray(np.asarray(data, dtype=np.uint8)).view()
    plain.flags.writeable = False
    return plain


def _scanned(raw: Bytes) -> tuple[Ints, Kinds, Ints, Ints]:
    nothing = np.full(256, -1, np.int64)
    places, kinds, definitions, counts, early = scan(raw, SIZES, nothing)
    first = nothing.copy()
    for place in definitions[1:][::-1]:
        first[raw[place + HEADER_BYTES]] = place
    first[~early] = -1
    if np.any(first >= 0):
        places, kinds, definitions, counts, _ = scan(raw, SIZES, first)
    return places, kinds, definitions, counts


def _formats(raw: Bytes, definitions: Ints) -> tuple[list[Format], list[int]]:
    formats, numbers = [FMT], [0x80]
    for row in gathered(raw, definitions[1:], FMT_LENGTH).view(FMT_RECORD):
        columns = text(row["Columns"]).split(",")
        formats.append(Format.of(text(row["Name"]), text(row["Format"]), columns))
        numbers.append(int(row["Type"]))
    return formats, numbers


def _described(
    raw: Bytes, places: Ints, formats: list[Format], numbers: list[int], groups: list[tuple[int, Ints]]
) -> list[Format]:
    """The formats with their units."""
    tables: dict[str, list[Table]] = defaultdict(list)
    for kind, group in groups:
        if formats[kind].name in units.COLUMNS and len(group):
            tables[formats[kind].name].append(_rows(raw, places[group], formats[kind]))
    meaning = units.Dictionary.of(tables)
    return [meaning.applied(form, number) for form, number in zip(formats, numbers, strict=True)]


def _split(raw: Bytes, places: Ints, form: Format, group: Ints) -> Iterator[Records]:
    """The records of one definition, apart by instance; one instance's bytes are gathered once."""
    if form.instance is None:
        yield Records(form, _rows(raw, places[group], form), group)
        return
    dtype, offset = form.dtype.fields[form.instance][:2]  # type: ignore[index]
    values = gathered(raw, places[group], dtype.itemsize, HEADER_BYTES + offset).view(dtype)
    found = _distinct(values)
    for value in found.tolist():
        part = group if len(found) == 1 else group[values == value]
        yield Records(form, _rows(raw, places[part], form), part, text(value) if isinstance(value, bytes) else value)


def _merged(records: list[Records]) -> list[Records]:
    """Records of one name, layout and instance together: a log may define a type twice, or under two numbers."""
    alike: dict[tuple[Format, int | str | None], list[Records]] = defaultdict(list)
    for part in records:
        alike[part.format, part.instance].append(part)
    return [parts[0] if len(parts) == 1 else _joined(parts) for parts in alike.values()]


def _joined(parts: list[Records]) -> Records:
    order = np.concatenate([part.order for part in parts])
    data = np.concatenate([part.data for part in parts])
    sequence = np.argsort(order, kind="stable")
    return Records(parts[0].format, data[sequence], order[sequence], parts[0].instance)


def _rows(raw: Bytes, places: Ints, form: Format) -> Table:
    if form.dtype.itemsize == 0:
        return np.zeros(len(places), form.dtype)
    return gathered(raw, places, form.dtype.itemsize, HEADER_BYTES).view(form.dtype)


def gathered(raw: Bytes, places: Ints, size: int, offset: int = 0) -> NDArray[np.void]:
    """``size`` bytes from ``offset`` after each of ``places`` (m,), as void rows (m,)."""
    count = max(len(raw) - offset - size + 1, 0)
    rows = np.ndarray((count,), np.dtype(f"V{size}"), buffer=raw.data, offset=offset, strides=(1,))
    return rows[places]


def _distinct(values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Sorted, as np.unique; most instances are one byte, which need only be counted."""
    if values.dtype != np.uint8:
        return np.unique(values)
    return np.flatnonzero(np.bincount(values, minlength=1)).astype(np.uint8)


def _completeness(raw: Bytes, counts: Ints) -> tuple[int, dict[str, int]]:
    """Bytes skipped and what they were; a block of equal bytes that fills up the last page is no loss."""
    skipped, runs = int(counts[SKIPPED]), int(counts[RUNS])
    tail = int(counts[TAIL])
    if tail >= 0 and raw[tail] in (0x00, 0xFF) and np.all(raw[tail:] == raw[tail]):
        skipped, runs = skipped - (len(raw) - tail), runs - 1
    named = {
        "runs of bad bytes": runs,
        "records cut short": int(counts[TORN_INSIDE]),
        "torn last record": int(counts[TORN_LAST]),
        "unreadable definitions": int(counts[BAD_FORMATS]),
    }
    return skipped, {reason: count for reason, count in named.items() if count}
