"""What is written in a picture: of a chart its values, of a node its class, values and outcomes."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

from engine.chart import Chart, DataKey, Node, Parameter, Reference, Rule
from engine.draw.chart_shapes import OutcomeLabel
from engine.draw.style import Cause
from engine.literals import Constant, constants_in

Values = Mapping[str, Any]
"""Values of a chart's parameters by name, without those that are not known; and constants."""
NONE: Mapping[str, Any] = {}
LONGEST_NOTE = 52
T = TypeVar("T")


def values_of(chart: Chart, given: Values, outer: Values) -> dict[str, Any]:
    """Values of a chart's parameters when used with `given`, whose references `outer` resolves.

    The constants of `outer` are known inside, too.
    """
    constants = {name: value for name, value in outer.items() if isinstance(value, Constant)}
    parameters = chart.parameters.items()
    known = {name: resolved_value(p.default, constants) for name, p in parameters if not p.required}
    return constants | known | {name: resolved_value(value, outer) for name, value in given.items()}


def resolved_value(value: Any, known: Values) -> Any:
    """A value with what is known instead of references."""
    if isinstance(value, Reference):
        found = known.get(value.name, value)
        return found.value if isinstance(found, Constant) else found
    if isinstance(value, Mapping):
        return {name: resolved_value(item, known) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [resolved_value(item, known) for item in value]
    return value


def declared_by(
    chart: Chart, constants: Mapping[str, Constant] = NONE
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """What a chart declares, under headings: `name: value`, or `name (type)` without a value."""
    keys = chart.keys.values()
    yield "parameters", tuple(_parameter(p, constants) for p in chart.parameters.values())
    yield "inputs", tuple(_key(key, constants) for key in keys if key.is_input)
    yield "data", tuple(_key(key, constants) for key in keys if not key.is_input)


def from_outside(used: Chart, given: Values) -> Iterator[str]:
    """The parameters of a chart used with `given` whose values are not from the charts' files."""
    for parameter in used.parameters.values():
        if parameter.origin and parameter.name not in given:
            yield _parameter(parameter, NONE)


def _parameter(parameter: Parameter, constants: Values) -> str:
    if parameter.required:
        return f"{parameter.name} ({parameter.type})"
    origin = f" ({parameter.origin})" if parameter.origin else ""
    return _given(parameter.name, parameter.default, constants) + origin


def _key(key: DataKey, constants: Values) -> str:
    name = f"{key.name} ({key.type})"
    return _given(name, key.initial, constants) if key.has_initial or key.optional else name


def target_of(node: Node) -> str:
    """What a leaf or a `use` names; "" for a container."""
    return f"chart {node.target}" if node.form == "use" else node.target


def notes_of(node: Node, values: Values) -> tuple[str, ...]:
    """What is given to a node and where its outputs go; further tries and priority."""
    return tuple(_notes(node, values))


def _notes(node: Node, values: Values) -> Iterator[str]:
    for name, value in node.parameters.items():
        yield _given(name, value, values)
    for name, value in node.given.items():
        yield _given(name, value, values)
    yield from _bound(node.reads, "←")
    yield from _bound(node.outputs, "→")
    if node.retry is not None:
        times, wait = (_told(value, values) for value in (node.retry.times, node.retry.wait))
        after = f" after {wait}" if node.retry.wait else ""
        yield f"retry: {times} on {', '.join(node.retry.on)}{after}"
    if node.timeout is not None and "timeout" not in node.next:  # else it is at its way out
        yield f"timeout: {_told(node.timeout, values)}"
    if node.priority:
        yield f"priority: {node.priority}"


def _given(name: str, value: Any, values: Values) -> str:
    text = f"{name}: {value_text(value, values)}"
    return textwrap.shorten(text, LONGEST_NOTE, placeholder=" …") + _origin(value, values)


def _bound(keys: Mapping[str, str], arrow: str) -> Iterator[str]:
    """Names and the data keys they are bound to; those named like their keys share one arrow."""
    yield from (f"{name} {arrow} {key}" for name, key in keys.items() if name != key)
    same = [name for name, key in keys.items() if name == key]
    if same:
        yield f"{arrow} {', '.join(same)}"


def outcome_label(node: Node, outcome: str, values: Values, cause: Cause = "") -> OutcomeLabel:
    """An outcome with its time limit and autonomy; `cause` is that of a container's outcome."""
    text = outcome
    if outcome == "timeout" and node.timeout is not None:
        text = f"timeout {_told(node.timeout, values)}"
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
    return _text(resolved_value(value, values))


def _told(value: Any, values: Values) -> str:
    return value_text(value, values) + _origin(value, values)


def _origin(value: Any, values: Values) -> str:
    """Where the constants in a value come from, in brackets."""
    found = (values.get(name) for name in constants_in(value))
    origins = dict.fromkeys(one.origin for one in found if isinstance(one, Constant))
    shown = ", ".join(filter(None, origins))
    return f" ({shown})" if shown else ""


def _text(value: Any) -> str:
    if isinstance(value, Reference):
        return str(value)
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_inner(item)}" for name, item in value.items())
    if isinstance(value, list | tuple):
        return _list_text(value)
    return str(value).lower() if value is None or isinstance(value, bool) else str(value)


def _list_text(items: Sequence[Any]) -> str:
    """A list; of names of one kind, such as places, the kind once."""
    kinds = {tuple(item) for item in items if isinstance(item, Mapping)}
    named = len(kinds) == 1 and all(isinstance(item, Mapping) and len(item) == 1 for item in items)
    if not named:
        return f"[{', '.join(map(_inner, items))}]"
    ((kind,),) = kinds
    return f"{kind} {', '.join(_text(item[kind]) for item in items)}"


def _inner(value: Any) -> str:
    return f"({_text(value)})" if isinstance(value, Mapping) else _text(value)


def noted(notes: Iterable[str], width: int) -> list[str]:
    """Notes in lines."""
    return [" · ".join(line) for line in packed(notes, width)]


def packed(items: Iterable[T], width: int, text: Callable[[T], str] = str) -> Iterator[list[T]]:
    """Items in lines, as many in each as fit into `width` characters with 3 between two."""
    line: list[T] = []
    used = 0
    for item in items:
        size = len(text(item)) + 3
        if line and used + size > width + 3:
            yield line
            line, used = [], 0
        line.append(item)
        used += size
    if line:
        yield line
