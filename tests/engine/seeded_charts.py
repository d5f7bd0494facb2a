"""Random valid charts as plain values, made from a seed, and smaller ones of a chart.

They carry what rule 4 has to sort out: guards with priorities, outcomes that containers hand on to
outer transitions, `when` and `all`, `use`, timeouts, retries, and monitors that are no guards.
"""

from __future__ import annotations

import copy
import random
from collections.abc import Iterator
from typing import Any

Values = dict[str, Any]
OUTCOMES = {"do": ("done", "failed", "other"), "watch": ("seen", "lost")}
CLASSES = {"do": "Do", "watch": "See"}
FORMS = ("states", "any", "all")


class Maker:
    """Draws one chart and those that it uses."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.charts: dict[str, Values] = {}

    def chart(self, name: str, depth: int) -> Values:
        outcomes = ("x", "y")
        made = {"chart": name, "outcomes": [*outcomes], **self.container(outcomes, depth, name)}
        self.charts[name] = made
        return made

    def container(self, ends: tuple[str, ...], depth: int, chart: str = "") -> Values:
        """A container that may end with any of `ends`; the whole of the main chart goes on long."""
        chance = self.chance
        form = chance.choices(FORMS, (9, 2, 1) if chart == "c" else (3, 5, 2))[0]
        count = chance.choices((1, 2, 3, 4, 5), (1, 3, 4, 4, 2))[0]
        keeps = form == "all" or (form == "any" and chance.random() < 0.25)
        guarded = form == "any" and not keeps and chance.random() < 0.75
        names = [f"n{number}" for number in range(max(count, 4) if guarded else count)]
        targets = [f".{end}" for end in ends] + (names * 4 if form == "states" else [])
        children = {name: self.node(form, keeps, targets, depth) for name in names}
        if guarded:  # three of them at least, to end together
            for name in chance.sample(names, 3):
                children[name] = self.node(form, keeps, targets, depth, "watch")
        made: Values = {form: children}
        # `all` alone ends with `done`, which this container may not be able to hand on
        if keeps and (form == "any" or "done" not in ends or chance.random() < 0.5):
            made["when"] = self.rules(children, ends)
        return made

    def rules(self, children: Values, ends: tuple[str, ...]) -> list[Values]:
        """Random rules, and behind them one for each outcome of the first child."""
        chance, made = self.chance, []
        kept = {name: self.outcomes(node) for name, node in children.items()}
        for _ in range(chance.randrange(3)):
            picked = chance.sample(sorted(children), chance.randint(1, len(children)))
            conditions = {name: chance.choice(kept[name]) for name in picked}
            made.append({"outcome": chance.choice(ends), "if": conditions})
        first = next(iter(children))
        return made + [{"outcome": chance.choice(ends), "if": {first: o}} for o in kept[first]]

    def outcomes(self, node: Values) -> list[str]:
        """Outcomes of a node of which some are not handed on."""
        for form, outcomes in OUTCOMES.items():
            if form in node:
                own = [*outcomes]
        if not {"do", "watch"} & set(node):
            own = node.get("_ends", ["x", "y"])
        return own + ["timeout"] * ("timeout" in node)

    def node(
        self, form: str, keeps: bool, targets: list[str], depth: int, kind: str = ""
    ) -> Values:
        """A child of a container of this form; `targets`: what its outcomes may lead to."""
        chance = self.chance
        weights = (2, 2, 4, 1) if form == "states" else (2, 7, 3, 1)
        kind = kind or chance.choices(("do", "watch", "box", "use"), weights)[0]
        if depth == 0 and kind in ("box", "use"):
            kind = chance.choice(("do", "watch"))
        node: Values
        if kind == "box":
            handed_on = [] if keeps else [t[1:] for t in targets if t.startswith(".")]
            outer = [end for end in handed_on if chance.random() < 0.6]
            own = [end for end in ("p", "q") if chance.random() < 0.8 or not outer]
            own = [end for end in own if end not in outer]
            node = self.container(tuple(own + outer), depth - 1)
            node["_ends"] = own + outer
        elif kind == "use":
            name = f"h{len(self.charts)}"
            self.charts[name] = {}  # taken
            self.chart(name, min(depth - 1, 1))
            node, own = {"use": name}, ["x", "y"]
        else:
            node, own = {kind: CLASSES[kind]}, [*OUTCOMES[kind]]
        self.limits(node, kind, own, guard=kind == "watch" and form != "states")
        self.targets(node, own, keeps, targets)
        return node

    def limits(self, node: Values, kind: str, own: list[str], *, guard: bool) -> None:
        chance = self.chance
        if chance.random() < 0.2:
            node["timeout"] = f"{chance.randint(1, 9) * 100} ms"
        if kind != "box" and chance.random() < 0.15:
            on = [chance.choice(own)] + ["error"] * (chance.random() < 0.3)
            wait = f"{chance.choice((0, 100, 150, 300))} ms"
            node["retry"] = {"times": chance.randint(1, 2), "on": on, "wait": wait}
        if guard and chance.random() < 0.5:
            node["priority"] = chance.randint(-2, 3)

    def targets(self, node: Values, own: list[str], keeps: bool, targets: list[str]) -> None:
        chance = self.chance
        outcomes = own + ["timeout"] * ("timeout" in node)
        outcomes += ["error"] * (chance.random() < 0.3)
        if keeps:
            targets = [target for target in targets if target.startswith(".")]
            outcomes = [o for o in outcomes if chance.random() < 0.25]
        if outcomes:
            node["next"] = {outcome: chance.choice(targets) for outcome in outcomes}


def made_of(seed: int) -> dict[str, Values]:
    """The charts of a seed, by name; `c` is the one to run."""
    maker = Maker(seed)
    maker.chart("c", maker.chance.randint(1, 3))
    for chart in maker.charts.values():
        _clean(chart)
    return {"c": maker.charts.pop("c"), **maker.charts}


def _clean(node: Values) -> None:
    node.pop("_ends", None)
    for child in _children(node).values():
        _clean(child)


def _children(node: Values) -> Values:
    return next((node[form] for form in FORMS if form in node), {})


def _nodes(node: Values) -> Iterator[Values]:
    yield node
    for child in _children(node).values():
        yield from _nodes(child)


def smaller(charts: dict[str, Values]) -> Iterator[dict[str, Values]]:
    """Valid charts that lack one thing each, the largest first."""
    for name, chart in charts.items():
        for number, node in enumerate(_nodes(chart)):
            for change in _changes(node):
                changed = copy.deepcopy(charts)
                found = next(n for i, n in enumerate(_nodes(changed[name])) if i == number)
                change(found)
                yield _used(changed)


def _changes(node: Values) -> Iterator[Any]:
    """What can be taken from a node."""
    children = _children(node)
    if len(children) > 1:
        yield from ((lambda n, name=name: _drop_child(n, name)) for name in children)
    for name, child in children.items():
        if not {"do", "watch"} & set(child):
            yield lambda n, name=name: _make_leaf(_children(n), name)
    yield from ((lambda n, key=key: n.pop(key)) for key in ("retry", "priority") if key in node)
    if "timeout" in node:
        yield _drop_timeout
    if "error" in node.get("next", {}):
        yield lambda n: n["next"].pop("error")
    if len(node.get("when", ())) > 1:
        yield from ((lambda n, i=i: n["when"].pop(i)) for i in range(len(node["when"])))


def _drop_child(node: Values, name: str) -> None:
    children = _children(node)
    del children[name]
    first = next(iter(children))
    for child in children.values():
        for outcome, target in child.get("next", {}).items():
            if target == name:
                child["next"][outcome] = first
    if "when" in node:
        rules = [r for r in node["when"] if name not in r["if"]]
        node["when"] = rules or [{**node["when"][0], "if": {first: "done"}}]


def _make_leaf(children: Values, name: str) -> None:
    """A leaf in place of a container."""
    node = children[name]
    targets = [*node.get("next", {}).values()]
    leaf: Values = {"do": "Do"}
    if targets:
        leaf["next"] = dict.fromkeys(OUTCOMES["do"], targets[0])
    children[name] = leaf


def _drop_timeout(node: Values) -> None:
    del node["timeout"]
    node.get("next", {}).pop("timeout", None)


def _used(charts: dict[str, Values]) -> dict[str, Values]:
    """Without the charts that nobody uses any more."""
    wanted, todo = {"c"}, ["c"]
    while todo:
        for node in _nodes(charts[todo.pop()]):
            if node.get("use", "c") not in wanted:
                wanted.add(node["use"])
                todo.append(node["use"])
    return {name: chart for name, chart in charts.items() if name in wanted}
