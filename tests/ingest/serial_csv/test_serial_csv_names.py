"""Names and units of the common loggers."""

import pytest

from attlog.ingest.serial_csv.names import Meaning, meaning
from attlog.ingest.serial_csv.units import Quantity, canonical

A, W, M, Q, E, T = Quantity.ACCEL, Quantity.GYRO, Quantity.MAG, Quantity.QUATERNION, Quantity.EULER, Quantity.TIME


@pytest.mark.parametrize(
    ("cell", "quantity", "axis", "unit"),
    [
        ("Gyroscope X (deg/s)", W, "x", "deg/s"),  # x-IMU3, NGIMU
        ("Accelerometer Z (g)", A, "z", "g"),
        ("Magnetometer Y (uT)", M, "y", "uT"),
        ("Time (s)", T, "", "s"),
        ("Timestamp (us)", T, "", "us"),
        ("ax_g", A, "x", "g"),
        ("ay_mg", A, "y", "mg"),
        ("gz_dps", W, "z", "deg/s"),
        ("acc_x_m_s2", A, "x", "m/s^2"),
        ("gyro_x_rad_s", W, "x", "rad/s"),
        ("mx_uT", M, "x", "uT"),
        ("mag_x_gauss", M, "x", "G"),
        ("t_us", T, "", "us"),
        ("millis", T, "", "ms"),
        ("micros()", T, "", "us"),
        ("seconds_elapsed", T, "", "s"),
        ("SampleTimeFine", T, "", "us"),  # Movella
        ("Acc_X", A, "x", ""),
        ("Gyr_Z", W, "z", ""),
        ("Quat_q0", Q, "w", ""),
        ("AccX", A, "x", ""),
        ("w_RS_S_x [rad s^-1]", W, "x", "rad/s"),  # EuRoC
        ("a_RS_S_z [m s^-2]", A, "z", "m/s^2"),
        ("#timestamp [ns]", T, "", "ns"),
        ("q_RS_w []", Q, "w", ""),
        ("Magnetic field x (µT)", M, "x", "uT"),  # phyphox
        ("Acceleration y (m/s^2)", A, "y", "m/s^2"),
        ("gFx", A, "x", ""),  # Physics Toolbox
        ("accelerometerAccelerationX(G)", A, "x", "g"),  # SensorLog
        ("gyroRotationX(rad/s)", W, "x", "rad/s"),
        ("field.linear_acceleration.x", A, "x", ""),  # rostopic echo -p
        ("Roll (deg)", E, "roll", "deg"),
        ("heading", E, "yaw", ""),
        ("Euler_Y", E, "pitch", ""),
        ("q3", Q, "z", ""),
    ],
)
def test_names_that_are_known(cell: str, quantity: Quantity, axis: str, unit: str) -> None:
    assert meaning(cell) == Meaning(quantity, axis, unit)


@pytest.mark.parametrize(
    "cell",
    [
        "Temperature (°C)",
        "temp_C",
        "pressure",
        "lat",
        "PacketCounter",
        "p_RS_R_x [m]",
        "b_w_RS_S_x [rad s^-1]",
        "x",
        "",
    ],
)
def test_names_that_say_nothing(cell: str) -> None:
    assert meaning(cell).quantity is Quantity.OTHER


def test_numbers_and_truth_in_names() -> None:
    assert meaning("imu1_ax").instance == 1
    assert meaning("acc2_y").instance == 2
    assert meaning("ref_qw") == Meaning(Q, "w", truth=True)
    assert meaning("Vicon Orientation W") == Meaning(Q, "w", truth=True)


@pytest.mark.parametrize(
    ("spelled", "quantity", "unit"),
    [
        ("M/S²", A, "m/s^2"),
        ("m/(sec^2)", A, "m/s^2"),
        ("mg", A, "mg"),
        ("mG", M, "mG"),
        ("G", M, "G"),
        ("T", M, "T"),
        ("°/s", W, "deg/s"),
        ("rad s⁻¹", W, "rad/s"),
        ("LSB", W, "raw"),
        ("furlong", A, None),
    ],
)
def test_units_as_people_spell_them(spelled: str, quantity: Quantity, unit: str | None) -> None:
    assert canonical(spelled, quantity) == unit
