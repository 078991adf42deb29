"""Where a run takes place: the Earth's field there, and local metres to degrees."""

from dataclasses import dataclass

import numpy as np

from .motion import Floats

# WGS 84 (NIMA TR8350.2).
SEMI_MAJOR_M = 6378137.0
ECCENTRICITY_SQUARED = 6.69437999014e-3


@dataclass(frozen=True)
class Place:
    """The origin of the local ENU world, and its magnetic field: declination east and inclination down positive."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    declination_deg: float
    inclination_deg: float
    field_t: float

    @property
    def field_enu(self) -> Floats:
        """The field (3,), tesla."""
        declination, inclination = np.radians([self.declination_deg, self.inclination_deg])
        level = np.cos(inclination)
        direction = [level * np.sin(declination), level * np.cos(declination), -np.sin(inclination)]
        return self.field_t * np.array(direction)

    def geodetic(self, position: Floats) -> Floats:
        """Latitude, longitude in degrees and altitude in m (n, 3), of ENU positions (n, 3) within some kilometres."""
        sine = np.sin(np.radians(self.latitude_deg))
        factor = 1.0 - ECCENTRICITY_SQUARED * sine * sine
        meridian = SEMI_MAJOR_M * (1.0 - ECCENTRICITY_SQUARED) / factor**1.5 + self.altitude_m
        parallel = (SEMI_MAJOR_M / np.sqrt(factor) + self.altitude_m) * np.cos(np.radians(self.latitude_deg))
        latitude = self.latitude_deg + np.degrees(position[:, 1] / meridian)
        longitude = self.longitude_deg + np.degrees(position[:, 0] / parallel)
        return np.stack([latitude, longitude, self.altitude_m + position[:, 2]], axis=-1)
