"""Columns to MCAP bytes and back."""

from .annotate import annotate
from .channels import ChannelInfo
from .logfile import LogFile
from .logfile import open_log as open
from .records import Attachment, Statistics
from .recover import Recovery, recover
from .stream import StreamWriter
from .writer import write

__all__ = [
    "Attachment",
    "ChannelInfo",
    "LogFile",
    "Recovery",
    "Statistics",
    "StreamWriter",
    "annotate",
    "open",
    "recover",
    "write",
]
