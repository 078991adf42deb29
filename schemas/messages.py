"""The message types of attlog's channels: ROS 2's own where one exists, ``attlog_msgs`` where none does."""

from collections.abc import Mapping
from typing import Final

from .definition import SEPARATOR, MessageType, short_name

_TEXTS: Final[Mapping[str, str]] = {
    "builtin_interfaces/msg/Time": """\
int32 sec
uint32 nanosec
""",
    "builtin_interfaces/msg/Duration": """\
int32 sec
uint32 nanosec
""",
    "std_msgs/msg/Header": """\
builtin_interfaces/Time stamp
string frame_id
""",
    "std_msgs/msg/ColorRGBA": """\
float32 r
float32 g
float32 b
float32 a
""",
    "geometry_msgs/msg/Vector3": """\
float64 x
float64 y
float64 z
""",
    "geometry_msgs/msg/Point": """\
float64 x
float64 y
float64 z
""",
    "geometry_msgs/msg/Quaternion": """\
float64 x
float64 y
float64 z
float64 w
""",
    "geometry_msgs/msg/Pose": """\
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
""",
    "geometry_msgs/msg/Transform": """\
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
""",
    "geometry_msgs/msg/TransformStamped": """\
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
""",
    "tf2_msgs/msg/TFMessage": """\
geometry_msgs/TransformStamped[] transforms
""",
    "sensor_msgs/msg/Imu": """\
std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance  # first element -1: no orientation
geometry_msgs/Vector3 angular_velocity  # rad/s, body FLU
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration  # specific force, m/s^2, body FLU
float64[9] linear_acceleration_covariance
""",
    "sensor_msgs/msg/MagneticField": """\
std_msgs/Header header
geometry_msgs/Vector3 magnetic_field  # T, body FLU
float64[9] magnetic_field_covariance
""",
    "sensor_msgs/msg/NavSatStatus": """\
int8 STATUS_NO_FIX=-1
int8 STATUS_FIX=0
int8 STATUS_SBAS_FIX=1
int8 STATUS_GBAS_FIX=2
uint16 SERVICE_GPS=1
uint16 SERVICE_GLONASS=2
uint16 SERVICE_COMPASS=4
uint16 SERVICE_GALILEO=8
int8 status
uint16 service
""",
    "sensor_msgs/msg/NavSatFix": """\
uint8 COVARIANCE_TYPE_UNKNOWN=0
uint8 COVARIANCE_TYPE_APPROXIMATED=1
uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN=2
uint8 COVARIANCE_TYPE_KNOWN=3
std_msgs/Header header
sensor_msgs/NavSatStatus status
float64 latitude  # deg, north positive
float64 longitude  # deg, east positive
float64 altitude  # m, as the source gives it
float64[9] position_covariance
uint8 position_covariance_type
""",
    "rcl_interfaces/msg/Log": """\
byte DEBUG=10
byte INFO=20
byte WARN=30
byte ERROR=40
byte FATAL=50
builtin_interfaces/Time stamp
uint8 level
string name
string msg
string file
string function
uint32 line
""",
    "visualization_msgs/msg/MarkerArray": """\
visualization_msgs/Marker[] markers
""",
    "visualization_msgs/msg/Marker": """\
int32 ARROW=0
int32 CUBE=1
int32 SPHERE=2
int32 CYLINDER=3
int32 LINE_STRIP=4
int32 LINE_LIST=5
int32 CUBE_LIST=6
int32 SPHERE_LIST=7
int32 POINTS=8
int32 TEXT_VIEW_FACING=9
int32 MESH_RESOURCE=10
int32 TRIANGLE_LIST=11
int32 ADD=0
int32 MODIFY=0
int32 DELETE=2
int32 DELETEALL=3
std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string texture_resource
sensor_msgs/CompressedImage texture
visualization_msgs/UVCoordinate[] uv_coordinates
string text
string mesh_resource
visualization_msgs/MeshFile mesh_file
bool mesh_use_embedded_materials
""",
    "sensor_msgs/msg/CompressedImage": """\
std_msgs/Header header
string format
uint8[] data
""",
    "visualization_msgs/msg/UVCoordinate": """\
float32 u
float32 v
""",
    "visualization_msgs/msg/MeshFile": """\
string filename
uint8[] data
""",
    "attlog_msgs/msg/Attitude": """\
std_msgs/Header header
string child_frame_id
geometry_msgs/Quaternion orientation  # body FLU to world ENU
float64[3] rpy_ned_deg  # deg, ZYX roll, pitch, yaw of body FRD in NED
""",
    "attlog_msgs/msg/AttitudeEstimate": """\
uint32 RESTART=1
uint32 COASTING=2
uint32 MAGNETOMETER_REJECTED=4
uint32 ACCELEROMETER_REJECTED=8
uint32 LOW_RATE=16
uint32 MAGNETOMETER_MISSING=32
uint32 DIVERGED=64
std_msgs/Header header
string child_frame_id
geometry_msgs/Quaternion orientation  # body FLU to world ENU
float64[3] rpy_ned_deg  # deg, ZYX roll, pitch, yaw of body FRD in NED
geometry_msgs/Vector3 angular_velocity  # rad/s, body FLU, bias removed
geometry_msgs/Vector3 gyro_bias  # rad/s, body FLU
float64[9] attitude_covariance  # rad^2, body, right error: R = R_est Exp(d)
float64[3] rpy_sigma_deg  # deg
float64[3] rate_sigma  # rad/s
float64[3] bias_sigma  # rad/s
float64[] state  # order in the channel's metadata
float64[] state_covariance  # row major
float64[] innovation  # order in the channel's metadata
float64[] innovation_covariance  # row major
uint32 status  # bits named by the constants
""",
    "attlog_msgs/msg/AttitudeError": """\
std_msgs/Header header
float64 total_deg  # deg, angle of R_est R_ref^T
float64 inclination_deg  # deg, angle between the two verticals
float64 heading_deg  # deg, rotation about the vertical, signed as NED yaw
float64 roll_deg  # deg, difference of rpy_ned_deg, wrapped
float64 pitch_deg  # deg
float64 yaw_deg  # deg
bool counted  # false where the Euler angles are near singular or the sample is excluded
""",
    "attlog_msgs/msg/ErrorStatistics": """\
std_msgs/Header header
float64 window_s  # s, length of the window that ends at the stamp
uint32 count
float64[6] mean_deg  # deg: total, inclination, heading, roll, pitch, yaw
float64[6] standard_deviation_deg  # deg, same order
float64[6] rmse_deg  # deg, same order
""",
    "attlog_msgs/msg/Finding": """\
uint8 DEBUG=10
uint8 INFO=20
uint8 WARN=30
uint8 ERROR=40
uint8 FATAL=50
std_msgs/Header header
builtin_interfaces/Time end
uint8 severity
string kind
string topic
float64 value
string unit
string advice
""",
    "attlog_msgs/msg/Inclination": """\
std_msgs/Header header
float64[2] tilt  # rad, theta1 and theta2
""",
    "attlog_msgs/msg/AccelerometerArray": """\
std_msgs/Header header
float64[] acceleration  # m/s^2, one single-axis accelerometer each; places and directions in the metadata
""",
}


def standard(name: str) -> MessageType:
    """The type called ``pkg/msg/Type``; KeyError where attlog writes none of that name."""
    sections = [_TEXTS[name]]
    sections += [f"{SEPARATOR}\nMSG: {short_name(other)}\n{text}" for other, text in _TEXTS.items() if other != name]
    return MessageType.parse(name, "".join(sections))


HEADER: Final = standard("std_msgs/msg/Header")
IMU: Final = standard("sensor_msgs/msg/Imu")
MAGNETIC_FIELD: Final = standard("sensor_msgs/msg/MagneticField")
NAV_SAT_FIX: Final = standard("sensor_msgs/msg/NavSatFix")
INCLINATION: Final = standard("attlog_msgs/msg/Inclination")
ACCELEROMETER_ARRAY: Final = standard("attlog_msgs/msg/AccelerometerArray")
ATTITUDE: Final = standard("attlog_msgs/msg/Attitude")
ATTITUDE_ESTIMATE: Final = standard("attlog_msgs/msg/AttitudeEstimate")
ATTITUDE_ERROR: Final = standard("attlog_msgs/msg/AttitudeError")
ERROR_STATISTICS: Final = standard("attlog_msgs/msg/ErrorStatistics")
FINDING: Final = standard("attlog_msgs/msg/Finding")
LOG: Final = standard("rcl_interfaces/msg/Log")
TF_MESSAGE: Final = standard("tf2_msgs/msg/TFMessage")
MARKER_ARRAY: Final = standard("visualization_msgs/msg/MarkerArray")
