"""Errors are seen: what a state raises is its outcome `error`, told with file, line and text."""

from __future__ import annotations

import asyncio
import inspect
import linecache
import sys
from contextlib import suppress
from typing import Any

import pytest

from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Measured, declare
from engine.state import Action, Context, Run as Steps

CHART = """
chart: c
outcomes: [x, failed]
any:
  bad: {do: Bad, timeout: 1 s, next: {done: .x, error: .failed, timeout: .x}}
  other: {do: Stay, next: {}}
"""


class Stay(Action):
    """Goes on."""

    outcomes = ()
    commands = ("base",)

    def run(self, ctx: Context) -> Steps:
        while True:
            yield None


def bad(phase: str, error: BaseException) -> type[Action]:
    """A state that raises in one phase of its life."""

    class Bad(Action):
        """Raises."""

        outcomes = ("done",)
        reads = {"number": None}

        def __init__(self) -> None:
            if phase == "making":
                raise error

        def run(self, ctx: Context) -> Steps:
            if phase == "first step":
                raise error
            try:
                yield None
                if phase == "later step":
                    raise error
                if phase == "reading":
                    ctx.value("number")
                yield None
                if phase == "returning":
                    return "nonsense"
                while True:
                    yield None
            finally:
                if phase == "cleaning up":
                    raise error

    return Bad


PHASES = ("making", "first step", "later step", "reading", "returning", "cleaning up")
ERRORS = (
    OSError("no link"),
    SystemExit(0),
    asyncio.CancelledError(),
    GeneratorExit(),
    StopIteration(),
)


def started(bench: Any, phase: str, error: BaseException) -> Any:
    def broken(_: float) -> float:
        raise error

    signals = declare([Measured("raw", float), Derived("number", ("raw",), broken)])
    board = Board(signals)
    board.put("raw", 1.0, 0)
    b = bench(CHART, (bad(phase, error), Stay), scripted=False, board=board)
    for _ in range(15):
        b.tick()
    return b


@pytest.mark.parametrize(
    ("phase", "error"),
    [
        pytest.param(phase, error, id=f"{phase}-{type(error).__name__}")
        for phase in PHASES
        for error in ERRORS
        if (phase, type(error)) != ("cleaning up", GeneratorExit)  # as every generator ends
    ],
)
def test_whatever_a_state_raises_in_whichever_phase_is_its_error(
    bench: Any, phase: str, error: BaseException
) -> None:
    b = started(bench, phase, error)

    assert b.run.outcome == "failed"
    (raised,) = b.run.errors
    assert raised.path == "bad"
    assert raised.file == __file__
    assert phase == "returning" or "error" in linecache.getline(__file__, raised.line)
    assert str(raised).startswith(f"{__file__}:{raised.line}: {raised.kind}")
    assert b.run.ended_by == ("bad", "error")
    assert sorted(record[1] for record in b.records("exit")) in (["", "bad"], ["", "bad", "other"])
    assert b.base.stops >= 1
    assert b.run.entered == {}


def test_an_undeclared_outcome_is_told_at_the_class(bench: Any) -> None:
    b = started(bench, "returning", OSError())

    (raised,) = b.run.errors
    assert raised.kind == "UndeclaredOutcome"
    assert "nonsense" in raised.text
    assert raised.line >= inspect.getsourcelines(bad)[1]


def test_a_state_that_swallows_its_end_is_told(bench: Any) -> None:
    class Bad(Action):
        """Will not end."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Steps:
            for _ in range(2):  # a third end would come from the interpreter
                with suppress(GeneratorExit):
                    while True:
                        yield None

    b = bench(CHART, (Bad, Stay), scripted=False)
    b.tick(12)

    assert b.run.outcome == "failed"
    (raised,) = b.run.errors
    assert (raised.path, raised.kind) == ("bad", "RuntimeError")
    assert "ignored GeneratorExit" in raised.text
    assert raised.file == __file__


def test_an_error_deep_in_a_library_is_told_at_the_line_of_the_state(bench: Any) -> None:
    class Bad(Action):
        """Calls a library."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Steps:
            yield None
            int("x" if sys else 0, 99)  # the line that is told

    b = bench(CHART, (Bad, Stay), scripted=False)
    b.tick(3)

    (raised,) = b.run.errors
    assert "the line that is told" in linecache.getline(__file__, raised.line)


def test_control_c_in_a_state_leaves_no_tick_half_done(bench: Any) -> None:
    b = bench(CHART, (bad("later step", KeyboardInterrupt()), Stay), scripted=False)
    b.tick(2)

    assert b.run.errors[0].kind == "KeyboardInterrupt"
    assert b.run.outcome == "failed"
    with pytest.raises(KeyboardInterrupt):
        b.tick()
    assert b.run.entered == {}
