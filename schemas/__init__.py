"""What a channel holds: message types as one definition each, and the types that a log becomes in memory."""

from .columns import Channel, Columns
from .csv_options import AttitudeColumns, CsvOptions, World
from .definition import Constant, Field, MessageType
from .errors import AttlogError, InputError, MissingSensorError, StorageError, UsageError
from .estimate import Estimate, North, Status
from .finding import Finding, Kind, Note, Severity
from .recording import Attitude, Declination, Fix, Imu, Magnetometer, Recording, Segment
from .sensors import PROFILES, SensorProfile
from .source import Completeness, Ingested, IngestOptions, Source

__all__ = [
    "PROFILES",
    "AttlogError",
    "Attitude",
    "AttitudeColumns",
    "Channel",
    "Columns",
    "Completeness",
    "Constant",
    "CsvOptions",
    "Declination",
    "Estimate",
    "Field",
    "Finding",
    "Fix",
    "Imu",
    "IngestOptions",
    "Ingested",
    "InputError",
    "Kind",
    "Magnetometer",
    "MessageType",
    "MissingSensorError",
    "North",
    "Note",
    "Recording",
    "Segment",
    "SensorProfile",
    "Severity",
    "Source",
    "Status",
    "StorageError",
    "UsageError",
    "World",
]
