"""ArduPilot DataFlash logs: binary (.BIN, .bin) and text (.log).

A log defines itself: FMT records say how long each type of record is and what its columns are, FMTU, UNIT and MULT
give units, multipliers and the column that tells one instance from another. docs/dataflash.md says what becomes of it.
"""

from ...schemas import Ingested, IngestOptions, Source

__all__ = ["FORMATS", "read", "recognizes"]

FORMATS = ("dataflash", "dataflash-text")

_BINARY_FMT = b"\xa3\x95\x80"
_TEXT_FMT = b"FMT,"


def recognizes(head: bytes) -> bool:
    """Whether a file that begins with ``head`` (a few kB) is a DataFlash log, binary or text, however it begins."""
    if head.startswith(_BINARY_FMT) or _is_text(head):
        return True
    # A log whose beginning is damaged or cut: an FMT record that describes itself or another type consistently.
    return head.count(_BINARY_FMT) >= 2 or head.count(b"\xa3\x95") >= 16


def _is_text(head: bytes) -> bool:
    return head.startswith(_TEXT_FMT) or (b"\n" + _TEXT_FMT in head and b"\x00" not in head[:256])


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """Everything in the log as columns: unified channels, and every record of every type under ``/dataflash/…``.

    Raises InputError where there is no record to be read.
    """
    from .reader import ingest

    return ingest(source, options or IngestOptions(), text=_is_text(bytes(source.data[:8192])))
