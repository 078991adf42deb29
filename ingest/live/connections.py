"""Bytes from a port: serial by pyserial, MAVLink by pymavlink's connections. Nothing is sent."""

import contextlib
import select
import socket
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from ...schemas.errors import InputError
from .address import SERIAL, Address, Kind

MOST: Final = 65536
ROOM: Final = 8 << 20
"""Bytes that the system is asked to keep for a socket that is not read for a moment."""
WAIT_S: Final = 0.05


class LinkLostError(Exception):
    """The port is gone, or the other side closed it."""


class Connection(Protocol):
    """An open port."""

    def read(self) -> bytes:
        """What has arrived, after waiting a moment for it; LinkLostError where nothing more can come."""
        ...

    def close(self) -> None:
        """Give the port back."""
        ...


class SerialLines:
    """A serial port (or a pseudo-terminal)."""

    def __init__(self, address: Address) -> None:
        import serial

        self._gone = (serial.SerialException, OSError, TypeError)
        self._port: Any = serial.Serial(address.place, address.number, timeout=WAIT_S)

    def read(self) -> bytes:
        try:
            first: bytes = self._port.read(1)
            waiting = self._port.in_waiting if first else 0
            return first + self._port.read(min(waiting, MOST)) if waiting else first
        except self._gone as error:
            raise LinkLostError(str(error)) from error

    def close(self) -> None:
        with contextlib.suppress(*self._gone):
            self._port.close()


class MavlinkPort:
    """A connection that pymavlink opened, read at the port itself: each read is stamped, and no byte is dropped."""

    def __init__(self, address: Address) -> None:
        from pymavlink import mavutil

        where = f"{address.transport}:{address.place}:{address.number}"
        if address.transport == SERIAL:
            self._link: Any = mavutil.mavserial(address.place, baud=address.number)
        else:
            self._link = mavutil.mavlink_connection(where, retries=1, autoreconnect=False)
            with contextlib.suppress(OSError, AttributeError):
                self._link.port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
        self._read: Callable[[], bytes] = _READS[address.transport](self._link)

    def read(self) -> bytes:
        if not select.select([self._link.fd], [], [], WAIT_S)[0]:
            return b""
        try:
            return self._read()
        except BlockingIOError:
            return b""
        except ConnectionRefusedError:  # what an earlier datagram of ours met
            return b""
        except OSError as error:
            raise LinkLostError(error.strerror or str(error)) from error

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._link.close()


def _datagram(link: Any) -> Callable[[], bytes]:
    return lambda: bytes(link.port.recvfrom(MOST)[0])


def _stream(link: Any) -> Callable[[], bytes]:
    def read() -> bytes:
        data = bytes(link.port.recv(MOST))
        if not data:
            raise LinkLostError("the other side closed the connection")
        return data

    return read


def _accepted(link: Any) -> Callable[[], bytes]:
    return lambda: bytes(link.recv(MOST) or b"")


def _port(link: Any) -> Callable[[], bytes]:
    def read() -> bytes:
        data = bytes(link.port.read(MOST))
        if not data:
            raise LinkLostError("the port is gone")
        return data

    return read


_READS: Final[Mapping[str, Callable[[Any], Callable[[], bytes]]]] = {
    "udpin": _datagram,
    "udp": _datagram,
    "tcp": _stream,
    "tcpin": _accepted,
    SERIAL: _port,
}


def connect(address: Address) -> Connection:
    """Open the port; InputError says why it cannot be."""
    try:
        return SerialLines(address) if address.kind is Kind.CSV else MavlinkPort(address)
    except (OSError, ValueError) as error:  # serial.SerialException is an OSError
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{address}: cannot be opened: {reason}; is it there, and not in use?") from error
