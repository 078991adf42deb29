"""IMUs and magnetometers: which message feeds which unified channel, and in which units."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.frames import flu_from_frd
from ...schemas.columns import Columns, Time
from ...schemas.errors import InputError
from ...schemas.finding import Finding, Kind, Severity
from ...schemas.recording import Floats
from ...schemas.sensors import SensorProfile
from ...schemas.unified import imu_columns, mag_columns
from .frames import Frames, Group
from .times import Timeline
from .vehicles import Vehicle, sent_by

GRAVITY: Final = 9.80665


@dataclass(frozen=True)
class Scales:
    """What one unit of a message's accelerometer (m/s^2), gyroscope (rad/s) and magnetometer (T) fields is."""

    accel: float
    gyro: float
    mag: float
    mag_axes: tuple[str, str, str] = ("x", "y", "z")


MILLI: Final = Scales(GRAVITY * 1e-3, 1e-3, 1e-7)
# message -> (instance, scales; None where they depend on the autopilot). The first to name an instance has it.
SOURCES: Final[dict[str, tuple[int, Scales | None]]] = {
    "HIGHRES_IMU": (0, Scales(1.0, 1.0, 1e-4)),
    "RAW_IMU": (0, None),
    "SCALED_IMU": (0, MILLI),
    "SCALED_IMU2": (1, MILLI),
    "SCALED_IMU3": (2, MILLI),
}
# Bits of HIGHRES_IMU.fields_updated
INERTIAL_BITS: Final = 0x03F
MAGNETIC_BITS: Final = 0x1C0


def channels(
    frames: Frames, line: Timeline, vehicle: Vehicle, sensor: SensorProfile | None, *, required: bool
) -> tuple[list[Columns], list[Finding]]:
    """The IMU and magnetometer channels of a vehicle.

    Where RAW_IMU holds counts, no ``sensor`` gives their scales and no SCALED_IMU stands in, InputError if the vehicle
    is ``required``, else a finding.
    """
    columns: list[Columns] = []
    findings: list[Finding] = []
    for name, (instance, fixed) in SOURCES.items():
        group = sent_by(frames, vehicle, name)
        if group is None:
            continue
        scales = fixed or _raw_scales(vehicle, sensor)
        for number, chosen in _instances(group, instance):
            taken = {c.channel.topic for c in columns}
            wanted = [f"{vehicle.prefix}/{kind}" for kind in (f"imu{number}/data_raw", f"mag{number}/field")]
            if wanted[0] in taken:
                continue
            if scales is None:
                findings.append(_refusal(frames, line, vehicle, group, required))
                continue
            found = _of(group, line, vehicle, number, chosen, scales)
            columns += [c for c in found if c.channel.topic not in taken]
    return columns, findings


def _raw_scales(vehicle: Vehicle, sensor: SensorProfile | None) -> Scales | None:
    if vehicle.is_ardupilot:
        return MILLI
    if sensor is None:
        return None
    gyro = float(np.radians(1.0)) / sensor.gyro_lsb_per_dps
    return Scales(GRAVITY / sensor.accel_lsb_per_g, gyro, sensor.mag_ut_per_lsb * 1e-6, sensor.mag_axes)


def _refusal(frames: Frames, line: Timeline, vehicle: Vehicle, group: Group, required: bool) -> Finding:
    text = (
        f"RAW_IMU of system {vehicle.system} holds raw counts, its autopilot being no ArduPilot: "
        "say what they mean with --sensor mpu9250 or another profile (IngestOptions.sensor)"
    )
    if required and sent_by(frames, vehicle, "SCALED_IMU") is None:
        raise InputError(text)
    times, topic = line.of(group), f"{vehicle.prefix}/imu0/data_raw"
    span = int(times.min()), int(times.max())
    return Finding(*span, Severity.WARN, Kind.UNITS, topic, float(len(group)), "messages", text)


def _instances(group: Group, instance: int) -> Iterator[tuple[int, NDArray[np.bool_] | None]]:
    """Instance numbers with the rows that are theirs (None: all), by the field ``id`` where the message has one."""
    names = group.rows.dtype.names or ()
    numbers = np.unique(group.rows["id"]) if "id" in names else np.array([instance])
    for number in numbers:
        yield int(number), None if len(numbers) == 1 else group.rows["id"] == number


def _of(
    group: Group,
    line: Timeline,
    vehicle: Vehicle,
    number: int,
    chosen: NDArray[np.bool_] | None,
    scales: Scales,
) -> Iterator[Columns]:
    """The channels of one IMU, without those that its message always leaves zero."""
    rows, times = group.rows, line.of(group)
    if chosen is not None:
        rows, times = rows[chosen], times[chosen]
    about: dict[str, Any] = {
        "source": group.name,
        "metadata": {"system": str(vehicle.system), **line.stamped_by(group)},
        "frame_id": f"{vehicle.prefix}/base_link".lstrip("/"),
    }
    force, rate, mag = (_vectors(rows, kind) for kind in ("acc", "gyro", "mag"))
    if force.any():
        values = [_flu(rate, scales.gyro), _flu(force, scales.accel)]
        topic = f"{vehicle.prefix}/imu{number}/data_raw"
        yield _made(imu_columns, topic, times, values, _updated(rows, INERTIAL_BITS), about)
    if mag.any():
        values = [_flu(_along(mag, scales.mag_axes), scales.mag)]
        topic = f"{vehicle.prefix}/mag{number}/field"
        present = (mag[:, 0] != 0) | (mag[:, 1] != 0) | (mag[:, 2] != 0)
        yield _made(mag_columns, topic, times, values, _updated(rows, MAGNETIC_BITS) & present, about)


def _flu(vectors: Floats, scale: float) -> Floats:
    """Body FRD in a message's units to FLU in SI."""
    return np.asarray(vectors * flu_from_frd(np.full(3, scale)))


def _vectors(rows: "NDArray[np.void]", kind: str) -> Floats:
    result = np.empty((len(rows), 3))
    for i, axis in enumerate("xyz"):
        result[:, i] = rows[f"{axis}{kind}"]
    return result


def _updated(rows: "NDArray[np.void]", bits: int) -> NDArray[np.bool_]:
    """Rows whose fields are new, by HIGHRES_IMU.fields_updated; all where nobody says."""
    names = rows.dtype.names or ()
    if "fields_updated" not in names or not rows["fields_updated"].any():
        return np.ones(len(rows), np.bool_)
    return np.asarray((rows["fields_updated"] & bits) != 0)


def _along(values: Floats, axes: tuple[str, str, str]) -> Floats:
    """Each body axis from the signed sensor axis along it."""
    if axes == ("x", "y", "z"):
        return values
    signed = [values[:, "xyz".index(axis[-1])] * (-1.0 if axis.startswith("-") else 1.0) for axis in axes]
    return np.stack(signed, axis=1)


def _made(
    make: Callable[..., Columns],
    topic: str,
    times: Time,
    values: Sequence[Floats],
    keep: NDArray[np.bool_],
    about: dict[str, Any],
) -> Columns:
    """The channel of the rows to keep, less those that are not finite."""
    for value in values:
        finite = np.isfinite(value)
        if not finite.all():
            keep &= finite.all(axis=1)
    if keep.all():
        return make(topic, times, *values, **about)
    return make(topic, times[keep], *(value[keep] for value in values), **about)
