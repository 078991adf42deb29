"""The lines of data as columns of numbers, parsed by Arrow, and every other line counted."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from pyarrow import csv

from .dialect import SAMPLE_BYTES, Dialect
from .lines import DAMAGED, HEADER, NOT_A_NUMBER, REASONS, classified
from .text import Bytes, Text

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

NULLS: Final = ["", " ", "nan", "NaN", "NAN", "ovf", "OVF", "null", "NULL", "None", "N/A"]
"""What stands for a value that is not there; Arduino prints ovf for a float beyond 4294967040."""
BLOCK_BYTES: Final = 4 << 20
_NUMBER: Final = r"^\s*$|(?i)^\s*[-+]?((\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|nan|inf|ovf|null|none|n/a)\s*$"
_INTEGER: Final = r"^\s*[-+]?\d{1,19}\s*$"


@dataclass(frozen=True, eq=False)
class Table:
    """``columns`` are (n,) each: float64 (NaN where empty), int64 for an exact clock, object for text. ``line`` (n,) is
    the number of each row's line; ``damaged`` the numbers of the lines that were samples once; ``dropped`` counts the
    lines that are no rows by reason, and ``dropped_bytes`` how long they were."""

    columns: tuple[NDArray[Any], ...]
    line: Ints
    lines: int
    damaged: Ints
    dropped: Mapping[str, int]
    dropped_bytes: Mapping[str, int]
    row_bytes: float
    """Length of a line of data, on average."""

    def __len__(self) -> int:
        return len(self.line)


def parse(text: Text, dialect: Dialect, exact: int | None) -> Table:
    """All columns of the file; column ``exact`` keeps all its digits."""
    return _clean(text, dialect, exact) or _careful(text, dialect, exact)


def _clean(text: Text, dialect: Dialect, exact: int | None) -> Table | None:
    """The fast way, for a file whose every line after the header is data; None for any other."""
    skip = len(dialect.header_lines)
    if any(dialect.is_text) or dialect.header_lines != tuple(range(skip)):
        return None
    lines = int(np.count_nonzero(text.data == 10))
    try:
        columns = _numbers(_after(text.data, skip), dialect, exact)
    except pa.ArrowInvalid:
        return None
    if len(columns[0]) + skip != lines:
        return None
    dropped = {HEADER: skip} if skip else {}
    size = len(text.data) - len(_after(text.data, skip))
    none = np.zeros(0, np.int64)
    row_bytes = (len(text.data) - size) / max(lines - skip, 1)
    return Table(columns, np.arange(skip, lines), lines, none, dropped, {HEADER: size} if skip else {}, row_bytes)


def _after(data: Bytes, lines: int) -> Bytes:
    """The bytes after the first ``lines`` lines, which a dialect's sample holds."""
    start = 0
    head = data[:SAMPLE_BYTES].tobytes()
    for _ in range(lines):
        start = head.index(b"\n", start) + 1
    return data[start:]


def _careful(text: Text, dialect: Dialect, exact: int | None) -> Table:
    """Any file: its lines are told apart first, and whatever then is no number costs its line."""
    codes = classified(text, dialect)
    line = np.flatnonzero(codes == 0)
    columns: tuple[NDArray[Any], ...] = tuple(np.zeros(0) for _ in range(dialect.fields))
    if len(line):
        data = text.only(codes == 0)
        try:
            columns = _numbers(data, dialect, exact)
        except pa.ArrowInvalid:
            columns, good = _checked(data, dialect, exact)
            codes[line[~good]] = REASONS.index(NOT_A_NUMBER)
            line = line[good]
    return _counted(text, columns, line, codes)


def _counted(text: Text, columns: tuple[NDArray[Any], ...], line: Ints, codes: NDArray[np.uint8]) -> Table:
    counts = np.bincount(codes, minlength=len(REASONS))
    sizes = np.bincount(codes, weights=text.ends + 1 - text.starts, minlength=len(REASONS))
    damaged = np.flatnonzero(np.isin(codes, [REASONS.index(reason) for reason in DAMAGED]))
    dropped = {reason: int(count) for reason, count in zip(REASONS, counts, strict=True) if reason and count}
    dropped_bytes = {reason: int(sizes[REASONS.index(reason)]) for reason in dropped}
    row_bytes = float(sizes[0] / max(counts[0], 1))
    return Table(columns, line, len(text), damaged, dropped, dropped_bytes, row_bytes)


def _read(data: Bytes, dialect: Dialect, types: Mapping[str, pa.DataType]) -> pa.Table:
    return csv.read_csv(
        _reader(data),
        read_options=csv.ReadOptions(use_threads=False, block_size=BLOCK_BYTES, column_names=list(types)),
        parse_options=csv.ParseOptions(
            delimiter=dialect.delimiter.decode(), quote_char='"' if 34 in data[:65536] else False
        ),
        convert_options=csv.ConvertOptions(
            column_types=dict(types),
            null_values=NULLS,
            strings_can_be_null=False,
            decimal_point=dialect.decimal.decode(),
            check_utf8=False,
        ),
    )


def _reader(data: Bytes) -> Any:
    buffer: Any = np.ascontiguousarray(data)
    return pa.BufferReader(pa.py_buffer(buffer))


def _numbers(data: Bytes, dialect: Dialect, exact: int | None) -> tuple[NDArray[Any], ...]:
    """All columns by Arrow's own conversion; ArrowInvalid where a value is no number or a line has other fields."""
    kinds = [pa.binary() if text else pa.float64() for text in dialect.is_text]
    names = [f"c{column}" for column in range(dialect.fields)]
    kind = _exact_kind(data, dialect, exact)
    if exact is not None and kind is not None and not dialect.is_text[exact]:
        kinds[exact] = kind
    table = _read(data, dialect, dict(zip(names, kinds, strict=True)))
    return tuple(_array(table.column(name)) for name in names)


def _exact_kind(data: Bytes, dialect: Dialect, exact: int | None) -> Any:
    """int64 for whole numbers, a decimal for stamps of more digits than a double holds, else None."""
    if exact is None:
        return None
    head = data[:4096].tobytes().split(b"\n")[:-1][:20]
    fields = [dialect.split(line)[exact].strip() for line in head if len(dialect.split(line)) == dialect.fields]
    if not fields or any(b"e" in field.lower() or not field for field in fields):
        return None
    if all(field.lstrip(b"+-").isdigit() for field in fields):
        return pa.int64()
    whole = max(len(field.lstrip(b"+-").split(dialect.decimal)[0]) for field in fields)
    return pa.decimal128(28, 9) if 8 < whole < 11 else None


def _array(column: Any) -> NDArray[Any]:
    if pa.types.is_decimal(column.type):
        return _nanoseconds(column)
    values: NDArray[Any] = column.to_numpy()
    return values


def _nanoseconds(column: Any) -> NDArray[Any]:
    """Decimals of 9 places as whole billionths: the low eight bytes of each 128-bit number."""
    chunk: Any = pa.concat_arrays(column.chunks)
    halves = np.frombuffer(chunk.buffers()[1], "<i8").reshape(-1, 2)[chunk.offset : chunk.offset + len(chunk)]
    if chunk.null_count or np.any(halves[:, 1] != halves[:, 0] >> 63):
        return np.asarray(chunk.cast(pa.float64()).to_numpy(zero_copy_only=False))
    return np.ascontiguousarray(halves[:, 0]).view(BILLIONTHS)


BILLIONTHS: Final = np.dtype("<m8[ns]")
"""How a column of exact decimals is marked: whole billionths of its unit."""


def _checked(data: Bytes, dialect: Dialect, exact: int | None) -> tuple[tuple[NDArray[Any], ...], Mask]:
    """All columns as text first, so that only the rows with something else than a number are lost."""
    names = [f"c{column}" for column in range(dialect.fields)]
    table = _read(data, dialect, dict.fromkeys(names, pa.string()))
    good = np.ones(len(table), np.bool_)
    for name, is_text in zip(names, dialect.is_text, strict=True):
        if not is_text:
            good &= pc.match_substring_regex(table.column(name), _NUMBER).to_numpy()
    table = table.filter(pa.array(good))
    kinds = enumerate(zip(names, dialect.is_text, strict=True))
    return tuple(_converted(table.column(name), dialect, text, i == exact) for i, (name, text) in kinds), good


def _converted(column: Any, dialect: Dialect, is_text: bool, exact: bool) -> NDArray[Any]:
    if is_text:
        return np.asarray(column.cast(pa.binary()).to_numpy())
    plain = pc.utf8_trim_whitespace(pc.replace_substring(column, dialect.decimal.decode(), "."))
    if exact and pc.all(pc.match_substring_regex(plain, _INTEGER)).as_py():
        with suppress(pa.ArrowInvalid):  # beyond 64 bits
            return np.asarray(plain.cast(pa.int64()).to_numpy())
    plain = pc.if_else(pc.is_in(plain, value_set=pa.array(NULLS)), None, plain)
    return np.asarray(plain.cast(pa.float64()).to_numpy())
