"""ArduPilot DataFlash logs: binary (.BIN, .bin) and text (.log).

A log defines itself: FMT records say how long each type of record is and what its columns are, FMTU, UNIT and MULT
give units, multipliers and the column that tells one instance from another. docs/dataflash.md says what becomes of it.
"""

from ...schemas import Ingested, IngestOptions, Source

__all__ = ["FORMATS", "read", "recognizes"]

FORMATS = ("dataflash", "dataflash-text")

_HEADER = b"\xa3\x95"
_BINARY_FMT = _HEADER + b"\x80"
_ENOUGH = 8
"""So many records in a row are no chance."""
_TEXT_FMT = b"FMT,"


def recognizes(head: bytes) -> bool:
    """Whether a file that begins with ``head`` (a few kB) is a DataFlash log, binary or text, however it begins."""
    if head.startswith(_BINARY_FMT) or _is_text(head):
        return True
    start = head.find(_BINARY_FMT)
    while start >= 0:
        if _walks(head, start):
            return True
        start = head.find(_BINARY_FMT, start + 1)
    return head.startswith(_HEADER) and head.count(_HEADER) > _ENOUGH


def _walks(head: bytes, at: int) -> bool:
    """Whether records follow each other from the FMT record at ``at`` on, as they do not in what merely holds some."""
    lengths = {0x80: 89}
    count = 0
    while count < _ENOUGH and head[at : at + 2] == _HEADER and at + 5 <= len(head) and head[at + 2] in lengths:
        if head[at + 2] == 0x80:
            lengths[head[at + 3]] = max(head[at + 4], 3)
        at += lengths[head[at + 2]]
        count += 1
    return count == _ENOUGH


def _is_text(head: bytes) -> bool:
    return head.startswith(_TEXT_FMT) or (b"\n" + _TEXT_FMT in head and b"\x00" not in head[:256])


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """Everything in the log as columns: unified channels, and every record of every type under ``/dataflash/…``.

    Raises InputError where there is no record to be read.
    """
    from .reader import ingest

    return ingest(source, options or IngestOptions(), text=_is_text(bytes(source.data[:8192])))
