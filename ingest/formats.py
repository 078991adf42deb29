"""The formats that are read, found by content."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from ..schemas.errors import InputError
from ..schemas.source import Ingested, IngestOptions, Source

HEAD_BYTES = 65536


@dataclass(frozen=True)
class Format:
    """A format: what it is, what is read from it, and the module of this room that recognises and reads it.

    A log is a file; where it is a ``folder`` of several, the module tells with ``members`` which of them it reads.
    """

    name: str
    summary: str
    reads: str
    module: str
    folder: bool = False

    def recognizes(self, head: bytes) -> bool:
        """Whether a file that begins with ``head`` is of this format."""
        return not self.folder and bool(self._call("recognizes")(head))

    def members(self, folder: Path) -> tuple[Path, ...]:
        """The files of ``folder`` that make it one log of this format; none where it is not."""
        files = self._call("members")(folder) if self.folder else ()
        assert isinstance(files, tuple)
        return files

    def read(self, source: Source, options: IngestOptions) -> Ingested:
        """The source as columns; InputError where nothing of it can be read."""
        result = self._call("read")(source, options)
        assert isinstance(result, Ingested)
        return result

    def _call(self, function: str) -> Callable[..., object]:
        return getattr(import_module(f".{self.module}", __package__), function)  # type: ignore[no-any-return]


FORMATS: Mapping[str, Format] = {
    form.name: form
    for form in (
        Format(
            "dataflash",
            "ArduPilot DataFlash log, binary (.bin) or text (.log)",
            "IMU or ACC and GYR, MAG, GPS, SIM (truth), ATT, XKQ, XKF1, NKF1, AHR2, DCM, PARM, MSG, MODE, EV, ERR; "
            "every message",
            "dataflash",
        ),
        Format(
            "ulog",
            "PX4 ULog (.ulg)",
            "sensor_combined, vehicle_imu, sensor_accel/gyro/mag, vehicle_magnetometer, vehicle_attitude, "
            "estimator_attitude, groundtruth, GPS, parameters, events; every topic",
            "ulog",
        ),
        Format(
            "mavlink",
            "MAVLink telemetry log (.tlog) or raw MAVLink 1 and 2 stream",
            "RAW_IMU, SCALED_IMU/2/3, HIGHRES_IMU, HIL_STATE_QUATERNION, SIM_STATE, SIMSTATE (truth), ATTITUDE, "
            "ATTITUDE_QUATERNION, AHRS2, GPS, PARAM_VALUE, STATUSTEXT; every message",
            "mavlink",
        ),
        Format(
            "broad",
            "BROAD trial (.mat, .hdf5)",
            "IMU, magnetometer, motion capture as the truth",
            "datasets.broad",
        ),
        Format(
            "repoimu",
            "RepoIMU trial (.csv)",
            "IMU, magnetometer, Vicon as the truth",
            "datasets.repoimu",
        ),
        Format(
            "euroc",
            "EuRoC or TUM-VI sequence (folder)",
            "IMU, ground truth",
            "datasets.euroc",
            folder=True,
        ),
        # The least certain comes last.
        Format(
            "csv",
            "CSV or other table of numbers (Arduino, ESP32, x-IMU, …)",
            "gyroscope, accelerometer, magnetometer, attitude; every column",
            "serial_csv",
        ),
    )
}


def recognize(head: bytes, name: str) -> Format:
    """The format of a file that begins with ``head``; InputError names what was tried."""
    for form in FORMATS.values():
        if form.recognizes(head):
            return form
    tried = "; ".join(form.summary for form in FORMATS.values())
    raise InputError(f"{name}: is of no format that attlog reads (begins with {head[:8]!r}; tried: {tried})")


def recognize_folder(folder: Path) -> Format | None:
    """The format that takes the folder as one log; None where it is only a place where logs are."""
    return next((form for form in FORMATS.values() if form.members(folder)), None)


def source_of(path: Path) -> Source:
    """The log at ``path``, a file or a data set's folder; InputError where it cannot be read."""
    form = recognize_folder(path) if path.is_dir() else None
    return Source.from_path(path) if form is None else Source.from_folder(path, form.members(path))


def read(source: Source, options: IngestOptions | None = None) -> Ingested:
    """Recognise a source and read it."""
    form = recognize_folder(source.path) if source.parts and source.path is not None else None
    form = form or recognize(source.data[:HEAD_BYTES].tobytes(), source.name)
    return form.read(source, options or IngestOptions())
