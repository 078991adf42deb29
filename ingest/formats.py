"""The formats that are read, found by content."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module

from ..schemas.errors import InputError
from ..schemas.source import Ingested, IngestOptions, Source

HEAD_BYTES = 65536


@dataclass(frozen=True)
class Format:
    """A format: what it is, and the module of this room that recognises and reads it."""

    name: str
    summary: str
    module: str

    def recognizes(self, head: bytes) -> bool:
        """Whether a file that begins with ``head`` is of this format."""
        return bool(self._call("recognizes")(head))

    def read(self, source: Source, options: IngestOptions) -> Ingested:
        """The source as columns; InputError where nothing of it can be read."""
        result = self._call("read")(source, options)
        assert isinstance(result, Ingested)
        return result

    def _call(self, function: str) -> Callable[..., object]:
        return getattr(import_module(f".{self.module}", __package__), function)  # type: ignore[no-any-return]


FORMATS: Mapping[str, Format] = {
    form.name: form
    for form in (
        Format("dataflash", "ArduPilot DataFlash log, binary (.bin) or text (.log)", "dataflash"),
        Format("ulog", "PX4 ULog (.ulg)", "ulog"),
        Format("mavlink", "MAVLink telemetry log (.tlog) or raw MAVLink 1 and 2 stream", "mavlink"),
    )
}


def recognize(head: bytes, name: str) -> Format:
    """The format of a file that begins with ``head``; InputError names what was tried."""
    for form in FORMATS.values():
        if form.recognizes(head):
            return form
    tried = "; ".join(form.summary for form in FORMATS.values())
    raise InputError(f"{name}: is of no format that attlog reads (begins with {head[:8]!r}; tried: {tried})")


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """Recognise a source and read it."""
    return recognize(source.data[:HEAD_BYTES].tobytes(), source.name).read(source, options or IngestOptions())
