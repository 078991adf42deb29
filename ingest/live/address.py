"""How a live source is spelled: ``serial:/dev/ttyUSB0:115200``, ``mavlink:udpin:0.0.0.0:14550``."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from ...schemas.errors import UsageError

BAUD: Final = 115200
NETWORK: Final = ("udpin", "udp", "tcp", "tcpin")
SERIAL: Final = "serial"
EXAMPLES: Final = (
    "serial:/dev/ttyUSB0:115200 (CSV lines), mavlink:udpin:0.0.0.0:14550, mavlink:tcp:127.0.0.1:5760, "
    "mavlink:tcpin:0.0.0.0:5760 or mavlink:serial:/dev/ttyACM0:57600"
)


class Kind(StrEnum):
    """What arrives: the name of the format that reads it."""

    CSV = "csv"
    MAVLINK = "mavlink"


@dataclass(frozen=True)
class Address:
    """``transport`` is serial, udpin, udp, tcp or tcpin; ``place`` a device or a host; ``number`` its baud or port."""

    kind: Kind
    transport: str
    place: str
    number: int

    def __str__(self) -> str:
        prefix = "" if self.kind is Kind.CSV else f"{self.kind}:"
        return f"{prefix}{self.transport}:{self.place}:{self.number}"

    @classmethod
    def parse(cls, spelled: str) -> "Address":
        """The address; UsageError says how one is spelled."""
        kind, rest = Kind.CSV, spelled
        if spelled.startswith("mavlink:"):
            kind, rest = Kind.MAVLINK, spelled.removeprefix("mavlink:")
        transport, _, place = rest.partition(":")
        place, number = _split(place)
        if not place or transport not in (SERIAL, *(NETWORK if kind is Kind.MAVLINK else ())):
            raise UsageError(f"{spelled!r} is no live source; give {EXAMPLES}")
        if number is None and transport != SERIAL:
            raise UsageError(f"{spelled!r} names no port; give {EXAMPLES}")
        if transport in NETWORK and number is not None and not 0 < number < 65536:
            raise UsageError(f"{spelled!r}: {number} is no port; there are 1 to 65535")
        if ":" in place and transport in NETWORK:
            raise UsageError(f"{spelled!r}: {place!r} is no host; give a name or an IPv4 address")
        return cls(kind, transport, place, BAUD if number is None else number)


def _split(place: str) -> tuple[str, int | None]:
    head, _, tail = place.rpartition(":")
    return (head, int(tail)) if head and tail.isdecimal() else (place, None)
