"""The interface of a leaf whose parameters name signals, parts or outcomes, or whose types vary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from engine.chart import LEAVES, Node, Reference, key_mark_of, mark_of
from engine.check.callee import Callee, of_interface, parameter_type
from engine.check.checked_chart import CheckedChart, PlacedNode
from engine.files import Mark, Seq
from engine.files.declared import Mismatch, is_name
from engine.interfaces import Interface, NoOutcome, bindings, resolved
from engine.literals import convert
from engine.state_class import RESERVED_OUTCOMES
from engine.types import ANY, Type


def name_by_nodes(checked: CheckedChart) -> None:
    """Give the leaves whose interface depends on their node the one that results."""
    for placed in checked.nodes:
        of = checked.scope.interfaces.get(placed.node.target)
        if placed.form in LEAVES and placed.callee is not None and of is not None and of.is_open:
            placed.callee = _callee_at(checked, placed, of)


def _callee_at(checked: CheckedChart, placed: PlacedNode, of: Interface) -> Callee:
    """What a leaf looks like with the names that its node gives; N05 where they cannot be used."""
    node = placed.node
    given = {name: _named(checked, node, of, name) for name in of.named_by}
    types = bindings(of, _signal_types(checked, node, of, given), _read_types(checked, placed, of))
    _bind_references(checked, node, of, types)
    ending = _naming_outcomes(of)
    assumed = dict.fromkeys(ending, ()) | dict.fromkeys(ending[:1], _mapped(node, of))
    if any(given[name] is _UNKNOWN for name in ending):
        given |= assumed
    known = {name: () if value is _UNKNOWN else value for name, value in given.items()}
    try:
        found = of_interface(resolved(of, known, types))
    except NoOutcome as error:
        at = _mark_of_outcome(node, ending, error.outcome)
        checked.error("N05", f"{of.name}: {error}", at)
        found = of_interface(resolved(of, known | assumed, types))
    return replace(found, ending=tuple(ending))


def _mapped(node: Node, of: Interface) -> tuple[str, ...]:
    """The outcomes that only the node names; it is assumed to have them if more is not known."""
    own = {*of.outcomes, *RESERVED_OUTCOMES}
    return tuple(outcome for outcome in node.next if is_name(outcome) and outcome not in own)


def _mark_of_outcome(node: Node, ending: Sequence[str], outcome: str) -> Mark:
    """The place of the last entry of this name in the lists that name outcomes."""
    found = mark_of(node.raw, "with", ending[0])
    for name in ending:
        value = node.parameters.get(name)
        if isinstance(value, Seq):
            marks = zip(value, value.values_at, strict=True)
            found = next((at for item, at in [*marks][::-1] if item == outcome), found)
    return found


_UNKNOWN: Any = object()


def _named(checked: CheckedChart, node: Node, of: Interface, name: str) -> Any:
    """The value of a parameter that names something; for `$x`, text that begins with `$`."""
    argument = of.parameters[name]
    if name not in node.parameters:
        if name in node.inputs:
            at = key_mark_of(node.raw, "in", name)
            message = f"{name!r} says what {of.name} reads, commands or ends with"
            hint = f"it has to be known before the run: `with: {{{name}: …}}`"
            checked.error("N10", message, at, hint)
        return _UNKNOWN if argument.required else argument.default
    value = checked.scope.meant(node.parameters[name])
    items = [checked.scope.meant(item) for item in value] if isinstance(value, list) else [value]
    hidden = next((item for item in items if isinstance(item, Reference)), None)
    if hidden is not None and name not in _naming_outcomes(of):
        names = tuple(str(item) for item in items if isinstance(item, str | Reference))
        return names if isinstance(value, list) else names[0]
    if hidden is not None:
        message = f"{name!r} names outcomes of {of.name}, and {hidden} hides which"
        at = mark_of(node.raw, "with", name)
        checked.parameters_used.add(hidden.name)
        right = "[first, second]" if argument.type.name == "list" else "first"
        checked.error("N05", message, at, f"write them here: `{name}: {right}`")
        return _UNKNOWN
    try:
        return convert(value, argument.type)
    except Mismatch:
        return _UNKNOWN  # reported with the other values


def _naming_outcomes(of: Interface) -> list[str]:
    named = (*of.outcomes, *of.outputs)
    return list(dict.fromkeys(name[1:] for name in named if name[0] == "$"))


def _signal_types(
    checked: CheckedChart, node: Node, of: Interface, given: Mapping[str, Any]
) -> dict[str, Type]:
    found = {}
    for name, argument in of.parameters.items():
        if argument.type.name != "signal":
            continue
        value = node.parameters.get(name)
        if isinstance(value, Reference) and value.name in checked.chart.parameters:
            kind = parameter_type(checked.chart.parameters[value.name], checked.scope.types)
            found[name] = kind.item or ANY
        elif checked.scope.signals is not None and isinstance(given.get(name), str):
            found[name] = checked.scope.signals.get(given[name], ANY)
    return found


def _read_types(checked: CheckedChart, placed: PlacedNode, of: Interface) -> dict[str, Type]:
    known = {**of.parameters, **of.inputs}
    keys = ((name, placed.names.get(key)) for name, key in placed.node.reads.items())
    return {n: checked.data.kinds[key] for n, key in keys if n in known and key is not None}


def _bind_references(
    checked: CheckedChart, node: Node, of: Interface, types: dict[str, Type]
) -> None:
    """Let parameters and inputs that are given as `$name` say what type variables stand for."""
    given = {**node.parameters, **node.given}
    named = {n: v for n, v in given.items() if isinstance(v, Reference)}
    known = {**of.parameters, **of.inputs}
    kinds = {
        name: parameter_type(checked.chart.parameters[value.name], checked.scope.types)
        for name, value in named.items()
        if name in known and value.name in checked.chart.parameters
    }
    for variable, kind in bindings(of, {}, kinds).items():
        types.setdefault(variable, kind)
