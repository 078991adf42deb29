"""Which lines are data, and why the others are not: whole files at once, and only odd lines one by one."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .dialect import COMMENT_MARKS, Dialect
from .text import Text

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
_NUMERIC: Final = b'0123456789+-.eE, \t\r\n";' + b"nainfNAINFovOVulULoOE/"
_PRINTABLE: Final = bytes(range(32, 127)) + b"\t\r\n"
_HIGH: Final = bytes(range(128, 256))
_QUOTE: Final = ord('"')


def classified(text: Text, dialect: Dialect) -> NDArray[np.uint8]:
    """For each line the position of its reason in `REASONS`; 0 is data."""
    result = np.zeros(len(text), np.uint8)
    words = any(dialect.is_text)
    result[_per_line(text, np.flatnonzero(_delimits(text, dialect))) + 1 != dialect.fields] = _CODE[FIELDS]
    known = _PRINTABLE + _HIGH if words else _NUMERIC + dialect.delimiter
    result[_per_line(text, _outside(text, known)) > 0] = _CODE[TEXT]
    suspects = np.flatnonzero((result != 0) | np.isin(text.data[text.starts], list(b"#%;/")))
    headers = {text.line(number).strip() for number in dialect.header_lines}
    for number in suspects.tolist():
        result[number] = _CODE[_odd(text.line(number).strip(), headers, dialect, REASONS[result[number]])]
    return result


def _odd(line: bytes, headers: set[bytes], dialect: Dialect, reason: str) -> str:
    """What a line is that is perhaps no data; a device that resets prints its header again."""
    if not line:
        return BLANK_LINE
    if line in headers:
        return HEADER
    if any(line.startswith(mark) for mark in COMMENT_MARKS if mark != dialect.delimiter):
        return COMMENT
    if line.translate(None, _PRINTABLE):
        return GARBAGE
    if reason == FIELDS and not any(dialect.number(field) and field.strip() for field in dialect.split(line)):
        return TEXT
    return reason


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


def _delimits(text: Text, dialect: Dialect) -> Mask:
    """Where one field ends and the next begins; a delimiter within quotes is text."""
    marks = text.data == ord(dialect.delimiter)
    quotes = text.data == _QUOTE
    if not np.any(quotes):
        return np.asarray(marks)
    before = np.cumsum(quotes)
    at_start = (before - quotes)[text.starts]
    lengths = text.ends + 1 - text.starts
    return np.asarray(marks & ((before - np.repeat(at_start, lengths)) % 2 == 0))
