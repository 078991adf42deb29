"""Message definitions of a MAVLink dialect, from pymavlink: wire layout, CRC_EXTRA, row dtype, ROS type."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import import_module
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.definition import Field, MessageType
from ...schemas.errors import UsageError
from ...schemas.passthrough import SourceField, generated_type, ros_field_names

PACKAGE: Final = "mavlink_msgs"
DEFAULT_DIALECT: Final = "ardupilotmega"

# MAVLink C type -> (ROS primitive, numpy type code)
C_TYPES: Final = {
    "char": ("char", "u1"),
    "int8_t": ("int8", "i1"),
    "uint8_t": ("uint8", "u1"),
    "int16_t": ("int16", "<i2"),
    "uint16_t": ("uint16", "<u2"),
    "int32_t": ("int32", "<i4"),
    "uint32_t": ("uint32", "<u4"),
    "int64_t": ("int64", "<i8"),
    "uint64_t": ("uint64", "<u8"),
    "float": ("float32", "<f4"),
    "double": ("float64", "<f8"),
}
# (field, C type) that hold a sample's own time -> how the kernel `rows_kernel.gather` reads it
OWN_TIME: Final = {
    ("time_boot_ms", "uint32_t"): 1,
    ("time_usec", "uint64_t"): 2,
    ("usec", "uint64_t"): 2,
    ("time_boot_us", "uint64_t"): 2,
    ("time_usec", "uint32_t"): 3,
}
# Messages whose time field is somebody else's clock, or no time of a sample
NOT_OWN_TIME: Final = frozenset({"PING", "TIMESYNC"})

LEADING: Final = (
    Field("received_us", "uint64", None, "received_us [us] stamp of the telemetry log, repaired where it was lost"),
    Field("sequence", "uint8", None, "sequence of the packet, counted by its sender"),
)
STAMP_BYTES: Final = 8
UNKNOWN_PAYLOAD: Final = 255


@dataclass(frozen=True)
class WireField:
    """A field at its place in the payload; ``length`` None is a scalar."""

    name: str
    c_type: str
    length: int | None
    offset: int
    unit: str

    @property
    def is_text(self) -> bool:
        """Whether the field is ``char[n]``."""
        return self.c_type == "char" and self.length is not None

    @property
    def column(self) -> tuple[str, tuple[int, ...]]:
        """numpy type code and shape."""
        if self.is_text:
            return f"S{self.length}", ()
        return C_TYPES[self.c_type][1], (() if self.length is None else (self.length,))


@dataclass(frozen=True)
class Definition:
    """A message: ``payload`` bytes on the wire with all extensions, fields in the order of the XML."""

    id: int
    name: str
    crc_extra: int
    payload: int
    fields: tuple[WireField, ...]

    @cached_property
    def type(self) -> MessageType:
        """The generated ROS type of the passed-through message."""
        fields = [
            SourceField(
                f.name, "string" if f.is_text else C_TYPES[f.c_type][0], None if f.is_text else f.length, f.unit
            )
            for f in self.fields
        ]
        return generated_type(PACKAGE, self.name, fields, LEADING)

    @property
    def row_size(self) -> int:
        """Bytes of a row: stamp, payload, sequence, padded to 8 so that the base fields lie aligned."""
        return -(-(STAMP_BYTES + self.payload + 1) // 8) * 8

    @cached_property
    def row(self) -> "np.dtype[np.void]":
        """A row as `rows_kernel.gather` lays it out, under the ROS names of `type`."""
        names = ros_field_names([f.name for f in LEADING] + [f.name for f in self.fields])
        columns = [f.column for f in self.fields]
        return np.dtype(
            {
                "names": names,
                "formats": ["<u8", "u1", *columns],
                "offsets": [0, STAMP_BYTES + self.payload, *(STAMP_BYTES + f.offset for f in self.fields)],
                "itemsize": self.row_size,
            }
        )

    @cached_property
    def own_time(self) -> tuple[int, int]:
        """How (a value of OWN_TIME, 0 for none) and where in the payload the message says its own time."""
        if self.name in NOT_OWN_TIME:
            return 0, 0
        found = ((OWN_TIME.get((f.name, f.c_type), 0), f.offset) for f in self.fields if f.length is None)
        return next((pair for pair in found if pair[0]), (0, 0))


@dataclass(frozen=True, eq=False)
class Dialect:
    """All messages of a dialect; ``crc_extra`` is indexed by message id, -1 where the dialect has none."""

    name: str
    crc_extra: NDArray[np.int16]
    module: Any

    def definition(self, message_id: int) -> Definition:
        """The definition of a message that the dialect knows, or one that keeps an unknown message's bytes."""
        return _definition(self.name, message_id)

    def id_of(self, message_name: str) -> int:
        """The id of a message by name, -1 where the dialect has none."""
        return int(getattr(self.module, f"MAVLINK_MSG_ID_{message_name}", -1))


@lru_cache(maxsize=8)
def dialect(name: str = DEFAULT_DIALECT) -> Dialect:
    """Load a dialect of pymavlink's; UsageError where there is none of that name."""
    try:
        module = import_module(f"pymavlink.dialects.v20.{name}")
    except ImportError as error:
        raise UsageError(f"no MAVLink dialect {name!r}: pymavlink has e.g. ardupilotmega, common, all") from error
    known = module.mavlink_map
    crc_extra = np.full(max(known) + 1, -1, np.int16)
    for message_id, message in known.items():
        crc_extra[message_id] = message.crc_extra
    return Dialect(name, crc_extra, module)


@lru_cache(maxsize=4096)
def _definition(dialect_name: str, message_id: int) -> Definition:
    message = dialect(dialect_name).module.mavlink_map.get(message_id)
    if message is None:
        return _unknown(message_id)
    c_types = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    offset, wire = 0, {}
    for name, length in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
        field = WireField(name, c_types[name], length or None, offset, message.fieldunits_by_name.get(name, ""))
        wire[name] = field
        offset += np.dtype(field.column).itemsize
    if offset != message.unpacker.size:
        raise AssertionError(f"{message.msgname}: {offset} bytes of fields, {message.unpacker.size} on the wire")
    fields = tuple(wire[name] for name in message.fieldnames)
    return Definition(message_id, message.msgname, message.crc_extra, offset, fields)


def _unknown(message_id: int) -> Definition:
    payload = WireField("payload", "uint8_t", UNKNOWN_PAYLOAD, 0, "")
    return Definition(message_id, f"UNKNOWN_{message_id}", -1, UNKNOWN_PAYLOAD, (payload,))
