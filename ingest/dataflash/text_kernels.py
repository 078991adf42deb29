"""Text logs, line by line and number by number."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import inline_kernel, kernel

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

TAB, NEWLINE, RETURN, SPACE, COMMA, POINT, MINUS, PLUS, ZERO, NINE, LOWER_N = 9, 10, 13, 32, 44, 46, 45, 43, 48, 57, 110
LONGEST_NAME: Final = 7
"""Names are packed into an integer; DataFlash's have four characters at most."""

INTEGER, REAL, HUNDREDTHS, DEGREES, WORDS = range(5)
"""Kinds of column: an integer, a real number, an integer written divided by 1e2 or 1e7, text."""
SHIFT: Final = (0, 0, 2, 7, 0)
"""Power of ten that a kind is multiplied by."""
READ, UNUSUAL, MISSING = range(3)
"""What became of a value: read; for Python to read; not there."""

POWERS: Final[Floats] = np.array([float(f"1e{power}") for power in range(23)])
"""Powers of ten that a double holds exactly."""
EXACT: Final = 2**53
WIDEST: Final = 10**17


@inline_kernel
def _blank(character: np.uint8) -> bool:
    return character in (SPACE, RETURN, TAB)


@kernel
def lines(data: Bytes) -> tuple[Ints, Ints, Ints]:
    """Begin, end and name of every line that is not blank; the name is packed, -1 where there is none.

    The end leaves out white space; a name ends at a comma.
    """
    capacity = data.size // 64 + 1024
    begins, ends, names = np.empty(capacity, np.int64), np.empty(capacity, np.int64), np.empty(capacity, np.int64)
    count = 0
    at = 0
    while at < data.size:
        stop = at
        while stop < data.size and data[stop] != NEWLINE:
            stop += 1
        end = stop
        while end > at and _blank(data[end - 1]):
            end -= 1
        if end > at:
            if count == capacity:
                capacity *= 2
                begins, ends, names = _grown(begins, capacity), _grown(ends, capacity), _grown(names, capacity)
            begins[count], ends[count], names[count] = at, end, _name(data, at, end)
            count += 1
        at = stop + 1
    return begins[:count].copy(), ends[:count].copy(), names[:count].copy()


@kernel
def _grown(values: Ints, capacity: int) -> Ints:
    result = np.empty(capacity, np.int64)
    result[: values.size] = values
    return result


@inline_kernel
def _name(data: Bytes, at: int, end: int) -> int:
    packed = 0
    for i in range(min(LONGEST_NAME + 1, end - at)):
        if data[at + i] == COMMA:
            return packed if i > 0 else -1
        packed = (packed << 8) | int(data[at + i])
    return -1


@kernel
def _number(data: Bytes, at: int, end: int) -> tuple[bool, int, int]:
    """Whether data[at:end] is a decimal number of at most 17 digits, and its digits and power of ten."""
    negative = data[at] == MINUS
    if negative or data[at] == PLUS:
        at += 1
    digits = 0
    power = 0
    seen = 0
    fraction = False
    while at < end:
        c = data[at]
        if ZERO <= c <= NINE:
            if digits >= WIDEST:
                return False, 0, 0
            digits = digits * 10 + int(c) - ZERO
            power -= fraction
            seen += 1
        elif c == POINT and not fraction:
            fraction = True
        else:
            break
        at += 1
    if seen == 0:
        return False, 0, 0
    if at < end and (data[at] | 32) == 101:
        at += 1
        down = at < end and data[at] == MINUS
        if down or (at < end and data[at] == PLUS):
            at += 1
        if at >= end:
            return False, 0, 0
        exponent = 0
        while at < end and ZERO <= data[at] <= NINE and exponent < 1000:
            exponent = exponent * 10 + int(data[at]) - ZERO
            at += 1
        power += -exponent if down else exponent
    return at == end, -digits if negative else digits, power


@inline_kernel
def _whole(digits: int, power: int) -> tuple[bool, int]:
    """digits 10^power to the nearest integer."""
    while power > 0 and abs(digits) < WIDEST:
        digits *= 10
        power -= 1
    if power > 0:
        return digits == 0, 0
    if power < -18:
        return True, 0
    divisor = 1
    while power < 0:
        divisor *= 10
        power += 1
    half = divisor // 2
    return True, (digits + half) // divisor if digits >= 0 else -((-digits + half) // divisor)


@kernel
def _trimmed(data: Bytes, first: int, last: int) -> tuple[int, int]:
    while first < last and _blank(data[first]):
        first += 1
    while last > first and _blank(data[last - 1]):
        last -= 1
    return first, last


@kernel
def _real(data: Bytes, first: int, last: int) -> tuple[int, float]:
    """State and value of a real number; unusual is one that digits times a power of ten does not round correctly."""
    plain, digits, power = _number(data, first, last)
    if not plain:
        return (READ, np.nan) if (data[first] | 32) == LOWER_N else (UNUSUAL, 0.0)
    if abs(digits) > EXACT or power < -22 or power > 22:
        return UNUSUAL, 0.0
    if digits == 0 and data[first] == MINUS:
        return READ, -0.0
    return READ, float(digits * POWERS[power] if power >= 0 else digits / POWERS[-power])


@kernel
def _integer(data: Bytes, first: int, last: int, shift: int) -> tuple[int, int]:
    """State and value of a number times 10^shift, to the nearest integer."""
    plain, digits, power = _number(data, first, last)
    if not plain:
        return UNUSUAL, 0
    fits, whole = _whole(digits, power + shift)
    return (READ if fits else UNUSUAL), whole


@inline_kernel
def _comma(data: Bytes, at: int, end: int) -> int:
    """The next comma from ``at`` on, or the end."""
    while at < end and data[at] != COMMA:
        at += 1
    return at


@kernel
def values(data: Bytes, begins: Ints, ends: Ints, kinds: Ints) -> tuple[Ints, Ints, Ints, NDArray[np.uint8]]:
    """The columns of lines of one type: (n, k) integers (reals as their bits), begin and end of each, and its state.

    A text in the last column goes on to the end of the line, commas and all.
    """
    shape = (begins.size, kinds.size)
    whole = np.zeros(shape, np.int64)
    real = whole.view(np.float64)
    starts, stops = np.zeros(shape, np.int64), np.zeros(shape, np.int64)
    state = np.full(shape, MISSING, np.uint8)
    for row in range(begins.size):
        end = ends[row]
        at = _comma(data, begins[row], end)
        for column in range(kinds.size):
            if at >= end:
                break
            first = at + 1 + (at + 1 < end and data[at + 1] == SPACE)
            kind = kinds[column]
            at = end if kind == WORDS and column == kinds.size - 1 else _comma(data, first, end)
            last = at
            if kind == WORDS:
                state[row, column] = READ
            else:
                first, last = _trimmed(data, first, last)
                if first == last:
                    continue
                if kind == REAL:
                    state[row, column], real[row, column] = _real(data, first, last)
                else:
                    state[row, column], whole[row, column] = _integer(data, first, last, SHIFT[kind])
            starts[row, column], stops[row, column] = first, last
    return whole, starts, stops, state
