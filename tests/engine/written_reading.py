"""The second reading of the rules with values: what nodes are given, read and write (rule 9).

As in `reading`, nothing is shared with the engine: names are replaced in the chart's own values
before anything else, and what a value means is said by a small table of units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tests.engine.reading import Item, Reading, Route
from tests.engine.written_charts import EYES

Values = dict[str, Any]
CONSTANTS: Values = {
    "k.pace": "80 cm/s", "k.wide": "1.2 m", "k.home": {"x": "3 m", "y": "50 cm"},
    "k.tries": 1, "k.eye": "s.far",
}  # fmt: skip
PLACES = {"dock": ("Spot", 1.0, 2.0), "kitchen": ("Spot", -4.0, 0.25)}
UNITS = {
    "m": 1.0, "cm": 0.01, "mm": 0.001, "s": 1.0, "ms": 0.001, "m/s": 1.0, "cm/s": 0.01,
    "km/h": 1 / 3.6, "deg": math.pi / 180,
}  # fmt: skip
NUMBERS = ("length", "speed", "angle", "duration", "integer")
ARGUMENTS: Mapping[str, Mapping[str, str]] = {
    "Go": {
        "pace": "speed", "via": "list of Spot", "times": "integer", "goal": "Spot", "leg": "Leg",
    },
    "Pick": {"cases": "list of text", "value": "text"},
    "Keep": {"items": "list of T", "value": "T"},
    "Push": {"part": "text", "heading": "Heading"},
    "Over": {"signal": "text", "limit": "N", "for": "duration", "older": "duration"},
}  # fmt: skip
"""The types of parameters and inputs, by class."""
INPUTS = {"Go": ("goal", "leg"), "Pick": ("value",), "Keep": ("value",)}
OUTPUTS = {
    ("Go", "done"): "where", ("Pick", "red"): "chosen", ("Pick", "blue"): "chosen",
    ("Keep", "done"): "item",
}  # fmt: skip


def meant(written: Any, kind: str) -> Any:
    """What a written value stands for, of plain tuples, with numbers rounded to 1e-9."""
    if kind.startswith("list of "):
        return tuple(meant(item, kind.removeprefix("list of ")) for item in written)
    if kind == "Spot" and "place" in written:
        return PLACES[written["place"]]
    if kind == "Spot":
        return "Spot", meant(written["x"], "length"), meant(written.get("y", 0.0), "length")
    if kind == "Leg":
        pace = meant(written.get("pace", 1.0), "speed")
        return "Leg", meant(written["spot"], "Spot"), pace, written.get("level", "LOW")
    if kind == "Heading":
        yaw = meant(written["yaw"], "angle")
        return "Heading", round(math.cos(yaw), 9), round(math.sin(yaw), 9)
    if kind in NUMBERS and isinstance(written, str):
        number, unit = written.split()
        return round(float(number) * UNITS[unit], 9)
    return written


def filled(written: Any, parameters: Mapping[str, Any]) -> Any:
    """A value, or a node, with what its `$names` stand for."""
    if isinstance(written, str) and written.startswith("$"):
        name = written[1:]
        return filled(CONSTANTS[name] if "." in name else parameters[name], {})
    if isinstance(written, dict):
        return {key: filled(value, parameters) for key, value in written.items()}
    if isinstance(written, list):
        return [filled(value, parameters) for value in written]
    return written


@dataclass(eq=False)
class Scope:
    """A chart in use: its parameters as they are written, and its data."""

    path: str
    chart: Values
    parameters: Values
    data: Values = field(default_factory=dict)

    def kind(self, key: str) -> str:
        """The type of a data key."""
        return str({**self.chart["inputs"], **self.chart["data"]}[key]["type"])


Writes = list[tuple[Scope, str, Any]]


class WrittenReading(Reading):
    """One run by the rules, with values.

    Attributes:
        entered: each leaf that was entered, with what it was given.
        written: each value that was written to a data key.
        results: the outputs of the chart.
    """

    def __init__(
        self, chart: Values, library: Mapping[str, Values], inputs: Mapping[str, Any]
    ) -> None:
        self.inside: dict[str, Scope] = {}  # what the children of a path stand in
        self.nodes: dict[str, Values] = {}
        self.scopes: dict[str, Scope] = {}
        self.given = inputs
        super().__init__(chart, library)
        self.entered: list[tuple[Any, ...]] = []
        self.written: list[tuple[int, str, str, Any]] = []
        self.results: Values = {}
        self.inputs: dict[str, Values] = {}  # of the leaves that run
        self.kept: dict[str, Writes] = {}
        self.outputs: dict[str, Writes] = {}  # of leaves that end now
        self.times: dict[str, int] = {}
        self.above: dict[str, int | None] = {}
        self.samples: dict[str, tuple[float, int]] = {}

    def _item(self, node: Mapping[str, Any], name: str, path: str, parent: Item | None) -> Item:
        outer = self.inside[parent.path] if parent is not None else None
        if outer is not None:
            node = filled(dict(node), outer.parameters)
        if outer is None or "use" in node:
            chart = dict(node) if outer is None else dict(self.library[node["use"]])
            passed = node.get("with", {}) if outer is not None else {}
            names = {n: passed.get(n, p.get("default")) for n, p in chart["parameters"].items()}
            self.scopes[path] = Scope(path, chart, filled(names, {}))
        self.inside[path] = self.scopes.get(path) or self.inside[parent.path if parent else ""]
        self.nodes[path] = dict(node)
        return super()._item(node, name, path, parent)

    def around(self, item: Item) -> Scope:
        """The chart that a node stands in; that of the top, for itself."""
        return self.inside[item.parent.path if item.parent is not None else ""]

    # -- entering ------------------------------------------------------------------------------

    def enter(self, item: Item) -> None:
        """Inputs are read at entry; a chart's own data begin anew."""
        super().enter(item)
        if item.path in self.scopes:
            self.open(item, self.scopes[item.path])
        if item.leaf:
            self.begin_leaf(item)

    def open(self, item: Item, scope: Scope) -> None:
        given = self.nodes[item.path].get("in", {}) if item.parent is not None else self.given
        for key, declared in scope.chart["data"].items():
            scope.data[key] = meant(filled(declared["initial"], {}), declared["type"])
        for key, declared in scope.chart["inputs"].items():
            value = given.get(key, declared.get("default"))
            if item.parent is not None and isinstance(value, str) and "$" not in value:
                scope.data[key] = self.around(item).data[value]
            else:
                scope.data[key] = meant(filled(value, {}), declared["type"])

    def begin_leaf(self, item: Item) -> None:
        node, scope = self.nodes[item.path], self.around(item)
        cls = node[item.form]
        self.times[item.path] = self.times.get(item.path, 0) + 1
        self.above[item.path] = None
        held: Values = {}
        for name, written in node.get("with", {}).items():
            held[name] = meant(written, self.kind_of(node, scope, cls, name))
        for name, written in node.get("in", {}).items():
            if isinstance(written, str):
                held[name] = scope.data[written]
            else:
                held[name] = meant(written, ARGUMENTS[cls][name])
        self.inputs[item.path] = held
        inputs = {name: held[name] for name in INPUTS.get(cls, ()) if name in held}
        parameters = {name: value for name, value in held.items() if name not in inputs}
        record = self.number, item.path, parameters, inputs
        if cls != "Over":
            self.entered.append((*record, (held["part"],) if cls == "Push" else ()))

    def kind_of(self, node: Values, scope: Scope, cls: str, name: str) -> str:
        """The type of an argument; of one that varies, what it stands for at this node."""
        kind = ARGUMENTS[cls][name]
        if kind == "N":
            return EYES[node["with"]["signal"]]
        if kind.endswith(" T"):
            return kind.replace("T", scope.kind(node["in"]["value"]))
        return kind

    # -- ending --------------------------------------------------------------------------------

    def step(self, leaf: Item) -> str | None:
        """As a script says, or as a signal is; outputs come with an outcome."""
        outcome = super().step(leaf)
        node = self.nodes[leaf.path]
        if node[leaf.form] == "Over":
            outcome = self.watched(leaf)
        self.outputs[leaf.path] = []
        name = OUTPUTS.get((node[leaf.form], outcome or ""))
        value: Any = None
        if name is not None:
            value = self.output_of(leaf, name, outcome)
        elif node[leaf.form] == "Over" and outcome == "seen":
            name, value = "value", self.samples[self.inputs[leaf.path]["signal"]][0]
        if name in node.get("out", {}):
            self.outputs[leaf.path] = [(self.around(leaf), node["out"][name], value)]
        return outcome

    def output_of(self, leaf: Item, name: str, outcome: str | None) -> Any:
        if name == "where":
            return "Spot", float(self.times[leaf.path]), float(self.number)
        return outcome if name == "chosen" else self.inputs[leaf.path]["value"]

    def watched(self, leaf: Item) -> str | None:
        held = self.inputs[leaf.path]
        value, stamp = self.samples.get(held["signal"], (None, 0))
        if value is None or ("older" in held and self.now - stamp > held["older"] * 1e9):
            self.above[leaf.path] = None
            return None
        if value < 0:
            return "lost"
        if value <= held["limit"]:
            self.above[leaf.path] = None
            return None
        if (since := self.above[leaf.path]) is None:
            since = self.above[leaf.path] = self.now
        return "seen" if self.now - since >= round(held.get("for", 0) * 1e9) else None

    def take(self, route: Route) -> None:
        """Outputs go up with the outcomes; those of tries that fail are dropped."""
        handed = self.handed_on(route)
        super().take(route)
        if route.kind == "keep":
            self.kept[route.top.path] = handed
        elif route.kind != "retry":
            box = route.top.parent
            self.write(handed, box.path if box is not None else "")
        if route.kind == "finish":
            named = self.scopes[""].chart.get("outputs", {}).get(route.outcome, {})
            self.results = {name: self.scopes[""].data[name] for name in named}

    def handed_on(self, route: Route) -> Writes:
        """What the ends of a route give to what is around them, last that of its top."""
        found: dict[str, Writes] = {}
        ended = {item.path: outcome for item, outcome in route.ends}
        for item, outcome in route.ends:
            writes: Writes = [*self.outputs.get(item.path, [])] if item.leaf else []
            ending: Writes = []
            for child in item.children:
                now = found.get(child.path, [])
                if child.path not in ended:
                    writes += self.kept[child.path] if child.kept is not None else []
                elif item.keeps and ended[child.path] not in child.next:
                    writes += now
                else:
                    ending = now
            writes += ending
            if item.path in self.scopes and item.parent is not None:
                writes = self.out_of(item, outcome, writes)
            found[item.path] = [] if outcome in ("error", "timeout") else writes
        return found.get(route.top.path, [])

    def out_of(self, item: Item, outcome: str, writes: Writes) -> Writes:
        """A chart that ends: its own data are written, then those that it hands out."""
        self.write(writes, item.path)
        scope, out = self.scopes[item.path], self.nodes[item.path].get("out", {})
        named = scope.chart.get("outputs", {}).get(outcome, {})
        return [(self.around(item), out[n], scope.data[n]) for n in named if n in out]

    def write(self, writes: Writes, at: str) -> None:
        """Write values, in the container at this path."""
        for scope, key, value in writes:
            scope.data[key] = value
            self.written.append((self.number, at, key, value))
