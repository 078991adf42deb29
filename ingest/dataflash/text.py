"""Text DataFlash logs: lines of values, one type a line, to the same structured arrays as a binary log's."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Table
from . import units
from .binary import read_only
from .formats import FMT, FMT_TYPE, Format
from .formats import text as string
from .log import Log, Records
from .text_kernels import DEGREES, HUNDREDTHS, INTEGER, MISSING, REAL, UNUSUAL, WORDS, lines, values

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

KIND: Final = {
    **dict.fromkeys("bBhHiIqQM", INTEGER),
    **dict.fromkeys("fdg", REAL),
    **dict.fromkeys("cCeE", HUNDREDTHS),
    **dict.fromkeys("nNZa", WORDS),
    "L": DEGREES,
}
"""Format character -> how its values are written."""
LONGEST: Final = 256
"""No value is written with more characters; a line that has one has lost its end."""
ROWS_AT_ONCE: Final = 65_536


@dataclass(frozen=True, eq=False)
class Lines:
    """The lines of a text log: begin and end of each in ``raw``, and the numbers of those that begin with a name."""

    raw: Bytes
    begins: Ints
    ends: Ints
    by_name: Mapping[str, Ints]

    @classmethod
    def of(cls, raw: Bytes) -> "Lines":
        """The lines in ``raw`` (uint8, shape (n,))."""
        begins, ends, names = lines(raw)
        packed, kind, count = np.unique(names, return_inverse=True, return_counts=True)
        groups = np.split(np.argsort(kind, kind="stable"), np.cumsum(count)[:-1])
        by_name = {_unpacked(name): group for name, group in zip(packed.tolist(), groups, strict=True)}
        return cls(raw, begins, ends, by_name)

    def named(self, name: str) -> Ints:
        """Numbers of the lines that begin with ``name``."""
        return self.by_name.get(name, np.empty(0, np.int64))

    def records(self, form: Format, chosen: Ints) -> Records:
        """The lines ``chosen`` as records of a format; a line that does not fit is left out."""
        kinds = np.array([KIND[character] for character in form.characters], np.int64)
        whole, starts, stops, state = values(self.raw, self.begins[chosen], self.ends[chosen], kinds)
        state[stops - starts > LONGEST] = MISSING
        modes = [i for i, c in enumerate(form.characters) if c == "M" and np.any(state[:, i] == UNUSUAL)]
        if modes:
            named = "".join("N" if i in modes else c for i, c in enumerate(form.characters))
            return self.records(replace(form, characters=named), chosen)
        good = self._unusual(form, whole, starts, stops, state)
        good &= ~np.any(state == MISSING, axis=1) & _in_range(form, whole)
        data = self._table(form, whole[good], starts[good], stops[good])
        return Records(form, data, chosen[good])

    def _unusual(
        self, form: Format, whole: Ints, starts: Ints, stops: Ints, state: NDArray[np.uint8]
    ) -> NDArray[np.bool_]:
        """Read in other ways what the kernel would not, such as 17 digits; which lines that was possible for."""
        good = np.ones(len(whole), np.bool_)
        for column, character in enumerate(form.characters):
            rows = np.flatnonzero(state[:, column] == UNUSUAL)
            if len(rows):
                tokens = self._strings(starts[rows, column], stops[rows, column])
                whole[rows, column], fits = _other_numbers(tokens, KIND[character])
                good[rows] &= fits
        return good

    def _table(self, form: Format, whole: Ints, starts: Ints, stops: Ints) -> Table:
        types: list[tuple[str, object]] = []
        texts: dict[str, NDArray[np.bytes_]] = {}
        for column, name in enumerate(form.columns):
            if KIND[form.characters[column]] == WORDS:
                texts[name] = self._strings(starts[:, column], stops[:, column])
                types.append((name, texts[name].dtype))
            else:
                types.append((name, form.dtype[name]))
        result = np.zeros(len(whole), types)
        for column, (name, character) in enumerate(zip(form.columns, form.characters, strict=True)):
            numbers = whole[:, column].view(np.float64) if KIND[character] == REAL else whole[:, column]
            with np.errstate(over="ignore"):
                result[name] = texts.get(name, numbers)
        return result

    def _strings(self, starts: Ints, stops: Ints) -> NDArray[np.bytes_]:
        width = max(1, int((stops - starts).max(initial=1)))
        matrix = np.zeros((len(starts), width), np.uint8)
        for first in range(0, len(starts), ROWS_AT_ONCE):
            rows = slice(first, first + ROWS_AT_ONCE)
            at = starts[rows, np.newaxis] + np.arange(width)
            inside = at < stops[rows, np.newaxis]
            matrix[rows][inside] = self.raw[at[inside]]
        return matrix.view(f"S{width}")[:, 0]


def parse(data: Bytes) -> Log:
    """Every line of a text log that its FMT lines explain; the others are skipped and counted."""
    source = Lines.of(read_only(data))
    definitions = source.records(FMT, source.named("FMT"))
    found = [definitions]
    numbers = {"FMT": FMT_TYPE}
    for name, versions in _versions(definitions).items():
        chosen = source.named(name)
        numbers[name] = versions[-1][2]
        bounds = [int(np.searchsorted(chosen, line)) for _, line, _ in versions[1:]]
        for (form, _, _), part in zip(versions, np.split(chosen, bounds), strict=True):
            if len(part):
                found.append(source.records(form, part))
    return _log(source, _described(found, numbers))


def _versions(definitions: Records) -> dict[str, list[tuple[Format, int, int]]]:
    """Name -> its definitions, each with the line from which it holds and its type number."""
    result: dict[str, list[tuple[Format, int, int]]] = {}
    for row, line in zip(definitions.data, definitions.order.tolist(), strict=True):
        name, characters = string(row["Name"]), string(row["Format"]).strip()
        if name == "FMT" or any(character not in KIND for character in characters):
            continue
        form = Format.of(name, characters, [column.strip() for column in string(row["Columns"]).split(",")])
        known = result.setdefault(name, [])
        if not known or known[-1][0] != form:
            known.append((form, line, int(row["Type"])))
    return result


def _described(found: Sequence[Records], numbers: dict[str, int]) -> list[Records]:
    """The records with their formats' units, apart by instance."""
    tables = {name: [part.data for part in found if part.format.name == name] for name in units.COLUMNS}
    meaning = units.Dictionary.of(tables)
    result = []
    for part in found:
        form = meaning.applied(part.format, numbers[part.format.name])
        described = Records(form, part.data, part.order)
        result += [described] if form.instance is None else list(described.by_column(form.instance))
    return [records for records in result if len(records)]


def _log(source: Lines, found: Sequence[Records]) -> Log:
    """Number the lines that were read, count the others."""
    number = np.zeros(len(source.begins), np.int64)
    for records in found:
        number[records.order] = 1
    unread = number == 0
    number = np.cumsum(number) - 1
    renumbered = tuple(replace(records, order=number[records.order]) for records in found)
    skipped = int((source.ends - source.begins)[unread].sum())
    count = int(np.count_nonzero(unread))
    return Log(renumbered, len(unread) - count, skipped, {"unreadable lines": count} if count else {})


def _in_range(form: Format, whole: Ints) -> NDArray[np.bool_]:
    """Which lines have only integers that their columns can hold."""
    good = np.ones(len(whole), np.bool_)
    for column, character in enumerate(form.characters):
        dtype = form.dtype[column]
        if dtype.kind in "iu" and dtype.itemsize < 8 and KIND[character] != WORDS:
            limits = np.iinfo(dtype)
            good &= (whole[:, column] >= limits.min) & (whole[:, column] <= limits.max)
    return good


def _unpacked(name: int) -> str:
    return "" if name < 0 else name.to_bytes(8, "big").lstrip(b"\0").decode("latin-1")


def _other_numbers(tokens: NDArray[np.bytes_], kind: int) -> tuple[Ints, NDArray[np.bool_]]:
    """Numbers (n,) as `values` leaves them, all at once if each is a real number; and which tokens are numbers."""
    good = np.ones(len(tokens), np.bool_)
    if kind == REAL:
        with suppress(ValueError):
            return tokens.astype(np.float64).view(np.int64), good
    bits = np.zeros(len(tokens), np.int64)
    for row, token in enumerate(tokens.tolist()):
        try:
            bits[row] = _bits(token.decode("ascii"), kind)
        except (ValueError, OverflowError):
            good[row] = False
    return bits, good


def _bits(token: str, kind: int) -> int:
    """A number as `values` leaves it: an integer, or the bits of a double."""
    if kind == REAL:
        return int(np.float64(token).view(np.int64))
    scale = {HUNDREDTHS: 100, DEGREES: 10_000_000}.get(kind, 1)
    value = int(token) if scale == 1 else round(float(token) * scale)
    return value - 2**64 if value >= 2**63 else value
