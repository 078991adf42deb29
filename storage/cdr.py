"""CDR (and ROS 1) payloads to columns: as a view where all messages share one layout, else by the general way."""

from collections.abc import Mapping

import numpy as np

from ..schemas.columns import Channel, Columns, Table
from ..schemas.definition import MessageType
from ..schemas.layout import CDR2_BE, CDR2_LE, CDR_BE, CDR_LE, ROS1, Layout, Wire, layout
from .collect import Payloads
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
    if int(payloads.size.min()) < HEADER:
        raise PayloadError(int(np.argmin(payloads.size)), "the payload is shorter than CDR's header of 4 bytes")
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
    if payloads.stride is not None:
        shared = _shared_layout(message, wire, payloads)
        if shared is not None and shared.dtype is not None and shared.dtype.itemsize <= payloads.stride - HEADER:
            origin = int(payloads.start[0]) + HEADER
            return np.ndarray((len(payloads),), shared.dtype, payloads.data, origin, (payloads.stride,))
    return _general(message, wire, payloads, HEADER)


def _shared_layout(message: MessageType, wire: Wire, payloads: Payloads) -> Layout | None:
    """The layout of the first message, if all others have its lengths too."""
    start, size = int(payloads.start[0]) + HEADER, int(payloads.size[0]) - HEADER
    try:
        lengths = lengths_of(message, wire, payloads.data[start : start + size].tobytes())
    except ProbeError:
        return None
    laid = layout(message, wire, lengths)
    if laid.size > size:
        return None
    for slot in laid.slots:
        if slot.count is not None:
            words = np.ndarray(
                (len(payloads),), slot.dtype, payloads.data, start + slot.offset, (payloads.stride or 0,)
            )
            if (words != slot.count).any():
                return None
    return laid


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
        part = Payloads(payloads.data, payloads.start[which], payloads.size[which], payloads.time_ns[which], None)
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
    return _general(message, CDR_LE, Payloads(data, start, size, payloads.time_ns, None), HEADER)
