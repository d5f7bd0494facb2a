"""Typed names of signals: text at run time, a type for the checker."""

from __future__ import annotations

import subprocess
import sys

import pytest

from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, Key, On, Run

LEVEL: Key[float] = Key("level")

TYPED = """
from typing import assert_type
from engine.state import Context, Key, Stamped

LEVEL: Key[float] = Key("level")

def known(ctx: Context) -> None:
    assert_type(ctx.value(LEVEL), float | None)
    assert_type(ctx.sample(LEVEL), Stamped[float] | None)
    assert_type(ctx.events(LEVEL), tuple[Stamped[float], ...])

def unknown(ctx: Context) -> None:
    ctx.value("level").whatever
"""


class Above(Action):
    """Waits for a level above 1."""

    outcomes = ("above",)
    reads = {LEVEL: 0.5, "other": None}

    def run(self, ctx: Context) -> Run:
        while (level := ctx.value(LEVEL)) is None or level <= 1.0:
            yield On(LEVEL)
        return "above"


def test_a_key_is_plain_text_at_run_time():
    assert type(LEVEL) is str
    assert type(Key[float]("level")) is str
    assert LEVEL == "level"


def test_a_state_reads_and_waits_by_its_keys(bench):
    text = "chart: c\noutcomes: [above]\nstates:\n  a: {do: Above, next: {above: .above}}\n"
    board = Board(declare([Measured("level", float), Measured("other", float)]))
    b = bench(text, states=(Above,), scripted=False, board=board)
    b.tick(2)
    assert b.run.outcome is None
    board.put("level", 2.0, b.now)
    b.tick()
    assert b.run.outcome == "above"


def test_the_type_checker_knows_the_type_behind_a_key(tmp_path):
    pytest.importorskip("mypy")
    file = tmp_path / "typed.py"
    file.write_text(TYPED)
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", ".mypy_cache", str(file)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout
