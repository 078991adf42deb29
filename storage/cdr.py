"""CDR (and ROS 1) payloads to columns: as a view where all messages share one layout, else by the general way."""

from collections.abc import Mapping

import numpy as np

from ..schemas.columns import Channel, Columns, Table
from ..schemas.definition import MessageType
from ..schemas.layout import CDR2_BE, CDR2_LE, CDR_BE, CDR_LE, ROS1, Layout, Wire, layout
from .collect import Payloads, Word
from .decode import OverrunError, decode
from .disassemble import disassemble
from .encode import encode, sizes
from .probe import ProbeError, lengths_of
from .ragged import Places, starts, window
from .steps import steps_of

WIRES: Mapping[int, Wire] = {0: CDR_BE, 1: CDR_LE, 6: CDR2_BE, 7: CDR2_LE}
"""Second byte of the encapsulation header -> rules. Parameter lists and XCDR2's delimited form are not ROS 2's."""
HEADER = 4


class PayloadError(ValueError):
    """A message's bytes are not what its type says; ``row`` is the first such."""

    def __init__(self, row: int, what: str) -> None:
        super().__init__(what)
        self.row = row


def supported(message: MessageType) -> bool:
    """False for types with wide strings, whose serialisation differs between ROS 2's middlewares."""
    fields = [*message.fields]
    while fields:
        kind = fields.pop().type
        if kind == "wstring":
            return False
        if isinstance(kind, MessageType):
            fields.extend(kind.fields)
    return True


def read_cdr(message: MessageType, payloads: Payloads) -> Table:
    """The messages as columns; PayloadError for what is no CDR of this type."""
    if len(payloads) == 0:
        return np.zeros(0, message.dtype())
    least = payloads.rows.size if payloads.rows else int(payloads.size.min())
    if least < HEADER:
        raise PayloadError(int(np.argmin(payloads.size)), "the payload is shorter than CDR's header of 4 bytes")
    if payloads.rows is not None and payloads.rows.alike:
        kind = int(payloads.column(0, np.dtype(">u2"))[0])
        return _read(message, _wire(kind, 0), payloads)
    kinds = window(payloads.data, np.dtype(">u2"))[payloads.start].astype(np.int64)
    if (kinds == kinds[0]).all():
        return _read(message, _wire(int(kinds[0]), 0), payloads)
    return _read_mixed(message, payloads, kinds)


def read_ros1(message: MessageType, payloads: Payloads) -> Table:
    """The messages of a ROS 1 channel as columns; PayloadError as for CDR."""
    if len(payloads) == 0:
        return np.zeros(0, message.dtype())
    return _general(message, ROS1, payloads, 0)


def _wire(kind: int, row: int) -> Wire:
    if kind not in WIRES:
        raise PayloadError(row, f"the payload begins with 0x{kind:04x}, which is no plain CDR")
    return WIRES[kind]


def _read(message: MessageType, wire: Wire, payloads: Payloads) -> Table:
    rows = payloads.rows
    if rows is not None and rows.alike:
        shared = _layout_of(message, wire, payloads.data[rows.offset + HEADER : rows.offset + rows.size].tobytes())
        if shared is not None and shared.dtype is not None and shared.dtype.itemsize <= rows.stride - HEADER:
            return payloads.column(HEADER, shared.dtype)
    return _general(message, wire, payloads, HEADER)


def watched(message: MessageType, payload: bytes) -> list[Word]:
    """The words that a payload's layout rests on: byte order and lengths, as `Collector` takes them."""
    if len(payload) < HEADER or payload[0] or payload[1] not in WIRES:
        return []
    laid = _layout_of(message, WIRES[payload[1]], payload[HEADER:])
    lengths = [] if laid is None else [slot for slot in laid.slots if slot.count is not None]
    return [(0, np.dtype("<u2")), *[(HEADER + slot.offset, slot.dtype) for slot in lengths]]


def _layout_of(message: MessageType, wire: Wire, payload: bytes) -> Layout | None:
    try:
        laid = layout(message, wire, lengths_of(message, wire, payload))
    except ProbeError:
        return None
    return laid if laid.size <= len(payload) else None


def _general(message: MessageType, wire: Wire, payloads: Payloads, header: int) -> Table:
    try:
        return decode(message, wire, payloads.data, payloads.start + header, payloads.size - header)
    except OverrunError as error:
        raise PayloadError(error.row, str(error)) from error


def _read_mixed(message: MessageType, payloads: Payloads, kinds: Places) -> Table:
    """Messages of several byte orders: all are brought into the usual one first."""
    data, start, size = payloads.data, payloads.start.copy(), payloads.size.copy()
    for kind in np.unique(kinds).tolist():
        which = np.flatnonzero(kinds == kind)
        wire = _wire(kind, int(which[0]))
        if wire == CDR_LE:
            continue
        part = Payloads(payloads.data, payloads.time_ns[which], (payloads.start[which], payloads.size[which]))
        try:
            table = _general(message, wire, part, HEADER)
        except PayloadError as error:
            raise PayloadError(int(which[error.row]), str(error)) from error
        tree = disassemble(Columns(Channel("", message), part.time_ns, table))
        length = sizes(steps_of(message), CDR_LE, tree, len(which))
        again = np.zeros(int(length.sum()), np.uint8)
        encode(steps_of(message), CDR_LE, tree, again, starts(length))
        start[which], size[which] = len(data) + starts(length) - HEADER, length + HEADER
        data = np.concatenate([data, again])
    return _general(message, CDR_LE, Payloads(data, payloads.time_ns, (start, size)), HEADER)
