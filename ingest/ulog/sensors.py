"""Inertial sensors, magnetometers and receivers as attlog's own channels: body FLU, SI units, the sample's own time."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.frames import flu_from_frd
from ...schemas import Columns
from ...schemas.unified import fix_columns, imu_columns, mag_columns
from .clock import Clock
from .log import Log, Topic

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

COMBINED: Final = "sensor_combined"
COMBINED_FIELDS: Final = ("gyro_rad", "accelerometer_m_s2")
"""rad/s and m/s^2, body FRD, means over the interval that ends at the time of the gyroscope's sample."""
ACCEL_DELAY: Final = "accelerometer_timestamp_relative"
MAG_DELAY: Final = "magnetometer_timestamp_relative"
INVALID: Final = 2**31 - 1
"""A relative time that says that there is no such sample."""
INTEGRALS: Final = (("delta_angle", "delta_angle_dt"), ("delta_velocity", "delta_velocity_dt"))
"""vehicle_imu: rad and m/s, body FRD, each with its interval in us."""
XYZ: Final = ("x", "y", "z")
TESLA_PER_GAUSS: Final = 1e-4
LEAST_HZ: Final = 10.0
"""An instance that is logged more slowly is there to be looked at, not to be integrated."""

NAV_STATUS: Final = np.array([-1, -1, 0, 0, 1, 2, 2, 0, 0], np.int8)
"""PX4 fix_type (none, none, 2D, 3D, differential, RTK float, RTK fixed, -, extrapolated) -> NavSatStatus."""


@dataclass(frozen=True)
class Position:
    """Names of a position's fields, and how much of each is a degree and a metre."""

    latitude: str
    longitude: str
    above_ellipsoid: str
    above_sea: str
    degree: float
    metre: float


POSITIONS: Final = (
    Position("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "altitude_msl_m", 1.0, 1.0),
    Position("lat", "lon", "alt_ellipsoid", "alt", 1e7, 1e3),
)
"""PX4 1.14 and later, and before."""
ELLIPSOID: Final = "above the WGS 84 ellipsoid"
SEA_LEVEL: Final = "above mean sea level"


def imu(log: Log, clock: Clock) -> Iterator[Columns]:
    """``/imu0`` is sensor_combined, ``/imu{k+1}`` vehicle_imu k, or sensor_gyro k with sensor_accel k."""
    for topic in log.named(COMBINED)[:1]:
        if topic.has_array(3, *COMBINED_FIELDS):
            yield _combined(topic, clock)
    whole, gyros, accels = (_instances(log, name) for name in ("vehicle_imu", "sensor_gyro", "sensor_accel"))
    for k in sorted(whole.keys() | (gyros.keys() & accels.keys())):
        columns = _integrated(k, whole[k], clock) if k in whole else None
        if columns is None and k in gyros and k in accels:
            columns = _raw(k, gyros[k], accels[k], clock)
        if columns is not None:
            yield columns


def _instances(log: Log, name: str) -> dict[int, Topic]:
    found: dict[int, Topic] = {}
    for topic in log.named(name):
        found.setdefault(topic.multi_id, topic)
    return found


def _combined(topic: Topic, clock: Clock) -> Columns:
    stamps = clock.stamps(topic)
    rate, force = (_body(topic[name]) for name in COMBINED_FIELDS)
    metadata = _instance(topic)
    delay = topic.integers(ACCEL_DELAY) if topic.has(ACCEL_DELAY) else np.zeros(len(topic), np.int64)
    known = delay != INVALID
    if np.any(delay) and np.any(known):
        force = _at(stamps, clock.earlier(topic, np.where(known, -delay, 0))[known], force[known])
        metadata["specific_force"] = "interpolated to the gyroscope's samples"
    return imu_columns("/imu0/data_raw", stamps, rate, force, source=topic.name, metadata=metadata)


def _integrated(k: int, topic: Topic, clock: Clock) -> Columns | None:
    """Increments over their intervals, at the end of the interval."""
    if not (topic.has_array(3, *(name for name, _ in INTEGRALS)) and topic.has(*(dt for _, dt in INTEGRALS))):
        return None
    intervals = [topic.integers(interval) for _, interval in INTEGRALS]
    good = (intervals[0] > 0) & (intervals[1] > 0)
    stamps = clock.sampled(topic)[good]
    if not _fast(stamps):
        return None
    rate, force = (
        _body(topic[name][good]) / (interval[good, np.newaxis] * 1e-6)
        for (name, _), interval in zip(INTEGRALS, intervals, strict=True)
    )
    metadata = _instance(topic) | ({} if np.all(good) else {"left_out": str(int(np.count_nonzero(~good)))})
    return imu_columns(f"/imu{k + 1}/data_raw", stamps, rate, force, source=topic.name, metadata=metadata)


def _raw(k: int, gyro: Topic, accel: Topic, clock: Clock) -> Columns | None:
    """The gyroscope's samples, each with the specific force interpolated to its time."""
    if not (gyro.has(*XYZ) and accel.has(*XYZ)):
        return None
    stamps, accel_stamps = clock.sampled(gyro), clock.sampled(accel)
    inside = (stamps >= accel_stamps.min()) & (stamps <= accel_stamps.max())
    if not (_fast(accel_stamps) and _fast(stamps[inside])):
        return None
    force = _at(stamps[inside], accel_stamps, _body(_vectors(accel)))
    metadata = _instance(gyro) | {
        "specific_force": f"{accel.name}, interpolated to the gyroscope's samples",
        "calibration": "none, as the driver published it",
    }
    source = f"{gyro.name}+{accel.name}"
    rate = _body(_vectors(gyro)[inside])
    return imu_columns(f"/imu{k + 1}/data_raw", stamps[inside], rate, force, source=source, metadata=metadata)


def mag(log: Log, clock: Clock) -> Iterator[Columns]:
    """The magnetometer in an old sensor_combined is ``/mag0``, and the others count from 1; else from 0:
    vehicle_magnetometer k, or sensor_mag k where there is none."""
    base = 0
    for topic in log.named(COMBINED)[:1]:
        if (
            topic.has_array(3, "magnetometer_ga")
            and topic.has(MAG_DELAY)
            and np.any(topic.integers(MAG_DELAY) != INVALID)
        ):
            base = 1
            yield _combined_mag(topic, clock)
    calibrated, raw = _instances(log, "vehicle_magnetometer"), _instances(log, "sensor_mag")
    for k in sorted(calibrated.keys() | raw.keys()):
        topic = calibrated.get(k, raw.get(k))  # type: ignore[assignment]
        if topic.has_array(3, "magnetometer_ga"):
            yield _mag(base + k, topic, clock.sampled(topic), topic["magnetometer_ga"], {})
        elif topic.has(*XYZ):
            about = {"calibration": "none, as the driver published it"}
            yield _mag(base + k, topic, clock.sampled(topic), _vectors(topic), about)


def _combined_mag(topic: Topic, clock: Clock) -> Columns:
    """Every sample once: a message repeats the last one until there is another."""
    delay = topic.integers(MAG_DELAY)
    stamps = clock.earlier(topic, np.where(delay == INVALID, 0, -delay))
    good = delay != INVALID
    repeated = {"repeated": str(int(np.count_nonzero(np.diff(stamps[good]) == 0)))}
    return _mag(0, topic, stamps[good], topic["magnetometer_ga"][good], repeated)


def _mag(n: int, topic: Topic, stamps: Ints, gauss: NDArray[np.generic], about: dict[str, str]) -> Columns:
    fresh = np.append(True, np.diff(stamps) != 0)
    field = _body(gauss[fresh]) * TESLA_PER_GAUSS
    metadata = _instance(topic) | about
    return mag_columns(f"/mag{n}/field", stamps[fresh], field, source=topic.name, metadata=metadata)


def gnss(log: Log, clock: Clock) -> Iterator[Columns]:
    """vehicle_gps_position k is ``/gnss{k}``; sensor_gps follows behind it, or is ``/gnss{k}`` without it."""
    base = 0
    for name in ("vehicle_gps_position", "sensor_gps"):
        instances = _instances(log, name)
        for k, topic in instances.items():
            kind = next((p for p in POSITIONS if topic.has(p.latitude, p.longitude, p.above_sea)), None)
            if kind is not None:
                yield _fix(base + k, topic, kind, clock)
        base += max(instances, default=-1) + 1


def _fix(n: int, topic: Topic, kind: Position, clock: Clock) -> Columns:
    told = topic.has(kind.above_ellipsoid) and bool(np.any(topic[kind.above_ellipsoid]))
    height = topic[kind.above_ellipsoid if told else kind.above_sea]
    fix_type = topic.integers("fix_type") if topic.has("fix_type") else np.full(len(topic), 3)
    return fix_columns(
        f"/gnss{n}/fix",
        clock.sampled(topic),
        topic[kind.latitude].astype(np.float64) / kind.degree,
        topic[kind.longitude].astype(np.float64) / kind.degree,
        height.astype(np.float64) / kind.metre,
        NAV_STATUS[np.clip(fix_type, 0, len(NAV_STATUS) - 1)],
        source=topic.name,
        metadata=_instance(topic) | {"altitude": ELLIPSOID if told else SEA_LEVEL},
    )


def _body(vectors: NDArray[np.generic]) -> Floats:
    """Body FRD (n, 3) as stored -> body FLU."""
    with np.errstate(invalid="ignore"):  # a damaged value may be a signaling NaN
        return flu_from_frd(vectors[:, :3].astype(np.float64))


def _vectors(topic: Topic) -> NDArray[np.generic]:
    return np.stack([topic[name] for name in XYZ], axis=-1)


def _at(stamps: Ints, times: Ints, values: Floats) -> Floats:
    """Values (m, 3) at ``times`` (m,), interpolated to ``stamps`` (n,)."""
    order = np.argsort(times, kind="stable")
    origin = times[order[0]]
    at, known = (stamps - origin).astype(np.float64), (times[order] - origin).astype(np.float64)
    return np.stack([np.interp(at, known, values[order, axis]) for axis in range(3)], axis=-1)


def _fast(stamps: Ints) -> bool:
    """Whether samples come often enough to be integrated."""
    return len(stamps) > 1 and float(np.median(np.diff(stamps))) * 1e-9 <= 1.0 / LEAST_HZ


def _instance(topic: Topic) -> dict[str, str]:
    return {"multi_id": str(topic.multi_id)}
