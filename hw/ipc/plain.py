"""Values as JSON by the table of `engine.files.codec`; of classes only those in `KINDS`.

Only plain data can be read, and only if every field is of its class: what is read can be used as
the type says, whoever wrote it. Numbers may be NaN or infinite; see `hw.finite`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from engine.files import Write, Writers, decoded, fields_of
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


def text(value: Any) -> str:
    """A value as JSON text.

    Raises:
        TypeError: it is neither plain nor one of `KINDS`.
    """
    return _WRITE[type(value)](value)


def _writer(kind: type) -> Write:
    name = kind.__name__
    write = _WRITE.of_base(kind) or _WRITE.of_fields(kind, name)
    if write is None or (KINDS.get(name) is not kind and not issubclass(kind, float | int | str)):
        raise TypeError(f"a {name} cannot be sent in a datagram; see hw.ipc.plain.KINDS")
    return write


_WRITE = Writers(_writer)


def parsed(found: Any) -> Any:
    """The value of parsed JSON; the inverse of `text`.

    Raises:
        ValueError, TypeError, KeyError: it is invalid.
    """
    return decoded(found, _made)


def _made(name: str, content: Any) -> Any:
    items = parsed(content)
    checks = _checks_of(KINDS[name])
    if (
        type(items) is not tuple
        or len(items) != len(checks)
        or not all(check(item) for check, item in zip(checks, items, strict=True))
    ):
        raise ValueError(f"no {name}: {items!r}")
    return KINDS[name](*items)


@cache
def _checks_of(kind: type) -> tuple[Check, ...]:
    """One check for each field of a class, in their order."""
    hints = get_type_hints(kind)
    return tuple([_check_of(hints[name]) for name in fields_of(kind) or ()])


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
