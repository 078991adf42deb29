"""Columns to MCAP bytes and back."""

from .logfile import ChannelInfo, LogFile
from .logfile import open_log as open
from .records import Attachment, Statistics
from .writer import write

__all__ = ["Attachment", "ChannelInfo", "LogFile", "Statistics", "open", "write"]
