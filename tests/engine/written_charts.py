"""Random charts that write values, name signals, parts and outcomes, and pass all this on.

They are charts of `seeded_charts` with other classes at their leaves: `with`, `in`, `out`, `data`,
`inputs`, `outputs` and `parameters` are filled with what their types allow.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any, NamedTuple

from tests.engine.seeded_charts import FORMS, made_of

Values = dict[str, Any]
RENAMED = {"done": "red", "failed": "blue"}
"""How the cases of a `Pick` are called in place of the outcomes of a `Do`."""
KEYS_OF = {"Spot": "spot", "Leg": "leg", "text": "word", "length": "level", "integer": "count"}
"""A data key of each type."""
EYES = {"s.far": "length", "s.pace": "speed", "s.count": "integer"}


class WrittenCase(NamedTuple):
    """Charts by name, `c` the one to run, and the values of its inputs."""

    charts: dict[str, Values]
    inputs: Values


def written_of(seed: int) -> WrittenCase:
    """The charts of a seed."""
    writer = Writer(random.Random(f"written {seed}"))
    charts = made_of(seed)
    names = list(charts)
    for name, chart in charts.items():
        writer.declare(chart, is_used=name != "c")
    for index, chart in enumerate(charts.values()):
        for node, parent, key in list(_nodes(chart)):
            if "use" in node and writer.chance.random() < 0.4:  # a chart that others use, too
                node["use"] = writer.chance.choice(names[max(index, 0) + 1 :])
            writer.fill(node, parent, key, charts)
    given = charts["c"]["inputs"]
    needed = [n for n, key in given.items() if "default" not in key]
    more = [n for n in given if n not in needed and writer.chance.random() < 0.3]
    return WrittenCase(charts, {name: writer.value(given[name]["type"]) for name in needed + more})


def _nodes(node: Values) -> Iterator[tuple[Values, Values, str]]:
    """All nodes below, with their parents and names."""
    form = next((form for form in FORMS if form in node), None)
    for name, child in node.get(form, {}).items() if form else ():
        yield child, node, name
        yield from _nodes(child)


class Writer:
    """Draws values; with `inside`, some of them by the parameters of a chart."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.parts = 0

    # -- values --------------------------------------------------------------------------------

    def value(self, kind: str, *, inside: bool = False) -> Any:
        """A value of this type, as a chart writes it."""
        chance = self.chance
        named = {
            "speed": ("$pace", "$k.pace"), "length": ("$wide", "$k.wide"), "Spot": ("$home",),
        }.get(kind, ())  # fmt: skip
        if inside and named and chance.random() < 0.3:
            return chance.choice(named)
        if kind.startswith("list of "):
            item = kind.removeprefix("list of ")
            return [self.value(item, inside=inside) for _ in range(chance.randrange(4))]
        if kind == "Spot":
            return self._spot(inside=inside)
        if kind == "Leg":
            leg = {"spot": self.value("Spot", inside=inside)}
            if chance.random() < 0.5:
                leg["pace"] = self.value("speed", inside=inside)
            return leg | ({"level": "HIGH"} if chance.random() < 0.3 else {})
        if kind == "Heading":
            return {"yaw": self.value("angle")}
        return chance.choice(_PLAIN[kind])

    def _spot(self, *, inside: bool) -> Any:
        chance = self.chance
        if chance.random() < 0.3:
            return {"place": chance.choice(("dock", "kitchen"))}
        spot = {"x": self.value("length", inside=inside)}
        return spot | ({"y": self.value("length", inside=inside)} if chance.random() < 0.7 else {})

    # -- declarations --------------------------------------------------------------------------

    def declare(self, chart: Values, *, is_used: bool) -> None:
        """Parameters, inputs, data and outputs; only charts that others use need parameters."""
        chance = self.chance

        def parameter(kind: str, default: Any) -> Any:
            needed = is_used and chance.random() < 0.4
            return {"type": kind} if needed else {"type": kind, "default": default}

        chart["parameters"] = {
            "pace": parameter("speed", chance.choice((self.value("speed"), "$k.pace"))),
            "wide": parameter("length", chance.choice((self.value("length"), "$k.wide"))),
            "home": parameter("Spot", chance.choice((self.value("Spot"), "$k.home"))),
            "tries": parameter("integer", chance.choice((1, 2, "$k.tries"))),
            "eye": parameter("signal of length", chance.choice(("s.far", "$k.eye"))),
            "part": parameter("text", self.part()),
            "limit": parameter("duration", chance.choice(("300 ms", "600 ms"))),
        }
        start: Values = {"type": "Spot"}
        if chance.random() < 0.5:
            start["default"] = chance.choice((self.value("Spot"), "$k.home"))
        chart["inputs"] = {"start": start}
        chart["data"] = {
            key: {"type": kind, "initial": self.value(kind)} for kind, key in KEYS_OF.items()
        } | {"spots": {"type": "list of Spot", "initial": self.value("list of Spot")}}
        if chance.random() < 0.6:
            chart["outputs"] = {"x": {"spot": "Spot", "level": "length"}}

    def part(self) -> str:
        """A part that no other node has."""
        self.parts += 1
        return f"p{self.parts}"

    # -- nodes ---------------------------------------------------------------------------------

    def fill(self, node: Values, parent: Values, name: str, charts: dict[str, Values]) -> None:
        """Give a node a class, its arguments and what it reads and writes."""
        chance = self.chance
        if "use" in node:
            self._use(node, charts[node["use"]])
        elif "watch" in node and chance.random() < 0.7:
            self._over(node)
        elif "do" in node:
            made = chance.choice((self._go, self._pick, self._keep, self._push, None))
            if made is not None:
                made(node)
            if node["do"] == "Pick":
                _rename(node, parent, name)
        if "timeout" in node and chance.random() < 0.3:
            node["timeout"] = "$limit"
        if "retry" in node and chance.random() < 0.5:
            node["retry"]["times"] = chance.choice(("$tries", "$k.tries"))

    def _use(self, node: Values, used: Values) -> None:
        chance = self.chance
        given = {}
        for name, parameter in used["parameters"].items():
            if "default" not in parameter or name == "part" or chance.random() < 0.4:
                given[name] = self._passed_on(name, parameter["type"])
        node["with"] = given
        if "default" not in used["inputs"]["start"] or chance.random() < 0.5:
            node["in"] = {"start": self._read_or_written("Spot", ("spot", "start"))}
        if "outputs" in used and chance.random() < 0.7:
            node["out"] = {"spot": "spot", "level": "level"}

    def _passed_on(self, name: str, kind: str) -> Any:
        chance = self.chance
        if name == "part":
            return self.part()
        if chance.random() < 0.4:
            return f"${name}"
        if name == "eye":
            return chance.choice(("s.far", "$k.eye"))
        if name == "limit":
            return "400 ms"
        return chance.choice((1, 3)) if name == "tries" else self.value(kind, inside=True)

    def _read_or_written(self, kind: str, keys: tuple[str, ...]) -> Any:
        if self.chance.random() < 0.5:
            return self.chance.choice(keys)
        return self.value(kind, inside=True)

    def _go(self, node: Values) -> None:
        chance = self.chance
        node["do"] = "Go"
        node["in"] = {"goal": self._read_or_written("Spot", ("spot", "start"))}
        given: Values = {}
        if chance.random() < 0.5:
            node["in"]["leg"] = self._read_or_written("Leg", ("leg",))
        if chance.random() < 0.5:
            given["pace"] = self.value("speed", inside=True)
        for name, key, kind in (("via", "spots", "list of Spot"), ("times", "count", "integer")):
            drawn = chance.random()
            if drawn < 0.3:
                node["in"][name] = key  # a parameter, bound at entry
            elif drawn < 0.6:
                given[name] = self.value(kind, inside=True)
        if given:
            node["with"] = given
        if chance.random() < 0.6:
            node["out"] = {"where": "spot"}

    def _pick(self, node: Values) -> None:
        node["do"] = "Pick"
        node["with"] = {"cases": self.chance.choice((["red", "blue"], ["blue", "red"]))}
        node["in"] = {"value": "word"}
        if self.chance.random() < 0.6:
            node["out"] = {"chosen": "word"}

    def _keep(self, node: Values) -> None:
        chance = self.chance
        kind, key = chance.choice(list(KEYS_OF.items()))
        node["do"] = "Keep"
        node["in"] = {"value": key}
        if chance.random() < 0.6:
            node["with"] = {"items": self.value(f"list of {kind}", inside=True)}
        if chance.random() < 0.5:
            node["out"] = {"item": key}

    def _push(self, node: Values) -> None:
        node["do"] = "Push"
        node["with"] = {"part": self.chance.choice(("$part", self.part()))}
        if self.chance.random() < 0.5:
            node["with"]["heading"] = self.value("Heading")

    def _over(self, node: Values) -> None:
        chance = self.chance
        node["watch"] = "Over"
        signal = chance.choice((*EYES, "$eye", "$k.eye"))
        kind = EYES.get(signal, "length")
        node["with"] = given = {"signal": signal}
        if kind in ("length", "integer") and chance.random() < 0.3:
            node["in"] = {"limit": KEYS_OF[kind]}
        else:
            given["limit"] = self.value(kind, inside=True)
        if chance.random() < 0.4:
            given["for"] = chance.choice(("200 ms", 0.1, "$limit"))
        if chance.random() < 0.4:
            given["older"] = chance.choice((0.15, "200 ms", "$limit"))
        if kind in ("length", "integer") and chance.random() < 0.6:
            node["out"] = {"value": KEYS_OF[kind]}


_PLAIN: dict[str, tuple[Any, ...]] = {
    "length": (0.5, 2, "20 cm", "1.5 m", "300 mm"),
    "speed": (1, "50 cm/s", "3.6 km/h"),
    "angle": (0.3, "90 deg", "-45 deg"),
    "integer": (1, 2, 3),
    "text": ("hello", "5 or so", "red"),
}


def _rename(node: Values, parent: Values, name: str) -> None:
    """Call the outcomes of a node as its cases, wherever they are named."""
    if "next" in node:
        node["next"] = {RENAMED.get(o, o): target for o, target in node["next"].items()}
    if "retry" in node:
        node["retry"]["on"] = [RENAMED.get(o, o) for o in node["retry"]["on"]]
    for rule in parent.get("when", ()):
        if name in rule["if"]:
            rule["if"][name] = RENAMED.get(rule["if"][name], rule["if"][name])
