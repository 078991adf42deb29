"""Which message types hold a sensor or an attitude, in whatever encoding, and where in them."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from ... import storage


class Kind(StrEnum):
    """What a channel can be taken for."""

    IMU = "imu"
    MAG = "mag"
    GNSS = "gnss"
    ATTITUDE = "attitude"
    TRANSFORMS = "transforms"


@dataclass(frozen=True)
class Shape:
    """Where a type holds its orientation (or what else it measures); ``child`` names the frame that turns."""

    kind: Kind
    orientation: tuple[str, ...] = ()
    child: str = "child_frame_id"


SHAPES: Mapping[str, Shape] = {
    "sensor_msgs/Imu": Shape(Kind.IMU, ("orientation",)),
    "sensor_msgs/MagneticField": Shape(Kind.MAG),
    "sensor_msgs/NavSatFix": Shape(Kind.GNSS),
    "foxglove/LocationFix": Shape(Kind.GNSS),
    "attlog_msgs/Attitude": Shape(Kind.ATTITUDE, ("orientation",)),
    "geometry_msgs/PoseStamped": Shape(Kind.ATTITUDE, ("pose", "orientation")),
    "geometry_msgs/PoseWithCovarianceStamped": Shape(Kind.ATTITUDE, ("pose", "pose", "orientation")),
    "geometry_msgs/QuaternionStamped": Shape(Kind.ATTITUDE, ("quaternion",)),
    "geometry_msgs/TransformStamped": Shape(Kind.ATTITUDE, ("transform", "rotation")),
    "nav_msgs/Odometry": Shape(Kind.ATTITUDE, ("pose", "pose", "orientation")),
    "foxglove/PoseInFrame": Shape(Kind.ATTITUDE, ("pose", "orientation")),
    "foxglove/FrameTransform": Shape(Kind.ATTITUDE, ("rotation",)),
    "tf2_msgs/TFMessage": Shape(Kind.TRANSFORMS, ("transform", "rotation")),
    "tf/tfMessage": Shape(Kind.TRANSFORMS, ("transform", "rotation")),
    "foxglove/FrameTransforms": Shape(Kind.TRANSFORMS, ("rotation",)),
}
"""By type name without ``/msg``; Foxglove's schemas under one name for JSON and ROS."""
ATTITUDES = frozenset({Kind.ATTITUDE, Kind.TRANSFORMS, Kind.IMU})
"""What a reference or an onboard attitude can be taken from."""


def shape_of(info: storage.ChannelInfo) -> Shape | None:
    """The shape of a channel's type; None where attlog makes nothing of it, or its messages are not decoded."""
    return None if info.raw else SHAPES.get(plain_name(info.schema_name))


def plain_name(schema: str) -> str:
    """``sensor_msgs/msg/Imu`` -> ``sensor_msgs/Imu``, ``foxglove.PoseInFrame`` -> ``foxglove/PoseInFrame``."""
    parts = schema.replace("::", "/").replace(".", "/").split("/")
    package = "foxglove" if parts[0] == "foxglove_msgs" else parts[0]
    return f"{package}/{parts[-1]}" if len(parts) > 1 else schema
