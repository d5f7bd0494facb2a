"""An example of a node for each state: one that validates in a chart of its own.

The values are those of the example in the class's docstring, `{do: DriveTo, in: …}`, if there is
one, else some of the types that are wanted.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from engine import Interface, Type, resolved
from engine.files import plain, read, written_text

_INLINE = re.compile(r"`(\{(?:do|watch): [^`]*\})`")
_VALUES: Mapping[str, Any] = {
    "duration": "1 s", "length": "1 m", "angle": "30 deg", "speed": "0.5 m/s", "force": "10 N",
    "integer": 1, "number": 1, "boolean": True, "text": "text", "any": 1, "mass": "1 kg",
    "torque": "1 Nm", "acceleration": "1 m/s2", "angular_speed": "0.5 rad/s", "ratio": "50 %",
}  # fmt: skip
_SIGNALS = ("user.distance", "base.mode")
"""A signal of a number, and one of another type."""


def example_node(of: Interface) -> dict[str, Any]:
    """The keys of a node that names a state."""
    told = _told(of.about)
    given = {name: _value(argument.type) for name, argument in of.parameters.items()
             if argument.required}  # fmt: skip
    fed = {name: name for name, argument in of.inputs.items() if argument.required}
    given |= told.get("with", {})
    fed |= told.get("in", {})
    outcomes = resolved(of, given).outcomes if of.is_open else of.outcomes
    form = "watch" if of.monitor else "do"
    sections = {
        "with": given,
        "in": fed,
        "out": told.get("out", {}),
        "next": {outcome: f".{outcome}" for outcome in outcomes},
    }
    return {form: of.name, **{key: value for key, value in sections.items() if value}}


def node_text(node: Mapping[str, Any]) -> str:
    """A node as a line of YAML, or as several if that is long."""
    line = written_text(node)
    if len(line) <= 88:
        return line
    return "\n".join(f"{key}: {written_text(value)}" for key, value in node.items())


def example_chart(of: Interface, name: str = "example") -> str:
    """A chart around the example of a state, with what it reads and writes as its data."""
    node = example_node(of)
    outcomes = list(node.get("next", {}).values())
    read_from = {
        key: str(of.inputs[at].type)
        for at, key in node.get("in", {}).items()
        if isinstance(key, str) and key[:1].isalpha()
    }
    written = {
        key: _output_type(of, at) for at, key in node.get("out", {}).items() if key not in read_from
    }
    step = {"states": {"step": node}}
    if not outcomes:  # it goes on until something else ends it
        guard = {"watch": "Wait", "with": {"time": "1 s"}, "next": {"over": ".over"}}
        step, outcomes = {"any": {"guard": guard, "step": node}}, [".over"]
    chart: dict[str, Any] = {"chart": name, "outcomes": [outcome[1:] for outcome in outcomes]}
    chart |= {"inputs": read_from} if read_from else {}
    chart |= {"data": written} if written else {}
    return "\n".join(f"{key}: {written_text(value)}" for key, value in {**chart, **step}.items())


def _output_type(of: Interface, output: str) -> str:
    return next(str(named[output]) for named in of.outputs.values() if output in named)


def _told(about: str) -> dict[str, Any]:
    """The node that a docstring shows, without where it goes."""
    found = _INLINE.search(about)
    if found is None:
        return {}
    node = plain(read(found[1].encode(), "").value)
    return {key: node[key] for key in ("with", "in", "out") if key in node}


def _value(kind: Type) -> Any:
    """Some value of a type."""
    if kind.choices:
        return kind.choices[0]
    if kind.name == "list" and kind.item is not None:
        return [_value(kind.item)]
    if kind.name == "signal" and kind.item is not None:
        return _SIGNALS[0] if kind.item.is_number else _SIGNALS[1]
    return _VALUES.get(kind.name, "none")
