"""IMU, MAG and GPS records as attlog's own channels: body FLU, SI units, the sample's own time."""

import re
from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.frames import flu_from_frd
from ...schemas import Columns
from ...schemas.unified import fix_columns, imu_columns, mag_columns
from .clock import FIX_3D, Clock
from .log import Log, Records

Ints = NDArray[np.int64]

GYRO: Final = ("GyrX", "GyrY", "GyrZ")
"""rad/s, body FRD."""
ACCEL: Final = ("AccX", "AccY", "AccZ")
"""m/s^2, body FRD."""
MAG: Final = ("MagX", "MagY", "MagZ")
"""Milligauss, body FRD, offsets and motor compensation already applied (OfsX and MOX say how much)."""
TESLA_PER_MILLIGAUSS: Final = 1e-7

INSTANCE_COLUMNS: Final = ("I", "Instance", "Inst")
"""Columns that number the sensor in logs without FMTU."""

FIX_2D: Final = 2
NAV_STATUS: Final = np.array([-1, -1, 0, 0, 1, 2, 2], np.int8)
"""AP_GPS status (none, no fix, 2D, 3D, differential, RTK float, RTK fixed) -> sensor_msgs/NavSatStatus."""

OWN_TIME_AGE_US: Final = 60_000_000
"""A sample's own time is believed up to this age."""


def numbered(log: Log, name: str) -> dict[int, Records]:
    """Records of ``name`` by instance: column I, or the number in the name (IMU, IMU2, IMU3 are 0, 1, 2)."""
    found: dict[int, Records] = {}
    for records in log.records:
        match = re.fullmatch(rf"{name}([0-9])?", records.format.name)
        if match is None or len(records) == 0:
            continue
        base = max(int(match[1] or 1) - 1, 0)
        for part in _by_instance(records):
            found.setdefault(base if part.instance is None else int(part.instance), part)
    return dict(sorted(found.items()))


def _by_instance(records: Records) -> Iterator[Records]:
    if records.instance is not None:
        if isinstance(records.instance, int):
            yield records
        return
    column = next((c for c in INSTANCE_COLUMNS if c in records.format.columns), None)
    if column is None:
        yield records
    else:
        yield from records.by_column(column)


def imu(log: Log, clock: Clock) -> Iterator[Columns]:
    """``/imu{n}/data_raw``: IMU records, or GYR and ACC ones where the raw samples are logged."""
    whole, gyros, accels = numbered(log, "IMU"), numbered(log, "GYR"), numbered(log, "ACC")
    for n in sorted(whole.keys() | (gyros.keys() & accels.keys())):
        raw = gyros.get(n) if n in accels else None
        if raw is not None and raw.format.has(*GYRO) and (n not in whole or len(raw) >= len(whole[n])):
            columns = _raw_imu(n, raw, accels[n], clock)
            if columns is not None:
                yield columns
                continue
        if n in whole and whole[n].format.has(*GYRO, *ACCEL):
            records = whole[n]
            rates, forces = _body(records, GYRO), _body(records, ACCEL)
            topic, source, metadata = f"/imu{n}/data_raw", records.format.name, _instance(records)
            yield imu_columns(topic, clock.stamps(records), rates, forces, source=source, metadata=metadata)


def _raw_imu(n: int, gyro: Records, accel: Records, clock: Clock) -> Columns | None:
    """Gyroscope samples, each with the specific force interpolated to its time; None where the two do not overlap."""
    if not accel.format.has(*ACCEL):
        return None
    gyro_ns, accel_ns = _own_stamps(gyro, clock, "SampleUS"), _own_stamps(accel, clock, "SampleUS")
    order = np.argsort(accel_ns, kind="stable")
    at, force = accel_ns[order], _body(accel, ACCEL)[order]
    inside = (gyro_ns >= at[0]) & (gyro_ns <= at[-1])
    if not np.any(inside):
        return None
    stamps = gyro_ns[inside]
    specific = np.stack([np.interp(stamps - at[0], at - at[0], force[:, axis]) for axis in range(3)], axis=1)
    metadata = {**_instance(gyro), "specific_force": f"{accel.format.name}, interpolated to {gyro.format.name}"}
    topic, source = f"/imu{n}/data_raw", f"{gyro.format.name}+{accel.format.name}"
    return imu_columns(topic, stamps, _body(gyro, GYRO)[inside], specific, source=source, metadata=metadata)


def mag(log: Log, clock: Clock) -> Iterator[Columns]:
    """``/mag{n}/field``: every measurement once. A compass that has stopped has its last one logged again and again."""
    for n, records in numbered(log, "MAG").items():
        if not records.format.has(*MAG):
            continue
        fresh = np.ones(len(records), np.bool_)
        if records.format.has("S"):
            fresh[1:] = (np.diff(records.data["S"].astype(np.int64)) != 0) | (records.data["S"][1:] == 0)
        chosen = records if np.all(fresh) else records.select(fresh, records.instance)
        metadata = _instance(records) | {"repeated": str(len(records) - len(chosen)), "offsets": "applied"}
        stamps = _own_stamps(chosen, clock, "S")
        field = _body(chosen, MAG) * TESLA_PER_MILLIGAUSS
        yield mag_columns(f"/mag{n}/field", stamps, field, source=records.format.name, metadata=metadata)


def gnss(log: Log, clock: Clock) -> Iterator[Columns]:
    """``/gnss{n}/fix``, where there was a fix: degrees, and metres above mean sea level, as ArduPilot logs them."""
    for n, found in numbered(log, "GPS").items():
        records = found
        longitude = next((name for name in ("Lng", "Lon") if records.format.has(name)), None)
        if longitude is None or not records.format.has("Lat", "Alt"):
            continue
        if records.format.has("Status"):
            records = records.select(records.data["Status"] >= FIX_2D, records.instance)
        if len(records) == 0:
            continue
        status = records.data["Status"] if records.format.has("Status") else np.full(len(records), FIX_3D)
        metadata = _instance(records) | {"altitude": "above mean sea level"}
        yield fix_columns(
            f"/gnss{n}/fix",
            clock.stamps(records),
            records.scaled("Lat"),
            records.scaled(longitude),
            records.scaled("Alt"),
            NAV_STATUS[np.minimum(status, len(NAV_STATUS) - 1)],
            source=records.format.name,
            metadata=metadata,
        )


def _own_stamps(records: Records, clock: Clock, column: str) -> Ints:
    """Stamps of the samples' own microseconds since boot in ``column``, which may count 32 bits only."""
    logged = clock.boot_us[records.order]
    if not records.format.has(column):
        return clock.at(logged, records.order)
    own = records.data[column].astype(np.int64)
    age = (logged - own) & 0xFFFFFFFF
    age = np.where(age >= 2**31, age - 2**32, age)
    believed = (own != 0) & (np.abs(age) < OWN_TIME_AGE_US)
    return clock.at(np.where(believed, logged - age, logged), records.order)


def _body(records: Records, names: tuple[str, str, str]) -> NDArray[np.float64]:
    return flu_from_frd(np.stack([records.data[name].astype(np.float64) for name in names], axis=-1))


def _instance(records: Records) -> dict[str, str]:
    return {} if records.instance is None else {"instance": str(records.instance)}
