"""How two clocks differ: the metadata record ``alignment``."""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .columns import Time

ALIGNMENT = "alignment"


@dataclass(frozen=True)
class ClockAlignment:
    """A stamp s of ``clock`` (a topic, or a log's name) is s + offset + drift (s - epoch) on the clock of ``sensor``.

    The offset holds at ``epoch_ns`` (on ``clock``), amid the overlap, where it is best known. Sigmas are standard
    deviations; ``correlation`` (0 to 1) says how well the two angular rates agree afterwards, ``samples`` on how many
    intervals of ``window_s`` that rests; ``sha256`` is the content hash of what was aligned.
    """

    clock: str
    sensor: str
    epoch_ns: int
    offset_ns: int
    offset_sigma_s: float
    drift_ppm: float
    drift_sigma_ppm: float
    correlation: float
    samples: int
    window_s: float
    sha256: str = ""
    software: str = ""

    @property
    def offset_s(self) -> float:
        """The offset in seconds."""
        return self.offset_ns * 1e-9

    def applied(self, time_ns: Time) -> Time:
        """Stamps of ``clock`` on the sensor's clock."""
        drifted = np.round((time_ns - self.epoch_ns) * (self.drift_ppm * 1e-6)).astype(np.int64)
        return np.asarray(time_ns + self.offset_ns + drifted, dtype=np.int64)

    def in_words(self) -> str:
        """``/reference/attitude + 0.13700 s ± 0.00002 s, drift 50.0 ± 0.4 ppm``."""
        sign = "-" if self.offset_ns < 0 else "+"
        offset = f"{abs(self.offset_ns) // 10**9}.{abs(self.offset_ns) % 10**9 // 10**4:05d}"
        drift = f"{self.drift_ppm:.1f} ± {self.drift_sigma_ppm:.1f} ppm"
        return f"{self.clock} {sign} {offset} s ± {self.offset_sigma_s:.5f} s, drift {drift}"


def alignment_record(alignments: Mapping[str, ClockAlignment]) -> dict[str, str]:
    """One entry per clock, a JSON object of the fields of `ClockAlignment`."""
    return {clock: json.dumps(dataclasses.asdict(each)) for clock, each in sorted(alignments.items())}


def parse_alignments(record: Mapping[str, str]) -> dict[str, ClockAlignment]:
    """The inverse of `alignment_record`; what is none of its entries is left out."""
    found = {}
    for clock, text in record.items():
        try:
            found[clock] = ClockAlignment(**json.loads(text))
        except (ValueError, TypeError):
            continue
    return found
