"""What users may ask for, and what they are told when they ask for something else."""

import importlib.metadata
import subprocess
import sys
from dataclasses import dataclass

import pytest

from attlog import estimators
from attlog.estimators import registry
from attlog.estimators.ecf import Parameters
from attlog.estimators.parameters import ImuParameters
from attlog.schemas.errors import UsageError


def test_names_and_defaults() -> None:
    assert estimators.names() == ("accmag", "ecf", "ekf6", "ekf9", "gyro")
    for name in estimators.names():
        found = estimators.get(name)
        assert found.name == name
        assert found.summary
        assert "doi" in found.source
        assert estimators.parse(name).parameters == found.parameters()


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("ecf", "ecf"),
        ("ecf:imu=0,mag=0", "ecf"),
        ("ecf:kp=0.5", "ecf"),
        ("ecf:imu=1", "ecf_imu1"),
        ("ecf:imu=1,mag=2", "ecf_imu1_mag2"),
        ("ecf:mag=none", "ecf_nomag"),
        ("ekf6:imu=2", "ekf6_imu2"),
        (" ecf : imu = 1 , as = mine ", "mine"),
    ],
)
def test_the_result_is_named_by_its_sensors(text: str, name: str) -> None:
    assert estimators.parse(text).name == name


def test_parameters_arrive() -> None:
    selection = estimators.parse("ecf:imu=1,mag=none,kp=0.3,heading_only=no,gate=inf,as=ecf_soft")
    expected = Parameters(imu=1, mag=None, kp=0.3, heading_only=False, gate=float("inf"))
    assert selection.parameters == expected


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("efc", "did you mean ecf. There are: accmag, ecf, ekf6"),
        ("", "There are: accmag"),
        ("ecf:kq=1", "ecf has no parameter 'kq'. It has: imu, max_gap_s, mag, kp"),
        ("ekf6:mag=1", "ekf6 has no parameter 'mag'"),
        ("ecf:kp=fast", "kp=fast is not a number"),
        ("ecf:kp=nan", "kp = nan: must be from 0"),
        ("ecf:kp=-1", "kp = -1.0: must be from 0 to inf 1/s"),
        ("ecf:imu=-1", "imu=-1 is not a whole number"),
        ("ecf:imu=1.5", "imu=1.5 is not a whole number"),
        ("ecf:heading_only=maybe", "is not true or false"),
        ("ecf:kp", "'kp' is not key=value"),
        ("ecf:kp=1,", "'' is not key=value"),
        ("ecf:kp=1,kp=2", "kp is given twice"),
        ("ecf:as=a/b", "a name is a letter"),
        ("ecf:preset=paper", "ecf has no preset 'paper'. There are: none"),
    ],
)
def test_mistakes_are_named(text: str, told: str) -> None:
    with pytest.raises(UsageError) as caught:
        estimators.parse(text)
    assert told in str(caught.value)


@dataclass(frozen=True)
class Plugged(ImuParameters):
    gain: float = 1.0


PLUGGED = registry.Estimator(
    "mine", Plugged, lambda recording, parameters: None, False, "test", "doi", {"soft": Plugged(gain=0.1)}
)  # type: ignore[arg-type,return-value]


class Point:
    name = "mine"
    value = "elsewhere:PLUGGED"

    def load(self) -> registry.Estimator:
        return PLUGGED


class Broken(Point):
    name = "broken"

    def load(self) -> registry.Estimator:
        raise ImportError("no such module")


def test_other_packages_plug_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "entry_points", lambda group: [Point(), Broken()])
    assert "mine" in estimators.names()
    assert estimators.parse("mine:gain=2").parameters == Plugged(gain=2.0)
    soft = estimators.parse("mine:preset=soft,imu=1")
    assert soft.parameters == Plugged(imu=1, gain=0.1)
    assert soft.name == "mine_imu1_soft"
    with pytest.raises(UsageError, match=r"broken.*does not load: no such module"):
        estimators.get("broken")


def test_the_entry_point_group_is_declared_as_documented() -> None:
    assert registry.GROUP == "attlog.estimators"
    assert importlib.metadata.entry_points(group=registry.GROUP) is not None


def test_parsing_needs_no_numba() -> None:
    code = "import sys; from attlog import estimators; [estimators.parse(n) for n in estimators.names()]"
    done = subprocess.run(
        [sys.executable, "-c", code + "; print('numba' in sys.modules)"], capture_output=True, text=True
    )
    assert done.stdout.strip() == "False", done.stderr
