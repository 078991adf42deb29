"""PX4's and MAVLink's numbers in words."""

from collections.abc import Callable
from typing import Final

Namer = Callable[[int], str]

NAV_STATES: Final = {
    0: "Manual",
    1: "Altitude",
    2: "Position",
    3: "Mission",
    4: "Hold",
    5: "Return",
    6: "Position Slow",
    10: "Acro",
    12: "Descend",
    13: "Termination",
    14: "Offboard",
    15: "Stabilized",
    17: "Takeoff",
    18: "Land",
    19: "Follow Target",
    20: "Precision Land",
    21: "Orbit",
    22: "VTOL Takeoff",
}
"""vehicle_status.nav_state; numbers that changed their meaning between releases are left out."""
ARMED: Final = 2

VEHICLES: Final = {
    1: "fixed wing",
    2: "quadrotor",
    3: "coaxial helicopter",
    4: "helicopter",
    7: "airship",
    8: "balloon",
    9: "rocket",
    10: "rover",
    11: "boat",
    12: "submarine",
    13: "hexarotor",
    14: "octorotor",
    15: "tricopter",
    19: "VTOL tailsitter duorotor",
    20: "VTOL tailsitter quadrotor",
    21: "VTOL tiltrotor",
    22: "VTOL fixed rotor",
    23: "VTOL tailsitter",
    24: "VTOL tiltwing",
    25: "VTOL",
    29: "dodecarotor",
}
"""MAV_TYPE, as in vehicle_status.system_type."""

RELEASES: Final = ((255, ""), (192, " release candidate"), (128, " beta"), (64, " alpha"), (0, " development"))
"""Least last byte of ver_sw_release -> what kind of release it is."""


def arming(state: int) -> str:
    """vehicle_status.arming_state: 2 is armed in every release, all others are kinds of disarmed."""
    return "armed" if state == ARMED else "disarmed"


def mode(state: int) -> str:
    """vehicle_status.nav_state."""
    return f"mode {NAV_STATES.get(state, state)}"


def release(version: int) -> str:
    """``ver_sw_release`` as ``1.15.0 beta``."""
    kind = next(name for least, name in RELEASES if version & 0xFF >= least)
    return f"{version >> 24 & 0xFF}.{version >> 16 & 0xFF}.{version >> 8 & 0xFF}{kind}"
