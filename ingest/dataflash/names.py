"""ArduPilot's numbers in words: flight modes, events, errors (AP_Logger.h; the FLTMODE and MODE parameters)."""

from collections.abc import Mapping, Sequence
from typing import Final


def _numbered(words: str) -> dict[int, str]:
    """``"0 STABILIZE 1 ACRO"`` -> {0: "STABILIZE", 1: "ACRO"}."""
    parts: Sequence[str] = words.split()
    return {int(number): name for number, name in zip(parts[::2], parts[1::2], strict=True)}


MODES: Final[Mapping[str, Mapping[int, str]]] = {
    "ArduCopter": _numbered(
        "0 STABILIZE 1 ACRO 2 ALT_HOLD 3 AUTO 4 GUIDED 5 LOITER 6 RTL 7 CIRCLE 8 POSITION 9 LAND 10 OF_LOITER 11 DRIFT "
        "13 SPORT 14 FLIP 15 AUTOTUNE 16 POSHOLD 17 BRAKE 18 THROW 19 AVOID_ADSB 20 GUIDED_NOGPS 21 SMART_RTL "
        "22 FLOWHOLD 23 FOLLOW 24 ZIGZAG 25 SYSTEMID 26 AUTOROTATE 27 AUTO_RTL 28 TURTLE 29 RATE_ACRO"
    ),
    "ArduPlane": _numbered(
        "0 MANUAL 1 CIRCLE 2 STABILIZE 3 TRAINING 4 ACRO 5 FBWA 6 FBWB 7 CRUISE 8 AUTOTUNE 10 AUTO 11 RTL 12 LOITER "
        "13 TAKEOFF 14 AVOID_ADSB 15 GUIDED 16 INITIALISING 17 QSTABILIZE 18 QHOVER 19 QLOITER 20 QLAND 21 QRTL "
        "22 QAUTOTUNE 23 QACRO 24 THERMAL 25 LOITERALTQLAND 26 AUTOLAND"
    ),
    "ArduRover": _numbered(
        "0 MANUAL 1 ACRO 2 LEARNING 3 STEERING 4 HOLD 5 LOITER 6 FOLLOW 7 SIMPLE 8 DOCK 9 CIRCLE 10 AUTO 11 RTL "
        "12 SMART_RTL 15 GUIDED 16 INITIALISING"
    ),
    "ArduSub": _numbered(
        "0 STABILIZE 1 ACRO 2 ALT_HOLD 3 AUTO 4 GUIDED 7 CIRCLE 9 SURFACE 16 POSHOLD 19 MANUAL 20 MOTOR_DETECT "
        "21 SURFTRAK"
    ),
    "AntennaTracker": _numbered("0 MANUAL 1 STOP 2 SCAN 3 SERVO_TEST 4 GUIDED 10 AUTO 16 INITIALISING"),
    "Blimp": _numbered("0 LAND 1 MANUAL 2 VELOCITY 3 LOITER 4 RTL 5 AUTO 6 HOLD"),
}
"""Firmware -> MODE.ModeNum -> name."""

EVENTS: Final = _numbered(
    "10 ARMED 11 DISARMED 15 AUTO_ARMED 17 LAND_COMPLETE_MAYBE 18 LAND_COMPLETE 19 LOST_GPS 21 FLIP_START 22 FLIP_END "
    "25 SET_HOME 26 SET_SIMPLE_ON 27 SET_SIMPLE_OFF 28 NOT_LANDED 29 SET_SUPERSIMPLE_ON 30 AUTOTUNE_INITIALISED "
    "31 AUTOTUNE_OFF 32 AUTOTUNE_RESTART 33 AUTOTUNE_SUCCESS 34 AUTOTUNE_FAILED 35 AUTOTUNE_REACHED_LIMIT "
    "36 AUTOTUNE_PILOT_TESTING 37 AUTOTUNE_SAVEDGAINS 38 SAVE_TRIM 39 SAVEWP_ADD_WP 41 FENCE_ENABLE 42 FENCE_DISABLE "
    "43 ACRO_TRAINER_OFF 44 ACRO_TRAINER_LEVELING 45 ACRO_TRAINER_LIMITED 46 GRIPPER_GRAB 47 GRIPPER_RELEASE "
    "49 PARACHUTE_DISABLED 50 PARACHUTE_ENABLED 51 PARACHUTE_RELEASED 52 LANDING_GEAR_DEPLOYED "
    "53 LANDING_GEAR_RETRACTED 54 MOTORS_EMERGENCY_STOPPED 55 MOTORS_EMERGENCY_STOP_CLEARED "
    "56 MOTORS_INTERLOCK_DISABLED 57 MOTORS_INTERLOCK_ENABLED 58 ROTOR_RUNUP_COMPLETE 59 ROTOR_SPEED_BELOW_CRITICAL "
    "60 EKF_ALT_RESET 61 LAND_CANCELLED_BY_PILOT 62 EKF_YAW_RESET 63 AVOIDANCE_ADSB_ENABLE 64 AVOIDANCE_ADSB_DISABLE "
    "65 AVOIDANCE_PROXIMITY_ENABLE 66 AVOIDANCE_PROXIMITY_DISABLE 67 GPS_PRIMARY_CHANGED 71 ZIGZAG_STORE_A "
    "72 ZIGZAG_STORE_B 73 LAND_REPO_ACTIVE 74 STANDBY_ENABLE 75 STANDBY_DISABLE 163 SURFACED 164 NOT_SURFACED "
    "165 BOTTOMED 166 NOT_BOTTOMED"
)
"""EV.Id -> name."""

SUBSYSTEMS: Final = _numbered(
    "1 MAIN 2 RADIO 3 COMPASS 4 OPTFLOW 5 FAILSAFE_RADIO 6 FAILSAFE_BATT 7 FAILSAFE_GPS 8 FAILSAFE_GCS "
    "9 FAILSAFE_FENCE 10 FLIGHT_MODE 11 GPS 12 CRASH_CHECK 13 FLIP 14 AUTOTUNE 15 PARACHUTES 16 EKFCHECK "
    "17 FAILSAFE_EKFINAV 18 BARO 19 CPU 20 FAILSAFE_ADSB 21 TERRAIN 22 NAVIGATION 23 FAILSAFE_TERRAIN 24 EKF_PRIMARY "
    "25 THRUST_LOSS_CHECK 26 FAILSAFE_SENSORS 27 FAILSAFE_LEAK 28 PILOT_INPUT 29 FAILSAFE_VIBE 30 INTERNAL_ERROR "
    "31 FAILSAFE_DEADRECKON"
)
"""ERR.Subsys -> name."""

UNHEALTHY: Final = 4
RESOLVED: Final = 0
CODES: Final[Mapping[str, Mapping[int, str]]] = {
    "MAIN": _numbered("1 INS_DELAY"),
    "RADIO": _numbered("2 LATE_FRAME"),
    "CRASH_CHECK": _numbered("1 CRASH 2 LOSS_OF_CONTROL"),
    "FLIP": _numbered("2 ABANDONED"),
    "PARACHUTES": _numbered("2 TOO_LOW 3 LANDED"),
    "EKFCHECK": _numbered("2 BAD_VARIANCE 0 VARIANCE_CLEARED"),
    "BARO": _numbered("2 GLITCH 3 BAD_DEPTH"),
    "GPS": _numbered("2 GLITCH"),
    "TERRAIN": _numbered("2 MISSING_TERRAIN_DATA"),
    "NAVIGATION": _numbered(
        "2 FAILED_TO_SET_DESTINATION 3 RESTARTED_RTL 4 FAILED_CIRCLE_INIT 5 DEST_OUTSIDE_FENCE 6 RTL_MISSING_RNGFND"
    ),
}
"""Subsystem -> ERR.ECode -> name, where it is not one of the general ones."""
GENERAL_CODES: Final = _numbered("0 RESOLVED 1 FAILED_TO_INITIALISE 4 UNHEALTHY")
FAILSAFE_CODES: Final = _numbered("0 RESOLVED 1 OCCURRED")
COUNTED: Final = frozenset({"FLIGHT_MODE", "EKF_PRIMARY", "INTERNAL_ERROR"})
"""Subsystems whose code is a number of something: the mode refused, the core chosen."""

FIRMWARE_OF_BUILD: Final = _numbered(
    "1 ArduRover 2 ArduCopter 3 ArduPlane 4 AntennaTracker 7 ArduSub 12 Blimp 13 ArduCopter"
)
"""VER.BU -> firmware."""


def mode(firmware: str, number: int) -> str:
    """A flight mode's name; its number where the firmware or the mode is unknown."""
    return MODES.get(firmware, {}).get(number, str(number))


def event(number: int) -> str:
    """An event's name."""
    return EVENTS.get(number, f"event {number}")


def error(subsystem: int, code: int) -> str:
    """Subsystem and code of an error in words."""
    name = SUBSYSTEMS.get(subsystem, f"subsystem {subsystem}")
    general = FAILSAFE_CODES if name.startswith("FAILSAFE") else {} if name in COUNTED else GENERAL_CODES
    return f"{name}: {CODES.get(name, {}).get(code) or general.get(code) or f'code {code}'}"
