"""Attitudes that the log holds: the simulator's truth, and what the autopilot's filters made of it."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.frames import enu_flu_from_ned_frd, orientation_from_rpy_ned
from ...geometry.quaternions import normalize
from ...schemas import Columns
from ...schemas.unified import attitude_columns
from .clock import Clock
from .log import Log, Topic

Floats = NDArray[np.float64]

TRUTH: Final = "vehicle_attitude_groundtruth"
ONBOARD: Final = {"vehicle_attitude": False, "estimator_attitude": True}
"""Topic -> whether its first instance is numbered too (one filter runs for each)."""
QUATERNION: Final = "q"
"""w x y z, body FRD to NED."""
EULER: Final = ("roll", "pitch", "yaw")
"""rad, in logs older than the quaternion."""


def reference(log: Log, clock: Clock) -> Iterator[Columns]:
    """``/reference/attitude`` of the simulator's truth."""
    for topic in log.named(TRUTH)[:1]:
        yield from _attitude("/reference/attitude", "reference", topic, clock)


def onboard(log: Log, clock: Clock) -> Iterator[Columns]:
    """``/onboard/{source}/attitude`` of every filter."""
    seen: set[str] = set()
    for name, numbered in ONBOARD.items():
        for topic in log.named(name):
            source = f"{name}{topic.multi_id}" if numbered or topic.multi_id else name
            if source not in seen:
                seen.add(source)
                yield from _attitude(f"/onboard/{source}/attitude", f"onboard_{source}", topic, clock)


def _attitude(place: str, child: str, topic: Topic, clock: Clock) -> Iterator[Columns]:
    orientation = _orientation(topic)
    if orientation is None:
        return
    known = np.all(np.isfinite(orientation), axis=1)
    if not np.any(known):
        return
    metadata = {"multi_id": str(topic.multi_id)}
    stamps = clock.sampled(topic)
    if not np.all(known):
        metadata["left_out"] = str(int(np.count_nonzero(~known)))
        stamps, orientation = stamps[known], orientation[known]
    yield attitude_columns(place, stamps, orientation, child_frame_id=child, source=topic.name, metadata=metadata)


def _orientation(topic: Topic) -> Floats | None:
    """Body FLU to ENU (n, 4), NaN where the filter had none yet."""
    if topic.has_array(4, QUATERNION):
        wxyz = topic[QUATERNION].astype(np.float64)
        return enu_flu_from_ned_frd(normalize(wxyz[:, [1, 2, 3, 0]]))
    if topic.has(*EULER):
        return orientation_from_rpy_ned(np.stack([topic[name].astype(np.float64) for name in EULER], axis=-1))
    return None
