"""What a user asks for: ``ecf:imu=1,mag=0,kp=0.3,as=ecf_soft`` becomes an estimator, its parameters and a name."""

import dataclasses
import re
import types
import typing
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from typing import Any

from ..schemas.errors import UsageError
from ..schemas.estimate import Estimate
from ..schemas.recording import Recording
from . import registry
from .parameters import ImuParameters, as_mapping, check
from .registry import Estimator

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, eq=False)
class Selection:
    """An estimator, the name of its result and its parameters."""

    estimator: Estimator
    name: str
    parameters: ImuParameters


def parse(text: str) -> Selection:
    """Read ``NAME[:key=value,…]``: any parameter of the estimator, ``preset=`` to start from, ``as=`` to name it.

    Without ``as`` the name is the estimator's, then ``_imu1``, ``_mag1`` or ``_nomag`` where a sensor is not the
    default, then the preset. UsageError for what does not exist or does not fit, listing what does.
    """
    head, colon, tail = text.strip().partition(":")
    estimator = registry.get(head.strip())
    options = _options(text, tail) if colon else {}
    given_name = options.pop("as", None)
    preset = options.pop("preset", None)
    base = _preset(estimator, preset)
    hints = _types(estimator)
    known = list(hints)
    for key in options:
        if key not in known:
            raise UsageError(
                f"{estimator.name} has no parameter {key!r}. It has: {', '.join([*known, 'preset', 'as'])}"
            )
    values: dict[str, Any] = {key: _value(estimator.name, key, value, hints[key]) for key, value in options.items()}
    parameters = dataclasses.replace(base, **values)
    check(parameters)
    name = _default_name(estimator, parameters, preset) if given_name is None else given_name
    if not _NAME.fullmatch(name):
        raise UsageError(f"as={name}: a name is a letter, then letters, digits and underscores")
    return Selection(estimator, name, parameters)


def estimate(recording: Recording, selection: Selection | str) -> Estimate:
    """Run an estimator over a recording; the result carries the selection's name and parameters.

    Raises MissingSensorError where the recording lacks a sensor that it needs, UsageError as `parse` does.
    """
    chosen = parse(selection) if isinstance(selection, str) else selection
    check(chosen.parameters)
    result = chosen.estimator.run(recording, chosen.parameters)
    return dataclasses.replace(
        result, name=chosen.name, estimator=chosen.estimator.name, parameters=as_mapping(chosen.parameters)
    )


@cache
def _types(estimator: Estimator) -> dict[str, Any]:
    hints = typing.get_type_hints(estimator.parameters)
    return {field.name: hints[field.name] for field in dataclasses.fields(estimator.parameters)}


def _options(text: str, tail: str) -> dict[str, str]:
    options: dict[str, str] = {}
    for item in tail.split(","):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not (key and equals and value):
            raise UsageError(f"{text!r}: {item.strip()!r} is not key=value; write for example ecf:imu=1,kp=0.3,as=soft")
        if key in options:
            raise UsageError(f"{text!r}: {key} is given twice")
        options[key] = value
    return options


def _preset(estimator: Estimator, preset: str | None) -> ImuParameters:
    if preset is None:
        return estimator.parameters()
    if preset not in estimator.presets:
        there = ", ".join(estimator.presets) or "none"
        raise UsageError(f"{estimator.name} has no preset {preset!r}. There are: {there}")
    return estimator.presets[preset]


def _default_name(estimator: Estimator, parameters: ImuParameters, preset: str | None) -> str:
    name = estimator.name
    if parameters.imu != 0:
        name += f"_imu{parameters.imu}"
    mag = getattr(parameters, "mag", 0)
    if mag != 0:
        name += "_nomag" if mag is None else f"_mag{mag}"
    return f"{name}_{preset}" if preset else name


def _value(estimator: str, key: str, text: str, wanted: Any) -> object:
    if isinstance(wanted, types.UnionType):
        if text.lower() == "none" and type(None) in wanted.__args__:
            return None
        wanted = next(kind for kind in wanted.__args__ if kind is not type(None))
    try:
        return _convert(text, wanted)
    except ValueError as error:
        raise UsageError(f"{estimator}: {key}={text} is not {_described(wanted)}") from error


def _convert(text: str, wanted: Any) -> object:
    if wanted is bool:
        return {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}[_lower(text)]
    if wanted is int:
        number = int(text)
        if number < 0:
            raise ValueError(text)
        return number
    return wanted(text)


def _lower(text: str) -> str:
    if text.lower() not in {"true", "yes", "1", "false", "no", "0"}:
        raise ValueError(text)
    return text.lower()


def _described(wanted: Any) -> str:
    if wanted is bool:
        return "true or false"
    if wanted is int:
        return "a whole number from 0 up"
    if isinstance(wanted, type) and issubclass(wanted, StrEnum):
        return "one of " + ", ".join(wanted)
    return "a number"
