"""Plain values as JSON: numbers, strings, None, tuples, and the classes in `KINDS` by name.

Only plain data can be read, and only if every field is of its class: what is read can be used as
the type says, whoever wrote it. Numbers may be NaN or infinite; see `hw.finite`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from hw.geometry import Pose2, Pose3, Twist2
from hw.safety import ChainStatus, SafetyRecord
from hw.samples import (
    ArmState,
    BumperHit,
    ClockState,
    GripperState,
    ImuReading,
    Odometry,
    PoseSigma,
    RobotView,
    Scan,
    TrackerPose,
    UserPose,
    WrenchReading,
)
from hw.truth import Contact, Hit, Truth

KINDS: Mapping[str, Any] = {
    kind.__name__: kind
    for kind in (
        Pose2, Pose3, Twist2, ArmState, BumperHit, ChainStatus, ClockState, Contact, GripperState,
        Hit, ImuReading, Odometry, PoseSigma, RobotView, SafetyRecord, Scan, TrackerPose, Truth,
        UserPose, WrenchReading,
    )
}  # fmt: skip
"""The classes that a value may contain."""
GREATEST = 1 << 63
"""Integers of fields are smaller than this."""
Check = Callable[[Any], bool]


def plain(value: Any) -> Any:
    """A value in the form that `json` accepts.

    Raises:
        TypeError: it has no such form.
    """
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if type(value) is tuple:
        return [plain(item) for item in value]
    name = type(value).__name__
    if KINDS.get(name) is not type(value):
        raise TypeError(f"a {name} cannot be sent in a datagram; see hw.ipc.plain.KINDS")
    if isinstance(value, tuple):
        return {name: [plain(item) for item in value]}
    return {name: [plain(getattr(value, field.name)) for field in dataclasses.fields(value)]}


def parsed(found: Any) -> Any:
    """The value of parsed JSON; the inverse of `plain`.

    Raises:
        ValueError, TypeError, KeyError: it is invalid.
    """
    if isinstance(found, list):
        return tuple([parsed(item) for item in found])
    if isinstance(found, dict):
        [(name, content)] = found.items()
        fields = tuple([parsed(item) for item in content])
        checks = _checks_of(KINDS[name])
        if len(fields) != len(checks) or not all(
            check(field) for check, field in zip(checks, fields, strict=True)
        ):
            raise ValueError(f"no {name}: {fields!r}")
        return KINDS[name](*fields)
    return found


@cache
def _checks_of(kind: type) -> tuple[Check, ...]:
    """One check for each field of a class, in their order."""
    hints = get_type_hints(kind)
    named = kind._fields if hasattr(kind, "_fields") else [f.name for f in dataclasses.fields(kind)]
    return tuple([_check_of(hints[name]) for name in named])


def _check_of(hint: Any) -> Check:
    """Whether a value is of an annotated type; integers pass as floats, booleans do not."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint is float:
        return lambda value: type(value) is float or _is_integer(value)
    if hint is int:
        return _is_integer
    if origin is Literal:
        return lambda value: isinstance(value, str) and value in arguments
    if origin in (Union, UnionType):
        any_of = [_check_of(one) for one in arguments]
        return lambda value: any(check(value) for check in any_of)
    if origin is tuple:
        return _check_of_tuple(arguments)
    if hint is None or hint is NoneType:
        return lambda value: value is None
    if hint in (bool, str) or hint in KINDS.values():
        return lambda value: type(value) is hint
    raise TypeError(f"fields of type {hint} cannot be sent in a datagram")


def _check_of_tuple(items: tuple[Any, ...]) -> Check:
    if items[-1] is Ellipsis:
        check = _check_of(items[0])
        return lambda value: type(value) is tuple and all(map(check, value))
    checks = [_check_of(item) for item in items]
    return lambda value: (
        type(value) is tuple
        and len(value) == len(checks)
        and all(check(item) for check, item in zip(checks, value, strict=True))
    )


def _is_integer(value: Any) -> bool:
    return type(value) is int and -GREATEST <= value < GREATEST
