"""Steps nodes: the only place that advances state generators and catches what they raise."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from engine.machine import (
    AGAIN,
    EVERY_TICK,
    MATCHED,
    RAISED,
    RETRYING,
    WAITING,
    BoxNode,
    LeafNode,
    RunNode,
    Token,
)
from engine.run.life import BEGUN, Life
from engine.run.wake_up import still_heard, wait

NOTHING = Token("nothing")
StepEnd = tuple[RunNode, Any]  # node, and the value or token that its step has ended with


class Stepper:
    """Steps the nodes of one run."""

    __slots__ = ("board", "life")

    def __init__(self, life: Life) -> None:
        self.life = life
        self.board = life.board

    def step(self, nodes: Iterator[RunNode]) -> StepEnd | None:
        """Step nodes until one ends, and return that end; None if none does.

        Another call with the same iterator continues after that node.
        """
        board = self.board
        now, fresh = board.now - board.paused_ns, board.fresh
        for node in nodes:
            if node.wake:
                if not node.mask & fresh and (node.wake > now or still_heard(node, board)):
                    continue
                node.wake = EVERY_TICK
            try:
                step = node.step
                if step is None:
                    value = self._turn(node)
                    if value is NOTHING:
                        continue
                    if value is not BEGUN:
                        return node, value
                    step = node.step
                    assert step is not None
                yielded = step()
                if yielded is not None:
                    wait(node, yielded, self.life)
            except StopIteration as stop:
                return node, stop.value
            except BaseException as error:  # noqa: BLE001  rule 8: whatever a state raises is an outcome
                self.life.report(node, error)
                return node, RAISED
        return None

    def step_all(self, nodes: Iterator[RunNode], first: StepEnd | None = None) -> list[StepEnd]:
        """Step all nodes; returns the ends of those that ended, preceded by `first` if given."""
        found = [] if first is None else [first]
        while (ended := self.step(nodes)) is not None:
            found.append(ended)
        return found

    def _turn(self, node: RunNode) -> Any:
        """Step a node without a generator: `BEGUN`, `NOTHING`, or what it ends with."""
        status = node.status
        if status == WAITING:
            answer, node.answer = node.answer, None
            return answer or NOTHING
        if isinstance(node, LeafNode):
            return self.life.begin(node)
        assert isinstance(node, BoxNode)
        if status == RETRYING:
            return AGAIN
        if node.news:
            node.news = False
            if node.box.match(node.kept) is not None:
                return MATCHED
        return NOTHING
