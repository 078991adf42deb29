"""A tape on which tests write MAVLink logs with pymavlink's own packers."""

import struct
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from pymavlink.generator.mavcrc import x25crc

from attlog.ingest import mavlink
from attlog.schemas import Columns, Ingested, IngestOptions, Source

START_US = 1_700_000_000_000_000


class Tape:
    """A telemetry log (or, not ``stamped``, a raw stream) in the making."""

    def __init__(self, *, stamped: bool = True, start_us: int = START_US) -> None:
        self.stamped = stamped
        self.start_us = start_us
        self.data = bytearray()
        self.frames = 0
        self._sequences: dict[tuple[int, int], int] = {}

    def frame(
        self, message: Any, *, system: int = 1, component: int = 1, version: int = 2, signed: bool = False
    ) -> bytes:
        """A packed message with the sender's next sequence number."""
        link = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        link.seq = self._sequences.get((system, component), 0)
        if signed:
            link.signing.secret_key, link.signing.sign_outgoing, link.signing.link_id = b"k" * 32, True, 7
        self._sequences[system, component] = (link.seq + 1) % 256
        return bytes(message.pack(link, force_mavlink1=version == 1))

    def send(self, at_s: float, message: Any, **how: Any) -> bytes:
        """Append a message that arrives ``at_s`` seconds after the tape's start."""
        return self.put(at_s, self.frame(message, **how))

    def put(self, at_s: float, frame: bytes) -> bytes:
        """Append a packed frame."""
        stamp = struct.pack(">Q", self.start_us + round(at_s * 1e6)) if self.stamped else b""
        self.data += stamp + frame
        self.frames += 1
        return frame

    def read(self, **options: Any) -> Ingested:
        """What attlog makes of it."""
        return mavlink.read(self.source(), IngestOptions(**options))

    def source(self) -> Source:
        """The bytes so far."""
        return Source("tape.tlog", np.frombuffer(bytes(self.data), np.uint8))

    @staticmethod
    def channel(ingested: Ingested, topic: str) -> Columns:
        """The channel of a topic."""
        return next(c for c in ingested.columns if c.channel.topic == topic)

    @staticmethod
    def topics(ingested: Ingested, *, unified: bool = True) -> list[str]:
        """The topics, without those that are passed through."""
        topics = [c.channel.topic for c in ingested.columns]
        return [t for t in topics if not (unified and t.startswith("/mavlink/"))]

    @staticmethod
    def unknown(message_id: int, payload: bytes, extra: int) -> bytes:
        """A MAVLink 2 frame of a message that no dialect knows."""
        body = bytes([len(payload), 0, 0, 9, 1, 1, *message_id.to_bytes(3, "little")]) + payload
        return b"\xfd" + body + struct.pack("<H", x25crc(body + bytes([extra])).crc)


@pytest.fixture(scope="session")
def tape() -> type[Tape]:
    """The class itself: tests make as many tapes as they need."""
    return Tape


@pytest.fixture(scope="session")
def messages() -> Any:
    """pymavlink's ardupilotmega dialect."""
    return dialect
