"""Message types: one definition from which the ros2msg text and the numpy dtypes are made."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from .errors import InputError

PRIMITIVES: Mapping[str, str] = {
    "bool": "?",
    "byte": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "<i2",
    "uint16": "<u2",
    "int32": "<i4",
    "uint32": "<u4",
    "int64": "<i8",
    "uint64": "<u8",
    "float32": "<f4",
    "float64": "<f8",
}
"""ROS 2 primitive -> numpy type code of its in-memory column."""

TEXT_TYPES = frozenset({"string", "wstring"})
SEPARATOR = "=" * 80
_FIELD = re.compile(
    r"^(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[(?P<size><=\d+|\d*)\])?\s+(?P<name>[A-Za-z]\w*)"
    r"\s*(?:=\s*(?P<value>.+)|(?P<default>\S.*))?$"
)
_BUILT_IN = {
    "time": "builtin_interfaces/msg/Time",
    "duration": "builtin_interfaces/msg/Duration",
    "builtin_interfaces/Time": "builtin_interfaces/msg/Time",
    "builtin_interfaces/Duration": "builtin_interfaces/msg/Duration",
    "Header": "std_msgs/msg/Header",
}


@dataclass(frozen=True)
class Constant:
    """A named value of a message type, as viewers show it beside the field of the same type."""

    type: str
    name: str
    value: str


@dataclass(frozen=True)
class Field:
    """A field: ``length`` None is a scalar, at least 1 a fixed array, 0 a sequence."""

    name: str
    type: "str | MessageType"
    length: int | None = None
    comment: str = ""

    @property
    def type_name(self) -> str:
        """The type as a definition spells it (``float64``, ``geometry_msgs/Vector3``)."""
        return self.type if isinstance(self.type, str) else short_name(self.type.name)


@dataclass(frozen=True)
class MessageType:
    """A ROS 2 message type: full name ``pkg/msg/Type``, fields in wire order, constants."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.name, self.fields, self.constants))

    def __getitem__(self, name: str) -> Field:
        return next(field for field in self.fields if field.name == name)

    @cached_property
    def text(self) -> str:
        """The ros2msg text with every type it depends on, in the form that MCAP's registry asks for."""
        parts = [_body(self)]
        parts += [f"{SEPARATOR}\nMSG: {short_name(used.name)}\n{_body(used)}" for used in dependencies(self)]
        return "".join(parts)

    @classmethod
    def parse(cls, name: str, text: str) -> "MessageType":
        """Read a ros2msg text with its dependencies; InputError names the line that is no definition."""
        return _parse(name, text)

    def dtype(self, lengths: Mapping[str, int] | None = None) -> "np.dtype[np.void]":
        """The logical column type, packed: nested message = nested struct, string = ``S{n}``, sequence = subarray.

        ``lengths`` gives the size of strings and sequences by dotted path (``{"state": 7}``); what is not named
        gets 1 for a string and 0 for a sequence.
        """
        return np.dtype([_column(field, lengths or {}, "") for field in self.fields])


def _column(field: Field, lengths: Mapping[str, int], path: str) -> tuple[str, object, tuple[int, ...]]:
    place = f"{path}{field.name}"
    if field.type in TEXT_TYPES:
        base: object = f"S{max(1, lengths.get(place, 1))}"
    elif isinstance(field.type, str):
        base = PRIMITIVES[field.type]
    else:
        base = np.dtype([_column(inner, lengths, f"{place}.") for inner in field.type.fields])
    if field.length is None:
        return field.name, base, ()
    return field.name, base, (field.length or lengths.get(place, 0),)


def short_name(name: str) -> str:
    """``pkg/msg/Type`` -> ``pkg/Type``."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[-1]}" if len(parts) == 3 else name


def full_name(name: str) -> str:
    """``pkg/Type`` -> ``pkg/msg/Type``."""
    parts = name.split("/")
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name


def dependencies(message: MessageType) -> list[MessageType]:
    """Every type that ``message`` is made of, once each, in order of first use."""
    found: dict[str, MessageType] = {}
    for used in _walk(message):
        found.setdefault(used.name, used)
    return list(found.values())


def _walk(message: MessageType) -> Iterator[MessageType]:
    for field in message.fields:
        if isinstance(field.type, MessageType):
            yield field.type
            yield from _walk(field.type)


def _body(message: MessageType) -> str:
    lines = [f"{c.type} {c.name}={c.value}" for c in message.constants]
    for field in message.fields:
        array = "" if field.length is None else f"[{field.length or ''}]"
        lines.append(f"{field.type_name}{array} {field.name}" + (f"  # {field.comment}" if field.comment else ""))
    return "\n".join(lines) + "\n"


@lru_cache(maxsize=4096)
def _parse(name: str, text: str) -> MessageType:
    bodies = _sections(name, text)
    return _resolve(full_name(name), bodies, {}, ())


def _sections(name: str, text: str) -> dict[str, str]:
    pieces = re.split(r"^=+[ \t]*\r?$", text, flags=re.MULTILINE)
    bodies = {full_name(name): pieces[0]}
    for piece in pieces[1:]:
        head, _, body = piece.lstrip("\r\n").partition("\n")
        if not head.startswith("MSG:"):
            raise InputError(f"{name}: a section of the definition begins with {head!r}, not with 'MSG: pkg/Type'")
        bodies[full_name(head[4:].strip())] = body
    return bodies


def _resolve(name: str, bodies: Mapping[str, str], done: dict[str, MessageType], above: tuple[str, ...]) -> MessageType:
    if name in done:
        return done[name]
    if name in above:
        raise InputError(f"{name}: the definition contains itself")
    body = bodies.get(name, _IMPLIED.get(name))
    if body is None:
        raise InputError(f"{above[0] if above else name}: the definition of {name} is missing from its text")
    fields: list[Field] = []
    constants: list[Constant] = []
    for number, raw in enumerate(body.splitlines(), 1):
        line, comment = _split_comment(raw)
        if not line:
            continue
        match = _FIELD.match(line)
        if match is None:
            raise InputError(f"{name}, line {number}: {raw.strip()!r} is not a field of a ros2msg definition")
        if match["value"] is not None and match["size"] is None:
            constants.append(Constant(match["type"], match["name"], match["value"].strip()))
            continue
        kind = _field_type(match["type"], name, bodies, done, (*above, name))
        fields.append(Field(match["name"], kind, _length(match["size"]), comment))
    done[name] = MessageType(name, tuple(fields), tuple(constants))
    return done[name]


def _split_comment(raw: str) -> tuple[str, str]:
    quoted = re.match(r"^([^#'\"]*=\s*(?:'[^']*'|\"[^\"]*\"))", raw)
    if quoted:
        return quoted[1].strip(), ""
    line, _, comment = raw.partition("#")
    return line.strip(), comment.strip()


def _length(size: str | None) -> int | None:
    if size is None:
        return None
    return 0 if size == "" or size.startswith("<=") else int(size)


def _field_type(
    spelled: str, owner: str, bodies: Mapping[str, str], done: dict[str, MessageType], above: tuple[str, ...]
) -> str | MessageType:
    if spelled in PRIMITIVES or spelled in TEXT_TYPES:
        return spelled
    wanted = _BUILT_IN.get(spelled, full_name(spelled))
    if "/" not in spelled and spelled not in _BUILT_IN:
        package = owner.split("/")[0]
        wanted = f"{package}/msg/{spelled}"
        if wanted not in bodies:
            wanted = next((known for known in bodies if known.endswith(f"/{spelled}")), wanted)
    return _resolve(wanted, bodies, done, above)


_IMPLIED = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec\n",
    "builtin_interfaces/msg/Duration": "int32 sec\nuint32 nanosec\n",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
}
