"""Satellite fixes."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from ...schemas.columns import Columns
from ...schemas.unified import fix_columns
from .frames import Frames
from .times import Timeline
from .vehicles import Vehicle, sent_by

# message -> instance
SOURCES: Final = {"GPS_RAW_INT": 0, "GPS2_RAW": 1}
# GPS_FIX_TYPE -> NavSatStatus: none, none, 2D, 3D, differential, RTK float and fixed, static, PPP
STATUS: Final = np.array([-1, -1, 0, 0, 1, 2, 2, 2, 1], np.int8)
DEG: Final = 1e-7
MILLIMETRE: Final = 1e-3


def channels(frames: Frames, line: Timeline, vehicle: Vehicle) -> Iterator[Columns]:
    """``/gnss{n}/fix`` from the messages that have a fix; altitude above the ellipsoid where it is sent, else above
    mean sea level, which the channel's metadata say.
    """
    for name, instance in SOURCES.items():
        group = sent_by(frames, vehicle, name)
        if group is None:
            continue
        status = STATUS[np.minimum(group.rows["fix_type"], len(STATUS) - 1)]
        keep = status >= 0
        if not keep.any():
            continue
        rows = group.rows if keep.all() else group.rows[keep]
        ellipsoid = bool(rows["alt_ellipsoid"].any())
        about = {"system": str(vehicle.system), **line.stamped_by(group)}
        about["altitude"] = "ellipsoid" if ellipsoid else "mean sea level"
        yield fix_columns(
            f"{vehicle.prefix}/gnss{instance}/fix",
            line.of(group)[keep],
            rows["lat"] * DEG,
            rows["lon"] * DEG,
            rows["alt_ellipsoid" if ellipsoid else "alt"] * MILLIMETRE,
            status[keep],
            source=name,
            metadata=about,
        )
