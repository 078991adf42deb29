"""What the vehicle said, in words, and who it was."""

from typing import Any

import pytest

from attlog.ingest.dataflash import names
from attlog.schemas import Severity


@pytest.mark.parametrize(
    ("firmware", "table"),
    [
        ("ArduCopter", "acm"),
        ("ArduPlane", "apm"),
        ("ArduRover", "rover"),
        ("ArduSub", "sub"),
        ("AntennaTracker", "tracker"),
        ("Blimp", "blimp"),
    ],
)
def test_modes_have_pymavlinks_names(firmware: str, table: str) -> None:
    from pymavlink import mavutil

    theirs = getattr(mavutil, f"mode_mapping_{table}")
    assert {number: names.mode(firmware, number) for number in theirs} == theirs


def test_unknown_numbers_stay_numbers() -> None:
    assert names.mode("ArduCopter", 250) == "250"
    assert names.mode("", 3) == "3"
    assert names.event(250) == "event 250"
    assert names.error(250, 9) == "subsystem 250: code 9"


@pytest.mark.parametrize(
    ("subsystem", "code", "words"),
    [
        (5, 1, "FAILSAFE_RADIO: OCCURRED"),
        (5, 0, "FAILSAFE_RADIO: RESOLVED"),
        (12, 2, "CRASH_CHECK: LOSS_OF_CONTROL"),
        (3, 4, "COMPASS: UNHEALTHY"),
        (16, 0, "EKFCHECK: VARIANCE_CLEARED"),
        (24, 1, "EKF_PRIMARY: code 1"),
        (10, 4, "FLIGHT_MODE: code 4"),
    ],
)
def test_errors_in_words(subsystem: int, code: int, words: str) -> None:
    assert names.error(subsystem, code) == words


def test_notes_in_order_of_time(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "MSG", "QZ", "TimeUS,Message")
    log.define(2, "MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn")
    log.define(3, "EV", "QB", "TimeUS,Id")
    log.define(4, "ERR", "QBB", "TimeUS,Subsys,ECode")
    log.define(5, "ARM", "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method")
    log.record("MSG", 1000, b"ArduPlane V4.6.0 (9cc2b9d5)")
    log.record("MODE", 2000, 5, 5, 1)
    log.record("ARM", 3000, 1, 0, 1, 2)
    log.record("ERR", 5000, 11, 2)
    log.record("EV", 4000, 10)
    log.record("ERR", 6000, 11, 0)
    notes = ingest(log.binary).notes
    assert [(note.name, note.text) for note in notes] == [
        ("MSG", "ArduPlane V4.6.0 (9cc2b9d5)"),
        ("MODE", "mode FBWA (reason 1)"),
        ("ARM", "armed, forced"),
        ("EV", "ARMED"),
        ("ERR", "GPS: GLITCH"),
        ("ERR", "GPS: RESOLVED"),
    ]
    assert [note.severity for note in notes][-2:] == [Severity.ERROR, Severity.INFO]


def test_version_record_and_parameters_say_who_it_is(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "VER", "QZB", "TimeUS,FWS,BU")
    log.define(2, "PARM", "QNf", "TimeUS,Name,Value")
    log.record("VER", 1, b"ArduSub V4.5.0", 7)
    log.record("PARM", 2, b"SYSID_THISMAV", 1.0)
    log.record("PARM", 3, b"SYSID_THISMAV", 51.0)
    ingested = ingest(log.binary)
    assert ingested.vehicle == {
        "autopilot": "ArduPilot",
        "firmware": "ArduSub V4.5.0",
        "type": "ArduSub",
        "sysid": "51",
    }
    assert ingested.parameters == {"SYSID_THISMAV": 51.0}
    assert {segment.vehicle for segment in ingested.segments} == {"51"}
