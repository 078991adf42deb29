"""``/tf`` and ``/bodies``: one frame and one body for each attitude, side by side, for the 3D views."""

from collections.abc import Sequence

import numpy as np

from ..geometry.quaternions import normalize
from ..schemas.columns import Channel, Columns, Time
from ..schemas.definition import MessageType
from ..schemas.messages import MARKER_ARRAY, TF_MESSAGE
from ..schemas.recording import Attitude, Recording
from ..schemas.unified import WORLD, nested

TF = "/tf"
BODIES = "/bodies"
MADE_BY = ("source", "attlog")
"""Entry of the channels' metadata that tells them from other people's of the same name."""
RATE_HZ = 25.0
MOST_TRANSFORMS = 10_000
SPACING_M = 1.5
SIZE_M = (1.0, 0.6, 0.15)
LABEL_HEIGHT_M = 0.15
# Okabe and Ito's palette, told apart by the colour-blind.
COLOURS = (
    (0.0, 0.62, 0.45),
    (0.9, 0.62, 0.0),
    (0.34, 0.71, 0.91),
    (0.8, 0.47, 0.65),
    (0.84, 0.37, 0.0),
    (0.0, 0.45, 0.7),
)


def drawn(recording: Recording) -> list[tuple[str, Attitude]]:
    """Frame name -> attitude, of everything in the recording that is drawn, in the order from left to right."""
    under = recording.prefix.strip("/")
    named = [("reference", recording.reference)] if recording.reference is not None else []
    named += [(f"onboard_{name}", attitude) for name, attitude in sorted(recording.onboard.items())]
    named += [(f"estimate_{name}", attitude) for name, attitude in sorted(recording.estimates.items())]
    return [(f"{under}/{name}" if under else name, attitude) for name, attitude in named if attitude is not None]


def bodies_columns(recordings: Sequence[Recording]) -> list[Columns]:
    """``/tf`` and ``/bodies`` of all vehicles, or nothing where there is no attitude."""
    frames = [frame for recording in recordings for frame in drawn(recording)]
    if not frames:
        return []
    length = max(len(name.encode()) for name, _ in frames)
    parts = [_transforms(name, attitude, place, length) for place, (name, attitude) in enumerate(frames)]
    time_ns = np.concatenate([stamps for stamps, _ in parts])
    data = np.concatenate([rows for _, rows in parts])
    if len(time_ns) == 0:
        return []
    return [
        Columns(Channel(TF, TF_MESSAGE, dict([MADE_BY])), time_ns, data),
        _markers([name for name, _ in frames], int(time_ns.min())),
    ]


def _transforms(
    name: str, attitude: Attitude, place: int, length: int
) -> tuple[Time, "np.ndarray[tuple[int], np.dtype[np.void]]"]:
    keep = _thinned(attitude.time_ns)
    orientation = normalize(attitude.orientation[keep])
    finite = np.isfinite(orientation).all(axis=1)
    time_ns = attitude.time_ns[keep][finite]
    lengths = {"transforms": 1, "transforms.header.frame_id": len(WORLD), "transforms.child_frame_id": length}
    rows = np.zeros(len(time_ns), TF_MESSAGE.dtype(lengths))
    inner = rows["transforms"][:, 0]
    stamp = inner["header"]["stamp"]
    stamp["sec"], stamp["nanosec"] = np.divmod(time_ns, 1_000_000_000)
    inner["header"]["frame_id"] = WORLD.encode()
    inner["child_frame_id"] = name.encode()
    inner["transform"]["translation"]["x"] = place * SPACING_M
    inner["transform"]["rotation"] = nested(_transform_type(), "rotation", orientation[finite])
    return time_ns, rows


def _transform_type() -> MessageType:
    stamped = TF_MESSAGE["transforms"].type
    assert isinstance(stamped, MessageType)
    transform = stamped["transform"].type
    assert isinstance(transform, MessageType)
    return transform


def _thinned(time_ns: Time) -> "np.ndarray[tuple[int], np.dtype[np.intp]]":
    """Positions of the first sample in each slot of 1/25 s, or of a longer slot where that would be too many."""
    if len(time_ns) == 0:
        return np.zeros(0, dtype=np.intp)
    span = int(time_ns[-1] - time_ns[0]) + 1
    slot = max(int(1e9 / RATE_HZ), -(-span // (MOST_TRANSFORMS - 1)))
    slots = (time_ns - time_ns[0]) // slot
    return np.flatnonzero(np.diff(slots, prepend=-1) != 0)


def _markers(names: Sequence[str], time_ns: int) -> Columns:
    """One message: a cube fixed to each frame, and its name above it."""
    length = max(len(name.encode()) for name in names)
    lengths = {"markers": 2 * len(names)}
    lengths |= {f"markers.{field}": length for field in ("header.frame_id", "ns", "text")}
    row = np.zeros(1, MARKER_ARRAY.dtype(lengths))
    markers = row["markers"][0]
    both = [name.encode() for name in names for _ in range(2)]
    stamp = markers["header"]["stamp"]
    stamp["sec"], stamp["nanosec"] = divmod(time_ns, 1_000_000_000)
    markers["header"]["frame_id"] = both
    markers["ns"] = both
    markers["id"] = np.arange(len(both)) % 2
    markers["pose"]["orientation"]["w"] = 1.0
    markers["frame_locked"] = True
    _fill_cubes(markers[0::2])
    _fill_labels(markers[1::2], names)
    return Columns(Channel(BODIES, MARKER_ARRAY, dict([MADE_BY])), np.array([time_ns], dtype=np.int64), row)


def _fill_cubes(cubes: "np.ndarray[tuple[int], np.dtype[np.void]]") -> None:
    cubes["type"] = 1
    for axis, size in zip("xyz", SIZE_M, strict=True):
        cubes["scale"][axis] = size
    colours = np.array([COLOURS[number % len(COLOURS)] for number in range(len(cubes))])
    for channel, values in zip("rgb", colours.T, strict=True):
        cubes["color"][channel] = values
    cubes["color"]["a"] = 0.9


def _fill_labels(labels: "np.ndarray[tuple[int], np.dtype[np.void]]", names: Sequence[str]) -> None:
    labels["type"] = 9
    labels["text"] = [name.encode() for name in names]
    labels["pose"]["position"]["z"] = 0.5
    labels["scale"]["z"] = LABEL_HEIGHT_M
    for channel in "rgba":
        labels["color"][channel] = 1.0
