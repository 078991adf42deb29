"""A ULog as an MCAP, read back by the official reader and its ROS 2 decoder."""

from collections import defaultdict

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

import attlog
from attlog import ingest as formats
from attlog.schemas.passthrough import source_names


@pytest.fixture(scope="module")
def decoded():
    """Topic -> decoded messages, CRCs checked."""

    def call(path):
        found = defaultdict(list)
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _, channel, message, ros in reader.iter_decoded_messages():
                found[channel.topic].append((message.log_time, ros))
        return found

    return call


def test_a_synthetic_log(writer, decoded, tmp_path):
    log = writer(1_000_000).format("inner:uint8_t a;bool[2] b;").info("sys_name", "PX4")
    log.format("2odd__Name:uint64_t timestamp;inner[2] _part;char[6] Text;double header;uint8_t[3] _padding0;")
    log.add(4, "2odd__Name", 1)
    for i in range(5):
        log.data(4, "Q3B3B6sd3x", 1_000_000 + i, i, 1, 0, i + 1, 0, 1, b"ab\0cd"[:i], i / 4)
    path = tmp_path / "odd.ulg"
    path.write_bytes(bytes(log))
    result = attlog.convert(path)
    assert result.complete
    messages = decoded(tmp_path / "odd.mcap")["/ulog/2odd__Name/1"]
    assert [time for time, _ in messages] == [(1_000_000 + i) * 1000 for i in range(5)]
    for i, (_, ros) in enumerate(messages):
        assert (ros.timestamp, ros.part_0_a, ros.part_1_a) == (1_000_000 + i, i, i + 1)
        assert (list(ros.part_0_b), list(ros.part_1_b)) == ([True, False], [False, True])
        assert (ros.text, ros.header_2) == (["", "a", "ab", "ab", "ab"][i], i / 4)


def test_a_real_log(logs, decoded, channels, tmp_path, ingest):
    source = logs / "px4_appended_three_times.ulg"
    attlog.convert(source, tmp_path / "flight.mcap")
    found = decoded(tmp_path / "flight.mcap")
    for topic, columns in channels(ingest(source)).items():
        assert [time for time, _ in found[topic]] == sorted(columns.time_ns.tolist())
        if not topic.startswith("/ulog/"):
            continue
        order = np.argsort(columns.time_ns, kind="stable")
        for name in source_names(columns.channel.type).values():
            read = (getattr(ros, name) for _, ros in found[topic])
            values = np.array([list(value) if isinstance(value, bytes) else value for value in read])
            np.testing.assert_array_equal(values, columns[name][order], err_msg=f"{topic} {name}")
    assert {"/annotations", "/imu0/data_raw", "/mag0/field"} <= set(found)


def test_the_format_is_found_by_content(writer):
    assert formats.recognize(bytes(writer(0)), "flight.dat").name == "ulog"
    for form in formats.FORMATS.values():
        assert form.recognizes(bytes(writer(0).say("hello", 1))) == (form.name == "ulog")
