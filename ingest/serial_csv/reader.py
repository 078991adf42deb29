"""A CSV as columns: dialect, table, layout, clock and channels put together, and every line accounted for."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Columns
from ...schemas.csv_options import CsvOptions
from ...schemas.errors import InputError
from ...schemas.finding import Finding, Kind, Note, Severity
from ...schemas.recording import Segment
from ...schemas.source import NOT_LOST, Completeness, Ingested, IngestOptions, Source
from . import channels, times
from .arrival import fitted, rising
from .channels import Rows, present
from .clock import RESET, Stamps, stamps
from .dialect import Dialect, sniff
from .guesses import time_column
from .layout import Layout, guessed, named, with_guess
from .lines import Odd
from .profile import checked
from .table import Table, parse
from .text import Bytes, Text, decoded, single_blanks, without_labels, without_monitor_stamps, without_quotes
from .units import NANOSECONDS

Ints = NDArray[np.int64]

FORMAT: Final = "csv"
NO_TIME: Final = "no time"
REPEATED: Final = "repeated line"
NO_VALUE: Final = "no value"
EACH: Final = 20
"""So many repaired runs of stamps are told one by one."""
SPOKEN: Final = 200
"""So many comments and boot messages become annotations."""


@np.errstate(all="ignore")  # what overflows was printed so
def ingest(source: Source, options: IngestOptions, line_ns: Ints | None = None) -> Ingested:
    """Read the file; InputError where it is no table, or where columns, units or clock cannot be told.

    ``line_ns`` (lines,), where they were received live, is when each line arrived: it says UTC, or the time itself.
    """
    csv = checked(options.csv)
    dialect, text = opened(source)
    layout = named(dialect, csv, source.name)
    table = parse(text, dialect, layout.time if layout is not None else 0)
    if len(table) == 0:
        raise InputError(f"{source.name}: has no line of data ({_counts(table.dropped)})")
    if layout is None:
        layout = guessed(table.columns, dialect.names, csv, source.name)
    table, layout, device, tick = _clocked(text, table, layout, csv, source.name, line_ns)
    stamped = stamps(device, tick)
    if line_ns is not None:
        stamped = fitted(stamped, line_ns[table.line])
    rows = Rows(
        table.columns, stamped.time_ns, table.line, source.name, csv, options.sensor or csv.sensor, list(layout.guesses)
    )
    made = _channels(rows, layout)
    _refuse_guesses(rows, csv)
    if not made or not rows.used:
        raise InputError(
            f"{source.name}: no sensor among its columns ({', '.join(layout.names)}); name them with --columns"
        )
    return Ingested(
        format=FORMAT,
        columns=tuple(made),
        completeness=_completeness(source, table, rows),
        segments=_segments(stamped),
        findings=(*_guess_findings(rows), *_clock_findings(stamped, made[0].channel.topic), *rows.findings),
        notes=tuple(_notes(table, stamped.time_ns)),
        metadata={"csv": _about(dialect, layout, table, rows, stamped)},
    )


def opened(source: Source) -> tuple[Dialect, Text]:
    """The dialect and the cleaned text of a file; InputError where it is no table of numbers."""
    data: Bytes = decoded(source.data)
    data = without_quotes(without_monitor_stamps(data))
    dialect = sniff(data)
    if dialect is None:
        raise InputError(f"{source.name}: is no table of numbers (no lines of at least four, parted alike)")
    if dialect.blanks:
        data = single_blanks(data)
    if dialect.labelled:
        data = without_labels(data, list(dialect.names))
    return dialect, Text(data)


def _channels(rows: Rows, layout: Layout) -> list[Columns]:
    made = list(channels.imu(rows, layout))
    first = made[0] if made else None
    made += channels.mag(rows, layout)
    made += channels.attitudes(rows, layout, first)
    made += channels.others(rows, layout)
    return [columns for columns in made if len(columns)]


def _clocked(
    text: Text, table: Table, layout: Layout, csv: CsvOptions, source: str, line_ns: Ints | None
) -> tuple[Table, Layout, Ints, int]:
    """The rows that have a time and do not repeat the one before word for word, and their device time."""
    if csv.rate_hz is not None:
        return table, layout, times.at_rate(table, csv.rate_hz), 1
    if layout.time is None and line_ns is None and (found := time_column(layout.names, table.columns)) is not None:
        layout = with_guess(replace(layout, time=found[0]), found[1])
    if layout.time is None and line_ns is not None:
        return table, layout, rising(line_ns[table.line]), 1
    if layout.time is None:
        raise InputError(
            f"{source}: no column is a time (columns: {', '.join(layout.names)}); give --rate HZ, or name it"
        )
    ns, valid, unit, guess = times.device_ns(table.columns[layout.time], layout.time_unit, source)
    layout = replace(layout, time_unit=unit)
    if guess is not None:
        layout = with_guess(layout, guess)
    dropped = {NO_VALUE: _empty(table, layout.time)}
    dropped[NO_TIME] = ~valid & ~dropped[NO_VALUE]
    dropped[REPEATED] = _repeats(table, ns) & valid & ~dropped[NO_VALUE]
    keep = ~np.logical_or.reduce(list(dropped.values()))
    if not np.any(keep):
        raise InputError(f"{source}: its column of times holds no number")
    return _without(table, dropped, text), layout, ns[keep] if not np.all(keep) else ns, NANOSECONDS.get(unit, 1)


def _empty(table: Table, clock: int | None) -> NDArray[np.bool_]:
    """Rows (n,) that hold nothing but a time."""
    empty = np.ones(len(table), np.bool_)
    for number, column in enumerate(table.columns):
        if number != clock and np.any(empty):
            empty &= ~present(column)
    return empty


def _repeats(table: Table, ns: Ints) -> NDArray[np.bool_]:
    """Rows (n,) that equal the one before in all they hold."""
    same = np.concatenate([[False], np.diff(ns) == 0])
    for column in table.columns if np.any(same) else ():
        later, earlier = column[1:], column[:-1]
        equal = np.asarray(later == earlier)
        if column.dtype.kind == "f":
            equal |= np.isnan(later) & np.isnan(earlier)
        same[1:] &= equal
    return same


def _without(table: Table, reasons: Mapping[str, NDArray[np.bool_]], text: Text) -> Table:
    """The table without the rows that are marked, which become odd lines."""
    odd = [
        Odd(number, reason, text.line(number))
        for reason, rows in reasons.items()
        for number in table.line[rows].tolist()
    ]
    if not odd:
        return table
    keep = ~np.logical_or.reduce(list(reasons.values()))
    every = sorted((*table.odd, *odd), key=lambda line: line.number)
    return replace(table, columns=tuple(c[keep] for c in table.columns), line=table.line[keep], odd=tuple(every))


def _refuse_guesses(rows: Rows, csv: CsvOptions) -> None:
    if csv.strict and rows.guesses:
        told = "; ".join(guess.text for guess in rows.guesses)
        raise InputError(f"{rows.source}: --strict takes no guesses, and this is not said: {told}")


def _completeness(source: Source, table: Table, rows: Rows) -> Completeness:
    """Every physical line is a sample, or among the dropped with its reason."""
    empty = int(np.count_nonzero(~rows.sampled))
    dropped = dict(table.dropped)
    if empty:
        dropped[NO_VALUE] = dropped.get(NO_VALUE, 0) + empty
    lost = min(table.dropped_bytes(NOT_LOST) + int(table.row_bytes * empty), source.size)
    return Completeness(source.size, source.size - lost, table.lines - sum(dropped.values()), lost, dropped)


def _segments(stamped: Stamps) -> tuple[Segment, ...]:
    starts = stamped.first
    reasons = ["start of the log", *(found.reason for found in stamped.breaks)]
    ends = [*(start - 1 for start in starts[1:]), len(stamped.time_ns) - 1]
    at = stamped.time_ns
    return tuple(
        Segment("", index, int(at[start]), int(at[end]), int(offset), reason)
        for index, (start, end, offset, reason) in enumerate(zip(starts, ends, stamped.offset_ns, reasons, strict=True))
    )


def _guess_findings(rows: Rows) -> Iterator[Finding]:
    start, end = int(rows.time_ns[0]), int(rows.time_ns[-1])
    for guess in rows.guesses:
        yield Finding(start, end, Severity.WARN, Kind.UNITS, "/csv", 0.0, "", guess.text)


def _clock_findings(stamped: Stamps, topic: str) -> Iterator[Finding]:
    at = stamped.time_ns
    for found in stamped.breaks:
        kind = Kind.REBOOT if found.reason == RESET else Kind.CLOCK_STEP
        advice = f"{found.reason}: the device's time leaps by {found.leap_ns / 1e9:.6g} s; a new segment begins"
        start = int(at[found.start])
        yield Finding(start, start, Severity.WARN, kind, topic, found.leap_ns / 1e9, "s", advice)
    yield from _repairs(stamped.glitched, at, topic, "wrong stamps, put between their neighbours'")
    yield from _repairs(stamped.repeated, at, topic, "stamps that repeat the one before, spread to the next")


def _repairs(marked: NDArray[np.bool_], at: Ints, topic: str, what: str) -> Iterator[Finding]:
    """One finding for each run of repaired stamps, or one for all where there are many."""
    turns = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]))).reshape(-1, 2)
    if len(turns) > EACH:
        turns = np.array([[turns[0, 0], turns[-1, 1]]])
    for first, end in turns.tolist():
        count = int(np.count_nonzero(marked[first:end]))
        advice = f"{count:,} {what}"
        yield Finding(int(at[first]), int(at[end - 1]), Severity.WARN, Kind.CLOCK_STEP, topic, count, "samples", advice)


def _notes(table: Table, time_ns: Ints) -> Iterator[Note]:
    """What the device said between the numbers: comments and messages, at the time of the next sample."""
    said = table.said[:SPOKEN]
    next_row = np.minimum(np.searchsorted(table.line, [line.number for line in said]), len(time_ns) - 1)
    for line, row in zip(said, next_row.tolist(), strict=True):
        yield Note(int(time_ns[row]), Severity.INFO, FORMAT, line.text.decode("utf-8", "replace").strip())


def _about(dialect: Dialect, layout: Layout, table: Table, rows: Rows, stamped: Stamps) -> dict[str, str]:
    """The metadata record ``csv``: how the file was read, and what was guessed."""
    marks = {b"\t": "tab", b" ": "blanks"}
    about = {
        "delimiter": marks.get(dialect.delimiter, dialect.delimiter.decode()),
        "decimal": dialect.decimal.decode(),
        "lines": str(table.lines),
        "samples": str(int(np.count_nonzero(rows.sampled))),
        "header": "yes" if dialect.names else "no",
        "time": "fixed rate" if layout.time is None else f"{layout.names[layout.time]} [{layout.time_unit}]",
        "glitched_stamps": str(int(np.count_nonzero(stamped.glitched))),
        "repeated_stamps": str(int(np.count_nonzero(stamped.repeated))),
    }
    about |= {f"column.{number + 1:03d}": name for number, name in enumerate(layout.names)}
    return about | {f"guess.{number + 1}": guess.text for number, guess in enumerate(rows.guesses)}


def _counts(dropped: Mapping[str, Any]) -> str:
    return ", ".join(f"{count:,} {reason}" for reason, count in dropped.items()) or "it is empty"
