"""Texts, events, parameters, information, dropouts, appended sections."""

import json
import lzma
import struct

import pytest

from attlog.ingest.ulog.events import definitions
from attlog.schemas import InputError, Kind, Severity

EVENT = "event:uint64_t timestamp;uint32_t id;uint16_t event_sequence;uint8_t[25] arguments;uint8_t log_levels;"
DEFINED = {
    "version": 2,
    "components": {
        "1": {
            "namespace": "px4",
            "enums": {
                "mode": {"type": "uint8_t", "entries": {"3": {"name": "hold", "description": "Hold"}}},
                "flags": {
                    "type": "uint16_t",
                    "is_bitfield": True,
                    "separator": ", ",
                    "entries": {"1": {"name": "a", "description": "low"}, "4": {"name": "b", "description": "high"}},
                },
            },
            "event_groups": {
                "default": {
                    "events": {
                        "7": {
                            "name": "seven",
                            "message": "In {1}, {2:.1m} above, {3} left\\{x\\}",
                            "arguments": [
                                {"type": "mode", "name": "m"},
                                {"type": "float", "name": "h"},
                                {"type": "px4::flags", "name": "f"},
                            ],
                        },
                        "8": {
                            "name": "eight",
                            "message": 'See <a href="https://x">the docs</a>, set <param>A_B</param>'
                            '<profile name="dev"> now</profile><profile name="!dev"> never</profile><b>x</b>.',
                        },
                    }
                },
                "health": {"events": {"9": {"name": "nine", "message": "hidden"}}},
            },
        }
    },
}


def compressed(defined=None) -> bytes:
    return lzma.compress(json.dumps(DEFINED if defined is None else defined).encode())


@pytest.fixture
def log(writer):
    return writer(1_000_000).format("t:uint64_t timestamp;").format(EVENT).info("sys_name", "PX4")


def event(log, number: int, arguments: bytes = b"", level: int = 6, time: int = 1_000_000) -> None:
    log.data(20, "QIH25sB", time, 1 << 24 | number, 0, arguments, level << 4 | 7)


def said(result, name: str) -> list[tuple[Severity, str]]:
    return [(note.severity, note.text) for note in result.notes if note.name == name]


def test_texts_and_their_levels(log, ingest):
    for level in range(8):
        log.say(f"level {level}", 1_000_000 + level, level)
    log.say("tagged", 1_000_100, 4, tag=513)
    result = ingest(log)
    fatal = Severity.FATAL
    levels = [fatal, fatal, fatal, Severity.ERROR, Severity.WARN, Severity.INFO, Severity.INFO, Severity.DEBUG]
    assert said(result, "log") == [(severity, f"level {i}") for i, severity in enumerate(levels)]
    assert said(result, "log/513") == [(Severity.WARN, "tagged")]
    assert [note.time_ns for note in result.notes] == [(1_000_000 + i) * 1000 for i in range(8)] + [1_000_100_000]


def test_events_in_words(log, ingest):
    log.lines("metadata_events", *[compressed()[i : i + 100] for i in range(0, len(compressed()), 100)], kind="uint8_t")
    log.add(20, "event").say("In Hold\t", 1_000_000)
    event(log, 7, struct.pack("<BfH", 3, 2.25, 5), level=4)
    event(log, 7, struct.pack("<BfH", 9, 0.0, 0))
    event(log, 8)
    event(log, 9)
    event(log, 10, b"\x01\x02")
    event(log, 8, level=8)
    result = ingest(log)
    assert said(result, "event") == [
        (Severity.WARN, "In Hold, 2.2 m above, low, high left{x}"),
        (Severity.INFO, "In (unknown: 9), 0.0 m above,  left{x}"),
        (Severity.INFO, "See the docs, set A_B now."),
        (Severity.INFO, f"event {1 << 24 | 10}, arguments 01 02"),
    ]
    assert said(result, "log") == []


@pytest.mark.parametrize(
    "content", [b"", b"junk", compressed([]), compressed({"components": {"x": 1}}), compressed()[:90]]
)
def test_definitions_that_are_none(content, log, ingest):
    with pytest.raises(InputError, match="event definitions"):
        definitions(content)
    log.lines("metadata_events", content, kind="uint8_t").add(20, "event").say("kept\t", 1_000_000)
    event(log, 8)
    result = ingest(log)
    assert said(result, "event") == [(Severity.INFO, f"event {1 << 24 | 8}")]
    assert said(result, "log") == [(Severity.INFO, "kept")]


def test_an_event_whose_arguments_do_not_fit(log, ingest):
    broken = json.loads(json.dumps(DEFINED))
    broken["components"]["1"]["event_groups"]["default"]["events"]["7"]["arguments"] = [{"type": "double", "name": "d"}]
    log.lines("metadata_events", compressed(broken), kind="uint8_t").add(20, "event")
    event(log, 7, b"\x05")
    assert said(ingest(log), "event") == [(Severity.INFO, f"event {1 << 24 | 7}, arguments 05")]


def test_parameters_at_the_end_and_their_changes(log, ingest):
    log.parameter("GAIN", 0.5).parameter("COUNT", 3).default("GAIN", 0.25, 3).default("COUNT", 1, 2)
    log.add(1, "t").data(1, "Q", 1_000_000).parameter("GAIN", 0.75).data(1, "Q", 1_020_000).parameter("NEW", 1)
    result = ingest(log)
    assert result.parameters == {"GAIN": 0.75, "COUNT": 3.0, "NEW": 1.0}
    assert said(result, "parameter") == [(Severity.INFO, "GAIN = 0.75 (was 0.5)"), (Severity.INFO, "NEW = 1")]
    assert [n.time_ns for n in result.notes] == [1_000_000_000, 1_020_000_000]
    assert result.metadata["ulog_parameter_defaults"] == {
        "setup.COUNT": "1.0",
        "setup.GAIN": "0.25",
        "system.GAIN": "0.25",
    }


def test_information(log, ingest):
    log.value("I", "uint32_t", "ver_sw_release", 1 << 24 | 14 << 16 | 3 << 8 | 255).info("ver_hw", "BOARD")
    log.value("I", "uint8_t[3]", "raw", b"\x01\x02\xff").lines("top", b"one", b"two").lines("top", b"three")
    log.lines("fault", b"first line\nsec", b"ond line\n").say("hello", 1)
    result = ingest(log)
    assert (result.vehicle["autopilot"], result.vehicle["firmware"], result.vehicle["board"]) == (
        "PX4",
        "1.14.3",
        "BOARD",
    )
    record = result.metadata["ulog_information"]
    assert record["raw"] == "0102ff"
    assert (record["top[0]"], record["top[1]"]) == ("one\ntwo", "three")
    assert record["fault"] == "first line\nsecond line\n"


@pytest.mark.parametrize(
    ("version", "shown"),
    [
        (0x010F0000, "1.15.0 development"),
        (0x010E0340, "1.14.3 alpha"),
        (0x010E0380, "1.14.3 beta"),
        (0x010E03C1, "1.14.3 release candidate"),
        (0x010E03FF, "1.14.3"),
    ],
)
def test_releases(version, shown, log, ingest):
    log.value("I", "uint32_t", "ver_sw_release", version).say("hello", 1)
    assert ingest(log).vehicle["firmware"] == shown


def test_who_and_in_which_mode(log, ingest):
    log.format(
        "vehicle_status:uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;"
        "uint8_t system_type;uint8_t system_id;"
    )
    log.add(3, "vehicle_status")
    for time, arming, mode in ((1_000_000, 1, 2), (1_010_000, 2, 2), (1_020_000, 2, 3), (1_030_000, 4, 99)):
        log.data(3, "Q4B", time, arming, mode, 13, 42)
    result = ingest(log)
    texts = ["disarmed", "mode Position", "armed", "mode Mission", "disarmed", "mode 99"]
    assert [text for _, text in said(result, "vehicle_status")] == texts
    assert (result.vehicle["type"], result.vehicle["sysid"], result.segments[0].vehicle) == ("hexarotor", "42", "42")


def test_dropouts(log, ingest):
    log.add(1, "t").data(1, "Q", 1_000_000).dropout(250).data(1, "Q", 1_250_000)
    result = ingest(log)
    (gap,) = result.findings
    assert (gap.kind, gap.time_ns, gap.end_ns, gap.value, gap.unit) == (Kind.GAP, 10**9, 1_250_000_000, 0.25, "s")
    assert (result.metadata["ulog"]["dropouts"], result.metadata["ulog"]["dropouts_ms"]) == ("1", "250")
    assert result.completeness.complete


def appended(writer, cut: int, flags: int = 1) -> tuple[bytes, int]:
    """A log whose last message is cut by ``cut`` bytes before what was appended."""
    log = writer(1_000_000, bytes(40)).format("t:uint64_t timestamp;").add(1, "t")
    for i in range(20):
        log.data(1, "Q", 1_000_000 + i)
    if cut:
        del log.content[-cut:]
    offset = len(log.content)
    log.lines("hardfault_plain", b"what ", b"happened").data(1, "Q", 1_000_050)
    struct.pack_into("<B", log.content, 16 + 3 + 8, flags)
    struct.pack_into("<Q", log.content, 16 + 3 + 16, offset)
    return bytes(log), offset


@pytest.mark.parametrize("cut", [0, 1, 5, 12])
def test_an_appended_section_behind_a_torn_message(cut, writer, ingest, channels):
    content, offset = appended(writer, cut)
    result = ingest(content)
    assert len(channels(result)["/ulog/t/0"]) == (21 if cut == 0 else 20)
    assert result.metadata["ulog_information"]["hardfault_plain"] == "what \nhappened"
    assert result.completeness.dropped == ({} if cut == 0 else {"torn last message": 1})
    assert result.completeness.bytes_skipped == (0 if cut == 0 else 13 - cut)
    assert result.metadata["ulog"]["appended_at"] == str(offset)


@pytest.mark.parametrize("offset", [3, 2**40, 2**64 - 1])
def test_offsets_of_sections_that_cannot_be(offset, writer, ingest, channels):
    content = bytearray(appended(writer, 0)[0])
    struct.pack_into("<Q", content, 16 + 3 + 16, offset)
    assert len(channels(ingest(bytes(content)))["/ulog/t/0"]) == 21
