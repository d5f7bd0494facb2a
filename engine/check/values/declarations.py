"""Checks of the declarations of a chart: parameters, data, outputs (N05, N09, N11, F02)."""

from __future__ import annotations

import re
from functools import partial
from typing import Any

from engine.chart import key_mark_of, mark_of
from engine.check.checked_chart import CheckedChart
from engine.check.values.written import check_value
from engine.files import Map, Mark, all_near
from engine.files.declared import with_article
from engine.literals import can_be_written
from engine.types import Type, fits


def check_declarations(checked: CheckedChart) -> None:
    """Check that types exist, that values have these types, and that nothing is declared twice."""
    _check_parameters(checked)
    _check_keys(checked)
    _check_outputs(checked)


def _check_parameters(checked: CheckedChart) -> None:
    mark = partial(checked.chart.declared_mark, "parameters")
    for name, parameter in checked.chart.parameters.items():
        kind = _type(checked, parameter.type, mark(name, "type"))
        at = mark(name, "default")
        if not can_be_written(kind):
            hint = "pass it on as data, by `inputs`"
            message = f"{with_article(kind)} cannot be written in a chart"
            checked.error("N09", message, parameter.at, hint)
        elif not parameter.required and parameter.default is not None:
            _check_start(checked, name, parameter.default, kind, at)


def _check_keys(checked: CheckedChart) -> None:
    raw = checked.chart.root.raw
    for name, key in checked.chart.keys.items():
        section = "inputs" if key.is_input else "data"
        if not _declares(raw, section, name):
            continue  # declared by `outputs`, see `_check_outputs`
        mark = partial(checked.chart.declared_mark, section, name)
        kind = _type(checked, key.type, mark("type"))
        start = "default" if key.is_input else "initial"
        if key.has_initial and not can_be_written(kind):
            at, hint = mark(start), f"`{start}: none`"
            checked.error("N09", f"{with_article(kind)} cannot be written in a chart", at, hint)
        elif key.has_initial:
            at, is_word = mark(start), isinstance(key.initial, str)
            empty = "`none` if it starts empty" if is_word and kind.python is not None else ""
            _check_start(checked, name, key.initial, kind, at, empty)
        if _declares(raw, "inputs", name) and _declares(raw, "data", name):
            first = (key_mark_of(raw, "inputs", name), "first here")
            at = key_mark_of(raw, "data", name)
            checked.error("N11", f"{name!r} is an input already", at, "keep one of them", first)


def _check_outputs(checked: CheckedChart) -> None:
    chart = checked.chart
    for outcome, named in chart.outputs.items():
        if outcome not in chart.outcomes:
            at = key_mark_of(chart.root.raw, "outputs", outcome)
            hint = checked.near(outcome, chart.outcomes)
            checked.error("N05", f"the chart has no outcome {outcome!r}", at, hint)
        for name, type_name in named.items():
            at = mark_of(chart.root.raw["outputs"], outcome, name)
            kind = _type(checked, type_name, at)
            key = chart.keys[name]
            held = checked.data.kinds[name]
            if not fits(held, kind):
                is_held = with_article(held)
                first = (key.at, f"{name!r} is {is_held} here")
                message = f"{name!r} holds {is_held}, not {with_article(kind)}"
                checked.error("F02", message, at, "", first)


def _type(checked: CheckedChart, name: str, at: Mark) -> Type:
    types = checked.scope.types
    if name not in types:
        checked.error("N11", f"no type {name!r}", at, _meant_type(checked, name))
    return types.get(name, _UNKNOWN)


_UNKNOWN = Type("any", optional=True)
_OWN_TYPES = "a project adds types of its own by `TYPES`, beside its states"
_OPTIONAL = re.compile(r"(.+?)\s*(?:\bor\b|\|)\s*(?:none|None|null)")
_OF_TYPES = re.compile(r"(list|signal|tuple|List|Key)\b\W*(?:of\s+)?(\w*)")


def _meant_type(checked: CheckedChart, name: str) -> str:
    """A hint for an unknown type: `list of X` is written with the name of a type."""
    types = [known for known in checked.scope.types if " " not in known]
    optional = _OPTIONAL.fullmatch(name)
    if optional is not None and optional[1] in checked.scope.types:
        return f"write `{optional[1]} | none`"
    found = _OF_TYPES.match(name)
    if found is None:
        return f"{checked.near(name, types)}; {_OWN_TYPES}".removeprefix("; ")
    shape = {"tuple": "list", "List": "list", "Key": "signal"}.get(found[1], found[1])
    items = [found[2]] if found[2] in types else all_near(found[2], types) or ["number"]
    return f"write {' or '.join(f'`{shape} of {item}`' for item in items)}"


def _check_start(
    checked: CheckedChart, name: str, value: Any, kind: Type, at: Mark, empty: str = ""
) -> None:
    """N09: a default or an initial value; of names it may use those from outside of the chart."""
    if kind is not _UNKNOWN:  # otherwise the type is reported
        check_value(checked, value, kind, at, name, empty, is_start=True)


def _declares(raw: Map, section: str, name: str) -> bool:
    inside = raw.get(section)
    return isinstance(inside, Map) and name in inside
