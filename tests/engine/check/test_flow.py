"""F01 against walks through random charts: all of them for sequences, random ones for the rest."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

from hypothesis import given, settings, strategies as st

from engine.chart.chart import Chart, Node, mark_of
from engine.check.all_checks import check
from engine.machine.machine import Machine
from tests.engine.check.some_charts import FORMS, INTERFACES, Maker, library
from tests.engine.check.test_sound import play
from tests.repeats import examples


class FlowMaker(Maker):
    """Leaves read and write two keys that hold nothing at the start."""

    def leaf(self) -> tuple[dict[str, Any], list[str]]:
        chance = self.chance
        name, key = chance.choice(("Give", "Give", "Near", "Take", "Work")), chance.choice("ab")
        node = {"watch" if name == "Near" else "do": name}
        bound = {"Give": {"out": {"value": key}}, "Take": {"in": {"value": key}}}
        return node | bound.get(name, {}), list(INTERFACES[name].outcomes)


def chart_of(chance: random.Random, forms: tuple[str, ...]) -> dict[str, Any]:
    chart: dict[str, Any] = {"chart": "main", "outcomes": ["x", "y"]}
    chart["data"] = {"a": "number", "b": "number"}
    chart["parameters"] = {"time": {"type": "duration", "default": "200 ms"}}
    maker = FlowMaker(chance, forms)
    maker.keys = ["a", "b"]
    return chart | maker.box(("x", "y"), 3)


def walk(chart: Any) -> set[tuple[str, str]]:
    """Every (path of a leaf, key) that some walk through sequences reads before it is written."""
    reads: set[tuple[str, str]] = set()
    seen: set[Any] = set()
    todo = [(first(chart, ()), frozenset[str]())]
    while todo:
        path, written = todo.pop()
        if (path, written) in seen:
            continue
        seen.add((path, written))
        node = at(chart, path)
        for key in node.get("in", {}).values():
            if real(chart, path, key) not in written:
                reads.add(("/".join(path), key))
        for outcome, keys in leaf_ends(node):
            wrote = {real(chart, path, key) for key in keys}
            todo += [(p, written | wrote) for p in after(chart, path, outcome)]
        for length in range(1, len(path)):
            if "timeout" in at(chart, path[:length]):
                todo += [(p, written) for p in after(chart, path[:length], "timeout")]
    return reads


def real(chart: Any, path: tuple[str, ...], key: str) -> str:
    """The key that `key` stands for at `path`; boxes may call it otherwise."""
    for length in range(len(path) - 1, 0, -1):
        key = at(chart, path[:length]).get("in", {}).get(key, key)
    return key


def leaf_ends(node: Any) -> Iterator[tuple[str, list[str]]]:
    """The outcomes of a leaf and the keys written with each."""
    known = INTERFACES[node.get("do") or node["watch"]]
    for outcome in known.outcomes:
        yield outcome, list(node.get("out", {}).values()) if outcome in known.outputs else []
    yield "error", []
    if "timeout" in node:
        yield "timeout", []


def at(chart: Any, path: tuple[str, ...]) -> Any:
    for name in path:
        chart = chart["states"][name]
    return chart


def first(chart: Any, path: tuple[str, ...]) -> tuple[str, ...]:
    while "states" in at(chart, path):
        path = (*path, next(iter(at(chart, path)["states"])))
    return path


def after(chart: Any, path: tuple[str, ...], outcome: str) -> list[tuple[str, ...]]:
    """The leaf that is entered when `path` ends with `outcome`; nothing if the chart ends."""
    while path:
        target = at(chart, path)["next"].get(outcome, f".{outcome}")
        path = path[:-1]
        if target[0] != ".":
            return [first(chart, (*path, target))]
        outcome = target[1:]
    return []


def reported(chart: Chart, findings: list[Any]) -> set[tuple[str, str]]:
    """The F01 among the findings, as `walk` has them."""
    places = {}

    def visit(node: Node, path: str) -> None:
        for child in node.children:
            below = f"{path}/{child.name}" if path else child.name
            for name, key in child.inputs.items():
                places[chart.place(mark_of(child.raw, "in", name))] = (below, key)
            visit(child, below)

    visit(chart.root, "")
    return {places[finding.place] for finding in findings if finding.code == "F01"}


@given(st.integers(0, 2**32))
@settings(deadline=None, max_examples=examples(300), derandomize=True)
def test_in_sequences_exactly_what_a_walk_can_read_too_early_is_found(seed: int) -> None:
    chart = chart_of(random.Random(seed), ("states",))
    found = library([chart])
    findings = check(found, INTERFACES)
    assert {finding.code for finding in findings if finding.severity == "error"} <= {"F01"}
    assert reported(found["main"], findings) == walk(chart)


@given(st.integers(0, 2**32))
@settings(deadline=None, max_examples=examples(300), derandomize=True)
def test_what_passes_never_reads_what_is_not_written(seed: int) -> None:
    chance = random.Random(seed)
    found = library([chart_of(chance, FORMS)])
    if all(finding.severity == "warning" for finding in check(found, INTERFACES)):
        play(Machine(found["main"], found, INTERFACES), chance)  # asserts it
