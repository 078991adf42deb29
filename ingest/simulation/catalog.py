"""The scenarios: data, not code. Each is a trajectory, a place, a suite of sensors and an autopilot."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import radians

from ...schemas.errors import UsageError
from .autopilot import Autopilot, Mode, Remark
from .motion import Trajectory
from .multirotor import Gust, Manoeuvre, Multirotor
from .place import Place
from .sensors import Disturbance, Sampling, Suite, Triad, Vibration

MICROTESLA = 1e-6
G = 9.80665


@dataclass(frozen=True)
class Scenario:
    """A run but for its random numbers. ``start_ns``: UTC of its first instant; ``boot_s``: time since boot then."""

    name: str
    summary: str
    trajectory: Trajectory
    place: Place
    sensors: Suite
    autopilot: Autopilot
    truth_hz: float
    start_ns: int
    boot_s: float


_MOJAVE = Place(  # World Magnetic Model 2025 at mid-2026
    latitude_deg=35.05,
    longitude_deg=-118.15,
    altitude_m=840.0,
    declination_deg=11.53,
    inclination_deg=59.62,
    field_t=46.53 * MICROTESLA,
)

_FLIGHT = Multirotor(
    manoeuvres=(
        Manoeuvre(12.0, flying=False),
        Manoeuvre(6.0, climb=2.5),
        Manoeuvre(3.0, turn_deg_s=30.0),
        Manoeuvre(4.0, speed=5.0),
        Manoeuvre(9.0, speed=5.0, turn_deg_s=22.0),
        Manoeuvre(5.0, speed=6.0),
        Manoeuvre(8.0, speed=5.0, turn_deg_s=-28.0),
        Manoeuvre(4.0),
        Manoeuvre(4.0, turn_deg_s=60.0),
        Manoeuvre(5.0, speed=8.0),
        Manoeuvre(4.0, speed=2.0),
        Manoeuvre(3.0, speed=4.0, turn_deg_s=40.0),
        Manoeuvre(3.0, speed=4.0, turn_deg_s=-40.0),
        Manoeuvre(3.0, speed=4.0, turn_deg_s=40.0),
        Manoeuvre(3.0, speed=4.0, turn_deg_s=-40.0),
        Manoeuvre(5.0),
        Manoeuvre(6.0, climb=-2.5),
        Manoeuvre(8.0, flying=False),
    ),
    gusts=(
        Gust(0.23, (0.25, 0.20, 0.08), 1.5),
        Gust(0.61, (0.08, 0.10, 0.03), 0.8),
        Gust(1.37, (0.03, 0.025, 0.01), 0.4),
        Gust(2.9, (0.008, 0.010, 0.003), 0.15),
    ),
    heading_deg=35.0,
    slope_deg=(1.2, -0.7),
    wind=(1.5, -0.6, 0.0),
)

_SENSORS = Suite(  # of the size that a small autopilot's sensors have, gyro bias on the large side
    imu=Sampling(rate_hz=50.0, jitter_s=0.0004),
    gyroscope=Triad(
        noise_density=radians(0.01),
        bias=(radians(0.5), radians(-0.3), radians(0.4)),
        bias_walk=radians(0.02),  # still warming up
        matrix=((1.004, 0.002, -0.001), (-0.002, 0.997, 0.002), (0.001, -0.002, 1.003)),
        quantum=radians(1.0 / 16.4),
        limit=radians(2000.0),
    ),
    accelerometer=Triad(
        noise_density=0.003,
        bias=(0.05, -0.04, 0.08),
        bias_walk=0.0005,
        matrix=((1.002, 0.001, 0.0), (-0.001, 0.999, 0.001), (0.0, -0.001, 1.001)),
        quantum=G / 2048.0,
        limit=16.0 * G,
    ),
    compass=Sampling(rate_hz=50.0, jitter_s=0.0004, delay_s=0.01),
    magnetometer=Triad(
        noise_density=0.04 * MICROTESLA,
        bias=(0.5 * MICROTESLA, -0.4 * MICROTESLA, 0.3 * MICROTESLA),
        quantum=0.1 * MICROTESLA,
        limit=1200.0 * MICROTESLA,
    ),
    satellites=Sampling(rate_hz=5.0, delay_s=0.1),
    position_noise_m=(0.3, 0.3, 0.6),
    first_fix_s=2.0,
    vibrations=(Vibration(87.0, (0.5, 0.4, 0.9)), Vibration(174.0, (0.15, 0.2, 0.3))),
    disturbances=(Disturbance(60.0, 68.0, (4.0 * MICROTESLA, -2.0 * MICROTESLA, 1.0 * MICROTESLA)),),
)

_TRIM = (0.012, -0.021)

_ARDUCOPTER = Autopilot(
    attitude_hz=25.0,
    tilt_sigma_deg=0.4,
    heading_sigma_deg=1.2,
    correlation_s=15.0,
    trim_rad=_TRIM,
    modes=(
        Mode(0.0, 0, "STABILIZE", armed=False),
        Mode(9.0, 4, "GUIDED", armed=False),
        Mode(10.0, 4, "GUIDED", armed=True),
        Mode(25.0, 7, "CIRCLE", armed=True),
        Mode(47.0, 5, "LOITER", armed=True),
        Mode(81.0, 9, "LAND", armed=True),
        Mode(90.0, 9, "LAND", armed=False),
    ),
    remarks=(
        Remark(0.5, 6, "simulated by attlog: scenario flight"),
        Remark(2.1, 6, "GPS 1: detected fix"),
        Remark(10.0, 6, "Arming motors"),
        Remark(12.0, 6, "Taking off"),
        Remark(60.5, 4, "Compass: field disturbed"),
        Remark(81.0, 6, "Landing"),
        Remark(90.0, 6, "Disarming motors"),
    ),
    parameters={
        "AHRS_TRIM_X": _TRIM[0],
        "AHRS_TRIM_Y": _TRIM[1],
        "AHRS_TRIM_Z": 0.0,
        "COMPASS_DEC": radians(_MOJAVE.declination_deg),
    },
)

SCENARIOS: Mapping[str, Scenario] = {
    "flight": Scenario(
        name="flight",
        summary="a small multirotor: rest, take-off, turns, braking, a slalom, a magnetic disturbance, landing",
        trajectory=_FLIGHT,
        place=_MOJAVE,
        sensors=_SENSORS,
        autopilot=_ARDUCOPTER,
        truth_hz=50.0,
        start_ns=1_780_304_400 * 1_000_000_000,  # 2026-06-01T09:00:00Z
        boot_s=21.5,
    ),
}


def scenarios() -> Mapping[str, str]:
    """The names, each with one line about it."""
    return {name: scenario.summary for name, scenario in SCENARIOS.items()}


def scenario(name: str) -> Scenario:
    """The scenario called ``name``; UsageError lists those that exist."""
    try:
        return SCENARIOS[name]
    except KeyError:
        raise UsageError(f"no scenario {name!r}; there are: {', '.join(SCENARIOS)}") from None
