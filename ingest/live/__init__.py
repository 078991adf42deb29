"""Live sources: a serial port that prints lines, or MAVLink over UDP, TCP or a serial port.

What arrives is kept as it is, in pieces with their arrival stamps (`pieces`), cut behind whole lines or frames
(`cutting`), and read by the same ingestors as files (`reading`).
"""

from .address import Address, Kind
from .connections import Connection, connect
from .pieces import TOPIC, Pieces, arrivals_of, from_columns, to_columns
from .reading import Live, read
from .receiver import Receiver

__all__ = [
    "TOPIC",
    "Address",
    "Connection",
    "Kind",
    "Live",
    "Pieces",
    "Receiver",
    "arrivals_of",
    "connect",
    "from_columns",
    "read",
    "to_columns",
]
