"""GPS time to UTC: the leap seconds of the day."""

from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

SECOND_NS: Final = 1_000_000_000
WEEK_NS: Final = 7 * 86_400 * SECOND_NS
GPS_EPOCH_NS: Final = int(datetime(1980, 1, 6, tzinfo=UTC).timestamp()) * SECOND_NS

SINCE_GPS: Final = (
    *("1981-07", "1982-07", "1983-07", "1985-07", "1988-01", "1990-01", "1991-01", "1992-07", "1993-07", "1994-07"),
    *("1996-01", "1997-07", "1999-01", "2006-01", "2009-01", "2012-07", "2015-07", "2017-01"),
)
"""Months that a leap second preceded (IERS Bulletin C), where no time zone database is installed."""


def utc_from_gps(week: ArrayLike, millisecond: ArrayLike) -> NDArray[np.int64]:
    """UNIX time in ns of GPS weeks and milliseconds of the week, each (n,)."""
    gps = GPS_EPOCH_NS + np.asarray(week, np.int64) * WEEK_NS + np.asarray(millisecond, np.int64) * 1_000_000
    leaps = _leaps()
    # The n-th leap second is over when GPS time, counted as UNIX time, has passed its midnight by n seconds.
    over = leaps + SECOND_NS * np.arange(1, len(leaps) + 1)
    return np.asarray(gps - SECOND_NS * np.searchsorted(over, gps, side="right"))


@lru_cache(maxsize=1)
def _leaps() -> NDArray[np.int64]:
    """UNIX time in ns of the midnights after each leap second since 1980: those of the newest source there is."""
    tables = [np.array([int(datetime.fromisoformat(f"{month}-01T00:00:00+00:00").timestamp()) for month in SINCE_GPS])]
    tables += [np.array(list(_published(text))) for text in _databases()]
    longest = max(tables, key=len)
    return np.asarray(longest * SECOND_NS, dtype=np.int64)


def _databases() -> Iterator[str]:
    """The IANA time zone database's leap second file: the package tzdata's, and the system's."""
    with suppress(ImportError, OSError):
        yield (resources.files("tzdata") / "zoneinfo" / "leapseconds").read_text()
    system = Path("/usr/share/zoneinfo/leapseconds")
    if system.is_file():
        yield system.read_text()


def _published(text: str) -> Iterator[int]:
    for line in text.splitlines():
        words = line.split()
        if len(words) >= 6 and words[0] == "Leap" and words[5] == "+":
            day = datetime.strptime(" ".join(words[1:4]), "%Y %b %d").replace(tzinfo=UTC)
            after = int(day.timestamp()) + 86_400
            if after * SECOND_NS > GPS_EPOCH_NS:
                yield after
