"""Every start is followed by exactly one stop, whatever happens to a chart.

Random nested charts over leaves that end, raise, raise in their clean-up, wait, and are preempted,
timed out, forced, locked, paused, retried and entered again. Runners with a deliberate fault show
that the property can fail, each by the rule that it breaks.
"""

from __future__ import annotations

import random
from collections import Counter
from functools import partial
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, Phase, example, given, settings, strategies as st

from engine.chart.load import Library, load_text
from engine.files.source import read
from engine.machine.machine import Machine
from engine.machine.node import (
    CHOSEN,
    IDLE,
    PUT_OFF,
    RETRYING,
    RUNNING,
    WAITING,
    BoxNode,
    LeafNode,
    RunNode,
    Substitute,
)
from engine.machine.vertices import Leaf
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from engine.run.life import Life
from engine.run.run_queue import RunQueue
from engine.state import Until
from tests.engine.conftest import STATES, Part, interface
from tests.engine.valid_charts import chart_texts
from tests.repeats import examples

INTERFACES = {cls.__name__: interface(cls) for cls in STATES}
many = settings(
    deadline=None,
    max_examples=examples(200),
    suppress_health_check=list(HealthCheck),
    derandomize=True,
)


class Ledger:
    """Counts starts and stops; keeps every generator, so that none is closed by being dropped."""

    def __init__(self) -> None:
        self.starts: list[int] = []
        self.stops: list[int] = []
        self.running: dict[int, str] = {}
        self.kept: list[Any] = []


class Wild:
    """A leaf that behaves by chance."""

    def __init__(
        self,
        leaf: Leaf,
        ledger: Ledger,
        chance: random.Random,
        **_parameters: Any,
    ) -> None:
        self.leaf, self.ledger, self.chance = leaf, ledger, chance
        if chance.random() < 0.02:
            raise RuntimeError("cannot be made")

    def run(self, ctx: Any, **_inputs: Any) -> Any:
        generator = self._run(ctx)
        self.ledger.kept.append(generator)
        return generator

    def _run(self, ctx: Any) -> Any:
        ledger, chance = self.ledger, self.chance
        number = len(ledger.starts)
        ledger.starts.append(number)
        ledger.running[number] = self.leaf.path
        try:
            for _ in range(chance.randrange(6)):
                yield (
                    Until(ctx.after(chance.choice((0.0, 0.25)))) if chance.random() < 0.3 else None
                )
            if chance.random() < 0.08:
                raise RuntimeError("in the middle")
            if chance.random() < 0.04:
                return "undeclared"
            return chance.choice(self.leaf.interface.outcomes)
        finally:
            ledger.stops.append(number)
            ledger.running.pop(number, None)
            if chance.random() < 0.05:
                raise RuntimeError("in the clean-up")


HELPER = """
chart: helper
outcomes: [done, failed, other]
any:
  guard: {watch: See, next: {seen: .done, lost: .other}}
  both:
    all:
      one: {do: Do, timeout: 300 ms}
      two: {do: Do, next: {failed: .failed}}
    next: {done: .done, failed: .failed}
  rest:
    states:
      first: {do: Do, next: {done: then, failed: .failed, other: then}}
      then: {watch: See, next: {seen: first, lost: .other}}
"""


def decorate(text: str, chance: random.Random) -> Library:
    """A chart with retries and autonomy, and with another chart for some of its leaves."""
    chart = yaml.safe_load(text)

    def visit(node: Any) -> None:
        for form in ("states", "any", "all"):
            for child in node.get(form, {}).values():
                guard = "watch" in child and form != "states"
                leaf = "do" in child or "watch" in child
                if "do" in child and chance.random() < 0.1:
                    del child["do"]
                    child["use"] = "helper"
                if leaf and chance.random() < 0.2:
                    outcome = "seen" if "watch" in child else "done"
                    child["retry"] = {"times": 2, "on": outcome, "wait": "150 ms"}
                if leaf and not guard and chance.random() < 0.2:
                    child["autonomy"] = {"seen" if "watch" in child else "done": "high"}
                visit(child)

    visit(chart)
    library = load_text(yaml.safe_dump(chart, sort_keys=False))
    library.add(read(HELPER.encode(), "helper.yaml"))
    assert not library.findings
    return library


def bother(operator: Operator, machine: Machine, chance: random.Random) -> None:
    """Do as operators do."""
    paths = sorted(machine.vertices)
    what = chance.randrange(14)
    if what == 0:
        operator.pause()
    elif what == 1:
        chance.choice((operator.resume, operator.step))()
    elif what == 2:
        operator.lock(chance.choice(paths))
    elif what == 3:
        for path in sorted(operator._run.judge.locks):
            operator.unlock(path)
    elif what == 4:
        path = chance.choice(paths)
        operator.force(path, chance.choice(("done", "failed", "other", "seen", "p", "q")))
    elif what == 5:
        operator.set_level(chance.choice((None, "off", "high", "full")))
    elif what == 6:
        operator.attend()
        operator.break_at(chance.choice(paths))
    else:
        answer(operator, chance)


def answer(operator: Operator, chance: random.Random) -> None:
    """Consent to what waits, or refuse it."""
    for path in operator.waiting():
        (operator.consent if chance.random() < 0.6 else operator.refuse)(path)


def check_lives(text: str, seed: int, runner: type[ChartRun] = ChartRun) -> None:
    chance = random.Random(seed)
    library = decorate(text, chance)
    ledger = Ledger()

    def bind() -> Machine:
        return Machine(library["c"], library, INTERFACES)

    machine = bind()
    stand_ins = {
        leaf.path: Substitute(partial(Wild, leaf, ledger, chance), leaf.interface.outputs)
        for leaf in machine.leaves
    }
    level = chance.choice((None, None, 2))
    run: Any = runner(machine, parts={"base": Part()}, level=level, stand_ins=stand_ins)
    operator = Operator(run)
    for tick in range(60):
        run.tick(tick * 10**8)
        check_now(run, ledger)
        if run.outcome is not None:
            break
        if chance.random() < 0.3:
            bother(operator, run.machine, chance)
        if chance.random() < 0.05:
            operator.replace(bind())
    if run.outcome is None:
        operator.stop()
        run.tick(60 * 10**8)
    assert run.outcome is not None
    assert ledger.running == {}, f"rule 7: never closed: {ledger.running}"
    assert Counter(ledger.stops) == Counter(ledger.starts), "rule 7: not closed exactly once"
    check_trace(run)


def check_now(run: ChartRun, ledger: Ledger) -> None:
    """What has started and not stopped is just what the runner calls active."""
    running = sorted(ledger.running.values())
    active = [leaf.path for leaf in run.running if leaf.generator is not None]
    assert running == sorted(active), f"rule 7: never closed: {running}, active: {active}"
    assert active == run.active
    check_queue(run)


def check_queue(run: ChartRun) -> None:
    """Nothing has two turns, and just what goes on has one."""
    queue = run.queue
    named = [*queue.nodes, *queue.frozen, *queue.put_off]
    assert len(named) == len(set(named)), "rule 6: something has two turns"
    assert queue.nodes == sorted(queue.nodes, key=lambda node: node.turn)
    assert queue.fresh == []
    for node in run.nodes.values():
        going = node.status in (CHOSEN, RUNNING, WAITING, RETRYING, PUT_OFF)
        if isinstance(node, LeafNode) or node.status in (WAITING, RETRYING, PUT_OFF):
            assert going == (node in named), f"rule 7: {node.path!r} has a turn and does not go on"


def check_trace(run: ChartRun) -> None:
    """Enter and exit alternate on every path, and boxes enclose what is in them."""
    open_paths: list[str] = []
    for record in run.trace:
        path = record.subject
        if record.kind == "enter":
            assert path not in open_paths, f"rule 7: {path!r} is entered twice"
            parent = path.rpartition("/")[0]
            assert path == "" or parent in open_paths, f"rule 7: {path!r} before its container"
            open_paths.append(path)
        elif record.kind == "exit":
            assert path in open_paths, f"rule 7: {path!r} is left and was not entered"
            inside = [p for p in open_paths if p != path and within(p, path)]
            assert not inside, f"rule 7: {path!r} is left before {inside}"
            open_paths.remove(path)
    assert open_paths == [], f"rule 7: never left: {open_paths}"


def within(path: str, box: str) -> bool:
    return box == "" or path.startswith(box + "/")


TWO_WAYS_TO_ONE_END = """
chart: c
outcomes: [x, y]
any:
  n0:
    any:
      n0: {watch: See, timeout: 100 ms, next: {seen: .p, lost: .p, timeout: .p}}
      n1: {watch: See, next: {seen: .p, lost: .p}}
      n2:
        any:
          n0: {watch: See, timeout: 100 ms}
          n1: {do: Do}
        when:
        - {outcome: p, if: {n0: seen}}
        - {outcome: p, if: {n0: lost}}
        - {outcome: p, if: {n0: timeout}}
        timeout: 100 ms
        next: {p: .p, timeout: .p}
    timeout: 100 ms
  n1: {do: Do}
when:
- {outcome: x, if: {n0: p}}
- {outcome: x, if: {n0: timeout}}
"""


@many
@given(text=chart_texts(timeouts=True), seed=st.integers(0, 10**6))
@example(text=TWO_WAYS_TO_ONE_END, seed=764)
@example(text=TWO_WAYS_TO_ONE_END, seed=1)
def test_every_start_is_followed_by_exactly_one_stop(text, seed):
    check_lives(text, seed)


class LeavesOpen(Life):
    """Forgets to close the generators of what loses."""

    __slots__ = ()

    def close_leaf(self, node: LeafNode) -> None:
        node.generator = node.step = None


class ClosesTheLastOnly(Life):
    """Closes one of those that have to be closed."""

    __slots__ = ()

    def close(self, top: RunNode, first: int) -> tuple[RunNode, ...]:
        inside = [n for n in reversed(self.entered) if first <= n.order <= top.last]
        boxes = [node for node in inside if isinstance(node, BoxNode)]
        for node in inside[:1] + boxes:
            if isinstance(node, LeafNode):
                self.close_leaf(node)
            self.entered.pop(node, None)
            node.status = IDLE
        return tuple(inside)


class ForgetfulQueue(RunQueue):
    """Drops nothing."""

    __slots__ = ()

    def drop(self, top: RunNode) -> None:
        pass


class DropsLosers(ChartRun):
    """Forgets to close what loses."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.life.__class__ = LeavesOpen


class ClosesOnlyTheFirst(ChartRun):
    """Closes one of those that have to be closed."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.life.__class__ = ClosesTheLastOnly


class KeepsTheTurnOfTheClosed(ChartRun):
    """Goes on stepping what it has closed."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.queue.__class__ = ForgetfulQueue


class EntersAgain(ChartRun):
    """Writes an entry twice."""

    def tick(self, now: int, between: bool = False) -> str | None:
        first = next((raw for raw in self.trace.raw if raw[0] == "enter"), None)
        if first is not None:
            self.trace.add(first)
        return super().tick(now, between)


class LeavesContainersFirst(ChartRun):
    """Writes exits the wrong way round."""

    def tick(self, now: int, between: bool = False) -> str | None:
        done = len(self.trace.raw)
        outcome = super().tick(now, between)
        self.trace.raw[done:] = sorted(self.trace.raw[done:], key=lambda raw: raw[2].depth)
        return outcome


@pytest.mark.parametrize(
    ("faulty", "message"),
    [
        (DropsLosers, "rule 7: never closed: "),
        (ClosesOnlyTheFirst, "rule 7: never closed: "),
        (KeepsTheTurnOfTheClosed, "rule 7: never closed: "),
        (EntersAgain, "rule 7: '.*' is entered twice"),
        (LeavesContainersFirst, "rule 7: '.*' is left before "),
    ],
)
def test_a_faulty_runner_is_caught(faulty, message):
    quick = settings(many, database=None, phases=(Phase.generate,), report_multiple_bugs=False)

    @settings(quick, max_examples=200)
    @given(text=chart_texts(timeouts=True), seed=st.integers(0, 10**6))
    def search(text, seed):
        check_lives(text, seed, faulty)

    with pytest.raises(AssertionError, match=message):
        search()
