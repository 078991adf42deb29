"""RepoIMU trials: IMU on a stick or on a pendulum, and a Vicon system's quaternion as the reference.

A. Szczesna, P. Skurowski, P. Pruszowski, D. Peszor, M. Paszkuta, K. Wojciechowski, ICCVG 2016, LNCS 9972, pp. 509-520,
doi:10.1007/978-3-319-46418-3_45. A file is a CSV with semicolons and two lines of header: time [s], Vicon quaternion
w x y z (from the trial's first pose), acceleration [m/s^2], angular rate [rad/s], field (of about unit norm).
"""

import re
from dataclasses import replace
from typing import Final

import numpy as np

from ...schemas import AttitudeColumns, Columns, CsvOptions, Ingested, IngestOptions, Source, World
from ...schemas.finding import Finding, Kind, Severity
from ...schemas.unified import attitude_columns, quaternions, vectors
from .. import serial_csv
from .frames import frames

FORMAT: Final = "repoimu"
REFERENCE: Final = "/reference/attitude"
UNITS: Final = {"accel": "m/s^2", "gyro": "rad/s", "mag": "a.u."}
_FIRST_LINE: Final = re.compile(rb"^(?:\xef\xbb\xbf)?\"?Time \(s\)\"?[;,\t]\"?Vicon Orientation", re.IGNORECASE)


def recognizes(head: bytes) -> bool:
    """Whether a file that begins with ``head`` has the header of a RepoIMU trial."""
    return _FIRST_LINE.match(head) is not None


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """The trial as columns, its reference turned into the sensor's axes and into a world whose z is up.

    Raises InputError where the file holds no trial.
    """
    said = options or IngestOptions()
    attitude = AttitudeColumns(World.ENU, reference=True)
    csv = CsvOptions(units=UNITS, time_unit="s", normalize=said.csv.normalize, attitude=attitude)
    done = serial_csv.read(source, replace(said, csv=csv))
    by_topic = {columns.channel.topic: columns for columns in done.columns}
    reference = by_topic.get(REFERENCE)
    imu = by_topic.get("/imu0/data_raw")
    if reference is None or imu is None:
        return replace(done, format=FORMAT)
    by_topic[REFERENCE], findings = _aligned(imu, reference)
    return replace(done, format=FORMAT, columns=tuple(by_topic.values()), findings=(*done.findings, *findings))


def _aligned(imu: Columns, reference: Columns) -> tuple[Columns, list[Finding]]:
    """The reference after R_W and R_B of `frames`, which its metadata tell; a finding where R_B could not be told."""
    rate, force = vectors(imu.data, "angular_velocity"), vectors(imu.data, "linear_acceleration")
    printed = quaternions(reference.data)
    found = frames(imu.time_ns, rate, force, reference.time_ns, printed)
    about = dict(reference.channel.metadata) | {
        "north": "arbitrary",
        "aligned": "R = R_W R_vicon R_B: R_B by angular rates, R_W levels the mean specific force",
        "world_rotation_xyzw": " ".join(f"{value:.9f}" for value in found.world),
        "body_rotation_xyzw": " ".join(f"{value:.9f}" for value in found.body),
        "rate_residual_deg_s": f"{np.degrees(found.residual):.3f}",
    }
    about.pop("source")
    q = found.applied_to(printed)
    columns = attitude_columns(
        REFERENCE, reference.time_ns, q, child_frame_id="reference", source="Vicon Orientation", metadata=about
    )
    if np.isfinite(found.residual):
        return columns, []
    advice = "too little rotation to tell how the markers sit on the sensor: their axes are taken to be the same"
    start, end = int(reference.time_ns[0]), int(reference.time_ns[-1])
    return columns, [Finding(start, end, Severity.WARN, Kind.UNITS, REFERENCE, 0.0, "", advice)]
