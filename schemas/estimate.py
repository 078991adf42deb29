"""What an estimator returns."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntFlag, StrEnum

import numpy as np
from numpy.typing import NDArray

from .columns import Time
from .finding import Finding
from .recording import Attitude, Floats


class Status(IntFlag):
    """Bits of an estimate's status; the constants of attlog_msgs/msg/AttitudeEstimate."""

    RESTART = 1
    COASTING = 2
    MAGNETOMETER_REJECTED = 4
    ACCELEROMETER_REJECTED = 8
    LOW_RATE = 16
    MAGNETOMETER_MISSING = 32
    DIVERGED = 64


class North(StrEnum):
    """What the heading of an estimate counts from."""

    TRUE = "true"
    MAGNETIC = "magnetic"
    ARBITRARY = "arbitrary"


@dataclass(frozen=True, eq=False)
class Estimate:
    """An attitude estimate at each IMU sample; NaN where the estimator does not estimate a quantity.

    ``orientation`` (n, 4) x y z w, body FLU to world ENU. ``angular_velocity``, ``gyro_bias``, ``rate_sigma``,
    ``bias_sigma`` (n, 3) rad/s, body. ``attitude_covariance`` (n, 9) rad^2, right error R = R_est Exp(d), body.
    ``rpy_sigma_deg`` (n, 3). ``state`` (n, k), ``state_covariance`` (n, k*k), ``innovation`` (n, m),
    ``innovation_covariance`` (n, m*m), in the order of ``state_names`` and ``innovation_names``. ``status`` (n,).
    """

    name: str
    estimator: str
    time_ns: Time
    orientation: Floats
    angular_velocity: Floats
    gyro_bias: Floats
    attitude_covariance: Floats
    rpy_sigma_deg: Floats
    rate_sigma: Floats
    bias_sigma: Floats
    state: Floats
    state_covariance: Floats
    innovation: Floats
    innovation_covariance: Floats
    status: NDArray[np.uint32]
    state_names: tuple[str, ...] = ()
    innovation_names: tuple[str, ...] = ()
    parameters: Mapping[str, object] = dataclasses.field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    north: North = North.TRUE
    declination_deg: float = 0.0
    findings: tuple[Finding, ...] = ()

    @property
    def attitude(self) -> Attitude:
        """The attitudes alone, as analysis takes them."""
        metadata = {"north": str(self.north), "declination_deg": f"{self.declination_deg:g}"}
        return Attitude(self.time_ns, self.orientation, self.name, f"/estimate/{self.name}/attitude", metadata)
