"""MCAPs of other writers as inputs: rosbags' bags, mcap-ros2-support's CDR, ROS 1, JSON; what is not ours stays."""

import json
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

import attlog
from attlog import storage
from attlog.geometry.quaternions import conjugate, multiply
from attlog.ingest.simulation import SimulatedRun, simulate, write
from attlog.pipeline.logs import load
from attlog.schemas import InputError, MessageType, Recording, UsageError
from attlog.schemas.messages import IMU, MAGNETIC_FIELD, standard

LATENCY_NS = 3_000_000
POSE = "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"
Row = tuple[int, dict[str, Any]]
Write = Callable[[Path, list[tuple[str, str, list[Row]]]], Path]


@pytest.fixture(scope="module")
def flown() -> SimulatedRun:
    return simulate("flight", 3)


def _xyz(values: np.ndarray, axes: str = "xyz") -> dict[str, float]:
    return dict(zip(axes, values.tolist(), strict=True))


def _header(time_ns: int, frame: str) -> dict[str, Any]:
    return {"stamp": {"sec": time_ns // 10**9, "nanosec": time_ns % 10**9}, "frame_id": frame}


def _imu_rows(run: SimulatedRun, orientation: bool = False, step: int = 1) -> list[Row]:
    imu = run.imu
    zeros = [0.0] * 9
    rows = []
    for n in range(0, len(imu.time_ns), step):
        t = int(imu.time_ns[n])
        q = run.reference.orientation[n] if orientation else np.array([0.0, 0.0, 0.0, 1.0])
        rows.append(
            (
                t + LATENCY_NS,
                {
                    "header": _header(t, "phone"),
                    "orientation": _xyz(q, "xyzw"),
                    "orientation_covariance": zeros if orientation else [-1.0, *zeros[1:]],
                    "angular_velocity": _xyz(imu.angular_velocity[n]),
                    "angular_velocity_covariance": zeros,
                    "linear_acceleration": _xyz(imu.specific_force[n]),
                    "linear_acceleration_covariance": zeros,
                },
            )
        )
    return rows


def _mag_rows(run: SimulatedRun) -> list[Row]:
    mag = run.magnetometer
    return [
        (
            int(t) + LATENCY_NS,
            {
                "header": _header(int(t), "phone"),
                "magnetic_field": _xyz(mag.field[n]),
                "magnetic_field_covariance": [0.0] * 9,
            },
        )
        for n, t in enumerate(mag.time_ns)
    ]


def _pose_rows(run: SimulatedRun) -> list[Row]:
    truth = run.reference
    origin = {"x": 0.0, "y": 0.0, "z": 0.0}
    return [
        (
            int(t) + LATENCY_NS,
            {
                "header": _header(int(t), "vicon"),
                "pose": {"position": origin, "orientation": _xyz(truth.orientation[n], "xyzw")},
            },
        )
        for n, t in enumerate(truth.time_ns)
    ]


def _transform_rows(run: SimulatedRun, frames: tuple[str, ...]) -> list[Row]:
    truth = run.reference
    origin = {"x": 0.0, "y": 0.0, "z": 0.0}
    rows = []
    for n, t in enumerate(truth.time_ns):
        turned = {"translation": origin, "rotation": _xyz(truth.orientation[n], "xyzw")}
        one = [{"header": _header(int(t), "map"), "child_frame_id": frame, "transform": turned} for frame in frames]
        rows.append((int(t) + LATENCY_NS, {"transforms": one}))
    return rows


def _pose_type() -> MessageType:
    tf = standard("tf2_msgs/msg/TFMessage").text
    text = f"std_msgs/Header header\ngeometry_msgs/Pose pose\n{'=' * 80}\nMSG: geometry_msgs/Pose\n{POSE}"
    rest = tf[tf.index("=" * 80) :]
    point = f"{'=' * 80}\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
    return MessageType.parse("geometry_msgs/msg/PoseStamped", text + point + rest)


TYPES = {
    "sensor_msgs/msg/Imu": IMU,
    "sensor_msgs/msg/MagneticField": MAGNETIC_FIELD,
    "geometry_msgs/msg/PoseStamped": _pose_type(),
    "tf2_msgs/msg/TFMessage": standard("tf2_msgs/msg/TFMessage"),
}


def write_ros2(path: Path, channels: list[tuple[str, str, list[Row]]]) -> Path:
    """By mcap-ros2-support."""
    with path.open("wb") as file:
        writer = Ros2Writer(file)
        for topic, kind, rows in channels:
            schema = writer.register_msgdef(kind, TYPES[kind].text)
            for time_ns, row in rows:
                writer.write_message(topic, schema, row, time_ns, time_ns)
        writer.finish()
    return path


def write_bag(path: Path, channels: list[tuple[str, str, list[Row]]]) -> Path:
    """By rosbags: a folder with metadata.yaml and one MCAP."""
    types = get_typestore(Stores.ROS2_HUMBLE)

    def message(kind: str, value: Any) -> Any:
        fields = types.get_msgdef(kind).fields
        return types.types[kind](**{name: _member(part, value[name]) for name, part in fields})

    def _member(part: Any, value: Any) -> Any:
        node, detail = part
        if node.name == "NAME":
            return message(detail, value)
        if node.name == "BASE":
            return value
        inner = detail[0]
        if inner[0].name == "NAME":
            return [message(inner[1], item) for item in value]
        return np.array(value)

    with BagWriter(path.with_suffix(""), version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, kind, rows in channels:
            connection = writer.add_connection(topic, kind, typestore=types)
            for time_ns, row in rows:
                writer.write(connection, time_ns, types.serialize_cdr(message(kind, row), kind))
    (made,) = path.with_suffix("").glob("*.mcap")
    return made


def write_json(path: Path, channels: list[tuple[str, str, list[Row]]]) -> Path:
    """By mcap's own writer, with the keys in another order."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("")
        for topic, kind, rows in channels:
            schema = writer.register_schema(kind, "jsonschema", b'{"type": "object"}')
            channel = writer.register_channel(topic, "json", schema)
            for time_ns, row in rows:
                writer.add_message(channel, time_ns, json.dumps(row, sort_keys=True).encode(), time_ns)
        writer.finish()
    return path


def write_ros1(path: Path, channels: list[tuple[str, str, list[Row]]]) -> Path:
    """ROS 1 serialisation by hand."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros1")
        for topic, kind, rows in channels:
            text = TYPES[kind].text.replace("builtin_interfaces/Time stamp", "uint32 seq\ntime stamp")
            text = text.replace("MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec", "MSG: none/None\nint8 none")
            schema = writer.register_schema(kind.replace("/msg", ""), "ros1msg", text.encode())
            channel = writer.register_channel(topic, "ros1", schema)
            for time_ns, row in rows:
                writer.add_message(channel, time_ns, b"".join(_ros1(row)), time_ns)
        writer.finish()
    return path


def _ros1(row: Any) -> Iterator[bytes]:
    if isinstance(row, dict):
        if "frame_id" in row:
            stamp, name = row["stamp"], row["frame_id"].encode()
            yield struct.pack("<IIII", 7, stamp["sec"], stamp["nanosec"], len(name)) + name
            return
        for value in row.values():
            yield from _ros1(value)
    elif isinstance(row, list):
        if row and isinstance(row[0], dict):
            yield struct.pack("<I", len(row))
        for value in row:
            yield from _ros1(value)
    elif isinstance(row, str):
        yield struct.pack("<I", len(row)) + row.encode()
    else:
        yield struct.pack("<d", row)


WRITERS: dict[str, Write] = {"ros2": write_ros2, "rosbags": write_bag, "json": write_json, "ros1": write_ros1}


def _main(path: Path, *topics: str) -> Recording:
    with storage.open(path) as log:
        return load(log, topics).vehicles[""]


@pytest.mark.parametrize("writer", WRITERS)
def test_every_writers_samples_are_what_was_written(writer: str, flown: SimulatedRun, tmp_path: Path) -> None:
    channels = [
        ("/phone/imu", "sensor_msgs/msg/Imu", _imu_rows(flown)),
        ("/phone/mag", "sensor_msgs/msg/MagneticField", _mag_rows(flown)),
        ("/vicon/drone/pose", "geometry_msgs/msg/PoseStamped", _pose_rows(flown)),
        ("/robot/tf", "tf2_msgs/msg/TFMessage", _transform_rows(flown, ("drone",))),
    ]
    path = WRITERS[writer](tmp_path / "log.mcap", channels)
    found = _main(path)
    assert (found.imu[0].time_ns == flown.imu.time_ns).all()  # header.stamp, not the log time
    assert (found.imu[0].angular_velocity == flown.imu.angular_velocity).all()
    assert (found.imu[0].specific_force == flown.imu.specific_force).all()
    assert (found.mag[0].field == flown.magnetometer.field).all()
    assert found.reference is not None
    assert found.reference.topic == "/vicon/drone/pose"
    assert found.reference.metadata["frame"] == "vicon"
    assert set(found.onboard) == {"robot_tf"}
    for attitude in (found.reference, found.onboard["robot_tf"]):
        assert (attitude.time_ns == flown.reference.time_ns).all()
        assert np.abs(attitude.orientation - flown.reference.orientation).max() < 1e-12


def _payloads(path: Path) -> dict[str, list[tuple[int, int, bytes]]]:
    found: dict[str, list[tuple[int, int, bytes]]] = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            found.setdefault(channel.topic, []).append((message.log_time, message.publish_time, message.data))
    return found


def _definitions(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return {
        c.topic: (c.message_encoding, c.metadata, summary.schemas[c.schema_id].name, summary.schemas[c.schema_id].data)
        for c in summary.channels.values()
    }


def test_estimate_and_analyze_in_place_leave_the_rest_as_it_was(flown: SimulatedRun, tmp_path: Path) -> None:
    path = write_ros2(
        tmp_path / "log.mcap",
        [
            ("/phone/imu", "sensor_msgs/msg/Imu", _imu_rows(flown)),
            ("/phone/mag", "sensor_msgs/msg/MagneticField", _mag_rows(flown)),
            ("/vicon/pose", "geometry_msgs/msg/PoseStamped", _pose_rows(flown)),
            ("/tf", "tf2_msgs/msg/TFMessage", _transform_rows(flown, ("a", "b"))),
        ],
    )
    before, definitions = _payloads(path), _definitions(path)
    estimated = attlog.estimate(path, ["ecf"], declination=flown.scenario.place.declination_deg)
    assert "/phone/imu is imu0" in estimated.to_text()
    analyzed = attlog.analyze(path, alignment="none")
    native = tmp_path / "native.mcap"
    write(flown, native)
    attlog.estimate(native, ["ecf"], declination=flown.scenario.place.declination_deg)
    assert analyzed.table["ecf"].statistics == attlog.analyze(native).table["ecf"].statistics
    after = _payloads(path)
    assert {topic: after[topic] for topic in before} == before
    assert {topic: d for topic, d in _definitions(path).items() if topic in definitions} == definitions
    assert {"/estimate/ecf/attitude", "/error/ecf/attitude", "/attlog/tf"} <= set(after)
    with storage.open(path) as log:
        assert log.profile == "ros2"
        about = log.topics["/estimate/ecf/attitude"].metadata
    assert len(about["input_sha256./phone/imu"]) == 64
    attlog.estimate(path, ["ecf"])
    assert {topic: _payloads(path)[topic] for topic in before} == before


def test_the_choice_between_several_is_asked_for_and_remembered(flown: SimulatedRun, tmp_path: Path) -> None:
    rows = _imu_rows(flown, step=2)
    path = write_ros2(tmp_path / "log.mcap", [(f"/{name}/imu", "sensor_msgs/msg/Imu", rows) for name in "ab"])
    with pytest.raises(InputError, match="--topic imu=/a/imu"):
        attlog.estimate(path, ["ecf"])
    attlog.estimate(path, ["ecf"], topics=["imu=/b/imu", "imu1=/a/imu"])
    found = _main(path)
    assert {number: imu.topic for number, imu in found.imu.items()} == {0: "/b/imu", 1: "/a/imu"}


def test_an_imus_own_orientation_is_an_onboard_attitude(flown: SimulatedRun, tmp_path: Path) -> None:
    path = write_ros2(tmp_path / "log.mcap", [("/imu/data", "sensor_msgs/msg/Imu", _imu_rows(flown, True))])
    found = _main(path)
    assert list(found.onboard) == ["imu_data"]
    known = len(flown.imu.time_ns)
    turned = multiply(conjugate(found.onboard["imu_data"].orientation), flown.reference.orientation[:known])
    assert np.abs(turned[:, :3]).max() < 1e-12
    chosen = _main(path, "reference=/imu/data")
    assert chosen.reference is not None
    assert chosen.onboard == {}


def test_a_tree_of_transforms_needs_its_frame(flown: SimulatedRun, tmp_path: Path) -> None:
    rows = _transform_rows(flown, ("a", "b"))
    path = write_ros2(tmp_path / "log.mcap", [("/tf", "tf2_msgs/msg/TFMessage", rows)])
    with storage.open(path) as log:
        assert load(log).vehicles == {}
    found = _main(path, "reference=/tf:b", "onboard_slam=/tf:a")
    assert found.reference is not None
    assert found.reference.metadata["child_frame"] == "b"
    assert list(found.onboard) == ["slam"]
    with pytest.raises(UsageError, match="several frames"):
        _main(path, "reference=/tf")
    with pytest.raises(UsageError, match="no such frame"):
        _main(path, "reference=/tf:c")


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("imu", "ROLE=TOPIC"),
        ("wheel=/phone/imu", "ROLE=TOPIC"),
        ("imu=/absent", "no topic /absent"),
        ("mag=/phone/imu", "no mag0"),
    ],
)
def test_a_choice_that_cannot_be_is_told(said: str, message: str, flown: SimulatedRun, tmp_path: Path) -> None:
    path = write_ros2(tmp_path / "log.mcap", [("/phone/imu", "sensor_msgs/msg/Imu", _imu_rows(flown)[:50])])
    with pytest.raises(UsageError, match=message):
        _main(path, said)


def test_stamps_of_another_epoch_keep_their_spacing(flown: SimulatedRun, tmp_path: Path) -> None:
    rows = _imu_rows(flown)[:500]
    boot = rows[0][0] - 5_000_000_000
    random = np.random.default_rng(0)
    delayed = [(t + int(random.integers(0, 8_000_000)), {**row, "header": _header(t - boot, "x")}) for t, row in rows]
    delayed.sort(key=lambda entry: entry[0])
    path = write_ros2(tmp_path / "log.mcap", [("/imu", "sensor_msgs/msg/Imu", delayed)])
    found = _main(path).imu[0]
    assert (np.diff(found.time_ns) == np.diff(flown.imu.time_ns[:500])).all()
    assert 0 <= int(found.time_ns[0] - flown.imu.time_ns[0]) - LATENCY_NS < 1_000_000


def test_a_wild_stamp_does_not_move_the_others(flown: SimulatedRun, tmp_path: Path) -> None:
    rows = _imu_rows(flown)[:200]
    rows[50] = (rows[50][0], {**rows[50][1], "header": _header(10**18 * 2, "x")})
    path = write_ros2(tmp_path / "log.mcap", [("/imu", "sensor_msgs/msg/Imu", rows)])
    with storage.open(path) as log:
        loaded = load(log)
    stamps = loaded.vehicles[""].imu[0].time_ns
    expected = flown.imu.time_ns[:200].copy()
    expected[50] += LATENCY_NS
    assert (stamps == expected).all()
    assert "1 of its stamps, hours from the others" in loaded.remarks[0]


def test_foxgloves_json(flown: SimulatedRun, tmp_path: Path) -> None:
    truth = flown.reference
    rows: dict[str, list[Row]] = {"foxglove.PoseInFrame": [], "foxglove.FrameTransforms": []}
    for n, t in enumerate(truth.time_ns.tolist()):
        stamp = {"sec": t // 10**9, "nsec": t % 10**9}
        q = _xyz(truth.orientation[n], "xyzw")
        pose = {"timestamp": stamp, "frame_id": "map", "pose": {"position": {}, "orientation": q}}
        one = {"timestamp": stamp, "parent_frame_id": "map", "child_frame_id": "base", "rotation": q}
        rows["foxglove.PoseInFrame"].append((t + 5, pose))
        rows["foxglove.FrameTransforms"].append((t + 5, {"transforms": [one]}))
    path = write_json(tmp_path / "log.mcap", [(f"/{name[-5:]}", name, values) for name, values in rows.items()])
    found = _main(path)
    assert set(found.onboard) == {"Frame", "forms"}
    for attitude in found.onboard.values():
        assert (attitude.time_ns == truth.time_ns).all()
        assert np.abs(attitude.orientation - truth.orientation).max() < 1e-12
        assert attitude.metadata["frame"] == "map"


@pytest.mark.parametrize("name", ["rosbag2_cdr_test.mcap", "bagel_part_0.mcap", "foxglove_json_logs.mcap"])
def test_real_files_of_other_writers_stay_byte_identical(name: str, logs: Path, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes((logs / name).read_bytes())
    before, definitions = _payloads(path), _definitions(path)
    with storage.open(path) as log:
        profile, library = log.profile, log.library
    attlog.annotate(path, "looked at", at="0s")
    after = _payloads(path)
    assert {topic: after[topic] for topic in before} == before
    assert {topic: d for topic, d in _definitions(path).items() if topic in definitions} == definitions
    assert len(after["/annotations"]) == 1
    with storage.open(path) as log:
        assert (log.profile, log.library) == (profile, library)
    with pytest.raises(InputError, match="no IMU"):
        attlog.estimate(path)


def test_units_that_ros_does_not_have_are_pointed_out(flown: SimulatedRun, tmp_path: Path) -> None:
    rows = _mag_rows(flown)[:100]
    for _, row in rows:
        row["magnetic_field"] = {axis: 1e6 * value for axis, value in row["magnetic_field"].items()}
    path = write_ros2(tmp_path / "log.mcap", [("/mag", "sensor_msgs/msg/MagneticField", rows)])
    with storage.open(path) as log:
        told = "\n".join(load(log).remarks)
    assert "cannot be tesla" in told


def test_the_command_line_takes_bags(flown: SimulatedRun, tmp_path: Path) -> None:
    bag = write_bag(
        tmp_path / "bag",
        [
            ("/a/imu", "sensor_msgs/msg/Imu", _imu_rows(flown)),
            ("/b/imu", "sensor_msgs/msg/Imu", _imu_rows(flown)),
            ("/body/pose", "geometry_msgs/msg/PoseStamped", _pose_rows(flown)),
        ],
    )

    def call(*words: str) -> "subprocess.CompletedProcess[str]":
        program = str(Path(sys.executable).with_name("attlog"))
        return subprocess.run([program, *words], cwd=tmp_path, capture_output=True, text=True, check=False)

    refused = call("run", str(bag))
    assert refused.returncode == 1
    assert "--topic imu=/a/imu" in refused.stderr
    assert call("estimate", "bag", "--topic", "imu=/c/imu").returncode == 2
    assert call("run", "flight.tlog", "--topic", "imu=/a/imu").returncode != 0
    done = call("run", str(bag), "-e", "ecf", "--topic", "imu=/a/imu", "--topic", "reference=/body/pose")
    assert done.returncode == 0, done.stderr
    assert "/body/pose is reference" in done.stdout
    aligned = call("align", "bag", "--json")
    assert aligned.returncode == 0, aligned.stderr
    told = json.loads(aligned.stdout)[0]["alignment"]
    assert told["clock"] == "/body/pose"
    assert abs(told["offset_s"]) < 1e-3
    analyzed = call("analyze", "bag")
    assert "clock aligned: /body/pose" in analyzed.stdout
