"""Who speaks in a log: systems, their autopilots, and which of them has the unprefixed topics."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ...schemas.errors import UsageError
from ...schemas.source import IngestOptions
from .frames import Frames, Group

ARDUPILOT: Final = 3
PX4: Final = 12
NO_AUTOPILOT: Final = 8
# Messages with samples of an IMU
IMU_MESSAGES: Final = ("HIGHRES_IMU", "RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3")
# Further messages whose sender is a vehicle
VEHICLE_MESSAGES: Final = ("ATTITUDE", "ATTITUDE_QUATERNION", "AHRS2", "SIMSTATE", "SIM_STATE", "HIL_STATE_QUATERNION")
# Messages that only ArduPilots send
ARDUPILOT_MESSAGES: Final = ("AHRS", "HWSTATUS", "MEMINFO", "EKF_STATUS_REPORT", "MCU_STATUS")


@dataclass(frozen=True)
class Vehicle:
    """A system that flies: its autopilot's component, MAV_AUTOPILOT and MAV_TYPE (-1 where no HEARTBEAT tells)."""

    system: int
    component: int
    autopilot: int
    type: int
    imu_samples: int
    prefix: str = ""

    @property
    def is_ardupilot(self) -> bool:
        """Whether the autopilot is an ArduPilot."""
        return self.autopilot == ARDUPILOT

    @property
    def has_autopilot(self) -> bool:
        """Whether a HEARTBEAT tells of an autopilot."""
        return self.autopilot not in (-1, NO_AUTOPILOT)


def find(frames: Frames, options: IngestOptions) -> list[Vehicle]:
    """All vehicles, the one with the unprefixed topics first; with ``all``, every one has its prefix.

    UsageError where the vehicle that was asked for is absent.
    """
    systems = sorted({g.system for g in frames.groups})
    vehicles = [v for v in (_vehicle(frames, system) for system in systems) if v is not None]
    vehicles.sort(key=lambda v: (not v.has_autopilot, -v.imu_samples, v.system))
    wanted = options.vehicle
    if isinstance(wanted, int):
        if wanted not in systems:
            raise UsageError(f"no vehicle {wanted} in the log; its systems are {', '.join(map(str, systems))}")
        vehicles.sort(key=lambda v: v.system != wanted)
        if not vehicles or vehicles[0].system != wanted:
            raise UsageError(f"system {wanted} sends neither HEARTBEAT of an autopilot nor IMU nor attitude")
    plain = [] if wanted == "all" else vehicles[:1]
    return plain + [replace(v, prefix=f"/vehicle{v.system}") for v in vehicles[len(plain) :]]


def _vehicle(frames: Frames, system: int) -> Vehicle | None:
    imu = frames.of(*IMU_MESSAGES, system=system)
    speaks = imu + frames.of(*VEHICLE_MESSAGES, system=system)
    beats = [(g, *_most_common(g)) for g in frames.of("HEARTBEAT", system=system)]
    pilots = [beat for beat in beats if beat[1] != NO_AUTOPILOT]
    samples = sum(len(g) for g in imu)
    if pilots:
        group, autopilot, kind = max(pilots, key=lambda beat: (len(beat[0]), -beat[0].component))
        return Vehicle(system, group.component, autopilot, kind, samples)
    if not speaks:
        return None
    autopilot = beats[0][1] if beats else ARDUPILOT if frames.of(*ARDUPILOT_MESSAGES, system=system) else -1
    return Vehicle(system, max(speaks, key=len).component, autopilot, -1, samples)


def _most_common(heartbeats: Group) -> tuple[int, int]:
    rows = heartbeats.rows
    autopilot = int(np.bincount(rows["autopilot"]).argmax())
    return autopilot, int(np.bincount(rows["type"][rows["autopilot"] == autopilot]).argmax())


def sent_by(frames: Frames, vehicle: Vehicle, name: str) -> Group | None:
    """The vehicle's messages called ``name``: the autopilot's, else those of the component that sent most."""
    groups = frames.of(name, system=vehicle.system)
    return max(groups, key=lambda g: (g.component == vehicle.component, len(g)), default=None)
