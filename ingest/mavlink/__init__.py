"""MAVLink: telemetry logs (.tlog) and raw streams, versions 1 and 2."""

from ...schemas.source import Ingested, IngestOptions, Source
from .recognize import recognizes

__all__ = ["read", "recognizes"]


def read(source: Source, options: IngestOptions) -> Ingested:
    """See `attlog.ingest.mavlink.reader.read`; imported late, since it needs Numba."""
    from .reader import read as read_

    return read_(source, options)
