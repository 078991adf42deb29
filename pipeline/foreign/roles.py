"""Which channel is what: as ``--topic imu=/phone/imu`` says, else where there is no doubt."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ... import storage
from ...schemas.errors import UsageError
from .kinds import ATTITUDES, Kind, Shape, shape_of

TOPICS = "topics"
"""Metadata record that remembers what ``--topic`` said: role -> place."""
REFERENCE = "reference"
_ROLE = re.compile(r"^(?:(?P<kind>imu|mag|gnss)(?P<number>\d*)|(?P<reference>reference)|onboard_(?P<name>\w+))$")
_TRUTH = re.compile(
    r"vicon|vrpn|mocap|optitrack|qualisys|natnet|ground_?truth|(?:^|[/_])(?:gt|truth|reference)(?:[/_]|$)"
)
_NATIVE = re.compile(r"^/(imu\d+|mag\d+|gnss\d+)/(?:data_raw|field|fix)$")
_KINDS = {"imu": Kind.IMU, "mag": Kind.MAG, "gnss": Kind.GNSS}


@dataclass(frozen=True)
class Place:
    """A channel, or one frame of a tree of transforms: written ``TOPIC`` or ``TOPIC:FRAME``."""

    topic: str
    child: str = ""

    def __str__(self) -> str:
        return f"{self.topic}:{self.child}" if self.child else self.topic


def parse(spelled: Sequence[str]) -> dict[str, str]:
    """``["imu=/phone/imu"]`` -> {"imu0": "/phone/imu"}; UsageError for what is no role or said twice."""
    chosen: dict[str, str] = {}
    for text in spelled:
        role, equals, place = text.partition("=")
        match = _ROLE.match(role)
        if not equals or not place or match is None:
            raise UsageError(
                f"--topic takes ROLE=TOPIC, such as imu=/phone/imu, mag1=…, gnss=…, reference=/vicon/pose or "
                f"onboard_fused=/odom, not {text!r}"
            )
        role = f"{match['kind']}{match['number'] or 0}" if match["kind"] else role
        if role in chosen:
            raise UsageError(f"--topic names {role} twice")
        chosen[role] = place
    return chosen


def kind_of(role: str) -> frozenset[Kind]:
    """What a channel must be to have the role."""
    match = _ROLE.match(role)
    return ATTITUDES if match is None or not match["kind"] else frozenset({_KINDS[match["kind"]]})


def placed(log: storage.LogFile, role: str, spelled: str) -> tuple[Place, Shape]:
    """The channel that ``spelled`` names; UsageError where there is none, or it cannot have the role."""
    topic, _, child = (spelled, "", "") if spelled in log.topics else spelled.rpartition(":")
    shapes = {name: shape for name, info in log.topics.items() if (shape := shape_of(info))}
    fitting = sorted(name for name, shape in shapes.items() if shape.kind in kind_of(role))
    there = f"there {'are' if len(fitting) > 1 else 'is'} {', '.join(fitting)}" if fitting else "there is none"
    if topic not in log.topics:
        raise UsageError(f"{log.path}: no topic {spelled} for {role}; {there} of a fitting type")
    if topic not in fitting:
        raise UsageError(
            f"{log.path}: {topic} is {log.topics[topic].schema_name or 'of no known type'}: no {role}; {there}"
        )
    return Place(topic, child), shapes[topic]


def automatic(shapes: Mapping[str, Shape], taken: frozenset[str]) -> tuple[dict[str, str], list[str]]:
    """Role -> topic for the sensors that only one channel can be, and lines about those that several can.

    ``taken`` are the roles that are filled already.
    """
    chosen: dict[str, str] = {}
    remarks = []
    for name, kind in _KINDS.items():
        topics = sorted(topic for topic, shape in shapes.items() if shape.kind is kind)
        if any(role.startswith(name) for role in taken) or not topics:
            continue
        numbered = {match[1]: topic for topic in topics if (match := _NATIVE.match(topic))}
        if numbered:
            chosen |= numbered
        elif len(topics) == 1:
            chosen[f"{name}0"] = topics[0]
        else:
            remarks.append(f"{' or '.join(topics)} could be {name}0: say which with --topic {name}={topics[0]}")
    return chosen, remarks


def is_truth(place: str) -> bool:
    """Whether a name says that a measurement from outside (motion capture, a simulator's truth) is there."""
    return _TRUTH.search(place.lower()) is not None


def onboard_name(topic: str) -> str:
    """``/imu/data`` -> ``imu_data``."""
    return re.sub(r"\W+", "_", topic).strip("_") or "attitude"
