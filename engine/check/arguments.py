"""What nodes are given and give: `with`, `in`, `out`, `timeout`, `retry` (N08–N11, F02, S11)."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

from engine.chart import Node, Reference, key_mark_of, mark_of
from engine.check.callee import Callee, parameter_type
from engine.check.checked_chart import NodeInPlace, Subject, unknown_key
from engine.files.source import Map, Mark
from engine.files.values import Mismatch
from engine.types import Type, convert, fits

LONGEST = 1e9  # seconds of a timeout or wait, about 30 years

_DURATION = Type("duration")


def check_arguments(subject: Subject) -> None:
    """Look at all nodes; notes on the way which keys each needs and gives."""
    for site in subject.sites[1:]:
        node = site.node
        if "timeout" in node.raw:
            at = mark_of(node.raw, "timeout")
            _check_value(subject, node.timeout, _DURATION, at, "timeout")
            _check_deadline(subject, node.timeout, at, is_timeout=True)
        if node.retry is not None:
            at = mark_of(node.raw, "retry", "wait")
            _check_value(subject, node.retry.wait, _DURATION, at, "wait")
            _check_deadline(subject, node.retry.wait, at, is_timeout=False)
        if site.callee is not None:
            _check_parameters(subject, node, site.callee)
            _check_inputs(subject, site, site.callee)
            if node.outputs:
                _check_outputs(subject, site, site.callee)
    _check_defaults(subject)


def _check_parameters(subject: Subject, node: Node, callee: Callee) -> None:
    for name, value in node.parameters.items():
        argument = callee.parameters.get(name)
        at = mark_of(node.raw, "with", name)
        if argument is None:
            hint = subject.near(name, callee.parameters)
            message = f"{callee.name} has no parameter {name!r}"
            subject.error("N08", message, key_mark_of(node.raw, "with", name), hint)
            continue
        _check_value(subject, value, argument.type, at, name)
        if name in callee.facts.deadlines:
            _check_deadline(subject, value, at, is_timeout=callee.facts.deadlines[name])
    if not callee.required_parameters <= node.parameters.keys():
        _report_missing(subject, node, "with", callee.required_parameters, "N08", "parameter")


def _report_missing(
    subject: Subject, node: Node, section: str, required: Collection[str], code: str, what: str
) -> None:
    inside = node.raw.get(section)
    if section in node.raw and not isinstance(inside, Map):
        return  # its shape has been complained about
    missing = [name for name in sorted(required) if name not in (inside or ())]
    if missing:
        names = ", ".join(map(repr, missing))
        message = f"{node.target} needs {what}{'s' if missing[1:] else ''} {names}"
        hint = f"`{section}: {{{', '.join(f'{name}: …' for name in missing)}}}`"
        subject.error(code, message, mark_of(node.raw, node.form), hint)


def _check_value(subject: Subject, value: Any, wanted: Type, at: Mark, what: str) -> None:
    """N09: `value` as written can become what is `wanted`."""
    if isinstance(value, Reference):
        _check_reference(subject, value, wanted, at, what)
        return
    if isinstance(value, list) and (wanted.item is not None or wanted.name == "any"):
        for item in value:
            _check_value(subject, item, wanted.item or wanted, at, what)
        return
    try:
        convert(value, wanted)
    except Mismatch as mismatch:
        is_parameter = isinstance(value, str) and value in subject.chart.parameters
        hint = f"`${value}` is the chart's parameter" if is_parameter else ""
        subject.error("N09", f"{what}: {mismatch}", at, hint)


def _check_reference(subject: Subject, value: Reference, wanted: Type, at: Mark, what: str) -> None:
    parameters = subject.chart.parameters
    if value.name not in parameters:
        bare = value.name.strip("{}()")
        hint = f"write `${bare}`" if bare in parameters else subject.near(value.name, parameters)
        subject.error("N09", f"{what}: the chart has no parameter {value.name!r}", at, hint)
        return
    subject.parameters_used.add(value.name)
    kind = parameter_type(parameters[value.name], subject.world.types)
    untyped = kind.name == "any" and wanted.name != "any"
    if untyped or not fits(kind, wanted):
        first = (parameters[value.name].at, "declared here")
        message = f"{what}: ${value.name} is a {kind}; wanted: a {wanted}"
        subject.error("N09", message, at, f"declare it with `type: {wanted.name}`", first)


def _check_deadline(subject: Subject, value: Any, at: Mark, *, is_timeout: bool) -> None:
    """S11: timeouts are positive and waits not negative, wherever their values come from."""
    if isinstance(value, Reference):
        before = subject.deadlines.get(value.name, False)
        subject.deadlines[value.name] = is_timeout or before
        return
    try:
        seconds = convert(value, _DURATION)
    except Mismatch:
        return  # reported as such
    if seconds > LONGEST:
        subject.error("S11", f"{seconds:g} s is too long", at, f"at most {LONGEST:g} s")
    elif is_timeout and seconds <= 0:
        subject.error("S11", "a timeout must be positive", at, "`timeout: 5 s`")
    elif seconds < 0:
        subject.error("S11", "a wait cannot be negative", at, "`wait: 1 s`")


def _check_defaults(subject: Subject) -> None:
    for name, is_timeout in subject.deadlines.items():
        parameter = subject.chart.parameters.get(name)
        if parameter is not None and parameter.default is not None:
            item = subject.chart.root.raw["parameters"][name]
            at = mark_of(item, "default")
            _check_deadline(subject, parameter.default, at, is_timeout=is_timeout)


def _check_inputs(subject: Subject, site: NodeInPlace, callee: Callee) -> None:
    node, data = site.node, subject.data
    for name, key in node.inputs.items():
        argument = callee.inputs.get(name)
        if argument is None:
            is_swapped = key in callee.inputs and name in site.names
            hint = f"the other way round: `{key}: {name}`" if is_swapped else ""
            hint = hint or subject.near(name, callee.inputs)
            message = f"{callee.name} has no input {name!r}"
            subject.error("N10", message, key_mark_of(node.raw, "in", name), hint)
        if key not in site.names:
            unknown_key(subject, site, "in", name, key, site.names)
        real = site.names.get(key)
        if argument is None or real is None:
            continue
        held, wanted = data.kinds[real], argument.type
        if not fits(held, wanted):
            at = mark_of(node.raw, "in", name)
            message = f"{key!r} holds a {held}; input {name!r} of {callee.name} is a {wanted}"
            subject.error("F02", message, at, "", (subject.chart.keys[real].at, "declared here"))
        data.read |= data.bits[real]
        if not (subject.chart.keys[real].optional and wanted.optional):
            site.needs |= data.bits[real]
    if not callee.required_inputs <= node.inputs.keys():
        _report_missing(subject, node, "in", callee.required_inputs, "N10", "input")


def _check_outputs(subject: Subject, site: NodeInPlace, callee: Callee) -> None:
    node = site.node
    for name, key in node.outputs.items():
        kinds = {o: named[name] for o, named in callee.outputs.items() if name in named}
        if not kinds:
            known = {known for named in callee.outputs.values() for known in named}
            message = f"{callee.name} has no output {name!r}"
            at = key_mark_of(node.raw, "out", name)
            is_swapped = key in known and name in site.names
            hint = (
                f"the other way round: `{key}: {name}`" if is_swapped else subject.near(name, known)
            )
            subject.error("N10", message, at, hint)
        if key not in site.names:
            unknown_key(subject, site, "out", name, key, site.names)
        real = site.names.get(key)
        if real is not None:
            for outcome, kind in kinds.items():
                _give(subject, site, outcome, kind, (name, real))


def _give(
    subject: Subject, site: NodeInPlace, outcome: str, kind: Type, binding: tuple[str, str]
) -> None:
    """An output of type `kind`, by its name, goes to a key."""
    (name, real), data = binding, subject.data
    key, held, bit = subject.chart.keys[real], data.kinds[real], data.bits[real]
    data.written |= bit
    site.final |= bit
    if kind.optional and kind.name != "any" and not held.optional:
        data.nullable |= bit
    else:
        site.gives[outcome] = site.gives.get(outcome, 0) | bit
    if not fits(kind, replace(held, optional=True) if key.optional else held):
        at = mark_of(site.node.raw, "out", name)
        message = f"output {name!r} of {site.node.target} is a {kind}; {real!r} holds a {held}"
        hint = f"declare it as `{held} | none`" if kind.optional and not held.optional else ""
        subject.error("F02", message, at, hint, (key.at, "declared here"))
