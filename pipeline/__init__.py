"""The calls behind the verbs of the command line."""

from .align import align
from .analyze import analyze
from .annotate import annotate
from .convert import convert
from .estimate import estimate
from .export import export
from .info import info
from .record import record
from .recover import recover
from .run import run
from .simulate import simulate
from .verbs import for_each

__all__ = [
    "align",
    "analyze",
    "annotate",
    "convert",
    "estimate",
    "export",
    "for_each",
    "info",
    "record",
    "recover",
    "run",
    "simulate",
]
