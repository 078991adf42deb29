"""Lines of data to columns by Arrow's CSV parser."""

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Final, Literal

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from pyarrow import csv

from .dialect import Dialect
from .text import Bytes

Mask = NDArray[np.bool_]

BLOCK_BYTES: Final = 4 << 20
NULLS: Final = [""]
"""What is read as no value at once; every word in the list costs time at every value."""
WORDS: Final = ["", "nan", "NaN", "NAN", "ovf", "OVF", "null", "NULL", "None", "N/A"]
"""What else stands for no value; Arduino prints ovf for a float beyond 4294967040."""
BILLIONTHS: Final = np.dtype("<m8[ns]")
"""How a column of exact decimals is marked: whole billionths of its unit."""
_NUMBER: Final = r"^\s*$|(?i)^\s*[-+]?((\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|nan|inf|ovf|null|none|n/a)\s*$"
_BAD_COLUMN: Final = re.compile(r"In CSV column #(\d+):")
_INTEGER: Final = r"^\s*[-+]?\d{1,19}\s*$"


def numbers(data: Bytes, dialect: Dialect, exact: int | None, odd: list[int] | None = None) -> pa.Table:
    """All columns by Arrow's own conversion; column ``exact`` keeps all its digits.

    Lines with another number of fields are skipped, and their numbers (from 0) put into ``odd``; an empty line is a row
    of nulls. ArrowInvalid where a value is no number, or without ``odd`` where a line has other fields.
    """
    return _read(data, dialect, _kinds(data, dialect, exact), odd)


def checked(data: Bytes, dialect: Dialect, exact: int | None) -> tuple[tuple[NDArray[Any], ...], Mask]:
    """The same, but only the rows with something else than a number are lost; which (n,) are good.

    A column in which Arrow finds such a thing is read again as text. ArrowInvalid where the lines have not all the same
    number of fields.
    """
    kinds = _kinds(data, dialect, exact)
    table = None
    while table is None:
        try:
            table = _read(data, dialect, kinds, None)
        except pa.ArrowInvalid as error:
            match = _BAD_COLUMN.search(str(error))
            if match is None or kinds[int(match[1])] == pa.string():
                raise
            kinds[int(match[1])] = pa.string()
    doubtful = [number for number, kind in enumerate(kinds) if kind == pa.string()]
    good = np.ones(len(table), np.bool_)
    for number in doubtful:
        good &= pc.match_substring_regex(table.column(number), _NUMBER).to_numpy()
    table = table.filter(pa.array(good))
    columns = list(arrays(table))
    for number in doubtful:
        columns[number] = _converted(table.column(number), dialect, number == exact)
    return tuple(columns), good


def arrays(table: pa.Table) -> tuple[NDArray[Any], ...]:
    """The columns (n,): float64 (NaN where empty), int64 or billionths for an exact clock, object for text."""
    return tuple(_nanoseconds(c) if pa.types.is_decimal(c.type) else np.asarray(c.to_numpy()) for c in table.columns)


def empty_rows(table: pa.Table) -> Mask | None:
    """Rows (n,) without any value; None where there are none."""
    if any(column.null_count == 0 and not pa.types.is_binary(column.type) for column in table.columns):
        return None
    empty = np.ones(len(table), np.bool_)
    for column in table.columns:
        blank = pc.equal(column, pa.scalar(b"")) if pa.types.is_binary(column.type) else pc.is_null(column)
        empty &= blank.to_numpy()
    return empty if np.any(empty) else None


def _read(data: Bytes, dialect: Dialect, kinds: list[Any], odd: list[int] | None) -> pa.Table:
    def skip(row: Any) -> Literal["skip"]:
        assert odd is not None
        odd.append(row.number - 1)
        return "skip"

    names = [f"c{column}" for column in range(dialect.fields)]
    types: Mapping[str, Any] = dict(zip(names, kinds, strict=True))
    parse_options = csv.ParseOptions(
        delimiter=dialect.delimiter.decode(),
        quote_char=False,
        ignore_empty_lines=odd is None,
        invalid_row_handler=None if odd is None else skip,
    )
    convert_options = csv.ConvertOptions(
        column_types=dict(types),
        null_values=NULLS,
        strings_can_be_null=False,
        decimal_point=dialect.decimal.decode(),
        check_utf8=False,
    )
    read_options = csv.ReadOptions(use_threads=False, block_size=BLOCK_BYTES, column_names=names)
    buffer: Any = np.ascontiguousarray(data)
    reader: Any = pa.BufferReader(pa.py_buffer(buffer))
    return csv.read_csv(reader, read_options, parse_options, convert_options)


def _kinds(data: Bytes, dialect: Dialect, exact: int | None) -> list[Any]:
    kinds: list[Any] = [pa.binary() if text else pa.float64() for text in dialect.is_text]
    kind = _exact_kind(data, dialect, exact)
    if exact is not None and kind is not None and not dialect.is_text[exact]:
        kinds[exact] = kind
    return kinds


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


def _nanoseconds(column: Any) -> NDArray[Any]:
    """Decimals of 9 places as whole billionths: the low eight bytes of each 128-bit number."""
    chunk: Any = pa.concat_arrays(column.chunks)
    halves = np.frombuffer(chunk.buffers()[1], "<i8").reshape(-1, 2)[chunk.offset : chunk.offset + len(chunk)]
    if chunk.null_count or np.any(halves[:, 1] != halves[:, 0] >> 63):
        return np.asarray(chunk.cast(pa.float64()).to_numpy(zero_copy_only=False))
    return np.ascontiguousarray(halves[:, 0]).view(BILLIONTHS)


def _converted(column: Any, dialect: Dialect, exact: bool) -> NDArray[Any]:
    """Texts that are all numbers, or words for none, as numbers."""
    plain = pc.utf8_trim_whitespace(pc.replace_substring(column, dialect.decimal.decode(), "."))
    if exact and pc.all(pc.match_substring_regex(plain, _INTEGER)).as_py():
        with suppress(pa.ArrowInvalid):  # beyond 64 bits
            return np.asarray(plain.cast(pa.int64()).to_numpy())
    plain = pc.if_else(pc.is_in(plain, value_set=pa.array(WORDS)), None, plain)
    return np.asarray(plain.cast(pa.float64()).to_numpy())
