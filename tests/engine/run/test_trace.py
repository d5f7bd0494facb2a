"""Rule 15: the trace and its one canonical encoding."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from enum import Enum, IntEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from engine.run.trace import encode
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, Outcome
from tests.engine.conftest import Bench

TWO = """
chart: c
outcomes: [x]
data: {goal: {type: any, initial: none}}
states:
  a: {do: Give, out: {value: goal}, next: {done: b, failed: b, other: .x}}
  b: {do: Do, next: {done: a, failed: .x, other: .x}}
"""


@dataclass(frozen=True)
class Spot:
    """A place, in m."""

    x: float
    y: float


class Pair(NamedTuple):
    """Two numbers."""

    one: int
    two: int


class Level(Enum):
    """How loud."""

    LOW = 1


class Code(IntEnum):
    """A number with a name."""

    SEVEN = 7


class Plain:
    """A value whose class says nothing about how it is shown."""

    def __init__(self) -> None:
        self.number = 1


class Shown:
    """A value whose class says how it is shown."""

    def __repr__(self) -> str:
        return "shown"


ENCODED = {
    "none": (None, "null"),
    "number": ((1, -0.0, 0.1, 1e300, True), "[1,-0.0,0.1,1e+300,true]"),
    "no number": ((float("nan"), float("inf")), "[NaN,Infinity]"),
    "text": ("Tür", '"Tür"'),
    "dataclass": (Spot(1.0, 2.0), '{"Spot":[1.0,2.0]}'),
    "named tuple": (Pair(1, 2), '{"Pair":[1,2]}'),
    "set": (frozenset("cab"), '{"frozenset":["\\"a\\"","\\"b\\"","\\"c\\""]}'),
    "mapping": ({"b": 1, "a": 2}, '{"a":2,"b":1}'),
    "enum": ((Level.LOW, Code.SEVEN), '[{"Level":"LOW"},7]'),
    "plain object": (Plain(), '{"Plain":{"number":1}}'),
    "object with a text": (Shown(), '{"Shown":"shown"}'),
}


@pytest.mark.parametrize("name", ENCODED)
def test_rule_15_each_value_has_one_encoding(name):
    value, text = ENCODED[name]
    assert encode(value) == text


def test_rule_15_arrays_are_encoded_by_digest_with_type_and_shape():
    row = np.arange(4.0)
    texts = {encode(a) for a in (row, row.reshape(2, 2), row.astype(int), row + 1.0)}
    assert len(texts) == 4
    assert encode(row) == encode(row.copy())
    assert all(len(text) < 100 for text in texts)


def test_rule_15_an_edge_is_written_out_as_outcome_exit_move_and_enter():
    bench = Bench(TWO)
    bench.tick()
    bench.end("a", "failed")
    bench.tick()
    kinds = [raw[0] for raw in bench.run.trace.raw]
    assert kinds == ["enter", "enter", "end", "enter"]
    assert list(bench.run.trace.lines())[2:] == [
        '[100000000,"outcome","a","failed"]',
        '[100000000,"exit","a","outcome"]',
        '[100000000,"move","","a","failed","b"]',
        '[100000000,"enter","b"]',
    ]


def test_rule_15_data_are_in_the_trace_and_in_its_hash():
    hashes = set()
    for value in (1.0, 2.0):
        bench = Bench(TWO)
        bench.tick()
        bench.end("a", "done", value=value)
        bench.tick()
        assert ("data", "", "goal", value) in bench.records("data")
        hashes.add(bench.run.trace.sha256())
    assert len(hashes) == 2


def test_rule_15_the_hash_covers_times_and_not_how_many_ticks_there_were():
    hashes = []
    for ticks, start in ((range(10), 0), (range(0, 10, 3), 0), (range(1, 10), 1)):
        bench = Bench(TWO)
        for tick in ticks:
            if tick == 9:
                bench.end("a", "failed")
            bench.run.recorded_tick(tick * 10**8)
        assert bench.run.trace.raw[0] == ("tick", start * 10**8, bench.run.nodes[""])
        hashes.append(bench.run.trace.sha256())
    assert hashes[0] == hashes[1] != hashes[2]


HASH = """
from tests.engine.conftest import Bench
from tests.engine.run.test_trace import TWO, Plain
bench = Bench(TWO, freezers={Plain: lambda value: value})
bench.tick()
bench.end("a", "done", value=(frozenset(("one", "two", "three")), Plain()))
bench.tick()
print(bench.run.trace.sha256())
"""


def test_rule_15_the_hash_is_the_same_in_every_process():
    root = Path(__file__).resolve().parents[3]
    hashes = set()
    for seed in ("1", "2"):
        env = os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": str(root)}
        done = subprocess.run(
            [sys.executable, "-c", HASH],
            env=env,
            cwd=root,
            capture_output=True,
            text=True,
            check=True,
        )
        hashes.add(done.stdout)
    assert len(hashes) == 1


class Tells(Action):
    """Notes what kinds of signals there are."""

    outcomes = ("done", "failed", "other")
    reads = {"bell": None, "level": None}

    def run(self, ctx: Context) -> Outcome:
        ctx.note(f"bell {ctx.is_event('bell')}, level {ctx.is_event('level')} \ud800")
        return "done"


def test_rule_15_notes_of_states_are_in_the_trace_and_not_in_its_hash() -> None:
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Tells, next: {done: .x}}\n"
    board = Board(declare([Measured("bell", event=True), Measured("level")]))
    bench = Bench(text, states=(Tells,), scripted=False, board=board)
    bench.tick()

    notes = [r for r in bench.run.trace if r.kind == "note"]
    without = [r for r in bench.run.trace if r.kind != "note"]

    assert [(r.subject, r.detail) for r in notes] == [("a", ("bell True, level False \\ud800",))]
    silent = Bench(text.replace("Tells", "Do"))
    silent.end("a", "done")
    silent.tick()
    assert bench.run.trace.sha256() == silent.run.trace.sha256()
    assert without == list(silent.run.trace)
