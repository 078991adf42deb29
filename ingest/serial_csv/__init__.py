"""Tables of numbers that a device prints: CSV from an Arduino, an ESP32, an x-IMU, with or without a header.

Columns, units and the clock come from the user, else from the header, else from the numbers; a guess is always shown,
and refused with `CsvOptions.strict`. Every line is a sample or is counted with the reason why not. docs/csv.md says
what is recognised.
"""

import numpy as np

from ...schemas import Ingested, IngestOptions, Source
from .profile import csv_options

__all__ = ["csv_options", "read", "recognizes"]


def recognizes(head: bytes) -> bool:
    """Whether a file that begins with ``head`` is a table of numbers: the least certain of all formats."""
    from .dialect import sniff
    from .text import without_monitor_stamps, without_quotes

    return sniff(without_quotes(without_monitor_stamps(np.frombuffer(head, np.uint8)))) is not None


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """The table as columns: IMU, magnetometer and attitudes, and every other column under ``/csv/{name}``.

    Raises InputError where it holds no data, or where columns, units or times cannot be told.
    """
    from .reader import ingest

    return ingest(source, options or IngestOptions())
