"""Checks single values as they are written in a chart (N09, N12, N13)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from engine.chart import Reference
from engine.check.callee import parameter_type
from engine.check.checked_chart import CheckedChart
from engine.files import Map, Mark, Seq, nearest
from engine.files.declared import NAME, Mismatch, with_article
from engine.literals import (
    LATER,
    ConstantMismatch,
    Resolver,
    Untyped,
    WithinLiteral,
    WrongKey,
    constant_of,
    convert,
    kind_of_names,
    path_text,
)
from engine.types import ANY, Type, fits


def check_value(
    checked: CheckedChart,
    value: Any,
    wanted: Type,
    at: Mark,
    what: str,
    hint: str = "",
    *,
    is_start: bool = False,
) -> Any:
    """N09: a value as written in the chart can be converted to the type `wanted`.

    `is_start`: it is a default or an initial value, which no parameter of the chart can be part of.

    Returns:
        The converted value; `LATER` if only a run has it, or it is wrong.
    """
    try:
        return convert(value, wanted, _Names(checked, value, at, what, is_start))
    except WithinLiteral as mismatch:
        place = _place_within(value, mismatch.keys, at, of_key=isinstance(mismatch, WrongKey))
        hint = _as_data(checked, what, value) if isinstance(mismatch, Untyped) else ""
        checked.error("N09", f"{what}{mismatch.path}: {mismatch}", place, hint)
    except Mismatch as mismatch:
        if isinstance(value, str):
            hint = _meant(checked, value, wanted) or hint
        checked.error("N09", f"{what}: {mismatch}", at, hint)
    return LATER


def is_open(value: Any) -> bool:
    """Whether it depends on a parameter of the chart what a value is."""
    if isinstance(value, list):
        return any(map(is_open, value))
    return isinstance(value, Reference) and not value.is_constant


def _meant(checked: CheckedChart, word: str, wanted: Type) -> str:
    """What a word is meant to be where a value of type `wanted` should stand."""
    if word in checked.chart.parameters:
        return f"`${word}` is the chart's parameter"
    if _DOTTED.fullmatch(word):
        return f"write `${word}` for a value from outside"
    return named_value(checked, word, wanted)


def _as_data(checked: CheckedChart, name: str, value: Any) -> str:
    """How to give a mapping, or a list of some, a type: as data."""
    shape = "list of " if isinstance(value, Seq) else ""
    first = value[0] if isinstance(value, Seq) else value
    kinds = (kind for kind in checked.scope.types if " " not in kind)
    meant = next((kind for kind in kinds if _can_be(first, checked.scope.types[kind])), "…")
    return f"give it as data: `data: {{{name}: {{type: {shape}{meant}, initial: …}}}}`"


def _can_be(value: Any, kind: Type) -> bool:
    try:
        return kind.python is not None and convert(value, kind) is not None
    except Mismatch:
        return False


def named_value(checked: CheckedChart, word: str, wanted: Type) -> str:
    """How to write the value of type `wanted` that has the name `word`; empty if there is none."""
    kind = kind_of_names(wanted)
    is_known = kind and word in (checked.scope.around.named or {}).get(kind, ())
    return f"{word!r} is a {kind}: `{{{kind}: {word}}}`" if is_known else ""


@dataclass(slots=True, eq=False)
class _Names(Resolver):
    """Looks up the names in a value, and reports those that cannot be meant."""

    checked: CheckedChart
    value: Any
    at: Mark
    what: str
    is_start: bool

    def _place(self, is_meant: Callable[[Any, Any], bool]) -> tuple[Mark, str]:
        """Where the first such item of a mapping or list in the value is, and what it is called."""
        keys = _keys_to(self.value, is_meant)
        return _place_within(self.value, keys, self.at), self.what + path_text(keys)

    def named(self, kind: str, name: str) -> Any:
        """N13: a value of this name is known somewhere; another run may have it elsewhere."""
        known = self.checked.scope.around.named
        if known is not None and name not in known.get(kind, ()):
            names = known.get(kind, ())
            hint = self.checked.near(name, names) or f"a {kind} is named where it is declared"
            at, what = self._place(lambda key, item: key == kind and item == name)
            self.checked.warning("N13", f"{what}: no {kind} {name!r} is known", at, hint)
        return LATER

    def signal(self, name: str, wanted: Type) -> str:
        """N12: there is a signal of this name; N09: its values are of the right type."""
        signals = self.checked.scope.signals
        held = ANY if signals is None else signals.get(name)
        if held is None:
            at, what = self._place(lambda _, item: item == name)
            hint = _meant_signal(self.checked, name, signals or {}, wanted)
            self.checked.error("N12", f"{what}: there is no signal {name!r}", at, hint)
        elif wanted.item is not None and not fits(held, _optional(wanted.item)):
            at, what = self._place(lambda _, item: item == name)
            message = f"{what}: {name} is a signal of {held}; wanted: a {wanted}"
            self.checked.error("N09", message, at)
        return name

    def reference(self, reference: Reference, wanted: Type) -> Any:
        """N09: there is such a parameter or constant, and it is of the right type."""
        if reference.is_constant:
            return self._constant(reference, wanted)
        checked = self.checked
        if self.is_start:
            at, what = self._place(lambda _, item: item is reference)
            message = f"a default is a value; ${reference.name} has none before the chart starts"
            checked.error("N09", f"{what}: {message}", at, _A_CONSTANT)
            return LATER
        parameters = checked.chart.parameters
        if reference.name not in parameters:
            hint = self._no_parameter(reference.name.strip("{}()"))
            at, what = self._place(lambda _, item: item is reference)
            message = f"{what}: the chart has no parameter {reference.name!r}"
            checked.error("N09", message, at, hint)
            return LATER
        checked.parameters_used.add(reference.name)
        checked.limit(reference.name, wanted)
        if parameters[reference.name].type not in checked.scope.types:
            return LATER  # reported where it is declared
        kind = parameter_type(parameters[reference.name], checked.scope.types)
        untyped = kind.name == "any" and wanted.name != "any"
        if untyped or not fits(kind, wanted):
            first = (parameters[reference.name].at, "declared here")
            at, what = self._place(lambda _, item: item is reference)
            held, need = with_article(kind), with_article(wanted)
            message = f"{what}: ${reference.name} is {held}; wanted: {need}"
            checked.error("N09", message, at, f"declare it with `type: {wanted}`", first)
        return LATER

    def _no_parameter(self, name: str) -> str:
        """A hint for `$name` that is no parameter."""
        if name in self.checked.chart.parameters:
            return f"write `${name}`"
        if name in self.checked.chart.keys:
            return f"{name!r} is a data key: name it under `in`, without the `$`"
        return self.checked.near(name, self.checked.chart.parameters)

    def _constant(self, reference: Reference, wanted: Type) -> Any:
        name, constants = reference.name, self.checked.scope.around.constants
        if name in constants:
            return self._of_type(reference, wanted)
        hint = self.checked.near(name, constants) if constants else _A_CONSTANT
        at, what = self._place(lambda _, item: item is reference)
        self.checked.error("N09", f"{what}: there is no value ${name}", at, hint)
        return LATER

    def _of_type(self, reference: Reference, wanted: Type) -> Any:
        try:
            return constant_of(reference.name, self.checked.scope.around.constants, wanted, self)
        except ConstantMismatch as mismatch:
            at, what = self._place(lambda _, item: item is reference)
            self.checked.error("N09", f"{what}: {mismatch}", at)
            return LATER


_DOTTED = re.compile(rf"{NAME}(\.{NAME})+")
_A_CONSTANT = "names of values from outside are written as `$profile.chase.inner`"


def _meant_signal(
    checked: CheckedChart, name: str, signals: Mapping[str, Type], wanted: Type
) -> str:
    """Which signal an unknown one stands for, or which there are of the type that is wanted."""
    if checked.effort <= 0:
        return ""
    kind = _optional(wanted.item or ANY)
    typed = {n: held for n, held in signals.items() if kind.name == "any" or held.name != "any"}
    fitting = sorted(signal for signal, held in typed.items() if fits(held, kind))
    if any(name.startswith(f"{signal}.") for signal in signals):
        shown = f", such as {', '.join(fitting[:3])}" if fitting else ""
        return f"fields of signals cannot be watched; a {wanted} is needed{shown}"
    if nearest(name, signals) is not None or not fitting:
        return checked.near(name, signals)
    more = ", …" if len(fitting) > _MOST_SIGNALS else ""
    return f"those that fit: {', '.join(fitting[:_MOST_SIGNALS])}{more}"


_MOST_SIGNALS = 8


def _optional(kind: Type) -> Type:
    """The same, or none: a signal may be without a value."""
    return replace(kind, optional=True)


def _keys_to(value: Any, is_meant: Callable[[Any, Any], bool]) -> tuple[str | int, ...]:
    """The keys that lead to the first item that is meant; empty if it is the whole value."""
    items: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, Map | Seq):
        items = value.items() if isinstance(value, Map) else enumerate(value)
    for key, item in items:
        if is_meant(key, item):
            return (key,)
        if keys := _keys_to(item, is_meant):
            return (key, *keys)
    return ()


def _place_within(value: Any, keys: Sequence[str | int], at: Mark, *, of_key: bool = False) -> Mark:
    """The place of a part of a value, or of the key of it."""
    for key in keys:
        if isinstance(value, Map) and key in value:
            marks: Mapping[Any, Mark] = value.values_at
            if of_key and key == keys[-1]:
                marks = value.keys_at
            at = marks.get(key, at)
        elif isinstance(value, Seq) and isinstance(key, int):
            at = value.values_at[key]
        else:
            return at
        value = value[key]
    return at
