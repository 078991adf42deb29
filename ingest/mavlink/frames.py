"""A log's frames: found, their stamps repaired, sorted into groups of rows."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from . import rows_kernel, scan_kernel
from .crc_kernel import Integer
from .definitions import Definition, Dialect
from .scan_kernel import IN_PLACE, LOOSE, STAMP, Bytes, Ints

WINDOW: Final = 1 << 16
DAY_US: Final = 86_400_000_000
SLACK_US: Final = 2_000_000
SHORT_RUN: Final = 3
USUAL_RECORD: Final = 28
ROOM: Final = 1024
ROUNDS: Final = 4


@dataclass(frozen=True, eq=False)
class Damage:
    """What of the bytes is no frame: ``runs`` as `scan_kernel.scan` gives them, bytes of a torn last record, and how
    many stamps had to be made up because they were lost or impossible.
    """

    runs: Ints
    torn: int = 0
    stamps_lost: int = 0
    stamps_wrong: int = 0

    @property
    def bytes(self) -> int:
        """Bad bytes in all."""
        return int((self.runs[:, 1] - self.runs[:, 0]).sum())

    @property
    def checksum_failures(self) -> int:
        """Runs that begin with a whole frame whose checksum is wrong."""
        return int((self.runs[:, 2] >= 0).sum())


@dataclass(frozen=True, eq=False)
class Group:
    """All messages of one kind from one component, the ``number``-th: ``rows`` (n,) in the order of the log."""

    number: int
    definition: Definition
    system: int
    component: int
    known: bool
    rows: "NDArray[np.void]"
    first_row: int

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def name(self) -> str:
        """The message's name."""
        return self.definition.name


@dataclass(frozen=True, eq=False)
class Frames:
    """Frames in the order of the log: stamp (us; -1 in a raw stream), group, row, own time (us, -1 for none)."""

    stamped: bool
    stamps_us: Ints
    groups_of: NDArray[np.int32]
    rows_of: Ints
    own_us: Ints
    groups: tuple[Group, ...]
    damage: Damage

    def __len__(self) -> int:
        return len(self.stamps_us)

    def of(self, *names: str, system: int | None = None) -> list[Group]:
        """The groups of these messages, in the order of ``names``."""
        return [g for n in names for g in self.groups if g.name == n and system in (None, g.system)]


def find(data: Bytes, dialect: Dialect) -> Frames:
    """All frames of a log; none where it holds no frame."""
    data = np.asarray(data).view()
    data.flags.writeable = False  # one compilation of the kernels for memory maps and for arrays
    stamped, reference = detect(data, dialect.crc_extra)
    (places, raw_stamps, key_of_frame), kinds, runs = scan(data, dialect.crc_extra, stamped, reference)
    stamps, wrong = repair(raw_stamps, kinds) if stamped else (raw_stamps, 0)
    lost = int(np.count_nonzero(kinds == LOOSE)) if stamped else 0
    groups_of, keys, counts = _classify(key_of_frame)
    groups, layout, out = _layout(dialect, keys, counts)
    rows_of, own = np.empty((2, len(places)), np.int64)
    rows_kernel.gather(data, places, stamps, groups_of, layout, out, rows_of, own)
    runs, torn = _split_torn(data, runs)
    return Frames(stamped, stamps, groups_of, rows_of, own, groups, Damage(runs, torn, lost, wrong))


def scan(
    data: Bytes, crc_extra: NDArray[np.int16], stamped: bool, reference: int
) -> tuple[Ints, NDArray[np.uint8], Ints]:
    """What `scan_kernel.scan` finds, in tables that grow where frames are short or much is broken."""
    parts: list[tuple[Ints, NDArray[np.uint8], Ints]] = []
    most = len(data) // USUAL_RECORD + ROOM
    at: Integer = 0
    last: Integer = reference
    while at < len(data):
        found, kinds, runs = np.empty((3, most), np.int64), np.empty(most, np.uint8), np.empty((most, 4), np.int64)
        count, bad, at, last = scan_kernel.scan(data, int(at), crc_extra, stamped, int(last), found, kinds, runs)
        parts.append((found[:, :count], kinds[:count], runs[:bad]))
    if len(parts) == 1:
        return parts[0]
    empty = np.empty((3, 0), np.int64), np.empty(0, np.uint8), np.empty((0, 4), np.int64)
    founds, kinds_, runs_ = zip(empty, *parts, strict=True)
    return np.concatenate(founds, axis=1), np.concatenate(kinds_), np.concatenate(runs_)


def _classify(key_of_frame: Ints) -> tuple[NDArray[np.int32], Ints, Ints]:
    """The group of each frame, in order of first appearance; the groups' keys; how many frames each has."""
    groups_of = np.empty(len(key_of_frame), np.int32)
    size = rows_kernel.FIRST_SIZE
    known: Integer = 0
    done: Integer = 0
    keys, counts = np.empty(size, np.int64), np.zeros(size, np.int64)
    while True:
        table = np.full(2 * size, rows_kernel.FREE, np.int64)
        known, done = rows_kernel.classify(key_of_frame, done, table, keys, counts, known, groups_of)
        if done == len(key_of_frame):
            return groups_of, keys[:known], counts[:known]
        size *= 2
        keys, counts = np.resize(keys, size), np.concatenate((counts, np.zeros(size // 2, np.int64)))


def _split_torn(data: Bytes, runs: Ints) -> tuple[Ints, int]:
    """The runs without one that is only a record which the end of the log cut off, and that one's bytes."""
    if len(runs) == 0 or runs[-1, 1] != len(data) or runs[-1, 2] >= 0:
        return runs, 0
    start = int(runs[-1, 0])
    torn = len(data) - start
    begins = data[start] in (scan_kernel.MAGIC_1, scan_kernel.MAGIC_2) and torn < scan_kernel.LONGEST
    return (runs[:-1], torn) if torn <= STAMP or begins else (runs, 0)


def detect(data: Bytes, crc_extra: NDArray[np.int16]) -> tuple[bool, int]:
    """Whether 8 bytes stand before each frame, as in a telemetry log, and a stamp near the log's first."""
    window = WINDOW
    places = _places(data[:window], crc_extra)
    while len(places) < 8 and window < len(data):
        window *= 8
        places = _places(data[:window], crc_extra)
    if len(places) == 0:
        return False, scan_kernel.NO_STAMP
    gaps, stamps = scan_kernel.gaps_and_stamps(data, places)
    if np.count_nonzero(gaps == STAMP) <= np.count_nonzero(gaps == 0):
        return False, scan_kernel.NO_STAMP
    return True, int(np.sort(stamps[gaps == STAMP])[np.count_nonzero(gaps == STAMP) // 2])


def _places(data: Bytes, crc_extra: NDArray[np.int16]) -> Ints:
    return np.asarray(scan(data, crc_extra, False, scan_kernel.NO_STAMP)[0][0])


def repair(raw: Ints, kinds: NDArray[np.uint8]) -> tuple[Ints, int]:
    """Stamps with the lost and the impossible ones replaced by interpolation, and how many were impossible.

    A stamp is impossible where it lies outside its neighbours' while they are in order: a clock that is set
    stays set, a flipped bit concerns one stamp.
    """
    if np.all(kinds == IN_PLACE) and _in_order(raw):
        return raw, 0
    usable = np.flatnonzero((raw >= 0) & (kinds != LOOSE))
    good = usable
    for _ in range(ROUNDS):
        outliers = _outliers(raw[good])
        if not outliers.any():
            break
        good = good[~outliers]
    if len(good) in (0, len(raw)):
        return np.maximum(raw, 0), 0
    base = raw[good[0]]
    made_up = base + np.rint(np.interp(np.arange(len(raw)), good, (raw[good] - base).astype(np.float64))).astype("i8")
    made_up[good] = raw[good]
    return made_up, int(np.count_nonzero(kinds != LOOSE)) - len(good)


def _in_order(stamps: Ints) -> bool:
    step = np.diff(stamps)
    return len(stamps) > 0 and stamps[0] >= 0 and (len(step) == 0 or (step.min() >= -SLACK_US and step.max() < DAY_US))


def _outliers(stamps: Ints) -> NDArray[np.bool_]:
    step = np.diff(stamps)
    firsts = np.concatenate(([0], np.flatnonzero((step < -SLACK_US) | (step > SLACK_US)) + 1))
    lasts = np.concatenate((firsts[1:] - 1, [len(stamps) - 1]))
    before = np.concatenate(([stamps[firsts[0]]], stamps[lasts[:-1]]))
    after = np.concatenate((stamps[firsts[1:]], [stamps[lasts[-1]]]))
    low, high = before - SLACK_US, after + SLACK_US
    if len(firsts) > 1:  # at the ends there is one neighbour only, and a pause is possible
        low[0], high[-1] = after[0] - DAY_US, before[-1] + DAY_US
    outside = (stamps[firsts] < low) | (stamps[lasts] > high) | (stamps[firsts] > high) | (stamps[lasts] < low)
    wrong = outside & (low <= high) & (lasts - firsts < SHORT_RUN)
    return np.asarray(np.repeat(wrong, lasts - firsts + 1))


def _layout(dialect: Dialect, keys: Ints, counts: Ints) -> tuple[tuple[Group, ...], Ints, NDArray[np.uint64]]:
    """Groups with their still empty rows, and what `rows_kernel.gather` needs to fill them."""
    definitions = [dialect.definition(int(key) >> 16) for key in keys]
    words = np.array([d.row_size // 8 for d in definitions], np.int64)
    starts = np.concatenate(([0], np.cumsum(words * counts)))
    first_row = np.concatenate(([0], np.cumsum(counts)))[:-1]
    _, senders = np.unique(keys & 0xFFFF, return_inverse=True)
    payload_and_time = np.array([(d.payload, *d.own_time) for d in definitions], np.int64).reshape(-1, 3)
    layout = np.column_stack((starts[:-1], words, payload_and_time, first_row, senders))
    out = np.zeros(int(starts[-1]), np.uint64)
    groups = tuple(
        Group(
            i,
            definition,
            int(key) >> 8 & 0xFF,
            int(key) & 0xFF,
            definition.crc_extra >= 0,
            out[starts[i] : starts[i + 1]].view(definition.row),
            int(first_row[i]),
        )
        for i, (key, definition) in enumerate(zip(keys, definitions, strict=True))
    )
    return groups, np.ascontiguousarray(layout), out
