"""A vehicle's parameters, and what it says about itself."""

import re
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .definitions import Dialect
from .frames import Frames, Group
from .passthrough import with_clean_texts
from .vehicles import PX4, Vehicle

AUTOPILOTS: Final = {3: "ArduPilot", 12: "PX4"}
FIRMWARE: Final = re.compile(r"^(?:Ardu\w+|APM:\w+|Rover|AntennaTracker|PX4|Blimp)\b.*\d+\.\d+")
RELEASES: Final = ((255, ""), (192, "-rc"), (128, "-beta"), (64, "-alpha"), (0, "-dev"))
# MAV_PARAM_TYPE of integers -> the type whose bytes PX4 sends in the float
INTEGERS: Final = {1: "<u1", 2: "<i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4"}


def parameters(frames: Frames, vehicle: Vehicle) -> dict[str, float]:
    """The last value of each parameter; the autopilot's own word counts before that of another component."""
    groups = sorted(frames.of("PARAM_VALUE", system=vehicle.system), key=lambda g: g.component == vehicle.component)
    found: dict[bytes, float] = {}
    for group in groups:
        names = with_clean_texts(group)["param_id"].tolist()
        values = _px4_values(group) if vehicle.autopilot == PX4 else group.rows["param_value"].astype(np.float64)
        found.update(zip(names, values.tolist(), strict=True))
    return {name.decode("utf-8", "replace"): value for name, value in sorted(found.items()) if name}


def _px4_values(group: Group) -> NDArray[np.float64]:
    floats = np.ascontiguousarray(group.rows["param_value"])
    values = floats.astype(np.float64)
    for kind, code in INTEGERS.items():
        of_kind = group.rows["param_type"] == kind
        width = np.dtype(code).itemsize
        values[of_kind] = floats[of_kind].view(np.uint8).reshape(-1, 4)[:, :width].copy().view(code)[:, 0]
    return values


def vehicle_record(frames: Frames, vehicle: Vehicle, dialect: Dialect) -> dict[str, str]:
    """autopilot, type, sysid and firmware, as far as the log tells."""
    enums = dialect.module.enums
    record = {"sysid": str(vehicle.system), "component": str(vehicle.component)}
    if vehicle.autopilot >= 0:
        record["autopilot"] = AUTOPILOTS.get(vehicle.autopilot) or _entry(enums, "MAV_AUTOPILOT", vehicle.autopilot)
    if vehicle.type >= 0:
        record["type"] = _entry(enums, "MAV_TYPE", vehicle.type)
    firmware = _version(frames, vehicle) or _banner(frames, vehicle)
    return record | ({"firmware": firmware} if firmware else {})


def _entry(enums: dict[str, dict[int, object]], enum: str, value: int) -> str:
    entry = enums.get(enum, {}).get(value)
    name = str(getattr(entry, "name", value))
    return name.removeprefix(f"{enum}_").lower()


def _version(frames: Frames, vehicle: Vehicle) -> str:
    for group in frames.of("AUTOPILOT_VERSION", system=vehicle.system):
        number = int(group.rows["flight_sw_version"][-1])
        if number:
            release = next(name for least, name in RELEASES if number & 0xFF >= least)
            return f"{number >> 24}.{number >> 16 & 0xFF}.{number >> 8 & 0xFF}{release}"
    return ""


def _banner(frames: Frames, vehicle: Vehicle) -> str:
    for group in frames.of("STATUSTEXT", system=vehicle.system):
        for text in with_clean_texts(group)["text"].tolist():
            if FIRMWARE.match(text.decode("utf-8", "replace")):
                return str(text.decode("utf-8", "replace"))
    return ""
