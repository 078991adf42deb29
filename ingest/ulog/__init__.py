"""PX4 ULog files (.ulg).

A log defines itself: 'F' messages say what a topic's fields are, 'A' messages which number a topic's instance has in
the file. docs/ulog.md says what becomes of it.
"""

from ...schemas import Ingested, IngestOptions, Source

__all__ = ["read", "recognizes"]

MAGIC = b"ULog\x01\x12\x35"
ENCRYPTED_MAGIC = b"ULogEnc"


def recognizes(head: bytes) -> bool:
    """Whether a file that begins with ``head`` is a ULog file, or an encrypted one (which `read` refuses by name)."""
    return head.startswith((MAGIC, ENCRYPTED_MAGIC))


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """Everything in the log as columns: unified channels, and every message of every topic under ``/ulog/…``.

    ``options`` have nothing to say here: a log is one vehicle's, in SI units. Raises InputError where there is nothing
    to be read, where the log is encrypted, or where its flags say that only those who know them can read it.
    """
    from .reader import ingest

    return ingest(source)
