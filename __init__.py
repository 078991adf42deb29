"""attlog: any flight or IMU log into one reviewable MCAP, attitude re-estimated offline, its errors explained.

Conventions, everywhere in this package and said once here:

* World ENU (east, north, up) with true north; body FLU (forward, left, up). A quaternion is x y z w, of unit norm, and
  turns body vectors into the world. ``a * b`` turns by b first.
* Euler angles for people are ZYX roll, pitch, yaw of the body FRD in NED, in degrees, and named ``rpy_ned_deg``.
* SI units: rad/s, m/s^2 (specific force: +9.8 along up at rest), tesla. Anything else has its unit in its name.
* Time is integer nanoseconds (UNIX epoch where the log knows UTC, else since boot), arrays named ``time_ns``.
* Arrays are sample-first: vectors (n, 3), quaternions (n, 4), covariances (n, 9) row major. NaN is "not known".
* Attitude covariance and error: right error in the body, R = R_est Exp(d), rad^2.
* Errors that a user can mend are `AttlogError`; their message says what, where and what to do next.

The calls behind the command line's verbs (`convert`, `estimate`, `analyze`, `run`, `info`, `annotate`, `align`,
`export`, `simulate`) take one log and return its result, or take a list of files, folders and globs and return the
`Outcomes` of them all; `for_each` does the latter with a number of jobs. `recover` makes damaged MCAPs whole likewise,
`record` takes one live source. `open` reads an MCAP.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .pipeline.align import align
    from .pipeline.analyze import analyze
    from .pipeline.annotate import annotate
    from .pipeline.convert import convert
    from .pipeline.estimate import estimate
    from .pipeline.export import export
    from .pipeline.info import info
    from .pipeline.record import record
    from .pipeline.recover import recover
    from .pipeline.run import run
    from .pipeline.simulate import simulate
    from .pipeline.verbs import for_each
    from .schemas.errors import AttlogError, InputError, MissingSensorError, StorageError, UsageError
    from .storage import open

_HOME = {
    "align": ".pipeline",
    "analyze": ".pipeline",
    "annotate": ".pipeline",
    "convert": ".pipeline",
    "estimate": ".pipeline",
    "export": ".pipeline",
    "for_each": ".pipeline",
    "info": ".pipeline",
    "record": ".pipeline",
    "recover": ".pipeline",
    "run": ".pipeline",
    "simulate": ".pipeline",
    "open": ".storage",
    "AttlogError": ".schemas.errors",
    "InputError": ".schemas.errors",
    "MissingSensorError": ".schemas.errors",
    "StorageError": ".schemas.errors",
    "UsageError": ".schemas.errors",
}

__all__ = [
    "AttlogError",
    "InputError",
    "MissingSensorError",
    "StorageError",
    "UsageError",
    "__version__",
    "align",
    "analyze",
    "annotate",
    "convert",
    "estimate",
    "export",
    "for_each",
    "info",
    "open",
    "record",
    "recover",
    "run",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("attlog")
    if name in _HOME:
        return getattr(import_module(_HOME[name], __name__), name)
    raise AttributeError(f"module 'attlog' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
