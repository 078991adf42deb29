"""One run of a scenario: the truth, and what the sensors and the autopilot made of it."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...schemas.recording import Attitude, Declination, Fix, Imu, Magnetometer, Recording, Segment
from .catalog import Scenario, scenario
from .motion import Floats, Motion, Trajectory
from .sensors import Suite, measured

IMU_TOPIC = "/imu0/data_raw"
MAG_TOPIC = "/mag0/field"
FIX_TOPIC = "/gnss0/fix"
TRUTH_TOPIC = "/reference/attitude"
ONBOARD_TOPIC = "/onboard/attitude/attitude"


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """A scenario with one seed. Stamps are whole microseconds of UTC.

    ``truth`` is the motion at the truth's instants, ``autopilot`` at the stamps of ``onboard``, ``satellites`` at what
    ``fix`` measured; ``fixed`` (n,) says which fixes are valid. Body FLU, world ENU, SI throughout.
    """

    scenario: Scenario
    seed: int
    truth: Motion
    imu: Imu
    magnetometer: Magnetometer
    satellites: Motion
    fix: Fix
    fixed: NDArray[np.bool_]
    autopilot: Motion
    onboard: Attitude

    def stamps_ns(self, time_s: Floats) -> NDArray[np.int64]:
        """UTC of instants (n,) of the run."""
        return stamps_ns(self.scenario, time_s)

    @cached_property
    def reference(self) -> Attitude:
        """The truth."""
        metadata = {"north": "true", **self.provenance}
        return Attitude(self.stamps_ns(self.truth.time_s), self.truth.orientation, "reference", TRUTH_TOPIC, metadata)

    @property
    def provenance(self) -> Mapping[str, str]:
        """What made the run."""
        return {"scenario": self.scenario.name, "seed": str(self.seed)}

    @property
    def segment(self) -> Segment:
        """The run is one stretch of one clock."""
        start = self.scenario.start_ns
        end = start + round(self.scenario.trajectory.duration_s * 1e9)
        return Segment("", 0, start, end, start - round(self.scenario.boot_s * 1e9), "start of log")

    @cached_property
    def recording(self) -> Recording:
        """The run as estimators and analysis take it, without a file between."""
        return Recording(
            imu={0: self.imu},
            mag={0: self.magnetometer},
            gnss={0: _select(self.fix, self.fixed)},
            reference=self.reference,
            onboard={self.onboard.name: self.onboard},
            segments=(self.segment,),
            declination=Declination(self.scenario.place.declination_deg, "simulated place"),
            metadata={"simulation": self.provenance},
        )


def simulate(name: str = "flight", seed: int = 0) -> SimulatedRun:
    """Run the scenario called ``name``. The same name and seed give the same run; UsageError for an unknown name."""
    return run_scenario(scenario(name), seed)


def run_scenario(chosen: Scenario, seed: int) -> SimulatedRun:
    """Run any scenario, be it registered or not."""
    path = chosen.trajectory.drawn(_random(seed, "path"))
    end_s, pilot = chosen.trajectory.duration_s, chosen.autopilot
    imu = _imu(chosen, path, seed)
    magnetometer = _magnetometer(chosen, path, seed)
    satellites, fix, fixed = _fix(chosen, path, seed)
    aware = path.at(_raster(end_s, pilot.attitude_hz))
    believed = pilot.estimate(aware.orientation, 1.0 / pilot.attitude_hz, _random(seed, "autopilot"))
    onboard = Attitude(stamps_ns(chosen, aware.time_s), believed, "attitude", ONBOARD_TOPIC, {"north": "true"})
    truth = path.at(_raster(end_s, chosen.truth_hz))
    return SimulatedRun(chosen, seed, truth, imu, magnetometer, satellites, fix, fixed, aware, onboard)


def stamps_ns(chosen: Scenario, time_s: Floats) -> NDArray[np.int64]:
    """UTC of instants (n,), in whole microseconds as logs have it."""
    return chosen.start_ns + 1000 * np.round(time_s * 1e6).astype(np.int64)


def _random(seed: int, purpose: str) -> np.random.Generator:
    """A stream of its own for each purpose: one sensor more changes no other's numbers."""
    return np.random.default_rng([seed, zlib.crc32(purpose.encode())])


def _raster(end_s: float, rate_hz: float) -> Floats:
    return np.arange(int(np.floor(end_s * rate_hz)) + 1) / rate_hz


def _imu(chosen: Scenario, path: Trajectory, seed: int) -> Imu:
    suite = chosen.sensors
    stamps = suite.imu.instants(path.duration_s, _random(seed, "imu"))
    phases = _random(seed, "vibration").uniform(0.0, 2.0 * np.pi, len(suite.vibrations))

    def force(time_s: Floats) -> Floats:
        motion = path.at(time_s)
        shaking = (v.at(time_s, motion.activity, p) for v, p in zip(suite.vibrations, phases, strict=True))
        return sum(shaking, motion.specific_force)

    def rate(time_s: Floats) -> Floats:
        return path.at(time_s).angular_velocity

    gyroscope = measured(suite.imu, suite.gyroscope, rate, stamps, _random(seed, "gyroscope"))
    accelerometer = measured(suite.imu, suite.accelerometer, force, stamps, _random(seed, "accelerometer"))
    return Imu(stamps_ns(chosen, stamps), gyroscope, accelerometer, IMU_TOPIC)


def _magnetometer(chosen: Scenario, path: Trajectory, seed: int) -> Magnetometer:
    suite = chosen.sensors
    stamps = suite.compass.instants(path.duration_s, _random(seed, "compass"))

    def field(time_s: Floats) -> Floats:
        disturbed = sum((d.at(time_s) for d in suite.disturbances), np.zeros((len(time_s), 3)))
        return path.at(time_s).in_body(chosen.place.field_enu + disturbed)

    readings = measured(suite.compass, suite.magnetometer, field, stamps, _random(seed, "magnetometer"))
    return Magnetometer(stamps_ns(chosen, stamps), readings, MAG_TOPIC)


def _fix(chosen: Scenario, path: Trajectory, seed: int) -> tuple[Motion, Fix, NDArray[np.bool_]]:
    suite: Suite = chosen.sensors
    stamps = suite.satellites.instants(path.duration_s, _random(seed, "satellites"))
    motion = path.at(stamps - suite.satellites.delay_s)
    noise = _random(seed, "position").normal(0.0, 1.0, (len(stamps), 3)) * np.array(suite.position_noise_m)
    place = chosen.place.geodetic(motion.position + noise)
    fix = Fix(stamps_ns(chosen, stamps), place[:, 0], place[:, 1], place[:, 2], FIX_TOPIC)
    return motion, fix, stamps >= suite.first_fix_s


def _select(fix: Fix, mask: NDArray[np.bool_]) -> Fix:
    latitude, longitude, altitude = (part[mask] for part in (fix.latitude_deg, fix.longitude_deg, fix.altitude_m))
    return Fix(fix.time_ns[mask], latitude, longitude, altitude, fix.topic, fix.metadata)
