"""BROAD on its real trials, and on files that are damaged or something else."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from attlog import ingest
from attlog.geometry.quaternions import rotate
from attlog.ingest.datasets import broad as module
from attlog.schemas import InputError, Source
from attlog.schemas.unified import quaternions, vectors

TRIAL = "34_disturbed_attached_magnet_3cm.mat"


def by_topic(path: Path):
    result = ingest.read(Source.from_path(path))
    return result, {columns.channel.topic: columns for columns in result.columns}


def test_every_trial_is_recognised(broad: Path) -> None:
    trials = sorted(broad.glob("*.mat"))
    assert len(trials) == 8
    for trial in trials:
        assert ingest.recognize(trial.read_bytes()[:65536], trial.name).name == "broad"


def test_every_value_is_that_of_the_file(broad: Path) -> None:
    file = loadmat(broad / TRIAL)
    result, channels = by_topic(broad / TRIAL)
    imu, mag, reference = channels["/imu0/data_raw"], channels["/mag0/field"], channels["/reference/attitude"]
    np.testing.assert_array_equal(vectors(imu.data, "angular_velocity"), file["imu_gyr"])
    np.testing.assert_array_equal(vectors(imu.data, "linear_acceleration"), file["imu_acc"])
    np.testing.assert_allclose(vectors(mag.data, "magnetic_field"), file["imu_mag"] * 1e-6, rtol=1e-15)
    seen = np.isfinite(file["opt_quat"]).all(axis=1)
    np.testing.assert_allclose(quaternions(reference.data), file["opt_quat"][seen][:, [1, 2, 3, 0]], atol=1e-15)
    np.testing.assert_array_equal(reference.time_ns, imu.time_ns[seen])
    assert imu.time_ns[1] - imu.time_ns[0] == 3_500_000  # 285.714 Hz
    assert abs(imu.time_ns[-1] * 1e-9 - (len(imu) - 1) / 285.714285714) < 1e-6
    np.testing.assert_array_equal(channels["/broad/trial"]["movement"], file["movement"].ravel())
    assert result.completeness.complete
    assert result.completeness.messages == len(file["imu_gyr"])


def test_samples_without_markers_are_counted(broad: Path) -> None:
    file = loadmat(broad / TRIAL)
    result, channels = by_topic(broad / TRIAL)
    hidden = int(np.isnan(file["opt_quat"]).any(axis=1).sum())
    (finding,) = result.findings
    assert (finding.value, finding.kind) == (hidden, "gap")
    assert len(channels["/reference/attitude"]) + hidden == len(channels["/imu0/data_raw"])


@pytest.mark.parametrize("name", ["10_undisturbed_slow_translation_A.mat", "24_disturbed_tapping_A.mat"])
def test_world_is_enu_with_magnetic_north(broad: Path, name: str) -> None:
    file = loadmat(broad / name)
    seen = np.isfinite(file["opt_quat"]).all(axis=1)
    q = file["opt_quat"][seen][:, [1, 2, 3, 0]]
    force, field = rotate(q, file["imu_acc"][seen]).mean(axis=0), np.median(rotate(q, file["imu_mag"][seen]), axis=0)
    assert np.degrees(np.arctan2(np.hypot(*force[:2]), force[2])) < 0.3  # z is up
    assert abs(np.degrees(np.arctan2(field[0], field[1]))) < 2.0  # y is where a compass points
    result, channels = by_topic(broad / name)
    assert channels["/reference/attitude"].channel.metadata["north"] == "magnetic"
    assert abs(float(result.metadata["broad"]["field_heading_deg"])) < 2.0
    assert float(result.metadata["broad"]["mean_force_tilt_deg"]) < 0.3


def test_spans_that_count_are_those_of_movement(broad: Path) -> None:
    file = loadmat(broad / "04_undisturbed_slow_rotation_with_breaks_A.mat")
    result, channels = by_topic(broad / "04_undisturbed_slow_rotation_with_breaks_A.mat")
    spans = [tuple(map(float, span.split(":"))) for span in result.metadata["broad"]["counted_s"].split()]
    assert len(spans) == 4
    time_s = channels["/imu0/data_raw"].time_ns * 1e-9
    inside = np.logical_or.reduce([(time_s >= a - 1e-4) & (time_s < b - 1e-4) for a, b in spans])
    np.testing.assert_array_equal(inside, file["movement"].ravel() == 1)


def test_hdf5_holds_the_same(broad: Path, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    file = loadmat(broad / TRIAL)
    path = tmp_path / "34.hdf5"
    with h5py.File(path, "w") as target:
        for name in ("imu_gyr", "imu_acc", "imu_mag", "opt_quat", "opt_pos"):
            target[name] = file[name]
        target["movement"] = file["movement"].ravel()
        target["sampling_rate"] = float(file["sampling_rate"].ravel()[0])
    _, from_mat = by_topic(broad / TRIAL)
    _, from_hdf5 = by_topic(path)
    assert from_mat.keys() == from_hdf5.keys()
    for topic, columns in from_mat.items():
        assert columns.data.tobytes() == from_hdf5[topic].data.tobytes()
        np.testing.assert_array_equal(columns.time_ns, from_hdf5[topic].time_ns)


def test_another_mat_file_is_not_broad(tmp_path: Path) -> None:
    for compressed in (False, True):
        savemat(tmp_path / "other.mat", {"a": np.eye(3)}, do_compression=compressed)
        assert not module.recognizes((tmp_path / "other.mat").read_bytes())


def test_a_trial_without_the_reference_is_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "part.mat", {"imu_gyr": np.zeros((9, 3)), "imu_acc": np.zeros((9, 3))}, do_compression=True)
    with pytest.raises(InputError, match="lacks imu_mag, opt_quat, sampling_rate"):
        ingest.read(Source.from_path(tmp_path / "part.mat"))


@pytest.mark.parametrize("size", [200, 5000, 1_000_000])
def test_a_cut_trial_is_one_clear_error(broad: Path, tmp_path: Path, size: int) -> None:
    path = tmp_path / "cut.mat"
    path.write_bytes((broad / TRIAL).read_bytes()[:size])
    with pytest.raises(InputError, match=r"cut\.mat"):
        ingest.read(Source.from_path(path))


def test_another_hdf5_file_is_refused_by_name(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "other.h5", "w") as target:
        target["images"] = np.zeros((2, 2))
        target.create_group("more")
    with pytest.raises(InputError, match=r"other\.h5"):
        ingest.read(Source.from_path(tmp_path / "other.h5"))
