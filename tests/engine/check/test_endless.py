"""Rule 10: cycles in which nothing waits (S03), and outcomes that nothing produces (S02)."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.finding import Finding
from engine.files.source import read
from engine.interfaces import interface
from engine.machine.exploration import explore
from engine.machine.machine import Machine
from engine.state import Action, Context, Run


class Drive(Action):
    """Fails at once where there is no way."""

    outcomes = ("arrived", "no_way", "stuck")

    def __init__(self, far: float = 1.0) -> None:
        self.far = far

    def run(self, ctx: Context) -> Run:
        if self.far < 0:
            return "no_way"
        for _ in range(3):
            yield
            if self.far > 5:
                return "stuck"
        return "arrived"


class Slow(Action):
    """Always waits first."""

    outcomes = ("done", "failed")

    def run(self, ctx: Context) -> Run:
        yield
        return "done" if ctx.now else "failed"


class Choose(Action):
    """Chooses in no time."""

    outcomes = ("chosen", "none")

    def run(self, ctx: Context) -> Run:
        return "chosen"


class Case(Action):
    """Ends in no time as one of `cases`."""

    outcomes = ("$cases", "other")

    def __init__(self, cases: tuple[str, ...]) -> None:
        self.cases = cases

    def run(self, ctx: Context) -> Run:
        return self.cases[0]


class Given(Action):
    """Has an output."""

    outcomes = ("given",)
    outputs: ClassVar = {"given": {"value": float}}

    def run(self, ctx: Context) -> Run:
        return "given", {"value": 1.0}


INTERFACES = {c.__name__: interface(c) for c in (Drive, Slow, Choose, Case, Given)}
DRIVE = "{do: Drive, next: {arrived: ARRIVED, no_way: NO_WAY, stuck: STUCK}}"
CHOOSE = "{do: Choose, next: {chosen: drive, none: .failed}}"


def library(*texts: str) -> Library:
    found = Library()
    for number, text in enumerate(texts):
        found.add(read(text.encode(), f"{number}.yaml"))
    return found


def findings(*texts: str) -> list[Finding]:
    return [f for f in check(library(*texts), INTERFACES) if f.code in ("S02", "S03")]


def chart(nodes: dict[str, str], outcomes: str = "[done, failed]", name: str = "c") -> str:
    lines = "".join(f"  {child}: {node}\n" for child, node in nodes.items())
    return f"chart: {name}\noutcomes: {outcomes}\nstates:\n{lines}"


def drive(arrived: str, no_way: str, stuck: str) -> str:
    ends = {"ARRIVED": arrived, "NO_WAY": no_way, "STUCK": stuck}
    node = DRIVE
    for name, target in ends.items():
        node = node.replace(name, target)
    return node


@pytest.mark.parametrize(
    ("node", "told"),
    [
        (drive(".done", "choose", ".failed"), ["choose", "drive"]),
        (drive("choose", ".failed", ".failed"), []),  # it has driven meanwhile
        (drive(".done", ".failed", "choose"), []),  # stuck comes after some time
        (drive("choose", "choose", "choose"), ["choose", "drive"]),
        (drive(".done", "choose", ".failed").replace("next", "timeout: 1 s, next")
            .replace("}}", ", timeout: .failed}}"), ["choose", "drive"]),
        (drive(".done", "choose", ".failed")
            .replace("next", "retry: {times: 2, on: no_way, wait: 1 s}, next"), []),
        (drive(".done", "drive", ".failed"), ["drive"]),
        ("{do: Slow, next: {done: choose, failed: choose}}", []),
    ],
)  # fmt: skip
def test_rule_10_an_action_that_fails_at_once_into_its_chooser_is_told(node, told):
    found = [f for f in findings(chart({"choose": CHOOSE, "drive": node})) if f.code == "S03"]
    assert len(found) == bool(told)
    assert all(name in found[0].message for name in told)


def test_rule_10_actions_that_succeed_one_after_another_are_no_busy_loop():
    """A patrol: each drive is meant to take its time."""
    nodes = {
        "a": drive("b", ".failed", ".failed"),
        "b": drive("c", ".failed", ".failed"),
        "c": drive("a", ".failed", ".failed"),
    }
    assert not findings(chart(nodes, "[failed]"))


def test_rule_10_a_patrol_that_goes_on_whatever_happens_is_a_busy_loop():
    """With no way to any of the places it turns round and round."""
    nodes = {"a": drive("b", "b", "b"), "b": drive("a", "a", "a")}
    (found,) = findings(chart(nodes, "[]"))
    assert found.code == "S03"
    assert "as long as they end at once" in found.message


def test_rule_10_a_wait_in_the_cycle_ends_the_alarm():
    nodes = {
        "choose": CHOOSE,
        "drive": drive(".done", "rest", ".failed"),
        "rest": "{do: Slow, next: {done: choose, failed: .failed}}",
    }
    assert not findings(chart(nodes))


@pytest.mark.parametrize(
    ("targets", "told"), [("red: n, other: .done", True), ("red: .done, other: n", True),
                          ("red: .done, other: .failed", False)],
)  # fmt: skip
def test_rule_10_outcomes_that_a_node_names_count_in_cycles(targets: str, told: bool):
    node = f"{{do: Case, with: {{cases: [red]}}, next: {{{targets}}}}}"
    busy = [f for f in findings(chart({"n": node})) if f.code == "S03"]
    assert bool(busy) == told


def test_rule_10_and_the_explorer_walks_them():
    node = "{do: Case, with: {cases: [red, blue]}, next: {red: n, blue: .done, other: .failed}}"
    found = library(chart({"n": node}))
    walked = explore(Machine(found["c"], found, INTERFACES))
    assert walked.complete
    assert set(walked.outcomes) == {"done", "failed"}
    assert {outcome for _, outcome in walked.moves} == {"red", "blue", "other"}


BOX = """\
chart: c
outcomes: [done, failed]
states:
  box:
    {form}:
      a: {{do: Slow{a}}}
      b: {{do: Slow{b}}}
{when}    next: {{{next}}}
"""
LEAD = ", next: {done: .ok, failed: .bad}"


def box(form: str, a: str, b: str, ends: str, when: str = "") -> str:
    return BOX.format(form=form, a=a, b=b, next=ends, when=when)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (box("any", LEAD, LEAD, "ok: .done, bad: .failed"), []),
        (box("any", LEAD, LEAD, "ok: .done, bad: .failed, lost: .failed"), ["N05"]),
        (box("all", "", "", "done: .done"), ["S02"]),
        (
            box("all", "", "", "both: .done, one: .failed",
                "    when:\n      - {outcome: both, if: {a: done, b: done}}\n"
                "      - {outcome: one, if: {a: failed}}\n"
                "      - {outcome: one, if: {b: failed}}\n"),
            [],
        ),
        (
            box("all", ", next: {done: .both, failed: .one}", ", next: {done: .both, failed: .one}",
                "both: .done, one: .failed, done: .done"),
            ["S02"],
        ),
    ],
)  # fmt: skip
def test_rule_10_an_outcome_that_a_container_never_has_is_told(text: str, found: list[str]):
    every = [f for f in check(library(text), INTERFACES) if f.code in ("S02", "N05")]
    assert [f.code for f in every] == found


def test_rule_10_an_outcome_that_a_chart_never_has_is_told_once():
    nodes: dict[str, Any] = {"n": "{do: Slow, next: {done: .done, failed: .done}}"}
    (found,) = findings(chart(nodes))
    assert (found.code, "'failed'" in found.message) == ("S02", True)
