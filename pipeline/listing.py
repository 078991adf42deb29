"""What there is to choose from: estimators, formats, scenarios."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from .text import table


@dataclass(frozen=True)
class Listing:
    """Names, each with one line that says what it is."""

    what: str
    entries: Mapping[str, str]

    def to_text(self) -> str:
        """What ``attlog list`` prints."""
        return table((self.what, "what it is"), list(self.entries.items()))

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {self.what: dict(self.entries)}


def listing(what: str) -> Listing:
    """``estimators``, ``formats`` or ``scenarios``; KeyError otherwise."""
    return Listing(what, _LISTS[what]())


def _estimators() -> dict[str, str]:
    from .. import estimators

    return {name: estimators.get(name).summary for name in estimators.names()}


def _formats() -> dict[str, str]:
    from .. import ingest

    found = {form.name: f"{form.summary}: {form.reads}" for form in ingest.FORMATS.values()}
    others = (
        "MCAP or ROS 2 bag of any writer: Imu, MagneticField, NavSatFix, poses, odometry, TF; estimate, analyze, run"
    )
    return found | {"mcap": f"{others} take it as it is"}


def _scenarios() -> dict[str, str]:
    from ..ingest import simulation

    return dict(simulation.scenarios())


_LISTS: Mapping[str, Callable[[], dict[str, str]]] = {
    "estimators": _estimators,
    "formats": _formats,
    "scenarios": _scenarios,
}
