"""Which lines are data, and why the others are not: whole files at once, and only odd lines one by one."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .dialect import COMMENT_MARKS, Dialect
from .text import NEWLINE, RETURN, Text, holds

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

DATA: Final = ""
BLANK_LINE: Final = "blank line"
COMMENT: Final = "comment"
HEADER: Final = "header"
GARBAGE: Final = "garbage bytes"
TEXT: Final = "text"
FIELDS: Final = "wrong number of fields"
NOT_A_NUMBER: Final = "not a number"

REASONS: Final = (DATA, BLANK_LINE, COMMENT, HEADER, GARBAGE, TEXT, FIELDS, NOT_A_NUMBER)
DAMAGED: Final = frozenset({GARBAGE, FIELDS, NOT_A_NUMBER})
"""Reasons that stand for a sample that was lost."""

_CODE: Final[Mapping[str, int]] = {reason: code for code, reason in enumerate(REASONS)}
_NUMERIC: Final = b"0123456789+-.eE, \t\r\n;" + b"nainfNAINFovOVulULoOE/"
_PRINTABLE: Final = bytes(range(32, 127)) + b"\t\r\n"
_HIGH: Final = bytes(range(128, 256))


@dataclass(frozen=True)
class Odd:
    """A line that is no row of the table."""

    number: int
    reason: str
    text: bytes


def reason_of(line: bytes, dialect: Dialect) -> str:
    """Why a line is no data, by itself; `DATA` where it may be."""
    plain = line.strip()
    if not plain:
        return BLANK_LINE
    if any(plain.startswith(mark) for mark in COMMENT_MARKS if mark != dialect.delimiter):
        return COMMENT
    words = any(dialect.is_text)
    if plain.translate(None, _PRINTABLE + (_HIGH if words else b"")) or b"\r" in line.rstrip(b"\r"):
        return GARBAGE
    fields = dialect.split(line)
    numbers = sum(dialect.number(field) and bool(field.strip()) for field in fields)
    if len(fields) != dialect.fields:
        return FIELDS if numbers else TEXT
    if words or not plain.translate(None, _NUMERIC + dialect.delimiter):
        return DATA
    return NOT_A_NUMBER if 2 * numbers > len(fields) else TEXT


def classified(text: Text, dialect: Dialect) -> NDArray[np.uint8]:
    """For each line the position of its reason in `REASONS`; 0 is data."""
    words = any(dialect.is_text)
    known = _PRINTABLE + _HIGH if words else _NUMERIC + dialect.delimiter
    delimiters = np.flatnonzero(text.data == ord(dialect.delimiter))
    suspect = _per_line(text, delimiters) + 1 != dialect.fields
    suspect |= _per_line(text, _outside(text, known)) > 0
    suspect |= np.isin(text.data[text.starts], list(b"#%;/")) | _torn(text)
    result = np.zeros(len(text), np.uint8)
    headers = {text.line(number).strip() for number in dialect.header_lines}
    for number in np.flatnonzero(suspect).tolist():
        line = text.line(number)
        result[number] = _CODE[HEADER if line.strip() in headers else reason_of(line, dialect)]
    return result


def _torn(text: Text) -> Mask:
    """Lines (n,) with a carriage return in their midst."""
    if not holds(text.data, RETURN):
        return np.zeros(len(text), np.bool_)
    at = np.flatnonzero(text.data == RETURN)
    return np.asarray(_per_line(text, at[text.data[at + 1] != NEWLINE]) > 0)


def _per_line(text: Text, at: Ints) -> Ints:
    """How many of the increasing positions lie in each line."""
    if len(at) == 0:
        return np.zeros(len(text), np.int64)
    return np.asarray(np.diff(np.searchsorted(at, text.starts), append=len(at)))


def _outside(text: Text, known: bytes) -> Ints:
    """Positions of the bytes that are not among ``known``."""
    if not text.data.tobytes().translate(None, known):
        return np.zeros(0, np.int64)
    foreign = np.ones(256, np.bool_)
    foreign[list(known)] = False
    return np.flatnonzero(foreign[text.data])
