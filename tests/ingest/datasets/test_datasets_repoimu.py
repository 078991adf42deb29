"""RepoIMU on files built as the published ones are written, with frames that are turned by known constants."""

from pathlib import Path

import numpy as np
import pytest

from attlog import ingest
from attlog.geometry.quaternions import angle_rad, conjugate, from_rotation_vector, multiply, rotate
from attlog.ingest.datasets.frames import frames
from attlog.schemas import Source
from attlog.schemas.unified import quaternions, vectors

HEADER = (
    "Time (s);Vicon Orientation;;;;IMU Acceleration;;;IMU Gyroscope;;;IMU Magnetometer;;;\n"
    ";W;X;Y;Z;X;Y;Z;X;Y;Z;X;Y;Z;\n"
)
MARKERS = from_rotation_vector([0.3, -0.2, 0.5])
"""Marker axes from sensor axes."""
WORLD = from_rotation_vector([1.2, 0.4, -0.7])
"""Vicon's world from ENU."""


def spelled(value: float) -> str:
    """A number as the files have it: five digits, and exponents of three (``9.5e-005``)."""
    text = f"{value:.5g}"
    mantissa, mark, exponent = text.partition("e")
    return text if not mark else f"{mantissa}e{exponent[0]}{int(exponent[1:]):03d}"


def written(motion, vicon, path: Path) -> Path:
    field = motion.field / np.linalg.norm(motion.field, axis=1, keepdims=True)
    rows = np.column_stack([motion.time_s + 0.01, vicon[:, [3, 0, 1, 2]], motion.force, motion.rate, field])
    lines = (f"{row[0]:.6g};" + ";".join(spelled(value) for value in row[1:]) for row in rows)
    path.write_text(HEADER + "\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def turned(motion) -> np.ndarray:
    return multiply(multiply(WORLD, motion.q), conjugate(MARKERS))


def by_topic(path: Path):
    result = ingest.read(Source.from_path(path))
    return result, {columns.channel.topic: columns for columns in result.columns}


def test_columns_units_and_no_guess(motion, turned, tmp_path: Path) -> None:
    path = written(motion, turned, tmp_path / "TStick_Test02_Trial1.csv")
    assert ingest.recognize(path.read_bytes()[:65536], path.name).name == "repoimu"
    result, channels = by_topic(path)
    assert result.format == "repoimu"
    assert list(channels) == ["/imu0/data_raw", "/mag0/field", "/reference/attitude"]
    np.testing.assert_allclose(
        vectors(channels["/imu0/data_raw"].data, "angular_velocity"), motion.rate, rtol=1e-4, atol=1e-9
    )
    np.testing.assert_allclose(vectors(channels["/imu0/data_raw"].data, "linear_acceleration"), motion.force, rtol=1e-4)
    norm = np.linalg.norm(vectors(channels["/mag0/field"].data, "magnetic_field"), axis=1)
    np.testing.assert_allclose(norm, 50e-6, rtol=1e-3)  # printed as of unit norm
    assert result.findings == ()
    assert result.completeness.complete


def test_both_constant_rotations_are_found(motion, turned, tmp_path: Path) -> None:
    _, channels = by_topic(written(motion, turned, tmp_path / "a.csv"))
    reference = channels["/reference/attitude"]
    q = quaternions(reference.data)
    # What is left between the two is a heading, the same at all times.
    rest = multiply(q, conjugate(motion.q))
    rest = rest * np.sign(rest[:, 3:])
    assert np.degrees(np.abs(2 * rest[:, :2]).max()) < 0.1
    assert np.degrees(np.ptp(2 * np.arctan2(rest[:, 2], rest[:, 3]))) < 0.2
    about = reference.channel.metadata
    assert about["north"] == "arbitrary"
    body = np.array([float(value) for value in about["body_rotation_xyzw"].split()])
    assert np.degrees(angle_rad(multiply(conjugate(MARKERS), body))) < 0.1
    assert float(about["rate_residual_deg_s"]) < 0.5


def test_what_vicon_wrote_can_be_had_back(motion, turned, tmp_path: Path) -> None:
    _, channels = by_topic(written(motion, turned, tmp_path / "a.csv"))
    about = channels["/reference/attitude"].channel.metadata
    world, body = (np.array([float(v) for v in about[f"{name}_rotation_xyzw"].split()]) for name in ("world", "body"))
    back = multiply(multiply(conjugate(world), quaternions(channels["/reference/attitude"].data)), conjugate(body))
    assert np.degrees(angle_rad(multiply(conjugate(back), turned)).max()) < 0.01


def test_rest_tells_no_body_rotation(motion, tmp_path: Path) -> None:
    still = type(motion)(**vars(motion))
    still.rate, still.q = 0.002 * motion.rate, np.tile(motion.q[:1], (motion.n, 1))
    still.force = rotate(conjugate(still.q), [0.0, 0.0, 9.80665])
    result, channels = by_topic(written(still, multiply(WORLD, still.q), tmp_path / "TStick_Test01_Static.csv"))
    assert channels["/reference/attitude"].channel.metadata["body_rotation_xyzw"].startswith("0.000000000 0.0")
    assert ["too little rotation" in finding.advice for finding in result.findings] == [True]
    up = rotate(quaternions(channels["/reference/attitude"].data), still.force).mean(axis=0)
    assert np.degrees(np.arctan2(np.hypot(*up[:2]), up[2])) < 0.01


def test_rows_that_vicon_did_not_see(motion, turned, tmp_path: Path) -> None:
    holes = turned.copy()
    holes[500:700] = 0.0
    result, channels = by_topic(written(motion, holes, tmp_path / "a.csv"))
    assert len(channels["/reference/attitude"]) == motion.n - 200
    assert len(channels["/imu0/data_raw"]) == motion.n
    assert [finding.value for finding in result.findings] == [200.0]


@pytest.mark.parametrize("seed", range(5))
def test_frames_of_random_mountings(motion, seed: int) -> None:
    rng = np.random.default_rng(seed)
    markers, world = from_rotation_vector(rng.normal(0, 1, 3)), from_rotation_vector(rng.normal(0, 1, 3))
    vicon = multiply(multiply(world, motion.q), conjugate(markers))
    bias = rng.normal(0, 0.02, 3)
    found = frames(motion.time_ns, motion.rate + bias, motion.force, motion.time_ns[::2], vicon[::2])
    assert np.degrees(angle_rad(multiply(conjugate(markers), found.body))) < 0.5
    up = rotate(found.applied_to(vicon), motion.force).mean(axis=0)
    assert up[2] / np.linalg.norm(up) == pytest.approx(1.0)
