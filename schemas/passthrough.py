"""Types generated from a source's own definitions, under names that every ROS 2 reader accepts."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from .definition import Field, MessageType
from .messages import HEADER

_COMMENT = re.compile(r"^(?P<name>\S+)(?: \[(?P<unit>[^\]]*)\])?")
RESERVED = frozenset({"header"})


@dataclass(frozen=True)
class SourceField:
    """A field as the source defines it: ``length`` as in `Field`, ``multiplier`` from stored value to ``unit``."""

    name: str
    type: str
    length: int | None = None
    unit: str = ""
    multiplier: float | None = None
    description: str = ""


def ros_type_name(name: str) -> str:
    """CamelCase of a source's type name: ``GPS_RAW_INT`` -> ``GpsRawInt``, ``XKF1`` -> ``Xkf1``."""
    words = re.findall(r"[A-Za-z0-9]+", name)
    camel = "".join(word[:1].upper() + word[1:].lower() for word in words)
    return camel if camel[:1].isalpha() else f"M{camel}"


def ros_field_names(names: Iterable[str]) -> list[str]:
    """Field names that ROS 2 accepts: ``TimeUS`` -> ``timeus``, ``2d`` -> ``f2d``, a second ``a`` -> ``a_2``."""
    taken: set[str] = set(RESERVED)
    result = []
    for name in names:
        plain = _plain_field_name(name)
        unique, number = plain, 2
        while unique in taken:
            unique, number = f"{plain}_{number}", number + 1
        taken.add(unique)
        result.append(unique)
    return result


def _plain_field_name(name: str) -> str:
    plain = re.sub(r"_+", "_", re.sub(r"[^0-9a-z_]", "_", name.lower())).strip("_") or "f"
    return plain if plain[0].isalpha() else f"f{plain}"


def generated_type(
    package: str, source_type: str, fields: Sequence[SourceField], leading: Sequence[Field] = ()
) -> MessageType:
    """The type of a passed-through message: Header, then ``leading``, then the source's fields under their ROS names.

    The comment of a field begins with the source's own name, then unit and multiplier (``TimeUS [us]``,
    ``Lat [deg] x1e-07``), which `source_names` reads back.
    """
    return _generated(package, source_type, tuple(fields), tuple(leading))


@lru_cache(maxsize=4096)
def _generated(
    package: str, source_type: str, fields: tuple[SourceField, ...], leading: tuple[Field, ...]
) -> MessageType:
    names = ros_field_names([field.name for field in leading] + [field.name for field in fields])[len(leading) :]
    own = [Field(name, f.type, f.length, _comment(f)) for name, f in zip(names, fields, strict=True)]
    header = Field("header", HEADER)
    return MessageType(f"{package}/msg/{ros_type_name(source_type)}", (header, *leading, *own))


def _comment(field: SourceField) -> str:
    parts = [field.name]
    if field.unit:
        parts.append(f"[{field.unit}]")
    if field.multiplier not in (None, 1.0):
        parts.append(f"x{field.multiplier:g}")
    if field.description:
        parts.append(" ".join(field.description.split()))
    return " ".join(parts)


def source_names(message: MessageType) -> Mapping[str, str]:
    """The source's own field name -> the ROS name, for a type that `generated_type` made (also when read back)."""
    found = ((_COMMENT.match(field.comment), field.name) for field in message.fields if field.comment)
    return {match["name"]: name for match, name in found if match}
