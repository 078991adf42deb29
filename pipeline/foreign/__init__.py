"""Channels that other software wrote, as a recording's sensors and attitudes."""

from .choice import Adopted, adopt

__all__ = ["Adopted", "adopt"]
