"""Writing and reading MCAP against other Python packages, by CPU time, in the same process.

1 M Imu at 1 kHz and 250 k MagneticField. A peer that builds messages one by one does a fraction of them, and its time
is scaled. Every figure is the best of some repeats.
"""

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from attlog import storage
from attlog.schemas import Columns
from attlog.schemas.unified import imu_columns, mag_columns

from .row import Row, cpu_seconds

IMU_COUNT = 1_000_000
MAG_EVERY = 4
FRACTION = 25
"""Peers that work message by message do one message of so many."""
REPEATS = 5
START_NS = 1_700_000_000_000_000_000
WORK = "1 M Imu + 250 k MagneticField"
SCALED = f", 1/{FRACTION} scaled"


def channels(count: int = IMU_COUNT) -> list[Columns]:
    """An IMU at 1 kHz that turns and shakes, with sensor noise, and a magnetometer at a quarter of its rate."""
    random = np.random.default_rng(1)
    time_ns = START_NS + np.arange(count) * 1_000_000
    phase = np.arange(count)[:, None] * 1e-3 * np.array([1.0, 1.3, 0.7])
    rate = np.sin(phase) + random.normal(0, 0.01, (count, 3))
    force = 9.81 * np.cos(phase) + random.normal(0, 0.1, (count, 3))
    field = 5e-5 * np.cos(phase[::MAG_EVERY]) + random.normal(0, 1e-7, (len(phase[::MAG_EVERY]), 3))
    imu = imu_columns("/imu0/data_raw", time_ns, rate, force, source="benchmark")
    return [imu, mag_columns("/mag0/field", time_ns[::MAG_EVERY], field, source="benchmark")]


def rows() -> Iterator[Row]:
    """Three rows of writing, two of reading."""
    with tempfile.TemporaryDirectory() as folder:
        yield from write_rows(Path(folder))
        yield from read_rows(Path(folder))


def write_rows(folder: Path) -> Iterator[Row]:
    """Writing with zstd, level 3."""
    whole, part = channels(), channels(IMU_COUNT // FRACTION)
    path = folder / "attlog.mcap"
    own = cpu_seconds(partial(storage.write, path, whole, force=True), REPEATS)
    work = f"write {WORK}, zstd 3"
    messages = list(_messages(part))
    peer = cpu_seconds(partial(_write_ros2, folder / "ros2.mcap", part, messages), 3)
    yield Row(work, f"mcap + mcap-ros2-support writer{SCALED}", peer * FRACTION / own, 45)
    payloads = list(_payloads(path))
    peer = cpu_seconds(partial(_write_mcap, folder / "mcap.mcap", whole, payloads), 2)
    yield Row(work, "mcap add_message, prebuilt bytes", peer / own, 6)
    peer = cpu_seconds(partial(_write_foxglove, folder / "foxglove.mcap", whole, payloads), 3)
    yield Row(work, "foxglove-sdk raw channel, prebuilt bytes", peer / own, 2)


def read_rows(folder: Path) -> Iterator[Row]:
    """Reading to columns, CRCs checked."""
    for compression, target in (("zstd", 110.0), ("lz4", 200.0)):
        whole, part = folder / f"whole_{compression}.mcap", folder / f"part_{compression}.mcap"
        storage.write(whole, channels(), compression=compression)
        storage.write(part, channels(IMU_COUNT // FRACTION), compression=compression)
        own = cpu_seconds(partial(_read, whole), REPEATS)
        peer = cpu_seconds(partial(_decode, part), 3) * FRACTION
        yield Row(f"read {WORK}, {compression}", f"mcap + mcap-ros2-support decoder{SCALED}", peer / own, target)


def _read(path: Path) -> dict[str, Columns]:
    with storage.open(path) as log:
        return log.read()


def _decode(path: Path) -> int:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    count = 0
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _ in reader.iter_decoded_messages():
            count += 1
    return count


def _payloads(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Channel number, log time and serialised message, as the peers get them ready made."""
    from mcap.reader import make_reader

    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            yield int(channel.topic == "/mag0/field"), message.log_time, message.data


def _messages(columns: list[Columns]) -> Iterator[tuple[int, int, SimpleNamespace]]:
    """The same as message objects, in order of time."""
    zero = np.zeros(9).tolist()
    no_turn = SimpleNamespace(x=0.0, y=0.0, z=0.0, w=0.0)
    unknown = [-1.0, *zero[1:]]
    imu, mag = columns
    fields = iter(_vectors(mag))
    turns, forces = _vectors(imu, "angular_velocity"), _vectors(imu, "linear_acceleration")
    for row, (time_ns, turn, force) in enumerate(zip(imu.time_ns.tolist(), turns, forces, strict=True)):
        header = SimpleNamespace(
            stamp=SimpleNamespace(sec=time_ns // 10**9, nanosec=time_ns % 10**9), frame_id="base_link"
        )
        yield (
            0,
            time_ns,
            SimpleNamespace(
                header=header,
                orientation=no_turn,
                orientation_covariance=unknown,
                angular_velocity=turn,
                angular_velocity_covariance=zero,
                linear_acceleration=force,
                linear_acceleration_covariance=zero,
            ),
        )
        if row % MAG_EVERY == 0:
            yield (
                1,
                time_ns,
                SimpleNamespace(header=header, magnetic_field=next(fields), magnetic_field_covariance=zero),
            )


def _vectors(columns: Columns, name: str = "magnetic_field") -> list[SimpleNamespace]:
    return [SimpleNamespace(x=x, y=y, z=z) for x, y, z in columns.data[name].tolist()]


def _write_ros2(path: Path, columns: list[Columns], messages: list[tuple[int, int, SimpleNamespace]]) -> None:
    from mcap_ros2.writer import Writer

    with path.open("wb") as file, Writer(file) as writer:
        types = [entry.channel.type for entry in columns]
        schemas = [writer.register_msgdef(kind.name, kind.text) for kind in types]
        topics = [entry.channel.topic for entry in columns]
        for number, time_ns, message in messages:
            writer.write_message(topics[number], schemas[number], message, time_ns, time_ns)


def _write_mcap(path: Path, columns: list[Columns], payloads: list[tuple[int, int, bytes]]) -> None:
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        ids = []
        for entry in columns:
            schema = writer.register_schema(entry.channel.type.name, "ros2msg", entry.channel.type.text.encode())
            ids.append(writer.register_channel(entry.channel.topic, "cdr", schema))
        for number, time_ns, data in payloads:
            writer.add_message(ids[number], time_ns, data, time_ns)
        writer.finish()  # type: ignore[no-untyped-call]


def _write_foxglove(path: Path, columns: list[Columns], payloads: list[tuple[int, int, bytes]]) -> None:
    import foxglove
    from foxglove import Channel, Context, Schema

    context = Context()
    made = []
    for entry in columns:
        kind = entry.channel.type
        schema = Schema(name=kind.name, encoding="ros2msg", data=kind.text.encode())
        made.append(Channel(entry.channel.topic, message_encoding="cdr", schema=schema, context=context))
    with foxglove.open_mcap(str(path), allow_overwrite=True, context=context):
        for number, time_ns, data in payloads:
            made[number].log(data, log_time=time_ns)
