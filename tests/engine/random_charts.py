"""Random charts of a right shape over four example states, for property tests."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from hypothesis import strategies as st

from engine.chart.load import Library
from engine.files.source import read
from engine.files.units import Duration, Length, Speed
from engine.interfaces import Interface, interface
from engine.state import Action, Context, Monitor, Run


@dataclass(frozen=True)
class Spot:
    """A place on the floor, in m."""

    x: float
    y: float


class Say(Action):
    """Says `text` aloud."""

    outcomes = ("said",)

    def __init__(self, text: str, times: int = 1, loud: bool = False) -> None:
        self.text, self.times, self.loud = text, times, loud

    def run(self, ctx: Context) -> Run:
        yield
        return "said"


class Drive(Action):
    """Drives to `goal`."""

    outcomes = ("arrived", "blocked")
    outputs: ClassVar = {"arrived": {"where": Spot}}

    def __init__(
        self, speed: Speed, mode: Literal["fast", "safe"] = "safe", via: tuple[Length, ...] = ()
    ) -> None:
        self.speed, self.mode, self.via = speed, mode, via

    def run(self, ctx: Context, goal: Spot) -> Run:
        yield
        return "arrived"


class Near(Monitor):
    """`near` once somebody is within `distance` for `hold`."""

    outcomes = ("near", "far")

    def __init__(self, distance: Length, hold: Duration | None = None) -> None:
        self.distance, self.hold = distance, hold

    def run(self, ctx: Context) -> Run:
        yield
        return "near"


class Tripped(Monitor):
    """`tripped` when the bumper is."""

    outcomes = ("tripped",)

    def run(self, ctx: Context) -> Run:
        yield
        return "tripped"


INTERFACES: dict[str, Interface] = {
    cls.__name__: interface(cls) for cls in (Say, Drive, Near, Tripped)
}
PARAMETERS = {
    "Say": {"text": ["hello", "$word"], "times": [2, "$count"], "loud": [True, False]},
    "Drive": {"speed": [1, "50 cm/s", "$pace"], "mode": ["fast", "safe"], "via": [[1, "20 cm"]]},
    "Near": {"distance": [0.5, "1 m"], "hold": [None, "3 s"]},
    "Tripped": {},
}
REQUIRED = {"Say": ["text"], "Drive": ["speed"], "Near": ["distance"], "Tripped": []}
GOALS = ["goal", {"x": 1, "y": 2.5}, {"y": "$far", "x": 0}]
KEYS = [{"type": "Spot"}, {"type": "Spot", "initial": {"x": 1, "y": 2}}]
ENDS = ["done", "failed"]
HELPER = """\
chart: helper
parameters: {reach: length, word: {type: text, default: hello}}
inputs: {goal: {type: Spot, default: {x: 1, y: 0.5}}}
outcomes: [done, failed]
outputs: {done: {where: Spot}}
states:
  go: {do: Drive, with: {speed: 1}, in: {goal: goal}, out: {where: where},
       next: {arrived: .done, blocked: .failed}}
  say: {do: Say, with: {text: $word}, next: {said: go}}
data: {where: Spot}
"""


@st.composite
def charts(draw: Any, depth: int = 2) -> dict[str, Any]:
    """A chart as plain values: shape right, meaning not necessarily."""
    chart: dict[str, Any] = {
        "chart": "main",
        "parameters": {
            "word": {"type": "text", "default": "hi"},
            "count": {"type": "integer", "default": 2},
            "pace": {"type": "speed", "default": "1 m/s"},
            "far": {"type": "number", "default": 3},
        },
        "outcomes": ENDS,
        "data": {"goal": draw(st.sampled_from(KEYS)), "where": "Spot"},
    }
    chart |= draw(containers(depth))
    return chart


@st.composite
def containers(draw: Any, depth: int) -> dict[str, Any]:
    """`{states: …}`, `{any: …}` or `{all: …}`, with its children."""
    form = draw(st.sampled_from(["states", "any", "all"]))
    names = [f"n{depth}{letter}" for letter in "abc"[: draw(st.integers(1, 3))]]
    found: dict[str, Any] = {}
    keeps = form == "all" or (form == "any" and draw(st.booleans()))
    found[form] = {name: draw(nodes(form, keeps, names, depth)) for name in names}
    if keeps and (form == "any" or draw(st.booleans())):
        found["when"] = [{"outcome": "done", "if": {names[0]: "done"}}]
    return found


@st.composite
def nodes(draw: Any, inside: str, keeps: bool, names: list[str], depth: int) -> dict[str, Any]:
    """A node inside a container of the form `inside`."""
    targets = st.sampled_from([*(names if inside == "states" else []), ".done", ".failed"])
    forms = ["do", "do", "watch", "use"] + (["container"] if depth else [])
    form = draw(st.sampled_from(forms))
    node: dict[str, Any]
    if form == "container":
        node = draw(containers(depth - 1))
        outcomes = draw(st.sampled_from([[], ["done"], ["done", "failed"]]))
    else:
        node, outcomes = draw(leaves(form, guard=inside != "states"))
        if keeps:
            outcomes = draw(st.sampled_from([[], outcomes[:1], outcomes]))
    if draw(st.booleans()):
        node["timeout"] = draw(st.sampled_from([1.5, "5 s", "200 ms"]))
        outcomes = [*outcomes, "timeout"]
    if draw(st.integers(0, 4)) == 0:
        outcomes = [*outcomes, "error"]
    if outcomes:
        node["next"] = {outcome: draw(targets) for outcome in outcomes}
    return node


@st.composite
def leaves(draw: Any, form: str, guard: bool) -> tuple[dict[str, Any], list[str]]:
    """A `do`, `watch` or `use` node without `next`, and its outcomes."""
    if form == "use":
        node = {"use": "helper", "with": {"reach": "1 m"}}
        if draw(st.booleans()):
            node["in"] = {"goal": draw(st.sampled_from(GOALS))}
        return node, ["done", "failed"]
    names = ["Say", "Drive"] if form == "do" else ["Near", "Tripped"]
    name = draw(st.sampled_from(names))
    node = {form: name}
    optional = [key for key in PARAMETERS[name] if key not in REQUIRED[name]]
    given = [*REQUIRED[name], *(key for key in optional if draw(st.booleans()))]
    if given:
        node["with"] = {key: draw(st.sampled_from(PARAMETERS[name][key])) for key in given}
    outcomes = list(INTERFACES[name].outcomes)
    if name == "Drive":
        node["in"] = {"goal": draw(st.sampled_from(GOALS))}
        if draw(st.booleans()):
            node["out"] = {"where": "where"}
    if not guard and draw(st.booleans()):
        times = draw(st.sampled_from([2, "$count"]))
        node["retry"] = {"times": times, "on": outcomes[0], "wait": "1 s"}
    if not (guard and form == "watch") and draw(st.integers(0, 2)) == 0:
        node["autonomy"] = {outcomes[0]: "low"}
    if guard and form == "watch" and draw(st.booleans()):
        node["priority"] = 3
    return node, outcomes


def library(*values: Any) -> Library:
    """The charts given as plain values (JSON is YAML), with the helper that they use."""
    found = Library()
    for number, value in enumerate(values):
        found.add(read(json.dumps(value).encode(), f"{number}.yaml"))
    found.add(read(HELPER.encode(), "helper.yaml"))
    return found
