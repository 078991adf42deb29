"""One file for each source: its bytes to columns, and everything skipped is counted."""

from .formats import FORMATS, Format, read, recognize, recognize_folder, source_of

__all__ = ["FORMATS", "Format", "read", "recognize", "recognize_folder", "source_of"]
