"""How wrong an attitude estimate is: errors against a reference, their statistics, tables and channels."""

from .alignment import Alignment, ConstantRotation
from .channels import error_columns
from .error import AttitudeError, Counts, ErrorOptions, attitude_error, default_alignment
from .summary import COMPONENTS, Statistics, statistics
from .table import ErrorRow, ErrorTable

__all__ = [
    "COMPONENTS",
    "Alignment",
    "AttitudeError",
    "ConstantRotation",
    "Counts",
    "ErrorOptions",
    "ErrorRow",
    "ErrorTable",
    "Statistics",
    "attitude_error",
    "default_alignment",
    "error_columns",
    "statistics",
]
