"""An MCAP that grows while it is recorded: whatever has been appended outlives the process."""

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ..schemas.columns import Columns
from ..schemas.errors import StorageError
from .chunks_out import ChunkWriter, Outlet
from .compression import codecs
from .contents import Contents, write_end, write_header, write_metadata
from .records import ChannelRecord, SchemaRecord
from .rows import rows_of
from .schedule import schedule
from .sink import Sink
from .writer import LIBRARY, PROFILE, channel_metadata, check, compression_name

BUFFER = 1 << 20


class StreamWriter:
    """Appends columns as chunks. Each chunk begins with its own schemas and channels, so that it can be read alone.

    Until `close` the file has no summary, and `recover` makes it whole. StorageError where ``path`` exists (unless
    ``force``) or the disk refuses.
    """

    def __init__(
        self, path: str | os.PathLike[str], metadata: Mapping[str, Mapping[str, str]] | None = None, force: bool = False
    ) -> None:
        self.path = Path(path)
        self._known: dict[str, tuple[SchemaRecord, ChannelRecord]] = {}
        with self._guard():
            if force and not self.path.is_dir():
                self.path.unlink(missing_ok=True)
            self._file = open(self.path, "xb", buffering=BUFFER)  # noqa: SIM115 - closed by close()
        self._sink = Sink(self._file, self.path)
        self._contents = Contents()
        name = compression_name("zstd")
        self._chunks = ChunkWriter(self._sink, self._contents, name, codecs()[name])
        with self._guard():
            write_header(self._sink, PROFILE, LIBRARY)
            for title, entries in (metadata or {}).items():
                write_metadata(self._sink, self._contents, title, dict(entries))
            self._file.flush()

    @property
    def size(self) -> int:
        """Bytes so far."""
        return self._sink.position

    def append(self, columns: Sequence[Columns]) -> None:
        """Write the messages as a chunk of their own (several where they are large) and hand it to the system."""
        check(columns)
        outlets = [self._outlet(entry) for entry in columns if len(entry)]
        with self._guard():
            self._chunks.write(outlets, schedule([outlet.rows for outlet in outlets]))
            self._file.flush()

    def sync(self) -> None:
        """Make what was appended last through a power cut."""
        with self._guard():
            os.fsync(self._file.fileno())

    def close(self, metadata: Mapping[str, Mapping[str, str]] | None = None) -> None:
        """Complete the file: metadata, summary, everything on the disk."""
        with self._guard():
            for title, entries in (metadata or {}).items():
                write_metadata(self._sink, self._contents, title, dict(entries))
            write_end(self._sink, self._contents)
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()

    def abandon(self) -> None:
        """Leave the file as it is, without a summary."""
        with contextlib.suppress(OSError):
            self._file.close()

    def _outlet(self, entry: Columns) -> Outlet:
        topic = entry.channel.topic
        if topic not in self._known:
            number = len(self._known) + 1
            message = entry.channel.type
            schema = SchemaRecord(number, message.name, "ros2msg", message.text.encode())
            record = ChannelRecord(number, number, topic, "cdr", channel_metadata(entry.channel))
            self._known[topic] = schema, record
        schema, record = self._known[topic]
        return Outlet(schema, record, rows_of(entry, record.id))

    @contextlib.contextmanager
    def _guard(self) -> Iterator[None]:
        try:
            yield
        except FileExistsError as error:
            hint = "choose another name, or overwrite it with --force (force=True)"
            raise StorageError(f"{self.path}: exists already; {hint}") from error
        except OSError as error:
            raise StorageError(f"{self.path}: cannot be written: {error.strerror or error}") from error
