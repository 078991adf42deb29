"""Metadata records, sources, profiles."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from attlog.schemas import Completeness, InputError, Segment, Source, UsageError, records
from attlog.schemas.sensors import profile

text = st.text(max_size=20)
whole = st.integers(0, 2**63 - 1)


@given(st.lists(st.builds(Segment, text, st.integers(0, 99), whole, whole, whole, text), max_size=12))
def test_segments_come_back(segments: list[Segment]) -> None:
    assert records.parse_segments(records.segments_record(segments)) == tuple(segments)


@given(st.builds(Completeness, whole, whole, whole, whole, st.dictionaries(text, whole)))
def test_completeness_comes_back(completeness: Completeness) -> None:
    record = records.completeness_record(completeness)
    assert records.parse_completeness(record) == completeness
    assert record["complete"] == ("yes" if completeness.complete else "no")


@given(st.dictionaries(text, st.floats(allow_nan=False)))
def test_parameters_come_back(parameters: dict[str, float]) -> None:
    assert records.parse_parameters(records.parameters_record(parameters)) == parameters


def test_a_source_that_is_none(tmp_path: Path) -> None:
    empty = tmp_path / "empty.bin"
    empty.touch()
    for path, what in ((empty, "empty"), (tmp_path / "no.bin", "cannot be read"), (tmp_path, "directory")):
        with pytest.raises(InputError, match=what):
            Source.from_path(path)


def test_a_source_has_the_sha256_of_its_bytes(tmp_path: Path) -> None:
    path = tmp_path / "abc"
    path.write_bytes(b"abc")
    # FIPS 180-2, appendix B.1
    expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert Source.from_path(path).sha256 == expected


def test_profiles() -> None:
    assert profile("mpu9250").accel_lsb_per_g == 16384
    with pytest.raises(UsageError, match="mpu9250"):
        profile("abacus")


def test_scales() -> None:
    given = profile("accel=2048,gyro=16.4,mag=0.3")
    assert (given.accel_lsb_per_g, given.gyro_lsb_per_dps, given.mag_ut_per_lsb) == (2048.0, 16.4, 0.3)


@pytest.mark.parametrize(
    "spelled", ["accel=1", "accel=0,gyro=1", "accel=1,gyro=x", "accel=1,gyro=1,baro=1", "=", "accel=nan,gyro=1"]
)
def test_what_are_no_scales(spelled: str) -> None:
    with pytest.raises(UsageError, match="accel="):
        profile(spelled)
