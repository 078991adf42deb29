"""The unit of each field: of ROS's own types by what their documentation says, of others by their comments."""

import re
from collections.abc import Mapping

from .definition import Field, MessageType, short_name

_STANDARD: Mapping[str, Mapping[str, str]] = {
    "builtin_interfaces/Time": {"sec": "s", "nanosec": "ns"},
    "builtin_interfaces/Duration": {"sec": "s", "nanosec": "ns"},
    "ros1/Time": {"sec": "s", "nanosec": "ns"},
    "ros1/Duration": {"sec": "s", "nanosec": "ns"},
    "sensor_msgs/Imu": {
        "angular_velocity": "rad/s",
        "linear_acceleration": "m/s^2",
        "orientation_covariance": "rad^2",
        "angular_velocity_covariance": "rad^2/s^2",
        "linear_acceleration_covariance": "m^2/s^4",
    },
    "sensor_msgs/MagneticField": {"magnetic_field": "T", "magnetic_field_covariance": "T^2"},
    "sensor_msgs/NavSatFix": {"latitude": "deg", "longitude": "deg", "altitude": "m", "position_covariance": "m^2"},
    "sensor_msgs/FluidPressure": {"fluid_pressure": "Pa", "variance": "Pa^2"},
    "sensor_msgs/Temperature": {"temperature": "degC", "variance": "degC^2"},
    "geometry_msgs/Pose": {"position": "m"},
    "geometry_msgs/Transform": {"translation": "m"},
    "geometry_msgs/Twist": {"linear": "m/s", "angular": "rad/s"},
}
_GENERATED = re.compile(r"^\S+(?: \[(?P<unit>[^\]]*)\])?(?: x(?P<multiplier>[-+0-9.e]+))?(?:\s|$)")
_WORD = re.compile(r"^(?:specific force, )?(?P<unit>rad(?:\^2)?(?:/s(?:\^2)?)?|m/s\^2|m/s|m|s|T|deg|degC|Pa)(?:[, ]|$)")


def unit_of(message: MessageType, field: Field) -> str:
    """The unit that values of the field are stored in; empty where it is not said. ``1e-07 deg`` is a multiple."""
    stated = _STANDARD.get(short_name(message.name), {}).get(field.name)
    if stated is not None:
        return stated
    word = _WORD.match(field.comment)
    if word:
        return word["unit"]
    match = _GENERATED.match(field.comment)
    if match is None or not (match["unit"] or match["multiplier"]):
        return ""
    return " ".join(part for part in (match["multiplier"], match["unit"]) if part)
