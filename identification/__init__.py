"""What a log tells about its sensors: how two clocks differ."""

from .align import align
from .turning import Turning, from_attitude, from_imu

__all__ = ["Turning", "align", "from_attitude", "from_imu"]
