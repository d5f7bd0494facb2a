"""The keys of the chart language: on which nodes each is, what its value is, what it means.

`load.py` reads charts by these tables, `schema/` makes the editors' schema from them. A new key is
a row here, a field of `chart.Node`, and what it does. How a kind of value is read is in `load.py`,
how editors see it in `schema/keys.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

from engine.chart.chart import CONTAINERS, LEAVES, Form

Value = Literal[
    "any",
    "bindings",
    "conditions",
    "count",
    "data",
    "duration",
    "flag",
    "inputs",
    "integer",
    "levels",
    "name",
    "names",
    "nodes",
    "outcomes",
    "outputs",
    "parameters",
    "period",
    "retry",
    "rules",
    "target",
    "text",
    "type",
    "values",
    "word",
    "words",
]
"""The kinds of values that keys have."""
FORMS: tuple[Form, ...] = get_args(Form)


@dataclass(frozen=True, slots=True)
class ChartKey:
    """A key: the kind of its value and what it means.

    `on`: the nodes that have it; `field`: that of `chart.Node`, if it is not named like the key.
    """

    value: Value
    about: str
    on: tuple[str, ...] = FORMS
    field: str = ""


Keys = Mapping[str, ChartKey]

_NAMED = (*LEAVES, "use")
NODE: Keys = {
    "do": ChartKey("target", "An action: a state class that may command the robot.", ("do",)),
    "watch": ChartKey("target", "A monitor: a state class that only watches.", ("watch",)),
    "use": ChartKey("target", "Another chart, by name.", ("use",)),
    "states": ChartKey("nodes", "A sequence: one node after another, from the first.", ("states",)),
    "any": ChartKey(
        "nodes", "Nodes side by side; the first to end decides, the others are stopped.", ("any",)
    ),
    "all": ChartKey("nodes", "Nodes side by side; ends once all have ended.", ("all",)),
    "when": ChartKey(
        "rules",
        "Conditions on `any` or `all`: outcomes of children are kept, the first match ends it.",
        ("any", "all"),
    ),
    "with": ChartKey(
        "values", "Values of parameters: `5 s`, `20 cm`, or `$parameter`.", _NAMED, "parameters"
    ),
    "in": ChartKey(
        "bindings",
        "Inputs and the data keys they are read from, or their values: `{x: 2 m, y: 1 m}`.",
        field="inputs",
    ),
    "out": ChartKey("words", "Outputs and the data keys they are written to.", field="outputs"),
    "next": ChartKey(
        "words", "The target of each outcome: a sibling, or `.x` to end the container with x."
    ),
    "timeout": ChartKey("period", "Give up after this long; `next` must map `timeout`."),
    "retry": ChartKey("retry", "Further tries after some outcomes.", _NAMED),
    "autonomy": ChartKey(
        "levels",
        "Per outcome: above this level of autonomy it is taken without asking the operator.",
        _NAMED,
    ),
    "priority": ChartKey(
        "integer",
        "Decides between guards that trip in the same tick; the higher one wins.",
        ("watch",),
    ),
    "break": ChartKey(
        "flag", "`true`: pause when it is entered, if an operator attends the run.", field="breaks"
    ),
    "about": ChartKey("text", "What this is for."),
}
CHART: Keys = {
    "chart": ChartKey("name", "The name of the chart."),
    "about": NODE["about"],
    "parameters": ChartKey(
        "parameters", "Parameters that `use` can set; `$name` inside the chart."
    ),
    "inputs": ChartKey("inputs", "Data keys that the using chart provides."),
    "data": ChartKey("data", "Data keys of the chart."),
    "outcomes": ChartKey("outcomes", "How the chart can end."),
    "outputs": ChartKey("outputs", "Per outcome: the data keys handed on, with their types."),
    **{key: NODE[key] for key in ("when", *CONTAINERS)},
}
RULE: Keys = {
    "outcome": ChartKey("word", "The outcome of the container."),
    "if": ChartKey("conditions", "Children and the outcomes they must have ended with."),
}
RETRY: Keys = {
    "times": ChartKey("count", "How many further tries; a number or `$parameter`."),
    "on": ChartKey("names", "Outcomes after which to try again."),
    "wait": ChartKey("duration", "How long to wait before each."),
}
_DECLARED: Keys = {
    "type": ChartKey("type", "A type by name."),
    "about": ChartKey("text", "What it is for."),
}
PARAMETER: Keys = {
    **_DECLARED,
    "default": ChartKey("any", "Its value where none is given; without it one must be."),
}
INPUT: Keys = {
    **_DECLARED,
    "default": ChartKey("any", "Its value where none is given; `none`: empty."),
}
DATA: Keys = {**_DECLARED, "initial": ChartKey("any", "Its value at the start; `none`: empty.")}

KEYS_OF: Mapping[str, frozenset[str]] = {
    form: frozenset(key for key, known in NODE.items() if form in known.on) for form in FORMS
}
"""The keys of each form of node."""
