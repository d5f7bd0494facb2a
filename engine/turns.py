"""Who is to be stepped in a run, and in which order.

The lists are replaced, never changed, so that a pass can go on over the one it began with.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine.machine import ENDED, IDLE, PUT_OFF, RETRYING, WAITING, Box, Vertex

if TYPE_CHECKING:
    from engine.board import Board


class Turns:
    """The vertices that have a turn.

    Attributes:
        monitors: by rank.
        actions: by place, with the boxes that keep outcomes, to look at their rules.
        fresh_monitors: chosen since the last round, to be stepped in the next one.
        fresh_actions: chosen in the action pass, to be stepped in place.
        put_off: to be chosen at the start of the next tick (rule 6).
        waiting: children of an `any` that wait for consent.
        frozen: the other actions in those `any`, which have no turn meanwhile (rule 12).
    """

    __slots__ = (
        "actions", "board", "fresh_actions", "fresh_monitors", "frozen", "monitors", "put_off",
        "waiting",
    )  # fmt: skip

    def __init__(self, board: Board) -> None:
        self.board = board
        self.monitors: list[Vertex] = []
        self.actions: list[Vertex] = []
        self.fresh_monitors: list[Vertex] = []
        self.fresh_actions: list[Vertex] = []
        self.put_off: list[Vertex] = []
        self.waiting: list[Vertex] = []
        self.frozen: list[Vertex] = []

    def add(
        self, monitors: tuple[Vertex, ...], actions: tuple[Vertex, ...], *, in_place: bool
    ) -> None:
        """Give vertices that were just chosen their turn; both come in order.

        `in_place`: the action pass is under way, so its actions start in this very pass.
        """
        if monitors:
            if self.monitors:
                self.monitors = sorted((*self.monitors, *monitors), key=rank)
            else:
                self.monitors = [*monitors]
            self.fresh_monitors += monitors
        if actions:
            if self.actions:
                self.actions = sorted((*self.actions, *actions), key=place)
            else:
                self.actions = [*actions]
            if in_place:
                self.fresh_actions += actions
            if self.waiting:
                self._freeze()

    def insert(self, vertex: Vertex) -> None:
        """Give one vertex a turn that is not its first."""
        if vertex.monitor:
            self.monitors = sorted([*self.monitors, vertex], key=rank)
            return
        self.actions = sorted([*self.actions, vertex], key=place)
        if self.waiting:
            self._freeze()

    def replace(self, leaf: Vertex, target: Vertex) -> None:
        """Give the turn of an action to the one that follows it in its sequence."""
        actions = self.actions
        self.actions = [target if v is leaf else v for v in actions] if actions[1:] else [target]

    def drop(self, top: Vertex) -> None:
        """Nothing in `top` has a turn any more."""
        first, last = top.order, top.last
        monitors = []
        for vertex in self.monitors:
            if first <= vertex.order <= last:
                vertex.status = IDLE
            else:
                monitors.append(vertex)
        self.monitors = monitors
        actions = []
        for vertex in self.actions:
            if first <= vertex.order <= last:
                vertex.status = IDLE
            else:
                actions.append(vertex)
        self.actions = actions
        if self.fresh_monitors or self.fresh_actions:
            self.fresh_monitors = [v for v in self.fresh_monitors if not top.holds(v)]
            self.fresh_actions = [v for v in self.fresh_actions if not top.holds(v)]
        if self.put_off:
            self.put_off = _without(self.put_off, top)
        if self.waiting:
            self.frozen = _without(self.frozen, top)
            self.waiting = [v for v in self.waiting if not top.holds(v)]
            self._thaw()

    def next_fresh_action(self) -> Vertex:
        """The first of the actions that start in place."""
        vertex = min(self.fresh_actions, key=place)
        self.fresh_actions.remove(vertex)
        return vertex

    def wait(self, vertex: Vertex) -> None:
        """`vertex` waits for consent: the other actions of its `any` have no turn meanwhile."""
        self.insert(vertex)
        parent = vertex.parent
        if parent is not None and parent.form == "any" and not parent.keeps:
            self.waiting.append(vertex)
            self._freeze()

    def _freeze(self) -> None:
        frozen = [vertex for vertex in self.actions if self._blocked(vertex)]
        if frozen:
            self.frozen = sorted(self.frozen + frozen, key=place)
            self.actions = [v for v in self.actions if v not in frozen]
            self.fresh_actions = [v for v in self.fresh_actions if v not in frozen]

    def _thaw(self) -> None:
        thawed = [vertex for vertex in self.frozen if not self._blocked(vertex)]
        self.frozen = [v for v in self.frozen if v not in thawed]
        self.actions = sorted(self.actions + thawed, key=place)
        self.notice(thawed)

    def _blocked(self, vertex: Vertex) -> bool:
        if vertex.status == WAITING or (isinstance(vertex, Box) and vertex.status != RETRYING):
            return False  # it steps nothing
        return any(
            waiting.parent is not None
            and waiting.parent.holds(vertex)
            and not waiting.holds(vertex)
            for waiting in self.waiting
        )

    def notice(self, vertices: list[Vertex]) -> None:
        """Wake those for whom news came while they had no turn; silence is looked for anew."""
        for vertex in vertices:
            if vertex.mask and self.board.news(vertex.mask, vertex.asked):
                vertex.wake = 0
            elif vertex.wake and vertex.silence is not None:
                vertex.wake = 1

    def still_has(self, vertex: Vertex) -> bool:
        """Whether a vertex of a pass begun earlier in this tick is still to be stepped."""
        if vertex.status in (IDLE, ENDED, PUT_OFF) or vertex in self.frozen:
            return False
        return isinstance(vertex, Box) or vertex.entered != self.board.ticks


def _without(vertices: list[Vertex], top: Vertex) -> list[Vertex]:
    for vertex in vertices:
        if top.holds(vertex):
            vertex.status = IDLE
    return [vertex for vertex in vertices if not top.holds(vertex)]


def rank(vertex: Vertex) -> int:
    """The order of monitors (rule 3)."""
    return vertex.rank


def place(vertex: Vertex) -> int:
    """The order of actions."""
    return vertex.place
