"""What a column's name says it holds: quantity, axis, which sensor, unit."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from .units import Quantity, canonical


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


STEMS: Final = {
    Quantity.ACCEL: _words(
        "a ac acc acce accel accl accelero accelerometer acceleration accelerations xl sf specificforce "
        "linearacceleration accelerometeracceleration gf gforce"
    ),
    Quantity.GYRO: _words(
        "g gy gyr gyro gyros gyroscope w om omega angularvelocity angularrate angvel rotationrate rotation rot "
        "gyrorotation gyroscoperotation"
    ),
    Quantity.MAG: _words("m mag magn magnet magneto magnetometer magnetic compass h b mf"),
    Quantity.QUATERNION: _words("q quat quatq quaternion quaternions orientation ori attitude att"),
    Quantity.EULER: _words("euler eul rpy"),
}
ANGLES: Final = {
    "roll": "roll",
    "phi": "roll",
    "pitch": "pitch",
    "theta": "pitch",
    "yaw": "yaw",
    "heading": "yaw",
    "psi": "yaw",
}
TIME_NAMES: Final = {
    "t": "",
    "ts": "",
    "time": "",
    "stamp": "",
    "timestamp": "",
    "timestamps": "",
    "clock": "",
    "datetime": "",
    "elapsed": "",
    "timeelapsed": "",
    "elapsedtime": "",
    "systemtime": "",
    "sampletime": "",
    "sampletimefine": "us",
    "secondselapsed": "s",
    "seconds": "s",
    "sec": "s",
    "millis": "ms",
    "milliseconds": "ms",
    "ms": "ms",
    "micros": "us",
    "microseconds": "us",
    "us": "us",
    "nanos": "ns",
    "nanoseconds": "ns",
    "ns": "ns",
}
"""Names of a clock, without blanks and marks -> the unit that the name implies."""
NOISE: Final = _words(
    "imu sensor sensors raw cal calibrated calib data value values val field body rs s r axis mpu icm bmi lsm bno "
    "ln wr component comp unfiltered filtered uncalibrated reading"
)
TRUTH: Final = _words("ref reference truth true gt groundtruth ground vicon mocap optitrack opti opt qualisys optical")
VECTOR_AXES: Final = {"x": "x", "y": "y", "z": "z", "0": "x", "1": "y", "2": "z"}
QUATERNION_AXES: Final = {"w": "w", "x": "x", "y": "y", "z": "z", "0": "w", "1": "x", "2": "y", "3": "z"}
EULER_AXES: Final = {"x": "roll", "y": "pitch", "z": "yaw"}


@dataclass(frozen=True)
class Meaning:
    """What a column holds: ``axis`` x y z, w x y z, or roll pitch yaw; ``unit`` "" where nothing says it;
    ``instance`` the sensor's number as the name gives it; ``truth`` where the name says that it is a reference."""

    quantity: Quantity
    axis: str = ""
    unit: str = ""
    instance: int | None = None
    truth: bool = False


OTHER: Final = Meaning(Quantity.OTHER)


def split_unit(cell: str) -> tuple[str, str]:
    """``Gyroscope X (deg/s)`` -> name and unit as they are spelled; an index in brackets stays with the name."""
    plain = cell.strip().strip("\"'").strip()
    match = re.fullmatch(r"(?P<name>.*?)[\s_]*(?:\((?P<round>.*)\)|\[(?P<square>.*)\])", plain)
    if match is None:
        return plain, ""
    unit = (match["round"] if match["round"] is not None else match["square"]).strip()
    return (f"{match['name']}_{unit}", "") if unit.isdigit() else (match["name"], unit)


def meaning(cell: str) -> Meaning:
    """What the column called ``cell`` holds; OTHER where the name says nothing that is known."""
    name, unit = split_unit(cell)
    tokens = _tokens(name)
    for kept, spelled in _with_unit(tokens, unit):
        found = _vector(kept, spelled) or _angle(kept, spelled)
        if found is not None:
            return found
    return _time(tokens, unit) or OTHER


def _tokens(name: str) -> list[str]:
    words = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|°", name.replace("µ", "u").replace("μ", "u"))
    return [word.lower() for word in words]


def _with_unit(tokens: Sequence[str], unit: str) -> Iterator[tuple[list[str], str]]:
    """The name's words without the unit that may end them (``ax_m_s2``, ``gyro_x_rad_s``), longest unit first."""
    if unit:
        yield list(tokens), unit
        return
    for length in (3, 2, 1):
        if len(tokens) > length:
            yield list(tokens[:-length]), "".join(tokens[-length:])
    yield list(tokens), ""


def _vector(tokens: list[str], unit: str) -> Meaning | None:
    """A component of a vector or a quaternion."""
    truth = any(token in TRUTH for token in tokens)
    words = [token for token in tokens if token not in TRUTH]
    for stem, axis, rest in _stem_and_axis(words):
        for quantity, stems in STEMS.items():
            name = _axis(quantity, axis)
            spelled = _unit(quantity, unit)
            if stem in stems and name and spelled is not None:
                return Meaning(quantity, name, spelled, _instance(rest), truth)
    return None


def _stem_and_axis(words: list[str]) -> Iterator[tuple[str, str, list[str]]]:
    """Ways to read the words as a stem and an axis: ``acc x``, ``accx``, ``x acc``, ``acc 0``; and the numbers left."""
    numbers = [word for word in words if word.isdigit()]
    plain = [word for word in words if not word.isdigit() and word not in NOISE]
    fused = "".join(plain)
    if plain and len(plain[-1]) > 1:
        yield fused[:-1], fused[-1], numbers
    if len(plain) == 1 and len(fused) > 1:
        yield fused[1:], fused[0], numbers
    if len(plain) > 1:
        yield "".join(plain[:-1]), plain[-1], numbers
        yield "".join(plain[1:]), plain[0], numbers
    if plain and words[-1].isdigit():
        yield fused, words[-1], numbers[:-1]


def _axis(quantity: Quantity, spelled: str) -> str:
    if quantity is Quantity.QUATERNION:
        return QUATERNION_AXES.get(spelled, "")
    return (EULER_AXES if quantity is Quantity.EULER else VECTOR_AXES).get(spelled, "")


def _unit(quantity: Quantity, spelled: str) -> str | None:
    """The canonical unit, "" where there is none, None where the word is no unit of this quantity."""
    if quantity is Quantity.QUATERNION:
        return "" if spelled in ("", "-", "1") else None
    return canonical(spelled, quantity) if spelled.strip() else ""


def _instance(numbers: Sequence[str]) -> int | None:
    return int(numbers[0]) if len(numbers) == 1 and len(numbers[0]) < 3 else None


def _angle(tokens: list[str], unit: str) -> Meaning | None:
    """A roll, pitch or yaw."""
    words = [token for token in tokens if token not in TRUTH and token not in NOISE and not token.isdigit()]
    words = [word for word in words if word not in ("angle", "euler", "est", "estimated")]
    spelled = _unit(Quantity.EULER, unit)
    if len(words) != 1 or words[0] not in ANGLES or spelled is None:
        return None
    numbers = [token for token in tokens if token.isdigit()]
    return Meaning(Quantity.EULER, ANGLES[words[0]], spelled, _instance(numbers), any(t in TRUTH for t in tokens))


def _time(tokens: list[str], unit: str) -> Meaning | None:
    """A clock. Its unit stands in brackets, at the name's end (``time_us``), or is the name (``millis``)."""
    words = [token for token in tokens if token not in ("utc", "unix", "epoch", "arduino", "device", "local", "imu")]
    for length in (len(words) - 1, len(words)):
        name, tail = "".join(words[:length]), "".join(words[length:])
        if name not in TIME_NAMES:
            continue
        spelled = canonical(unit or tail, Quantity.TIME) if unit or tail else TIME_NAMES[name]
        if spelled is not None:
            return Meaning(Quantity.TIME, unit=spelled)
    return Meaning(Quantity.TIME) if tokens in (["utc"], ["unix"], ["date", "time"]) else None
