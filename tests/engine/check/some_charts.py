"""Random charts with data, parameters and used charts, and ways to break them."""

from __future__ import annotations

import copy
import json
import random
from typing import Any

from engine.chart.load import Library
from engine.files.source import read
from engine.files.units import Duration
from engine.interfaces import Interface, interface
from engine.state import Action, Context, Monitor, Run


class _Busy:
    def run(self, ctx: Context) -> Run:
        yield
        return ""


class Work(_Busy, Action):
    """Takes parameters of several types."""

    outcomes = ("done", "failed")

    def __init__(
        self, time: Duration = 1.0, level: int = 1, names: tuple[str, ...] = (), other: Any = None
    ) -> None:
        self.time, self.level, self.names, self.other = time, level, names, other


class Wait(_Busy, Action):
    """Has a parameter that must be given."""

    outcomes = ("done",)

    def __init__(self, time: Duration) -> None:
        self.time = time


class Give(_Busy, Action):
    """Has an output."""

    outcomes = ("done", "failed")
    outputs = {"done": {"value": float}}


class Try(_Busy, Action):
    """Has an output that may be nothing."""

    outcomes = ("done",)
    outputs = {"done": {"value": float | None}}


class Tell(_Busy, Action):
    """Has an output of another type."""

    outcomes = ("done",)
    outputs = {"done": {"text": str}}


class Take(Action):
    """Has an input."""

    outcomes = ("done", "failed")

    def run(self, ctx: Context, value: float) -> Run:
        yield
        return "done"


class Peek(Action):
    """Has an input that may be nothing."""

    outcomes = ("done",)

    def run(self, ctx: Context, value: float | None) -> Run:
        yield
        return "done"


class Near(_Busy, Monitor):
    """A monitor with an output."""

    outcomes = ("near", "far")
    outputs = {"near": {"value": float}}


class Think(Action):
    """Decides at once."""

    outcomes = ("yes", "no")

    def run(self, ctx: Context) -> Run:
        return "yes"


class Rest(_Busy, Action):
    """Never ends."""


class Drive(_Busy, Action):
    """Commands a part."""

    outcomes = ("done",)
    commands = ("base",)


CLASSES = (Work, Wait, Give, Try, Tell, Take, Peek, Near, Think, Rest, Drive)
INTERFACES: dict[str, Interface] = {cls.__name__: interface(cls) for cls in CLASSES}
USUAL = ("Work", "Work", "Give", "Give", "Take", "Near", "Near", "Peek", "Try", "Think", "Wait")
KEYS = {
    "a": {"type": "number"},
    "b": {"type": "number", "initial": 1.5},
    "c": {"type": "number", "initial": "none"},
    "d": {"type": "text"},
    "e": "any",
}
FORMS = ("states", "states", "any", "all")
JUNK = (
    None, "", "x", 5, -1, 1.5, True, "$nope", "$time", "$rest", ".nope", ".done", ".", "$", {}, [],
    ["a"], {"a": "b"}, "5 s", "1e300 s", "-3 s", "5 parsec", "none", "error", ".error", "timeout",
    "Work", "inner", "main", "a", "n0", [["$time"]], {"if": {}}, "done",
)  # fmt: skip


class Maker:
    """Makes charts by chance, out of boxes of these `forms`."""

    def __init__(self, chance: random.Random, forms: tuple[str, ...] = FORMS) -> None:
        self.chance = chance
        self.forms = forms
        self.used: tuple[str, ...] = ()  # charts that a node may use
        self.keys = list(KEYS)

    def charts(self) -> list[dict[str, Any]]:
        """A chart, one that it may use, and one that both may."""
        return [
            self.chart("main", 3, ("inner", "deeper")),
            self.chart("inner", 2, ("deeper",)),
            self.chart("deeper", 1, ()),
        ]

    def chart(self, name: str, depth: int, used: tuple[str, ...]) -> dict[str, Any]:
        chance = self.chance
        self.used = used
        self.sub = name != "main"
        self.keys = list(KEYS) + ["given"] * self.sub + ["value"] * self.sub
        chart: dict[str, Any] = {"chart": name, "outcomes": ["done", "failed"]}
        chart["parameters"] = {
            "time": {"type": "duration", "default": chance.choice(("2 s", 1, "100 ms"))},
            "rest": {"type": "any", "default": chance.choice((None, 1, ["x"]))},
        }
        if self.sub:
            chart["parameters"]["count"] = "integer"
            chart["inputs"] = {"given": "number"}
            chart["outputs"] = {"done": {"value": "number"}} if chance.random() < 0.7 else {}
            if not chart["outputs"]:
                self.keys.remove("value")
        chart["data"] = copy.deepcopy(KEYS)
        if "value" in self.keys and chance.random() < 0.7:
            chart["data"]["value"] = {"type": "number", "initial": 3}
        return chart | self.box(("done", "failed"), depth)

    def box(self, outcomes: tuple[str, ...], depth: int) -> dict[str, Any]:
        """A box that ends with some of `outcomes`."""
        chance = self.chance
        form = chance.choice(self.forms)
        names = [f"n{number}" for number in range(chance.randint(1, 4))]
        plain = form == "all" and "done" in outcomes and chance.random() < 0.3
        keeps = form == "all" or (form == "any" and chance.random() < 0.3)
        ways = [f".{outcome}" for outcome in outcomes] + (names if form == "states" else [])
        made = {name: self.node(ways, keeps, depth - 1) for name in names}
        found: dict[str, Any] = {form: {name: node for name, (node, _) in made.items()}}
        if keeps and not plain:
            found["when"] = self.rules({name: kept for name, (_, kept) in made.items()}, outcomes)
        return found

    def rules(self, kept: dict[str, list[str]], outcomes: tuple[str, ...]) -> list[Any]:
        """Some, and one for each outcome of the first child."""
        chance, rules = self.chance, []
        for _ in range(chance.randint(0, 2)):
            picked = [name for name in kept if chance.random() < 0.6 and kept[name]]
            if picked:
                conditions = {name: chance.choice(kept[name]) for name in picked}
                rules.append({"outcome": chance.choice(outcomes), "if": conditions})
        first = next(iter(kept))
        last = [(chance.choice(outcomes), {first: outcome}) for outcome in kept[first]]
        return rules + [{"outcome": outcome, "if": conditions} for outcome, conditions in last]

    def node(self, ways: list[str], keeps: bool, depth: int) -> tuple[dict[str, Any], list[str]]:
        """A node, and its outcomes that are not mapped."""
        chance = self.chance
        kind = chance.choice(["leaf"] * 4 + ["use"] * bool(self.used) + ["box"] * 2 * (depth > 0))
        if kind == "leaf":
            node, outcomes = self.leaf()
        elif kind == "use":
            node, outcomes = self.use()
        else:
            node = self.box(("p", "q"), depth)
            outcomes = ends(node)
            if chance.random() < 0.3:
                node["in"] = {"a": chance.choice(self.keys)}
        if chance.random() < 0.2:
            node["timeout"] = chance.choice(("$time", "300 ms", 2))
            outcomes = [*outcomes, "timeout"]
        left = [outcome for outcome in outcomes if not keeps or chance.random() < 0.2]
        node["next"] = {outcome: chance.choice(ways) for outcome in left}
        if chance.random() < 0.3:
            node["next"]["error"] = chance.choice(ways)
        return node, [outcome for outcome in outcomes if outcome not in left]

    def use(self) -> tuple[dict[str, Any], list[str]]:
        """A node that uses another chart."""
        chance = self.chance
        node: dict[str, Any] = {"use": chance.choice(self.used)}
        node["with"] = {"count": chance.randint(0, 3)}
        node["in"] = {"given": chance.choice(("b", "b", "a"))}
        if chance.random() < 0.5:
            node["with"]["time"] = chance.choice(("$time", "3 s"))
        return node, ["done", "failed"]

    def leaf(self) -> tuple[dict[str, Any], list[str]]:
        chance = self.chance
        name = chance.choice(USUAL) if chance.random() < 0.95 else chance.choice(("Rest", "Drive"))
        known = INTERFACES[name]
        node: dict[str, Any] = {"watch" if known.monitor else "do": name}
        if name == "Wait" or (name == "Work" and chance.random() < 0.5):
            node["with"] = {"time": chance.choice(("$time", "1 s", 2))}
        if name == "Work" and chance.random() < 0.3:
            node["with"] = {"level": 3, "names": ["x", "y"], "other": chance.choice(("$rest", [1]))}
        for argument in known.inputs:
            node["in"] = {argument: self.key(name, argument)}
        for argument in (n for named in known.outputs.values() for n in named):
            if chance.random() < 0.8:
                node["out"] = {argument: self.key(name, argument)}
        if chance.random() < 0.1 and known.outcomes and not known.monitor:
            node["retry"] = {"times": 2, "on": known.outcomes[0], "wait": chance.choice((0, "1 s"))}
        return node, list(known.outcomes)

    def key(self, name: str, argument: str) -> str:
        if self.chance.random() < 0.03:
            return self.chance.choice(self.keys)
        if argument == "text":
            return "d"
        if name in ("Try", "Peek"):
            return "c"
        if self.chance.random() < 0.6:
            return "b" if argument == "value" and INTERFACES[name].inputs else "a"
        return self.chance.choice([key for key in self.keys if key not in "cd"])


def ends(box: dict[str, Any]) -> list[str]:
    """The outcomes that a box names."""
    (children,) = (box[form] for form in ("states", "any", "all") if form in box)
    ways = [way for node in children.values() for way in node["next"].values()]
    found = [way[1:] for way in ways if way[0] == "."]
    found += [rule["outcome"] for rule in box.get("when", ())]
    if "all" in box and "when" not in box:
        found.append("done")
    return list(dict.fromkeys(found))


def damage(value: Any, chance: random.Random) -> None:
    """Delete, replace, rename or copy something in nested maps and lists."""
    places: list[tuple[Any, Any]] = []

    def visit(inside: Any) -> None:
        for key, item in list(inside.items() if isinstance(inside, dict) else enumerate(inside)):
            places.append((inside, key))
            if isinstance(item, dict | list):
                visit(item)

    visit(value)
    inside, key = chance.choice(places)
    kind = chance.randrange(4)
    if kind == 0:
        del inside[key]
    elif kind == 1:
        inside[key] = copy.deepcopy(chance.choice(JUNK))
    elif kind == 2 and isinstance(inside, dict):
        inside[str(chance.choice(JUNK))] = inside.pop(key)
    else:
        other, there = chance.choice(places)
        inside[key] = copy.deepcopy(other[there])


def library(charts: list[Any]) -> Library:
    """The charts given as plain values; JSON is YAML."""
    found = Library()
    for number, chart in enumerate(charts):
        found.add(read(json.dumps(chart).encode(), f"{number}.yaml"))
    return found
