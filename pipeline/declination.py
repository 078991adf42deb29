"""The declination that turns a magnetic heading into a true one."""

import dataclasses
import math
from collections.abc import Mapping
from datetime import UTC, datetime

from ..schemas import records
from ..schemas.errors import UsageError
from ..schemas.finding import Finding, Kind, Severity
from ..schemas.recording import Declination, Fix, Recording

DECLINATION_PARAMETERS = {"COMPASS_DEC": math.degrees(1.0), "EKF2_MAG_DECL": 1.0, "ATT_MAG_DECL": 1.0}
"""Parameters of ArduPilot and PX4 with the degrees that one of their units is."""
FIRST_UTC_NS = 946_684_800 * 1_000_000_000  # 2000-01-01: stamps before it count from boot, not from 1970


def with_declination(recording: Recording, stated_deg: float | None) -> tuple[Recording, list[Finding]]:
    """The recording with its declination: as stated, else the autopilot's parameter, else the World Magnetic Model at
    the first fix and its date, else 0 with a finding."""
    parameters = recording.metadata.get(records.PARAMETERS, {}) if not recording.prefix else {}
    found = _stated(stated_deg) or _parameter(parameters) or _model(recording.gnss)
    if found is not None or not recording.mag:
        return dataclasses.replace(recording, declination=found or Declination(0.0, "not needed")), []
    start = min(int(mag.time_ns[0]) for mag in recording.mag.values())
    advice = "no declination known: headings count from magnetic north; give --declination DEGREES"
    topic = f"{recording.prefix}/mag{min(recording.mag)}/field"
    finding = Finding(start, start, Severity.WARN, Kind.DECLINATION, topic, 0.0, "deg", advice)
    return dataclasses.replace(recording, declination=None), [finding]


def _stated(degrees: float | None) -> Declination | None:
    if degrees is None:
        return None
    if not abs(degrees) <= 180.0:
        raise UsageError(f"a declination of {degrees} degrees; it lies from -180 to 180, east positive")
    return Declination(degrees, "stated")


def _parameter(parameters: Mapping[str, str]) -> Declination | None:
    for name, degrees in DECLINATION_PARAMETERS.items():
        value = float(parameters.get(name, "nan")) * degrees
        if math.isfinite(value) and value != 0.0:  # the default 0 means that the autopilot has not looked it up yet
            return Declination(value, name)
    return None


def _model(gnss: Mapping[int, Fix]) -> Declination | None:
    fix = next((gnss[number] for number in sorted(gnss) if len(gnss[number].time_ns)), None)
    if fix is None or fix.time_ns[0] < FIRST_UTC_NS:
        return None
    from pygeomag import GeoMag

    moment = datetime.fromtimestamp(int(fix.time_ns[0]) / 1e9, tz=UTC)
    year = moment.year + (moment.timetuple().tm_yday - 1) / 365.25
    height_km = float(fix.altitude_m[0]) / 1000.0
    try:
        model = GeoMag(base_year=int(year))
        field = model.calculate(float(fix.latitude_deg[0]), float(fix.longitude_deg[0]), height_km, year)
    except ValueError:  # a date that no model covers
        return None
    return Declination(float(field.d), f"World Magnetic Model at {fix.topic}")
