"""What a user may say about a table of numbers that does not explain itself."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from .sensors import SensorProfile


class World(StrEnum):
    """The world and body axes that an attitude in a file is given in."""

    ENU = "enu"
    """x east, y north, z up; body x forward, y left, z up."""
    NWU = "nwu"
    """x north, y west, z up; body x forward, y left, z up."""
    NED = "ned"
    """x north, y east, z down; body x forward, y right, z down."""


@dataclass(frozen=True)
class AttitudeColumns:
    """How to read a quaternion or Euler angles: in which axes, in which order, from which north, and as whose word.

    ``euler`` names the order of the turns about the moving axes; ``inverse`` says that the quaternion turns the world
    into the body; ``reference`` None leaves it to the column's name (ref, truth, vicon, mocap, …).
    """

    world: World | None = None
    euler: str = "zyx"
    inverse: bool = False
    reference: bool | None = None
    north: str = "arbitrary"


@dataclass(frozen=True)
class CsvOptions:
    """Columns, units and clock of a CSV. Whatever is left out comes from the file's header, or is guessed and shown.

    ``columns`` names the columns from the left as a header would (``t_us``, ``ax_g``, ``gx_dps``, ``-`` for one that
    only passes through); ``names`` gives the file's own names another meaning; ``units`` is by quantity (``accel``,
    ``gyro``, ``mag``, ``angle``). ``rate_hz`` takes the place of a time column. ``strict`` refuses every guess,
    ``normalize`` accepts quaternions that are not of unit norm. ``axes`` are the sensor's: ``flu``, or ``frd`` where z
    reads -1 g at rest. ``sensor`` is the one whose raw counts are printed. ``topics`` puts ``imu``, ``mag``,
    ``attitude`` or ``csv`` on another topic.
    """

    columns: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    time_unit: str | None = None
    rate_hz: float | None = None
    strict: bool = False
    normalize: bool = False
    axes: str = "flu"
    attitude: AttitudeColumns = field(default_factory=AttitudeColumns)
    sensor: SensorProfile | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
