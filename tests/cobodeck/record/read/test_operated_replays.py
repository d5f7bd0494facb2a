"""Runs with an operator who does anything at any time are replayed equally; records say who."""

from __future__ import annotations

import random
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from cobodeck.record.format.messages import command_again, command_text
from cobodeck.record.read.reader import Record
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup
from engine.operator.commands import outcomes_of, output_types
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from tests.cobodeck.record.read.test_record_replay import Act, Jittering, recorded, replayed
from tests.repeats import fewer

STATES = '''
from engine.state import Action, Monitor, Until


class Fetch(Action):
    """Brings something after a while."""

    outcomes = ("done", "failed")
    outputs = {"done": {"weight": float, "label": str}}

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds

    def run(self, ctx):
        yield Until(ctx.after(self.seconds))
        return "done", {"weight": self.seconds * 2.0, "label": f"at {ctx.now}"}


class Carry(Action):
    """Carries it for as long as it is heavy."""

    outcomes = ("done", "failed")

    def run(self, ctx, weight: float):
        end = ctx.after(min(abs(weight), 3.0))
        while ctx.now < end:
            yield
        return "done" if weight < 2.0 else "failed"


class Knock(Monitor):
    """Somebody knocks after a while."""

    outcomes = ("knock",)

    def run(self, ctx):
        yield Until(ctx.after(1.7))
        return "knock"
'''
ERRANDS = """
chart: errands
data:
  weight: {type: number, initial: 0.5}
  label: {type: text, initial: none}
states:
  fetch:
    do: Fetch
    with: {seconds: 700 ms}
    break: true
    out: {weight: weight, label: label}
    autonomy: {failed: high, done: low}
    next: {done: work, failed: work}
  work:
    any:
      door: {watch: Knock, next: {knock: .again}}
      both:
        all:
          carry: {do: Carry, in: {weight: weight}, retry: {times: 2, on: failed, wait: 200 ms}}
          rest: {do: Fetch, with: {seconds: 300 ms}, timeout: 5 s}
        next: {done: .again, error: .again}
    next: {again: fetch, error: fetch}
"""
VALUES = {"number": 1.25, "text": "by hand", "integer": 3}
KINDS = (
    "Pause", "Resume", "StepOnce", "ForceOutcome", "SetLock", "SetLevel", "Answer", "Replace",
    "Break", "SetBreak", "Remark", "End",
)  # fmt: skip


@pytest.fixture
def errands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with a chart that has data, limits of autonomy, tries, and a breakpoint."""
    (tmp_path / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nerrands = "errand_states"\n'
    )
    (tmp_path / "errand_states.py").write_text(STATES)
    (tmp_path / "errands.yaml").write_text(ERRANDS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "errand_states", raising=False)
    return tmp_path


def force(operator: Operator, run: ChartRun, chance: random.Random) -> None:
    """Force something that runs, with outputs of the declared types."""
    running = [n for n in run.nodes.values() if n in run.entered and n.vertex.parent is not None]
    possible = [(n, o) for n in running for o in sorted(outcomes_of(n.vertex))]
    if not possible:
        return
    node, outcome = chance.choice(possible)
    types = output_types(run.machine, node.vertex, outcome)
    outputs = {name: VALUES.get(kind.name) for name, kind in types.items()}
    operator.force(node.path, outcome, outputs)


def anything(operator: Operator, run: ChartRun, setup: Setup, chance: random.Random) -> None:
    """One thing that an operator may do; most often something that has an effect now."""
    operator.attend()
    paths = list(run.machine.vertices)
    path = chance.choice(paths)
    waiting = sorted(operator.waiting())
    acts: dict[str, Any] = {
        "resume": operator.resume,
        "consent": lambda: [operator.consent(waits) for waits in waiting],
        "refuse": lambda: [operator.refuse(waits) for waits in waiting],
        "step": operator.step,
        "pause": operator.pause,
        "force": lambda: force(operator, run, chance),
        "lock": lambda: operator.lock(path),
        "unlock": lambda: [operator.unlock(locked) for locked in sorted(run.judge.locks)],
        "level": lambda: operator.set_level(chance.choice((None, "off", "low", "high", "full"))),
        "replace": lambda: operator.replace(run.machine.changed(setup.chart, setup.library)),
        "break": lambda: operator.break_at(path),
        "unbreak": lambda: [operator.unbreak(at) for at in operator.breaks()[:1]],
        "remark": lambda: operator.remark("stop"),
    }
    likely = ["consent"] * 3 * bool(waiting) + ["resume", "step", "step"] * 3 * run.paused
    acts[chance.choice([*acts, *likely])]()


def of_one_run(seed: int) -> dict[float, Act]:
    """Commands at 60 instants of 9 s; every third run ends by one."""
    chance = random.Random(seed)

    def act(operator: Operator, run: ChartRun, setup: Setup) -> object:
        anything(Operator(run, chance.choice(("Ada", "Björn", ""))), run, setup, chance)

    def end(operator: Operator, run: ChartRun, setup: Setup) -> object:
        chance.choice((operator.stop, operator.preempt))()

    acts: dict[float, Act] = {chance.random() * 9.0: act for _ in range(60)}
    return acts | ({8.5: end} if seed % 3 == 0 else {})


def operated(seed: int, path: Path) -> Counter[str]:
    """A run and its replay, which are equal; how often each command was carried out."""
    given: dict[str, Any] = {"chart": "errands.yaml", "robot": "rbkairos_ur10"}
    options = Options(duration_s=9.0)
    if seed % 5 == 4:
        given, options = {"scene": "lab_a"}, Options(user="random", seed=seed, duration_s=9.0)
    elif seed % 5 == 3:  # in real time: ticks are added, late and missed
        given = {"scene": "lab_a", "clock": Jittering(seed)}
        options = Options(duration_s=9.0, mock=True)
    result = recorded(path, options, of_one_run(seed), **given)
    done = list(result.wired.run.carried_out)

    replay = replayed(path)

    run = replay.loop.wired.run
    assert replay.difference is None, f"{seed}: {replay.difference}"
    assert run.trace.sha256() == result.figures["trace_sha256"]
    assert not run.attended
    again = [(at, type(command), command.by) for at, command in run.carried_out]
    assert again == [(at, type(command), command.by) for at, command in done]
    return Counter(type(command).__name__ for _, command in done)


@pytest.mark.requirement(19, 57)
@pytest.mark.slow
def test_runs_with_any_commands_at_any_time_are_replayed_equally(errands: Path) -> None:
    seeds = fewer(range(20))
    done: Counter[str] = Counter()
    for seed in seeds:
        done += operated(seed, errands / f"{seed}.mcap")
    assert set(done) == set(KINDS)


@pytest.mark.slow
def test_a_record_says_who_issued_a_command(errands: Path) -> None:
    path = errands / "run.mcap"
    acts: dict[float, Act] = {
        0.3: lambda op, run, _: Operator(run, "Ada").pause(),
        0.5: lambda op, run, _: Operator(run, "Björn").step(),
        0.6: lambda op, *_: op.resume(),
    }
    result = recorded(
        path, Options(duration_s=1.0), acts, chart="errands.yaml", robot="rbkairos_ur10"
    )
    told = [found for group in Record(path).groups() for found in group.messages("operator")]
    assert [(f["command"], f.get("by")) for f in told] == [
        ("Pause", "Ada"), ("StepOnce", "Björn"), ("Resume", None)
    ]  # fmt: skip
    assert "by" not in command_text(result.wired.run.carried_out[-1][1])
    older = command_again("Pause", {}, lambda _: None)  # type: ignore[arg-type, return-value]
    assert older.by == ""
