"""Estimators by name: attlog's own, and those that other packages register as entry points ``attlog.estimators``."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from ..schemas.errors import UsageError
from ..schemas.estimate import Estimate
from ..schemas.recording import Recording
from .parameters import ImuParameters

GROUP = "attlog.estimators"

_OWN: Mapping[str, tuple[str, str]] = {
    "accmag": (".accmag", "ESTIMATOR"),
    "ecf": (".ecf", "ESTIMATOR"),
    "ekf6": (".ekf", "EKF6"),
    "ekf9": (".ekf", "EKF9"),
    "gyro": (".gyro", "ESTIMATOR"),
}


@dataclass(frozen=True, eq=False)
class Estimator:
    """A named estimator: ``run(recording, parameters)`` gives an Estimate; ``parameters`` is a frozen dataclass type.

    ``needs_mag``: cannot run without a magnetometer. ``presets`` are instances of ``parameters`` under a name.
    ``source``: the paper and its DOI.
    """

    name: str
    parameters: type[ImuParameters]
    run: Callable[[Recording, Any], Estimate]
    needs_mag: bool
    summary: str
    source: str
    presets: Mapping[str, ImuParameters] = field(default_factory=dict)


def names() -> tuple[str, ...]:
    """All that can be asked for, sorted; attlog's own win over an entry point of the same name."""
    return tuple(sorted({*_OWN, *_plugins()}))


def get(name: str) -> Estimator:
    """The estimator of this name; UsageError where there is none, or where a package's own fails to load."""
    if name in _OWN:
        module, attribute = _OWN[name]
        return _checked(name, getattr(import_module(module, __package__), attribute))
    plugin = _plugins().get(name)
    if plugin is None:
        near = get_close_matches(name, names(), 1)
        hint = f"; did you mean {near[0]}" if near else ""
        raise UsageError(f"no estimator {name!r}{hint}. There are: {', '.join(names())}")
    try:
        loaded = plugin.load()
    except Exception as error:
        raise UsageError(f"estimator {name!r} of {plugin.value} does not load: {error}") from error
    return _checked(name, loaded)


def _plugins() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}


def _checked(name: str, loaded: object) -> Estimator:
    if not isinstance(loaded, Estimator):
        raise UsageError(f"the entry point {name!r} of {GROUP} is {type(loaded).__name__}, not an Estimator")
    return loaded
