"""The calls behind the verbs of the command line."""

from .analyze import analyze
from .annotate import annotate
from .convert import convert
from .estimate import estimate
from .info import info
from .record import record
from .recover import recover
from .run import run
from .simulate import simulate
from .verbs import for_each

__all__ = ["analyze", "annotate", "convert", "estimate", "for_each", "info", "record", "recover", "run", "simulate"]
