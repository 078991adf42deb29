"""Columns whose fields lie apart are written as those of a structured array are."""

from pathlib import Path

import numpy as np
import pytest

from attlog import storage
from attlog.schemas import Channel, Columns, Estimate, messages
from attlog.schemas.fields import Fields
from attlog.schemas.unified import estimate_columns

COUNT = 5000


def _estimate(order: str) -> Estimate:
    rng = np.random.default_rng(3)

    def array(width: int) -> np.ndarray:
        return np.array(rng.normal(size=(COUNT, width)), order=order)

    nothing = np.broadcast_to(np.nan, (COUNT, 3))
    return Estimate(
        name="ecf",
        estimator="ecf",
        time_ns=np.arange(COUNT, dtype=np.int64) * 1_000_000,
        orientation=array(4),
        angular_velocity=array(3),
        gyro_bias=array(3),
        attitude_covariance=np.broadcast_to(np.nan, (COUNT, 9)),
        rpy_sigma_deg=nothing,
        rate_sigma=nothing,
        bias_sigma=array(3),
        state=array(7),
        state_covariance=array(49),
        innovation=array(0),
        innovation_covariance=array(0),
        status=rng.integers(0, 64, COUNT).astype(np.uint32),
    )


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("shuffled", [False, True])
def test_apart_and_together_are_the_same_file(tmp_path: Path, order: str, shuffled: bool) -> None:
    apart = estimate_columns(_estimate(order))
    assert isinstance(apart.data, Fields)
    if shuffled:
        stamps = np.random.default_rng(1).permutation(apart.time_ns)
        apart = Columns(apart.channel, stamps, apart.data)
    together = Columns(apart.channel, apart.time_ns, np.asarray(apart.data))
    assert not isinstance(together.data, Fields)
    storage.write(tmp_path / "apart.mcap", [apart])
    storage.write(tmp_path / "together.mcap", [together])
    assert (tmp_path / "apart.mcap").read_bytes() == (tmp_path / "together.mcap").read_bytes()


def test_texts_of_any_length_may_lie_apart_too(tmp_path: Path) -> None:
    stamps = np.arange(3, dtype=np.int64)
    fields = Fields({"level": np.array([10, 20, 30], "u1"), "msg": np.array([b"a", b"bcd", b""])})
    storage.write(tmp_path / "log.mcap", [Columns(Channel("/annotations", messages.LOG), stamps, fields)])  # type: ignore[arg-type]
    with storage.open(tmp_path / "log.mcap") as log:
        assert log["/annotations"]["msg"].tolist() == [b"a", b"bcd", b""]
        assert log["/annotations"]["level"].tolist() == [10, 20, 30]


def test_rows_are_structured() -> None:
    fields = Fields({"a": np.arange(6).reshape(3, 2), "b": np.array([1.0, 2.0, 3.0])})
    assert fields[1:]["a"].tolist() == [[2, 3], [4, 5]]
    assert fields[np.array([True, False, True])]["b"].tolist() == [1.0, 3.0]
    assert np.asarray(fields).dtype == fields.dtype
