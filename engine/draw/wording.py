"""What is written in a picture about a node: its class, its values, its outcomes."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

from engine.chart import Chart, Node, Reference, Rule
from engine.draw.chart_shapes import OutcomeLabel
from engine.draw.style import Cause

Values = Mapping[str, Any]
"""Values of a chart's parameters, without those that are not known."""
LONGEST_NOTE = 44


def values_of(chart: Chart, given: Values, outer: Values) -> dict[str, Any]:
    """Values of a chart's parameters when used with `given`, whose references `outer` resolves."""
    known = {name: p.default for name, p in chart.parameters.items() if not p.required}
    for name, value in given.items():
        from_outer = isinstance(value, Reference) and value.name in outer
        known[name] = outer[value.name] if from_outer else value
    return known


def notes_of(node: Node, values: Values) -> tuple[str, ...]:
    """The small lines under a node's name."""
    return tuple(_notes(node, values))


def _notes(node: Node, values: Values) -> Iterator[str]:
    yield f"chart {node.target}" if node.form == "use" else node.target
    for name, value in node.parameters.items():
        shown = f"{name}: {value_text(value, values)}"
        yield textwrap.shorten(shown, LONGEST_NOTE, placeholder=" …")
    if node.retry is not None:
        wait = f" after {value_text(node.retry.wait, values)}" if node.retry.wait else ""
        yield f"retry: {node.retry.times} on {', '.join(node.retry.on)}{wait}"
    if node.priority:
        yield f"priority: {node.priority}"


def outcome_label(node: Node, outcome: str, values: Values, cause: Cause = "") -> OutcomeLabel:
    """An outcome with its time limit and autonomy; `cause` is that of a container's outcome."""
    text = outcome
    if outcome == "timeout" and node.timeout is not None:
        text = f"timeout {value_text(node.timeout, values)}"
    level = node.autonomy.get(outcome)
    return OutcomeLabel(f"{text} ({level} autonomy)" if level else text, cause_of(outcome) or cause)


def cause_of(outcome: str) -> Cause:
    """The cause that the name of an outcome stands for."""
    return "error" if outcome == "error" else "timeout" if outcome == "timeout" else ""


def condition_text(rule: Rule) -> str:
    """Text that tells when a rule of `when` holds."""
    shown = [f"{child} {outcome}" for child, outcome in rule.conditions.items()]
    return f"if {' and '.join(shown)}" if shown else "all have ended"


def value_text(value: Any, values: Values) -> str:
    """A value as written in the chart; a parameter as its value, or as `$name` if not known."""
    if isinstance(value, Reference):
        return value_text(values[value.name], {}) if value.name in values else f"${value.name}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(value_text(item, values) for item in value)}]"
    return json.dumps(value) if value is None or isinstance(value, bool) else str(value)
