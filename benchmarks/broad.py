"""Accuracy on BROAD trials beside vqf: ``python -m benchmarks.broad [FOLDER]`` prints RMSE in degrees.

D. Laidig et al., BROAD, Data 6(7):72, 2021, doi:10.3390/data6070072. Motion capture is the truth, where a trial moves;
no rotation is removed. Defaults of both sides.
"""

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from attlog import estimators
from attlog.geometry import quaternions
from attlog.schemas.recording import Declination, Imu, Magnetometer, Recording

FOLDER = Path(os.environ.get("ATTLOG_SHARED", Path(__file__).parents[2] / "shared")) / "data" / "broad"
OURS = ("ecf", "ekf9")

Floats = NDArray[np.float64]


def main(folder: Path) -> None:
    """Total, inclination and heading of each trial and their mean."""
    names = (*OURS, "vqf")
    print("| trial | " + " | ".join(f"{name} total / incl. / heading" for name in names) + " |")
    print("|---" * (len(names) + 1) + "|")
    table = []
    for path in sorted(folder.glob("*.mat")):
        errors = np.array([rmse(q, *truth(path)) for q in orientations(path)])
        table.append(errors)
        print(row(path.stem, errors))
    print(row("mean", np.mean(table, axis=0)))


def row(name: str, errors: Floats) -> str:
    """One line, a cell an estimator."""
    return f"| {name} | " + " | ".join(" / ".join(f"{value:.2f}" for value in cell) for cell in errors) + " |"


def load(path: Path) -> dict[str, Any]:
    """The trial's arrays by name."""
    from scipy.io import loadmat

    data: dict[str, Any] = loadmat(path, squeeze_me=True)
    return data


def orientations(path: Path) -> list[Floats]:
    """Of ours and of vqf, each (n, 4) x y z w, body to ENU."""
    import vqf

    data = load(path)
    rate, force, field = (np.ascontiguousarray(data[key]) for key in ("imu_gyr", "imu_acc", "imu_mag"))
    hz = float(data["sampling_rate"])
    time_ns = np.round(np.arange(len(rate)) * (1e9 / hz)).astype(np.int64)
    recording = Recording(
        imu={0: Imu(time_ns, rate, force)},
        mag={0: Magnetometer(time_ns, field * 1e-6)},
        declination=Declination(0.0, "the trials' north is magnetic"),
    )
    peer = vqf.VQF(1.0 / hz).updateBatch(rate, force, field)["quat9D"][:, [1, 2, 3, 0]]
    return [*(estimators.estimate(recording, name).orientation for name in OURS), peer]


def truth(path: Path) -> tuple[Floats, NDArray[np.bool_]]:
    """Motion capture (n, 4) x y z w, and where it counts."""
    data = load(path)
    reference = data["opt_quat"][:, [1, 2, 3, 0]]
    return reference, data["movement"].astype(bool) & np.isfinite(reference).all(axis=1)


def rmse(orientation: Floats, reference: Floats, counts: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Total, inclination and heading RMSE, degrees."""
    e = quaternions.multiply(orientation[counts], quaternions.conjugate(reference[counts]))
    upright = np.clip(np.hypot(e[:, 3], e[:, 2]), 0.0, 1.0)
    heading = 2 * np.arctan2(e[:, 2], e[:, 3])
    angles = (2 * np.arccos(np.clip(np.abs(e[:, 3]), 0.0, 1.0)), 2 * np.arccos(upright), np.angle(np.exp(1j * heading)))
    total, inclination, turn = (float(np.degrees(np.sqrt(np.mean(angle**2)))) for angle in angles)
    return total, inclination, turn


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
