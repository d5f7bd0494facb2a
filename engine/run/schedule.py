"""What is due next in a run, and which ticks may be left out (rule 13)."""

from __future__ import annotations

from collections import deque
from typing import Protocol

from engine.machine import WAITING, BoxNode, RunNode
from engine.run.command import Command
from engine.run.life import Life
from engine.run.run_queue import RunQueue
from engine.run.wake_up import wakes_at
from engine.signals import Board
from engine.state import NEVER_NS


class Scheduled(Protocol):
    """What a schedule asks of its run."""

    board: Board
    life: Life
    queue: RunQueue
    commands: deque[Command]
    over: bool
    paused: bool
    stepping: bool


class Schedule:
    """When a run needs its next tick."""

    __slots__ = ("_rests", "_run")

    def __init__(self, run: Scheduled) -> None:
        self._run = run
        self._rests = (-1, 0)  # a tick, and until when nothing is due after it, ns

    def wants_news(self) -> bool:
        """Whether news has arrived that a state waits for, so that a tick should be added."""
        run = self._run
        if run.paused or run.over:
            return False
        arrived = run.board.arrived()
        return any(node.wake and node.mask & arrived for node in run.queue.nodes)

    def next_deadline(self) -> int:
        """The run time of the first timeout, ns; `NEVER_NS` if there is none."""
        run = self._run
        if run.paused or run.over:
            return NEVER_NS
        return min(run.life.first_deadline() + run.board.paused_ns, NEVER_NS)

    def leave_out(self, now: int) -> bool:
        """Let an instant of the grid, ns, pass without a tick if nothing is due or news.

        True: it has passed, and the samples that had arrived are taken. False: it needs its tick.
        """
        run = self._run
        if run.commands or run.life.interrupt is not None:
            return False
        moved = now - run.board.paused_ns >= run.life.due  # a deadline was set from outside
        if moved or self._rests[0] != run.board.ticks or now >= self._rests[1]:
            self._rests = run.board.ticks, self._due_inside()
        return now < self._rests[1] and run.board.rest(now)

    def next_due(self, steady: int = 0) -> int:
        """The first run time, ns, at which a tick has something to do if nothing arrives before.

        Rule 13: earlier ticks change nothing and may be left out, unless a sample or a command
        arrives. If it is not after the current instant, the next tick is needed; if `NEVER_NS`,
        none is. The signals of the bits `steady` go on being repeated, so they are never silent.
        """
        run = self._run
        if not run.over and (run.commands or run.board.inbox):
            return run.board.now
        return self._due_inside(steady)

    def _due_inside(self, steady: int = 0) -> int:
        run = self._run
        board = run.board
        if run.stepping and not run.over:
            return board.now  # the pause goes on with the next tick
        if run.over or run.paused:
            return NEVER_NS
        if run.queue.put_off:
            return board.now
        nodes = run.queue.nodes
        for node in nodes:
            if not node.wake and _acts(node):
                return board.now
        due = run.life.first_deadline()
        for node in nodes:
            if node.wake:
                wake = node.wake if node.silence is None else wakes_at(node, board, steady)
                due = min(due, wake)
        return min(due + board.paused_ns, NEVER_NS)


def _acts(node: RunNode) -> bool:
    """Whether a node that does not sleep has something to do in the next tick."""
    return node.status != WAITING and (not isinstance(node, BoxNode) or node.news)
