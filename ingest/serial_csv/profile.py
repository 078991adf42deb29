"""CSV options from a TOML profile, so that a logger's columns are described once.

columns = ["t_us", "ax", "ay", "az", "gx", "gy", "gz"]   # or [names] for files with a header
rate_hz = 100.0           # instead of a column of times
time_unit = "us"
axes = "flu"              # or "frd"
strict = false
normalize = false
sensor = "mpu9250"        # or the table [sensor]

[names]                   # the file's own names -> what they mean
"Accel X" = "ax_g"
[units]
accel = "g"
gyro = "deg/s"
[attitude]
reference = true
world = "ned"             # enu, nwu, ned
euler = "zyx"
[topics]
imu = "/imu1/data_raw"
[sensor]
name = "mine"
accel_lsb_per_g = 8192
gyro_lsb_per_dps = 65.5
mag_ut_per_lsb = 0.15
mag_axes = ["y", "x", "-z"]
"""

import tomllib
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

from ...schemas.csv_options import AttitudeColumns, CsvOptions, World
from ...schemas.errors import InputError, UsageError
from ...schemas.sensors import SensorProfile, profile
from .units import NANOSECONDS

_AXES: Final = ("flu", "frd")


def csv_options(profile_path: str | Path | None = None, **said: Any) -> CsvOptions:
    """The options of a TOML profile, with whatever else is ``said`` (fields of `CsvOptions`) in its place.

    InputError where the profile cannot be read; UsageError where an entry is unknown or has no such value.
    """
    base = CsvOptions() if profile_path is None else _load(Path(profile_path))
    return checked(replace(base, **{name: value for name, value in said.items() if value is not None}))


def checked(options: CsvOptions) -> CsvOptions:
    """The same options; UsageError where one has no such value."""
    if options.time_unit is not None and options.time_unit not in NANOSECONDS:
        raise UsageError(f"{options.time_unit!r} is no unit of time; there are: {', '.join(NANOSECONDS)}")
    if options.rate_hz is not None and not options.rate_hz > 0:
        raise UsageError(f"a rate of {options.rate_hz:g} Hz is not above 0")
    if options.axes not in _AXES:
        raise UsageError(f"{options.axes!r} are no axes; there are: {', '.join(_AXES)}")
    return options


def _load(path: Path) -> CsvOptions:
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is no TOML: {error}") from error
    _only_fields_of(CsvOptions, entries, path)
    values = dict(entries)
    if "columns" in values:
        values["columns"] = tuple(values["columns"])
    if "attitude" in values:
        values["attitude"] = _attitude(values["attitude"], path)
    if "sensor" in values:
        values["sensor"] = _sensor(values["sensor"], path)
    return CsvOptions(**values)


def _only_fields_of(kind: type, entries: Mapping[str, Any], path: Path) -> None:
    known = [field.name for field in fields(kind)]
    for name in entries:
        if name not in known:
            raise UsageError(f"{path}: knows no entry {name!r}; there are: {', '.join(known)}")


def _attitude(entries: Mapping[str, Any], path: Path) -> AttitudeColumns:
    _only_fields_of(AttitudeColumns, entries, path)
    values = dict(entries)
    if "world" in values:
        try:
            values["world"] = World(values["world"])
        except ValueError:
            raise UsageError(f"{path}: world = {values['world']!r}; there are: {', '.join(World)}") from None
    return AttitudeColumns(**values)


def _sensor(said: str | Mapping[str, Any], path: Path) -> SensorProfile:
    if isinstance(said, str):
        return profile(said)
    _only_fields_of(SensorProfile, said, path)
    try:
        return SensorProfile(**{"name": path.stem, **said, "mag_axes": tuple(said.get("mag_axes", ("x", "y", "z")))})
    except TypeError as error:
        raise UsageError(f"{path}: [sensor] needs accel_lsb_per_g, gyro_lsb_per_dps and mag_ut_per_lsb") from error
