"""Detects NaN and infinity in samples, which must not reach a comparison."""

from __future__ import annotations

import cmath
import dataclasses
import math
from collections.abc import Callable, Collection, Iterable, Mapping
from enum import Enum
from types import MemberDescriptorType
from typing import Any, get_args, get_origin, get_type_hints

from hw.samples import Scan

SampleCheck = Callable[[Any, int], bool]
"""Takes a value and the nesting depth left to inspect; True if it is finite."""
DEEPEST = 16
"""Greatest nesting depth of a sample; a value that contains itself exceeds it."""


def is_finite(value: object) -> bool:
    """True if no number in it is NaN or infinite; otherwise the sample is to be dropped.

    Comparisons with NaN are false, so a NaN pose would pass as a user out of danger. Looks into
    collections, mappings, arrays, dataclasses and the attributes of other objects; infinity is
    legal in the ranges of a `Scan` only. Values that cannot be inspected completely, because they
    are nested deeper than `DEEPEST` or raise, and integers too large for a float do not count as
    finite.
    """
    try:
        return _CHECKS[type(value)](value, DEEPEST)
    except Exception:  # noqa: BLE001  a foreign class may raise anything
        return False


def _finite(value: object, left: int) -> bool:
    return left > 0 and _CHECKS[type(value)](value, left - 1)


class _Checks(dict[type, SampleCheck]):
    """The check for values of a class, built once per class."""

    def __missing__(self, kind: type) -> SampleCheck:
        check = self[kind] = _check_of(kind)
        return check


def _check_of(kind: type) -> SampleCheck:
    if dataclasses.is_dataclass(kind):
        return _check_of_fields(kind)
    if issubclass(kind, complex):
        return lambda number, _: cmath.isfinite(number)
    if hasattr(kind, "tolist"):
        return _is_finite_array
    if hasattr(kind, "__float__"):
        return lambda number, _: math.isfinite(number)
    if issubclass(kind, str | bytes | bytearray | range | type):
        return lambda *_: True
    if issubclass(kind, Mapping):
        return lambda pairs, left: _all_finite(pairs, left) and _all_finite(pairs.values(), left)
    if issubclass(kind, Collection):
        return _all_finite
    if issubclass(kind, Enum):
        return lambda member, left: _finite(member.value, left)
    return _check_of_attributes(kind)


def _all_finite(values: Iterable[object], left: int) -> bool:
    return all(_finite(value, left) for value in values)


def _is_finite_array(array: Any, left: int) -> bool:
    """NaN and infinity survive `abs` and `max`; objects and records are checked one by one."""
    kind = getattr(getattr(array, "dtype", None), "kind", None)
    if kind is None or kind in "OV":
        return _finite(array.tolist(), left)
    return kind not in "fc" or array.size == 0 or math.isfinite(abs(array).max())


def _check_of_attributes(kind: type) -> SampleCheck:
    slots = [
        name
        for cls in kind.__mro__
        if "__slots__" in vars(cls)
        for name, member in vars(cls).items()
        if isinstance(member, MemberDescriptorType)
    ]

    def check(thing: Any, left: int) -> bool:
        held = [getattr(thing, name, None) for name in slots]
        return _all_finite([*held, *getattr(thing, "__dict__", {}).values()], left)

    return check


def _check_of_fields(kind: type) -> SampleCheck:
    """Numeric fields, also those of dataclasses in fields, are summed in one expression.

    A sum is finite only if all its terms are. The other fields are looked into, and so is each that
    is not of its declared class.
    """
    sums, parts, inner = _terms(kind, "v")
    names: dict[str, Any] = {"isfinite": math.isfinite, "finite": _finite}
    plain = _conjunction(sums, [*parts, *(_looked_into(place) for place, _ in inner)])
    if inner:
        classes = [f"{place}.__class__ is class{n}" for n, (place, _) in enumerate(inner)]
        names |= {f"class{n}": cls for n, (_, cls) in enumerate(inner)}
        whole = [*sums, *(term for place, cls in inner for term in _terms(cls, place)[0])]
        plain = f"({_conjunction(whole, parts)}) if {' and '.join(classes)} else ({plain})"
    check: SampleCheck = eval(f"lambda v, left: {plain}", names)
    return check


def _terms(kind: type, value: str) -> tuple[list[str], list[str], list[tuple[str, type]]]:
    """Numbers to sum, conditions, and fields that are dataclasses of numbers, with their class."""
    try:
        hints = get_type_hints(kind)
    except Exception:  # noqa: BLE001  a name imported for type checkers only, or no type at all
        hints = {}
    sums, parts, inner = [], [], []
    for field in dataclasses.fields(kind):
        hint, place = hints.get(field.name), f"{value}.{field.name}"
        if hint in (float, int):
            sums.append(place)
        elif get_origin(hint) is tuple and set(get_args(hint)) <= {float, int, ...}:
            sums.append(f"sum({place})")
        elif isinstance(hint, type) and dataclasses.is_dataclass(hint) and _is_numbers(hint):
            inner.append((place, hint))
        elif hint not in (str, bool):
            parts.append(_looked_into(place))
    return sums, parts, inner


def _is_numbers(kind: type) -> bool:
    sums, parts, inner = _terms(kind, "v")
    return bool(sums) and not parts and not inner


def _looked_into(place: str) -> str:
    return f"({place} is None or finite({place}, left))"


def _conjunction(sums: list[str], parts: list[str]) -> str:
    terms = [f"isfinite({' + '.join(sums)})"] if sums else []
    return " and ".join(terms + parts) or "True"


def _is_scan(scan: Scan, _: int) -> bool:
    """The least range is NaN if one is."""
    least: float = scan.array.min(initial=math.inf)
    return math.isfinite(scan.start + scan.step + scan.beam_time) and least > -math.inf


_CHECKS = _Checks({Scan: _is_scan})
