"""Columns to recordings, declination, frames and bodies."""

import dataclasses

import numpy as np
import pytest

from attlog.geometry.quaternions import normalize
from attlog.pipeline.bodies import MOST_TRANSFORMS, SPACING_M, bodies_columns
from attlog.pipeline.declination import with_declination
from attlog.pipeline.recordings import recordings
from attlog.schemas import Attitude, Fix, Magnetometer, Recording, Segment, records
from attlog.schemas.unified import attitude_columns, fix_columns, imu_columns, mag_columns

SECOND = 1_000_000_000


def _columns() -> list[object]:
    rng = np.random.default_rng(1)
    stamps = np.array([3, 1, 2], dtype=np.int64) * SECOND
    rate, force, field = rng.normal(size=(3, 3, 3))
    turn = normalize(rng.normal(size=(3, 4)))
    return [
        imu_columns("/imu0/data_raw", stamps, rate, force, source="RAW_IMU"),
        imu_columns("/vehicle7/imu1/data_raw", stamps, 2 * rate, force, source="SCALED_IMU2"),
        mag_columns("/mag0/field", stamps, field, source="RAW_IMU"),
        fix_columns("/gnss0/fix", stamps, [1, 2, 3], [4, 5, 6], [7, 8, 9], [0, -1, 0], source="GPS_RAW_INT"),
        attitude_columns("/onboard/att/attitude", stamps, turn, child_frame_id="onboard_att", source="ATT"),
        attitude_columns("/reference/attitude", stamps, turn, child_frame_id="reference", source="SIM"),
    ]


def test_vehicles_stay_apart_and_samples_are_in_order() -> None:
    segments = [Segment("1", 0, 0, 5, 0, "start"), Segment("7", 0, 1, 5, 0, "start")]
    metadata = {records.VEHICLE: {"sysid": "1"}, records.SEGMENTS: records.segments_record(segments)}
    columns = _columns()
    found = recordings(columns, metadata)  # type: ignore[arg-type]
    assert list(found) == ["", "/vehicle7"]
    main, other = found.values()
    assert main.imu[0].time_ns.tolist() == [SECOND, 2 * SECOND, 3 * SECOND]
    x = columns[0].data["angular_velocity"]["x"]  # type: ignore[attr-defined]
    assert main.imu[0].angular_velocity[:, 0].tolist() == [x[1], x[2], x[0]]
    assert main.gnss[0].latitude_deg.tolist() == [3.0, 1.0]  # the fix at 1 s has none
    assert set(main.onboard) == {"att"}
    assert main.reference is not None
    assert list(other.imu) == [1]
    assert other.reference is None
    assert main.segments == (segments[0],)
    assert other.segments == (segments[1],)


def _with_mag(**more: object) -> Recording:
    mag = Magnetometer(np.array([0, SECOND], dtype=np.int64), np.ones((2, 3)), "/mag0/field")
    return dataclasses.replace(Recording(mag={0: mag}), **more)  # type: ignore[arg-type]


def _fix(year_ns: int) -> dict[int, Fix]:
    return {0: Fix(np.array([year_ns]), np.array([-35.363]), np.array([149.165]), np.array([584.0]), "/gnss0/fix")}


def test_declination_stated_then_parameter_then_model_then_none() -> None:
    parameter = {records.PARAMETERS: {"COMPASS_DEC": "0.2077"}}
    recording = _with_mag(metadata=parameter, gnss=_fix(1_700_000_000 * SECOND))
    stated, none = with_declination(recording, 5.0)
    assert stated.declination is not None
    assert stated.declination.degrees == 5.0
    assert none == []
    logged, _ = with_declination(recording, None)
    assert logged.declination is not None
    assert logged.declination.degrees == pytest.approx(11.9, abs=0.01)
    modelled, _ = with_declination(dataclasses.replace(recording, metadata={}), None)
    assert modelled.declination is not None
    # NOAA's calculator gives 12.6 to 12.7 degrees east for Canberra in 2023.
    assert modelled.declination.degrees == pytest.approx(12.65, abs=0.1)
    unknown, findings = with_declination(_with_mag(), None)
    assert unknown.declination is None
    assert [str(finding.kind) for finding in findings] == ["declination"]


@pytest.mark.parametrize("seconds", [100, 946_684_801])
def test_no_model_without_a_date_that_it_covers(seconds: int) -> None:
    unknown, findings = with_declination(_with_mag(gnss=_fix(seconds * SECOND)), None)
    assert unknown.declination is None
    assert len(findings) == 1


def test_bodies_stand_side_by_side_at_25_hz() -> None:
    stamps = np.arange(0, 10 * SECOND, SECOND // 400, dtype=np.int64)
    turn = np.tile([0.0, 0.0, 0.0, 2.0], (len(stamps), 1))
    turn[100] = np.nan
    attitude = Attitude(stamps, turn, "att")
    tf, bodies = bodies_columns([Recording(reference=attitude, onboard={"att": attitude})])
    assert 2 * 249 <= len(tf) <= 2 * 250
    inner = tf["transforms"][:, 0]
    places = dict(zip(inner["child_frame_id"], inner["transform"]["translation"]["x"], strict=True))
    assert places == {b"reference": 0.0, b"onboard_att": SPACING_M}
    assert np.all(inner["transform"]["rotation"]["w"] == 1.0)
    markers = bodies["markers"][0]
    assert set(markers["header"]["frame_id"]) == {b"reference", b"onboard_att"}
    assert markers["type"].tolist() == [1, 9, 1, 9]


def test_a_long_log_has_few_transforms() -> None:
    attitude = Attitude(np.arange(200_000, dtype=np.int64) * SECOND // 25, np.tile([0, 0, 0, 1.0], (200_000, 1)), "a")
    tf, _ = bodies_columns([Recording(reference=attitude)])
    assert 0.9 * MOST_TRANSFORMS <= len(tf) <= MOST_TRANSFORMS


def test_no_attitude_no_bodies() -> None:
    assert bodies_columns([Recording()]) == []
