"""Checks values and data at nodes: `with`, `in`, `out`, `timeout`, `retry` (N08–N11, F02, S11).

How a single value is checked: `written.py`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

from engine.chart import LEAVES, Node, Reference, key_mark_of, mark_of
from engine.check.callee import Callee
from engine.check.checked_chart import CheckedChart, PlacedNode, unknown_key
from engine.check.values.written import check_value, is_open, named_value
from engine.files import Map, Mark, nearest
from engine.files.declared import Mismatch, with_article
from engine.interfaces import Argument, python_name
from engine.literals import LATER, convert
from engine.types import TIMEOUT, TIMES, WAIT, Type, fits


def check_arguments(checked: CheckedChart) -> None:
    """Check all nodes, and note which keys each needs and gives."""
    for placed in checked.nodes[1:]:
        node = placed.node
        if "timeout" in node.raw:
            at = mark_of(node.raw, "timeout")
            _check_period(checked, node.timeout, TIMEOUT, at, "timeout")
        if node.retry is not None:
            at = mark_of(node.raw, "retry", "wait")
            _check_period(checked, node.retry.wait, WAIT, at, "wait")
            at = mark_of(node.raw, "retry", "times")
            _check_period(checked, node.retry.times, TIMES, at, "times")
        if placed.callee is not None:
            _check_parameters(checked, node, placed.callee)
            if node.inputs or placed.callee.required_inputs:
                _check_inputs(checked, placed, placed.callee)
            if node.outputs:
                _check_outputs(checked, placed, placed.callee)
    _check_defaults(checked)


def _check_period(checked: CheckedChart, value: Any, wanted: Type, at: Mark, what: str) -> None:
    """A value with a range on the node itself: N09 for its type, S11 for its range."""
    found = check_value(checked, value, _unlimited(wanted), at, what)
    _check_limit(checked, value, found, wanted, at, what)


def _check_parameters(checked: CheckedChart, node: Node, callee: Callee) -> None:
    values: dict[str, Any] = {}
    for name, value in node.parameters.items():
        values[name] = LATER
        argument = callee.parameters.get(name)
        at = mark_of(node.raw, "with", name)
        if argument is None:
            is_input = name in callee.inputs
            hint = f"it is an input: `in: {{{name}: …}}`" if is_input else ""
            hint = hint or checked.near(name, callee.parameters)
            message = f"{callee.name} has no parameter {name!r}"
            checked.error("N08", message, key_mark_of(node.raw, "with", name), hint)
            continue
        if name in callee.ending and is_open(value):
            continue  # reported with what the node can end with
        values[name] = found = check_value(checked, value, argument.type, at, name)
        if name in callee.facts.limits:
            _check_limit(checked, value, found, callee.facts.limits[name], at, name)
    if not callee.required_parameters <= node.parameters.keys() | node.inputs.keys():
        _report_missing(checked, node, "with", callee.required_parameters, "N08", "parameter")
    elif node.form in LEAVES and not node.inputs.keys() & callee.parameters.keys():
        _check_together(checked, node, values)


def _check_together(checked: CheckedChart, node: Node, values: Mapping[str, Any]) -> None:
    """N09: what a class finds wrong with its parameters, where all that are given are known."""
    if any(value is LATER for value in values.values()):
        return
    given = {python_name(name): value for name, value in values.items()}
    for name, message in checked.scope.interfaces[node.target].faults(node.inputs.keys(), **given):
        is_given = name in node.parameters
        at = mark_of(node.raw, "with", name) if is_given else mark_of(node.raw, node.form)
        checked.error("N09", f"{name}: {message}", at)


def _report_missing(
    checked: CheckedChart, node: Node, section: str, required: Collection[str], code: str, what: str
) -> None:
    inside = node.raw.get(section)
    if section in node.raw and not isinstance(inside, Map):
        return  # reported when the file was loaded
    missing = [name for name in sorted(required) if name not in (inside or ())]
    if missing:
        names = ", ".join(map(repr, missing))
        message = f"{node.target} needs {what}{'s' if missing[1:] else ''} {names}"
        hint = f"`{section}: {{{', '.join(f'{name}: …' for name in missing)}}}`"
        checked.error(code, message, mark_of(node.raw, node.form), hint)


@cache
def _unlimited(kind: Type) -> Type:
    """The type without its range."""
    return replace(kind, within=None)


def _check_limit(
    checked: CheckedChart, value: Any, found: Any, wanted: Type, at: Mark, what: str
) -> None:
    """S11: a value, `found` as converted, is in the range of a type, whatever gives it."""
    if isinstance(value, Reference) and not value.is_constant:
        checked.limit(value.name, wanted)
    elif isinstance(found, int | float) and wanted.within is not None:  # else of another type
        try:
            wanted.within.require(found, wanted.name)
        except Mismatch as mismatch:
            checked.error("S11", f"{what}: {mismatch}", at)


def _check_defaults(checked: CheckedChart) -> None:
    for name, wanted in [*checked.limits.items()]:
        parameter = checked.chart.parameters.get(name)
        if parameter is not None and parameter.default is not None:
            try:
                found = convert(checked.scope.meant(parameter.default), _unlimited(wanted))
            except Mismatch:
                continue  # reported with the declarations
            at = checked.chart.declared_mark("parameters", name, "default")
            _check_limit(checked, parameter.default, found, wanted, at, name)


def _check_inputs(checked: CheckedChart, placed: PlacedNode, callee: Callee) -> None:
    node, data = placed.node, checked.data
    for name, value in node.given.items():
        argument = _argument(checked, node, callee, name)
        if argument is not None:
            check_value(checked, value, argument.type, mark_of(node.raw, "in", name), name)
    for name, key in node.reads.items():
        argument = _argument(checked, node, callee, name, key if name in placed.names else "")
        real = placed.names.get(key)
        if key not in placed.names:
            hint = _no_key(checked, placed, callee, name, key) if argument is not None else ""
            unknown_key(checked, placed, "in", name, key, placed.names, hint)
        if argument is None or real is None:
            continue
        held, wanted = data.kinds[real], argument.type
        if not fits(held, wanted):
            at = mark_of(node.raw, "in", name)
            what = "input" if name in callee.inputs else "parameter"
            given, need = with_article(held), with_article(wanted)
            message = f"{key!r} holds {given}; {what} {name!r} of {callee.name} is {need}"
            checked.error("F02", message, at, "", (checked.chart.keys[real].at, "declared here"))
        data.read |= data.bits[real]
        if not (checked.chart.keys[real].optional and wanted.optional):
            placed.needs |= data.bits[real]
    if not callee.required_inputs <= node.inputs.keys():
        _report_missing(checked, node, "in", callee.required_inputs, "N10", "input")


def _no_key(checked: CheckedChart, placed: PlacedNode, callee: Callee, name: str, word: str) -> str:
    """What is meant by text under `in` that is no data key; empty if it may be one, misspelt."""
    argument = callee.inputs.get(name) or callee.parameters[name]
    named = named_value(checked, word, argument.type)
    if named or checked.effort <= 0 or (" " not in word and nearest(word, placed.names)):
        return named
    if name in callee.parameters:
        return f"text in `in` is a data key, a value stands in `with: {{{name}: {word}}}`"
    if argument.type.name not in ("text", "any", "choice") and " " not in word:
        return ""
    given = f"`data: {{{name}: {{type: text, initial: {word}}}}}`"
    return (
        f"text in `in` is a data key; a text is given as data, {given}, or by a parameter, `$name`"
    )


def _argument(
    checked: CheckedChart, node: Node, callee: Callee, name: str, key: str = ""
) -> Argument | None:
    """The input, or parameter of a class, that an entry of `in` gives; N10 if there is none.

    `key`: what it is read from, if the chart has data of both names.
    """
    is_class = node.form in LEAVES
    named_by = checked.scope.interfaces[node.target].named_by if is_class else ()
    if name in named_by and name not in node.parameters:
        return None  # reported where the names of nodes are looked up
    found = callee.inputs.get(name) or (callee.parameters.get(name) if is_class else None)
    if found is None:
        is_parameter = name in callee.parameters
        hint = f"the other way round: `{key}: {name}`" if key in callee.inputs else ""
        hint = hint or (f"it is a parameter: `with: {{{name}: …}}`" if is_parameter else "")
        hint = hint or checked.near(name, callee.inputs)
        message = f"{callee.name} has no input {name!r}"
        checked.error("N10", message, key_mark_of(node.raw, "in", name), hint)
    elif name in node.parameters and name in callee.parameters:
        at, first = key_mark_of(node.raw, "in", name), (mark_of(node.raw, "with", name), "here")
        checked.error("N10", f"{name!r} is given by `with` already", at, "keep one of them", first)
    return found


def _check_outputs(checked: CheckedChart, placed: PlacedNode, callee: Callee) -> None:
    node = placed.node
    for name, key in node.outputs.items():
        kinds = {o: named[name] for o, named in callee.outputs.items() if name in named}
        if not kinds:
            known = {known for named in callee.outputs.values() for known in named}
            message = f"{callee.name} has no output {name!r}"
            at = key_mark_of(node.raw, "out", name)
            is_swapped = key in known and name in placed.names
            hint = (
                f"the other way round: `{key}: {name}`" if is_swapped else checked.near(name, known)
            )
            checked.error("N10", message, at, hint)
        if key not in placed.names:
            unknown_key(checked, placed, "out", name, key, placed.names)
        real = placed.names.get(key)
        if real is not None:
            for outcome, kind in kinds.items():
                _note_output(checked, placed, outcome, kind, (name, real))


def _note_output(
    checked: CheckedChart, placed: PlacedNode, outcome: str, kind: Type, binding: tuple[str, str]
) -> None:
    """Note that an output of type `kind` is written to a key; `binding`: output name, key name."""
    (name, real), data = binding, checked.data
    key, held, bit = checked.chart.keys[real], data.kinds[real], data.bits[real]
    data.written |= bit
    placed.final |= bit
    if kind.optional and kind.name != "any" and not held.optional:
        data.nullable |= bit
    else:
        placed.gives[outcome] = placed.gives.get(outcome, 0) | bit
    if not fits(kind, replace(held, optional=True) if key.optional else held):
        at = mark_of(placed.node.raw, "out", name)
        is_kind, is_held = with_article(kind), with_article(held)
        message = f"output {name!r} of {placed.node.target} is {is_kind}; {real!r} holds {is_held}"
        hint = f"declare it as `{held} | none`" if kind.optional and not held.optional else ""
        checked.error("F02", message, at, hint, (key.at, "declared here"))
