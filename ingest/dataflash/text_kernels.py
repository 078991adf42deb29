"""Text logs, line by line and number by number."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import inline_kernel, kernel

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

TAB, NEWLINE, RETURN, SPACE, COMMA, POINT, MINUS, PLUS, ZERO, NINE = 9, 10, 13, 32, 44, 46, 45, 43, 48, 57
LONGEST_NAME: Final = 7
"""Names are packed into an integer; DataFlash's have four characters at most."""

INTEGER, REAL, HUNDREDTHS, DEGREES, WORDS = range(5)
"""Kinds of column: an integer, a real number, an integer written divided by 1e2 or 1e7, text."""
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
def values(data: Bytes, begins: Ints, ends: Ints, kinds: Ints) -> tuple[Ints, Ints, Ints, NDArray[np.uint8]]:
    """The columns of lines of one type: (n, k) integers (reals as their bits), begin and end of each, and its state."""
    shape = (begins.size, kinds.size)
    whole = np.zeros(shape, np.int64)
    real = whole.view(np.float64)
    starts, stops = np.zeros(shape, np.int64), np.zeros(shape, np.int64)
    state = np.full(shape, MISSING, np.uint8)
    for row in range(begins.size):
        at = begins[row]
        end = ends[row]
        while at < end and data[at] != COMMA:
            at += 1
        for column in range(kinds.size):
            if at >= end:
                break
            at += 1
            if at < end and data[at] == SPACE:
                at += 1
            stop = at
            while stop < end and data[stop] != COMMA:
                stop += 1
            if kinds[column] == WORDS:
                if column == kinds.size - 1:
                    stop = end
                starts[row, column], stops[row, column], state[row, column] = at, stop, READ
                at = stop
                continue
            first, last = at, stop
            while first < last and _blank(data[first]):
                first += 1
            while last > first and _blank(data[last - 1]):
                last -= 1
            starts[row, column], stops[row, column], state[row, column] = first, last, UNUSUAL
            at = stop
            if first == last:
                state[row, column] = MISSING
                continue
            plain, digits, power = _number(data, first, last)
            if not plain:
                if kinds[column] == REAL and (data[first] | 32) == 110:
                    real[row, column] = np.nan
                    state[row, column] = READ
                continue
            if kinds[column] == REAL:
                if abs(digits) <= EXACT and -22 <= power <= 22:
                    value = digits * POWERS[power] if power >= 0 else digits / POWERS[-power]
                    real[row, column] = -0.0 if digits == 0 and data[first] == MINUS else value
                    state[row, column] = READ
                continue
            shift = 2 if kinds[column] == HUNDREDTHS else 7 if kinds[column] == DEGREES else 0
            plain, number = _whole(digits, power + shift)
            if plain:
                whole[row, column] = number
                state[row, column] = READ
    return whole, starts, stops, state
