"""Who flew, by information messages and vehicle_status; parameters as they were at the end; the file's metadata."""

from collections.abc import Mapping
from typing import Final

from . import names
from .information import Value, defaults, multiple, printable, single
from .log import Log

KEPT: Final = {"ver_hw": "board", "ver_sw": "firmware_hash", "sys_os_name": "os", "sys_uuid": "uuid", "sys_mcu": "mcu"}
"""Key of the information -> key of the metadata."""
SYSTEM_ID: Final = "MAV_SYS_ID"


def vehicle(log: Log, parameters: Mapping[str, float]) -> dict[str, str]:
    """Autopilot, type, firmware, board and system id, as far as the log tells."""
    said = single(log.single)
    result = {"autopilot": str(said["sys_name"])} if "sys_name" in said else {}
    kind = _last(log, "system_type")
    if kind in names.VEHICLES:
        result["type"] = names.VEHICLES[kind]
    firmware = _firmware(said)
    if firmware:
        result["firmware"] = firmware
    result |= {name: str(said[key]) for key, name in KEPT.items() if key in said}
    system = parameters.get(SYSTEM_ID, _last(log, "system_id"))
    result["sysid"] = str(int(system)) if system is not None and 0 < system < 256 else "1"
    return result


def _firmware(said: Mapping[str, Value]) -> str:
    version = said.get("ver_sw_release")
    if isinstance(version, int):
        return names.release(version)
    return str(said.get("ver_sw", ""))[:10]


def _last(log: Log, column: str) -> int | None:
    for topic in log.named("vehicle_status"):
        if topic.has(column):
            return int(topic.integers(column)[-1])
    return None


def last_parameters(log: Log) -> dict[str, float]:
    """Parameter -> value at the end of the log."""
    return {e.key: float(e.value) for e in log.parameters if isinstance(e.value, int | float)}


def metadata(log: Log) -> dict[str, dict[str, str]]:
    """Records of the file: all information, the parameters' defaults, and what the file itself is like."""
    lost_ms = sum(duration for _, duration in log.dropouts)
    records = {
        "ulog": {
            "version": str(log.version),
            "start_us": str(log.start_us),
            "compatible_flags": log.compatible_flags.hex(),
            "appended_at": " ".join(map(str, log.appended)),
            "dropouts": str(len(log.dropouts)),
            "dropouts_ms": str(lost_ms),
        },
        "ulog_information": printable(single(log.single), multiple(log.multiple)),
        "ulog_parameter_defaults": {name: repr(value) for name, value in sorted(defaults(log.defaults).items())},
    }
    return {name: record for name, record in records.items() if record}
