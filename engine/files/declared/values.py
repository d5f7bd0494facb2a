"""Conversion of single values from files: numbers with units, text, choices; ranges."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from engine.files.finding import did_you_mean
from engine.files.suggestions import plain_word
from engine.files.units import NUMBER, UNITS, quantity, respelt, si_unit

PLAIN, ANY = "", "number"
"""In place of a dimension: numbers without a unit, and numbers with any unit."""
NAME = "[A-Za-z_][A-Za-z0-9_]*"
"""Pattern of the names of charts, nodes and everything else that files describe."""
_NAME = re.compile(NAME)
_NUMBER = re.compile(NUMBER)
LONGEST = 60
"""Longest name of a scene, a robot, a user …, letters; file names contain several of them."""


class Mismatch(ValueError):
    """A value of the wrong kind; the message says what would be right."""


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers from `low` to `high`, in SI units and rad; `above`: `low` itself is excluded."""

    low: float
    high: float
    above: bool = False

    def admits(self, value: float) -> bool:
        """True if the value is in the range."""
        return (self.low < value if self.above else self.low <= value) and value <= self.high

    def require(self, value: float, dimension: str = PLAIN) -> None:
        """Check that a value is in the range.

        Raises:
            Mismatch: it is not; the message has the allowed range, in the unit of `dimension`.
        """
        if self.admits(value):
            return
        is_degrees = dimension == "angle" and self.admits(math.radians(value))
        hint = f"; write `{value:g} deg` for degrees" if is_degrees else ""
        allowed = self._shown(si_unit(dimension))
        raise Mismatch(f"{value:g} is out of range, {allowed} is allowed{hint}")

    def _shown(self, unit: str) -> str:
        if self.high == math.inf:
            low = f"{self.low:.4g} {unit}".rstrip()
            return f"more than {low}" if self.above else f"{low} or more"
        begin = f"above {self.low:.4g} up" if self.above else f"{self.low:.4g}"
        return f"{begin} to {self.high:.4g} {unit}".rstrip()

    def narrowed(self, other: Range) -> Range:
        """The numbers that are in both ranges."""
        low, above = max((self.low, self.above), (other.low, other.above))
        return Range(low, min(self.high, other.high), above)


@dataclass(frozen=True, slots=True)
class Count:
    """The number of items of a list, from `least` to `most`."""

    least: int
    most: int = 100_000

    def require(self, count: int) -> None:
        """Check the length of a list.

        Raises:
            Mismatch: it has another length; the message has the allowed one.
        """
        if self.least <= count <= self.most:
            return
        if count == 0:
            raise Mismatch("is an empty list; at least one value is needed")
        wanted = f"{self.least}" if self.least == self.most else f"{self.least} to {self.most}"
        raise Mismatch(f"needs {wanted} values, has {count}")


def above_0(high: float = math.inf) -> Range:
    """The range above 0, up to `high`."""
    return Range(0.0, high, above=True)


FROM_0 = Range(0.0, math.inf)
"""Numbers that are not negative."""
ABOVE_0 = above_0()
"""Numbers that are positive."""


def number(value: Any, dimension: str = PLAIN) -> float:
    """A number in SI units; text with a unit of this dimension is converted.

    Raises:
        Mismatch: it is not a number of this dimension.
    """
    if isinstance(value, str):
        return _with_unit(value, dimension)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Mismatch(f"{shown(value)} is not a number; wanted: {example(dimension)}")
    return float(value)


def whole(value: Any) -> int:
    """A whole number.

    Raises:
        Mismatch: it is not one.
    """
    if isinstance(value, str):
        meant = f"; write {value} without quotes" if _NUMBER.fullmatch(value) else ""
        raise Mismatch(f"{value!r} is not a whole number{meant}")
    found = number(value)
    if found != int(found):
        raise Mismatch(f"{value!r} is not a whole number")
    return int(value)


def text(value: Any) -> str:
    """Text.

    Raises:
        Mismatch: it is not text.
    """
    if isinstance(value, str):
        return value
    raise Mismatch(f"{shown(value)} is not text; put it in quotes")


def name(value: Any) -> str:
    """Text that can serve as a name, also in the name of a file.

    Raises:
        Mismatch: it cannot.
    """
    found = text(value)
    if not is_name(found) or len(found) > LONGEST:
        wanted = f"letters, digits and _, not starting with a digit, {LONGEST} at most"
        raise Mismatch(f"{found[:LONGEST]!r} cannot be a name; wanted: {wanted}")
    return found


def is_name(word: str) -> bool:
    """True if the word can be a name."""
    return _NAME.fullmatch(word) is not None


def boolean(value: Any) -> bool:
    """True or false.

    Raises:
        Mismatch: it is neither.
    """
    if isinstance(value, bool):
        return value
    meant = plain_word(value)
    hint = f"; write `{meant}`" if meant else ""
    raise Mismatch(f"{shown(value)} is not true or false{hint}")


def choice(value: Any, choices: Iterable[Any]) -> Any:
    """One of some values, of the same type.

    Raises:
        Mismatch: it is none of them.
    """
    known = tuple(choices)
    for allowed in known:
        if value == allowed and type(value) is type(allowed):
            return value
    names = [str(allowed) for allowed in known]
    if isinstance(value, str):
        raise Mismatch(f"{value!r} is not known; {did_you_mean(value, names)}")
    raise Mismatch(f"{shown(value)} is not one of {', '.join(names)}")


def shown(value: Any) -> str:
    """A value as messages show it."""
    if value is None:
        return "nothing"
    if isinstance(value, Mapping):
        return "a mapping"
    return "a list" if isinstance(value, list) else repr(value)


def _with_unit(written: str, dimension: str) -> float:
    found = quantity(written)
    if found is None:
        if _NUMBER.fullmatch(written):
            raise Mismatch(f"{written!r} is text; write {written} without quotes")
        meant = respelt(written)
        meant = f"did you mean {meant!r}?" if meant else f"wanted: {example(dimension)}"
        if written.strip().endswith(","):
            meant = f"leave out the comma; {meant}"
        raise Mismatch(f"{written!r} is not {with_article(dimension or ANY)}; {meant}")
    value, given = found
    if dimension not in (given, ANY):
        raise Mismatch(f"{written!r} is {with_article(given)}; wanted: {example(dimension)}")
    return value


def example(dimension: str) -> str:
    """What numbers of a dimension look like: `a length, in mm, cm, m, km`."""
    if dimension == PLAIN:
        return "a number without a unit"
    units = [unit for unit, (of, _, _) in UNITS.items() if of == dimension]
    return f"{with_article(dimension)}, in {', '.join(units)}" if units else with_article(dimension)


def with_article(what: object) -> str:
    """A noun, such as the name of a dimension or a type, with its article."""
    words = str(what).replace("_", " ")
    return f"an {words}" if words[:1] in tuple("aeiouAEI") else f"a {words}"
