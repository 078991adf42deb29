"""What the vehicle itself said: MSG, ERR, EV, MODE and ARM records as lines of ``/annotations``, and who it is."""

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from ...schemas import Note, Severity
from . import names
from .clock import Clock
from .formats import text
from .log import Log, Records

_FIRMWARE: Final = re.compile(r"^(Ardu\w+|APM:?\s?\w+|AntennaTracker|Antenna Tracker|Blimp)\s+V?\d")
_BOARD: Final = re.compile(r"^(\S.*?) [0-9A-F]{8} [0-9A-F]{8} [0-9A-F]{8}$")
_ALIASES: Final = (
    ("Copter", "ArduCopter"),
    ("Plane", "ArduPlane"),
    ("Rover", "ArduRover"),
    ("Sub", "ArduSub"),
    ("Antenna", "AntennaTracker"),
    ("Blimp", "Blimp"),
)
_SYSTEM_IDS: Final = ("MAV_SYSID", "SYSID_THISMAV")
ARMED: Final = {0: "disarmed", 1: "armed"}


def vehicle(log: Log, parameters: Mapping[str, float]) -> dict[str, str]:
    """Autopilot, type, firmware, board, frame and system id, as far as the log tells."""
    result = {"autopilot": "ArduPilot"}
    for line in (text(m) for records in log.named("MSG") for m in _texts(records, "Message")):
        if "type" not in result and _FIRMWARE.match(line):
            result |= {"type": _firmware(line), "firmware": line}
        if "board" not in result and (board := _BOARD.match(line)):
            result["board"] = board[1]
        if "frame" not in result and line.startswith("Frame: "):
            result["frame"] = line[len("Frame: ") :]
    for records in log.named("VER"):
        result |= _version(records)
    system = next((parameters[name] for name in _SYSTEM_IDS if name in parameters), None)
    if system is not None and np.isfinite(system):
        result["sysid"] = str(int(system))
    return result


def _firmware(line: str) -> str:
    return next((name for word, name in _ALIASES if word in line), line.split()[0])


def _version(records: Records) -> dict[str, str]:
    found: dict[str, str] = {}
    if records.format.has("FWS") and len(records):
        found["firmware"] = text(bytes(records.data["FWS"][0]))
    if records.format.has("BU") and len(records):
        build = names.FIRMWARE_OF_BUILD.get(int(records.data["BU"][0]))
        found |= {"type": build} if build else {}
    return {key: value for key, value in found.items() if value}


def notes(log: Log, clock: Clock, firmware: str) -> Iterator[Note]:
    """Every MSG, ERR, EV, MODE and ARM record in words."""
    makers: Mapping[str, Callable[[Mapping[str, Any]], tuple[Severity, str] | None]] = {
        "MSG": _message,
        "ERR": _error,
        "EV": _event,
        "MODE": lambda row: _mode(row, firmware),
        "ARM": _arming,
    }
    for name, make in makers.items():
        for records in log.named(name):
            stamps = clock.stamps(records).tolist()
            for time_ns, values in zip(stamps, records.data.tolist(), strict=True):
                said = make(dict(zip(records.format.columns, values, strict=True)))
                if said is not None:
                    yield Note(time_ns, said[0], name, said[1])


def _message(row: Mapping[str, Any]) -> tuple[Severity, str] | None:
    message = row.get("Message")
    return None if message is None else (Severity.INFO, text(message))


def _error(row: Mapping[str, Any]) -> tuple[Severity, str] | None:
    if "Subsys" not in row or "ECode" not in row:
        return None
    severity = Severity.INFO if row["ECode"] == names.RESOLVED else Severity.ERROR
    return severity, names.error(row["Subsys"], row["ECode"])


def _event(row: Mapping[str, Any]) -> tuple[Severity, str] | None:
    return (Severity.INFO, names.event(row["Id"])) if "Id" in row else None


def _mode(row: Mapping[str, Any], firmware: str) -> tuple[Severity, str] | None:
    mode = row.get("Mode", row.get("ModeNum"))
    if mode is None:
        return None
    written = text(mode) if isinstance(mode, bytes) else str(row.get("ModeNum", mode))
    named = names.mode(firmware, int(written)) if written.isdecimal() else written
    reason = f" (reason {row['Rsn']})" if "Rsn" in row else ""
    return Severity.INFO, f"mode {named}{reason}"


def _arming(row: Mapping[str, Any]) -> tuple[Severity, str] | None:
    state = row.get("ArmState")
    if state is None:
        return None
    forced = ", forced" if row.get("Forced") else ""
    return Severity.INFO, f"{ARMED.get(state, f'arm state {state}')}{forced}"


def _texts(records: Records, column: str) -> list[bytes]:
    return records.data[column].tolist() if records.format.has(column) else []
