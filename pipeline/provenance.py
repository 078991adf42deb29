"""What made a channel: version, inputs by content hash."""

from collections.abc import Collection
from importlib.metadata import version

from ..schemas.recording import Imu, Magnetometer, Recording


def software() -> str:
    """``attlog 0.1.0``."""
    return f"attlog {version('attlog')}"


def made_from(recording: Recording, topics: Collection[str]) -> dict[str, str]:
    """``software``, and ``input.{topic}`` -> content hash of each sensor channel of ``recording`` that is named."""
    channels: list[Imu | Magnetometer] = [*recording.imu.values(), *recording.mag.values()]
    inputs = {f"input_sha256.{c.topic}": c.sha256 for c in channels if c.topic in topics}
    return {"software": software(), **inputs}
