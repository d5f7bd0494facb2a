"""A board that passes over repeats is the one that has taken them all."""

from __future__ import annotations

import random

import pytest

from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Estimated, Measured, declare
from tests.cobodeck.loop.test_leaps import Since, Span

HZ, SECOND = 10, 10**9
GRAPH = declare([
    Measured("a"),
    Measured("b"),
    Derived("both", ("a", "b"), lambda a, b: a + b),
    Estimated("either", ("a", "b"), Span, needs=("a",)),
    Estimated("sums", ("a", "b"), Span),
    Estimated("since", ("sums",), Since),
])  # fmt: skip


def rest(board: Board, number: int, **values: float) -> bool:
    now = number * SECOND // HZ
    for name, value in values.items():
        board.put(name, value, now)
    if board.rest(now):
        return True
    board.begin(now)
    return False


@pytest.mark.parametrize("repeated", ["a", "b"])
@pytest.mark.parametrize("read", [False, True])
def test_after_a_leap_all_is_as_if_each_repeat_had_been_taken(repeated: str, read: bool) -> None:
    dense, leapt = Board(GRAPH), Board(GRAPH)
    values = {"a": 1.5, "b": 2.5}
    chance = random.Random(3)
    for board in (dense, leapt):
        rest(board, 0, **values)
        for number in range(1, 16):
            rest(board, number, **{name: values[name] for name in repeated})
    for number in range(16, 46):
        assert rest(dense, number, **{name: values[name] for name in repeated})
        if read:
            dense.slots[chance.choice(list(GRAPH))].read()
    leapt.leap(30, 3 * SECOND)
    for number in (46, 47, 48):
        told = {name: values[name] for name in repeated} if number < 48 else {"a": 7.0}
        assert rest(dense, number, **told) == rest(leapt, number, **told)
        assert dense.interval == leapt.interval
        for name, slot in dense.slots.items():
            assert slot.read() == leapt.slots[name].read(), name
        for name, inlet in dense.inlets.items():
            assert inlet.heard == leapt.inlets[name].heard, name


def test_only_instants_that_repeat_the_same_signals_count_as_rested() -> None:
    board = Board({name: GRAPH[name] for name in ("a", "b")})
    found = []
    for number, names in enumerate(("ab", "ab", "ab", "a", "a", "ab", "ab", "", "", "")):
        rest(board, number, **dict.fromkeys(names, 1.5))
        found.append(board.rested)

    assert found == [0, 0, 1, 0, 1, 0, 1, 0, 1, 2]
