"""Checks single values as they are written in a chart (N09, N12, N13)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from engine.chart import Reference
from engine.check.callee import parameter_type
from engine.check.checked_chart import CheckedChart
from engine.files import Map, Mark, Seq
from engine.files.declared import Mismatch
from engine.literals import (
    LATER,
    OpenName,
    Resolver,
    WithinLiteral,
    constant_of,
    convert,
)
from engine.types import ANY, Type, fits


def check_value(
    checked: CheckedChart, value: Any, wanted: Type, at: Mark, what: str, hint: str = ""
) -> None:
    """N09: a value as written in the chart can be converted to the type `wanted`."""
    try:
        convert(value, wanted, _Names(checked, at, what))
    except WithinLiteral as mismatch:
        place = _place_within(value, mismatch.keys, at)
        checked.error("N09", f"{what}{mismatch.path}: {mismatch}", place)
    except Mismatch as mismatch:
        is_parameter = isinstance(value, str) and value in checked.chart.parameters
        hint = f"`${value}` is the chart's parameter" if is_parameter else hint
        checked.error("N09", f"{what}: {mismatch}", at, hint)


@dataclass(frozen=True)
class _Names(Resolver):
    """Looks up the names in a value, and reports those that cannot be meant."""

    checked: CheckedChart
    at: Mark
    what: str

    def named(self, kind: str, name: str) -> Any:
        """N13: a value of this name is known somewhere; another run may have it elsewhere."""
        known = self.checked.scope.around.named
        if known is not None and name not in known.get(kind, ()):
            names = known.get(kind, ())
            hint = self.checked.near(name, names) or f"a {kind} is named where it is declared"
            message = f"{self.what}: no {kind} {name!r} is known"
            self.checked.warning("N13", message, self.at, hint)
        return OpenName(kind, name)

    def signal(self, name: str, wanted: Type) -> str:
        """N12: there is a signal of this name; N09: its values are of the right type."""
        signals = self.checked.scope.signals
        held = ANY if signals is None else signals.get(name)
        if held is None:
            hint = self.checked.near(name, signals or ())
            message = f"{self.what}: there is no signal {name!r}"
            self.checked.error("N12", message, self.at, hint)
        elif wanted.item is not None and not fits(held, _optional(wanted.item)):
            message = f"{self.what}: {name} is a signal of {held}; wanted: a {wanted}"
            self.checked.error("N09", message, self.at)
        return name

    def reference(self, reference: Reference, wanted: Type) -> Any:
        """N09: there is such a parameter or constant, and it is of the right type."""
        if reference.is_constant:
            return self._constant(reference.name, wanted)
        checked, what = self.checked, self.what
        parameters = checked.chart.parameters
        if reference.name not in parameters:
            bare = reference.name.strip("{}()")
            hint = f"write `${bare}`" if bare in parameters else checked.near(bare, parameters)
            message = f"{what}: the chart has no parameter {reference.name!r}"
            checked.error("N09", message, self.at, hint)
            return LATER
        checked.parameters_used.add(reference.name)
        kind = parameter_type(parameters[reference.name], checked.scope.types)
        untyped = kind.name == "any" and wanted.name != "any"
        if untyped or not fits(kind, wanted):
            first = (parameters[reference.name].at, "declared here")
            message = f"{what}: ${reference.name} is a {kind}; wanted: a {wanted}"
            checked.error("N09", message, self.at, f"declare it with `type: {wanted}`", first)
        return LATER

    def _constant(self, name: str, wanted: Type) -> Any:
        constants = self.checked.scope.around.constants
        if name in constants:
            return constant_of(name, constants, wanted, self)
        hint = self.checked.near(name, constants)
        self.checked.error("N09", f"{self.what}: there is no value ${name}", self.at, hint)
        return LATER


def _optional(kind: Type) -> Type:
    """The same, or none: a signal may be without a value."""
    return Type(kind.name, kind.choices, kind.item, True, kind.python)


def _place_within(value: Any, keys: Sequence[str | int], at: Mark) -> Mark:
    """The place of a part of a value."""
    for key in keys:
        if isinstance(value, Map) and key in value:
            marks: Mapping[Any, Mark] = value.values_at
            at = marks.get(key, at)
        elif isinstance(value, Seq) and isinstance(key, int):
            at = value.values_at[key]
        else:
            return at
        value = value[key]
    return at
