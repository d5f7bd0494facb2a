"""S01, S02 and S04 against walking all configurations; what guards, timeouts and users change."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from engine.chart.chart import Node
from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.finding import Finding
from engine.files.source import read
from engine.machine.exploration import explore
from engine.machine.machine import Machine
from tests.engine.check.some_charts import INTERFACES, Maker, library
from tests.repeats import examples


class PlainMaker(Maker):
    """Charts without data and mapped errors, which are not walked; some leaves never end."""

    def leaf(self) -> tuple[dict[str, Any], list[str]]:
        name = self.chance.choice(("Work", "Work", "Near", "Think", "Rest"))
        return {"watch" if name == "Near" else "do": name}, list(INTERFACES[name].outcomes)

    def node(self, *args: Any) -> tuple[dict[str, Any], list[str]]:
        node, kept = super().node(*args)
        node["next"].pop("error", None)
        node.pop("in", None)
        return node, kept


def plain_chart(chance: random.Random) -> dict[str, Any]:
    chart: dict[str, Any] = {"chart": "main", "outcomes": ["x", "y"]}
    chart["parameters"] = {"time": {"type": "duration", "default": "1 s"}}
    return chart | PlainMaker(chance).box(("x", "y"), 2)


def below(found: Library, findings: list[Finding], code: str) -> list[str]:
    """The paths of the nodes that findings of this code are about."""
    chart = found["main"]
    paths: dict[Any, str] = {}

    def visit(node: Node, path: str) -> None:
        for child in node.children:
            inner = f"{path}/{child.name}" if path else child.name
            paths[chart.place(child.at)] = inner
            visit(child, inner)

    visit(chart.root, "")
    return [paths[finding.place] for finding in findings if finding.code == code]


@given(st.integers(0, 2**32))
@settings(deadline=None, max_examples=examples(300), derandomize=True)
def test_unreachable_unproduced_and_dead_are_what_no_walk_finds_a_way_for(seed: int) -> None:
    found = library([plain_chart(random.Random(seed))])
    findings = check(found, INTERFACES)
    if any(finding.severity == "error" for finding in findings):
        return
    machine = Machine(found["main"], found, INTERFACES)
    walked = explore(machine, limit=2000)
    if not walked.complete:
        return
    unreached = below(found, findings, "S01")
    leaves = [leaf.path for leaf in machine.leaves]
    flagged = {p for p in leaves if any(f"{p}/".startswith(f"{u}/") for u in unreached)}
    assert flagged == set(leaves) - walked.entered
    never = {f.message.split("'")[1] for f in findings if f.code == "S02"}
    assert never == {"x", "y"} - set(walked.outcomes)
    if walked.stuck:
        assert "S04" in {f.code for f in findings} or never == {"x", "y"}


def codes(*texts: str) -> list[str]:
    """The codes found in charts that are given as text, without F04 and S10."""
    found = Library()
    for number, text in enumerate(texts):
        found.add(read(text.encode(), f"{number}.yaml"))
    findings = check(found, INTERFACES)
    return [finding.code for finding in findings if finding.code not in ("F04", "S10")]


DAY = """\
  day:
    states:
      work: {do: Work, next: {done: rest, failed: .failed}}
      rest: {do: Rest}
"""
HEAD = "chart: c\noutcomes: [failed, over]\n"


@pytest.mark.parametrize(
    ("beside", "found"),
    [
        ("  never: {do: Rest}\n", ["S02", "S04"]),
        ("  near: {watch: Near, next: {near: .over, far: .over}}\n", []),
        ("  inner: {any: {near: {watch: Near, next: {near: .over, far: .over}}}}\n", []),
    ],
)
def test_a_dead_end_is_none_if_something_beside_it_ends_it(beside: str, found: list[str]) -> None:
    assert codes(f"{HEAD}any:\n{beside}{DAY}") == found


def test_a_timeout_around_a_dead_end_ends_it() -> None:
    day = DAY.replace("\n    states", "\n    timeout: 8 h\n    next: {timeout: .over}\n    states")
    assert codes(f"{HEAD}states:\n{day}") == []


def test_whoever_uses_a_chart_may_end_its_dead_ends() -> None:
    inner = f"{HEAD.replace(', over', '')}states:\n{DAY}".replace("chart: c", "chart: day")
    use = "{use: day, next: {failed: .failed}}"
    guard = "{watch: Near, next: {near: .over, far: .over}}"
    alone = f"chart: c\noutcomes: [failed]\nstates:\n  a: {use}\n"
    guarded = f"{HEAD}any:\n  a: {use}\n  near: {guard}\n"
    assert codes(inner) == ["S04"]
    assert codes(alone, inner) == ["S04"]
    assert codes(guarded, inner) == []
    assert codes(guarded, alone.replace("chart: c", "chart: d"), inner) == ["S04"]


def test_a_chart_without_outcomes_is_meant_to_go_on() -> None:
    assert (
        codes("chart: c\nstates:\n  a: {do: Work, next: {done: b, failed: b}}\n  b: {do: Rest}\n")
        == []
    )


def test_a_circle_of_instant_states_is_found_through_boxes_and_used_charts() -> None:
    inner = "chart: inner\noutcomes: [p, q]\nstates:\n  a: {do: Think, next: {yes: .p, no: .q}}\n"
    outer = (
        "chart: c\noutcomes: [over]\nstates:\n"
        "  a: {use: inner, next: {p: b, q: .over}}\n"
        "  b: {any: {c: {do: Think, next: {yes: .y, no: .n}}}, next: {y: a, n: a}}\n"
    )
    assert codes(inner, outer) == ["S03"]
    waiting = outer.replace("next: {y: a, n: a}", "next: {y: w, n: w}")
    assert codes(inner, waiting + "  w: {do: Wait, with: {time: 1 s}, next: {done: a}}\n") == []


def test_a_used_chart_that_is_tried_again_is_not_instant() -> None:
    """A further try is the next tick at the earliest, so no circle through it is endless."""
    inner = "chart: inner\noutcomes: [p]\nstates:\n  a: {do: Think, next: {yes: .p, no: .p}}\n"
    outer = "chart: c\nstates:\n  a: {use: inner, next: {p: b}}\n  b: {use: inner, next: {p: a}}\n"
    assert codes(inner, outer) == ["S03"]
    again = "retry: {times: 1, on: p, wait: 1 s}"
    assert codes(inner, outer.replace("a: {use: inner,", f"a: {{use: inner, {again},")) == []


def test_parts_are_followed_into_used_charts() -> None:
    inner = "chart: inner\noutcomes: [over]\nstates:\n  a: {do: Drive, next: {done: .over}}\n"
    outer = "chart: c\noutcomes: [over]\nany:\n  a: {use: inner, next: {over: .over}}\n"
    drive = "{do: Drive, next: {done: .over}}"
    assert codes(inner, f"{outer}  b: {drive}\n") == ["S08"]
    assert codes(inner, f"{outer}  b: {{do: Work, next: {{done: .over, failed: .over}}}}\n") == []
    in_turn = outer.replace("any:", "states:").replace("over: .over", "over: b")
    assert codes(inner, f"{in_turn}  b: {drive}\n") == []


def test_two_charts_may_use_a_third_but_not_each_other() -> None:
    use = "chart: {}\noutcomes: [done]\nstates: {{a: {{use: {}, next: {{done: .done}}}}}}\n"
    leaf = "chart: c\noutcomes: [done]\nstates: {a: {do: Drive, next: {done: .done}}}\n"
    assert codes(use.format("a", "c"), use.format("b", "c"), leaf) == []
    assert codes(use.format("a", "b"), use.format("b", "c"), use.format("c", "a")) == ["S05"]
    assert codes(use.format("a", "a")) == ["S05"]
