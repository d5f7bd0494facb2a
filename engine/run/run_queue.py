"""Which nodes are stepped in a run, in which order, and what is stepped next.

The list of nodes is replaced, never modified, so that a pass can continue over its own list.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import dropwhile
from operator import attrgetter

from engine.machine import (
    AT_ONCE,
    CHOSEN,
    ENDED,
    EVERY_TICK,
    IDLE,
    PUT_OFF,
    RETRYING,
    WAITING,
    BoxNode,
    LeafNode,
    Opening,
    RunNode,
    Writes,
    opening_of,
)
from engine.run.life import Life

ASKS = "asks to end with "
"""How a note begins that tells which outcome of a node waits for consent."""
BUSY_TICKS = 3  # a node put off in more consecutive ticks than this is noted as a busy loop
turn_of = attrgetter("turn")
is_monitor = attrgetter("monitor")
NO_OPENING = Opening((), (), (), ())


class RunQueue:
    """The nodes to be stepped.

    Attributes:
        acting: the action pass is under way, so what is chosen starts in this very pass.
        nodes: in stepping order: monitors, then actions and the boxes that keep outcomes, whose
            rules are evaluated.
        fresh: chosen since the last round of monitors, or during the action pass, and still to be
            stepped in this tick.
        put_off: to be chosen at the start of the next tick (rule 6).
        waiting: children of an `any` that wait for consent.
        frozen: the other actions in those `any`, which are not stepped meanwhile (rule 12).
    """

    __slots__ = ("acting", "board", "fresh", "frozen", "life", "nodes", "put_off", "waiting")

    def __init__(self, life: Life) -> None:
        self.life = life
        self.board = life.board
        self.acting = False
        self.nodes: list[RunNode] = []
        self.fresh: list[RunNode] = []
        self.put_off: list[RunNode] = []
        self.waiting: list[RunNode] = []
        self.frozen: list[RunNode] = []

    # -- choosing --------------------------------------------------------------------------------

    def choose(self, node: RunNode, *, again: bool = False) -> None:
        """Queue `node`, with all that starts with it, to be entered.

        `again`: it is a further try, so its number of tries and its timeout continue.
        """
        tick = self.board.ticks
        opening = node.opening or opening_of(node)
        for other in opening.nodes:
            if other.entered == tick:
                opening = self._choose_some(node, again=again)
                break
        chosen, added, monitors, keeping = opening
        for other in chosen:
            if other is not node or not again:
                other.tries, other.since = 0, None
        for other in added:
            other.status, other.step, other.wake = CHOSEN, None, EVERY_TICK
        for box in keeping:
            box.kept = {}
            box.news = False
        if not added:
            return
        nodes = self.nodes
        if not nodes or nodes[-1].turn < added[0].turn:
            self.nodes = [*nodes, *added]
        else:
            self.nodes = sorted((*nodes, *added), key=turn_of)
        self.fresh += added if self.acting else monitors
        if self.waiting:
            self._freeze()

    def _choose_some(self, node: RunNode, *, again: bool) -> Opening:
        """Rule 6: choose `node` although part of it was entered in this tick already.

        Puts that part off to the next tick and chooses the rest below `node`; returns what is left
        to be chosen, `node` itself or nothing.
        """
        if node.entered == self.board.ticks and not again:
            self._put_off(node)
            return NO_OPENING
        if not isinstance(node, BoxNode):
            return NO_OPENING
        for child in node.box.first:
            self.choose(node.children[child.name])
        keeping = (node,) if node.box.keeps else ()
        return Opening((node,), keeping, (), keeping)

    def _put_off(self, node: RunNode) -> None:
        node.status = PUT_OFF
        tick, running = node.put_off
        running = running + 1 if tick == self.board.ticks - 1 else 1
        node.put_off = (self.board.ticks, running)
        if running > BUSY_TICKS:
            self.life.note(node, "busy-loop")
        self.put_off.append(node)
        self.life.early = True

    def try_again(self, node: RunNode, *, counted: bool) -> None:
        """Schedule a further try, in the next tick or later; `counted`: by `retry`, after its wait.

        Without `counted` it follows a refusal (rule 12).
        """
        retry = node.vertex.retry
        wait = retry[2] if counted and retry else 0
        node.tries += 1 if counted else 0
        node.status = RETRYING
        node.wake = self.board.chart_now + max(wait, 1)
        node.mask, node.silence = 0, None
        node.step = None
        self.insert(node)

    def ask(self, node: RunNode, outcome: str, writes: Writes) -> None:
        """Let `node` wait for consent; the other actions of its `any` are not stepped meanwhile."""
        node.status = WAITING
        node.waiting, node.answer = (outcome, writes), None
        node.wake = EVERY_TICK
        node.step = None
        self.insert(node)
        parent = node.parent
        if parent is not None and parent.box.form == "any" and not parent.box.keeps:
            self.waiting.append(node)
            self._freeze()
        self.life.note(node, f"{ASKS}{outcome}")

    # -- the list --------------------------------------------------------------------------------

    def insert(self, node: RunNode) -> None:
        """Add a node in the order of stepping."""
        self.nodes = sorted((*self.nodes, node), key=turn_of)
        if self.waiting:
            self._freeze()

    def drop(self, top: RunNode) -> None:
        """Remove `top` and all nodes below it."""
        if isinstance(top, LeafNode):
            top.status = IDLE
            if top in self.nodes:
                self.nodes = self.nodes.copy()
                self.nodes.remove(top)
        else:
            self.nodes = _without(self.nodes, top)
        if self.fresh:
            self.fresh = [node for node in self.fresh if not top.spans(node)]
        if self.put_off:
            self.put_off = _without(self.put_off, top)
        if self.waiting:
            self.frozen = _without(self.frozen, top)
            self.waiting = [node for node in self.waiting if not top.spans(node)]
            self._thaw()

    def renew(self, entered: Iterable[RunNode]) -> None:
        """After a replacement of the chart: queue the entered nodes in its order of stepping."""
        going = [n for n in entered if not isinstance(n, BoxNode) or n.box.keeps]
        self.nodes = sorted(going, key=turn_of)
        self.fresh, self.put_off, self.waiting, self.frozen = [], [], [], []

    @property
    def actions(self) -> Iterator[RunNode]:
        """The nodes after the monitors."""
        return dropwhile(is_monitor, self.nodes)

    def take_monitors(self) -> list[RunNode]:
        """Remove from `fresh` the monitors, and return them in the order of stepping."""
        monitors = self.fresh
        self.fresh = []
        if self.acting:
            self.fresh = [node for node in monitors if not node.monitor]
            monitors = [node for node in monitors if node.monitor]
        if len(monitors) > 1:
            monitors.sort(key=turn_of)
        return monitors

    def first_fresh(self) -> RunNode:
        """The first of `fresh` in the order of stepping."""
        fresh = self.fresh
        return fresh[0] if len(fresh) == 1 else min(fresh, key=turn_of)

    def _freeze(self) -> None:
        frozen = [node for node in self.nodes if self._blocked(node)]
        if frozen:
            self.frozen = sorted(self.frozen + frozen, key=turn_of)
            self.nodes = [node for node in self.nodes if node not in frozen]
            self.fresh = [node for node in self.fresh if node not in frozen]

    def _thaw(self) -> None:
        thawed = [node for node in self.frozen if not self._blocked(node)]
        self.frozen = [node for node in self.frozen if node not in thawed]
        self.nodes = sorted(self.nodes + thawed, key=turn_of)
        self.notice(thawed)

    def _blocked(self, node: RunNode) -> bool:
        if node.monitor or node.status == WAITING:
            return False
        if isinstance(node, BoxNode) and node.status != RETRYING:
            return False  # stepping it runs no state
        return any(
            waiting.parent is not None and waiting.parent.spans(node) and not waiting.spans(node)
            for waiting in self.waiting
        )

    def notice(self, nodes: Iterable[RunNode]) -> None:
        """Wake the nodes that got news while they were not stepped; check silence again."""
        for node in nodes:
            if node.mask and self.board.news(node.mask, node.asked):
                node.wake = EVERY_TICK
            elif node.wake and node.silence is not None:
                node.wake = AT_ONCE

    def still_has(self, node: RunNode) -> bool:
        """Whether a node of a pass begun earlier in this tick is still to be stepped."""
        if node.status in (IDLE, ENDED, PUT_OFF) or node in self.frozen:
            return False
        return isinstance(node, BoxNode) or node.entered != self.board.ticks


def _without(nodes: list[RunNode], top: RunNode) -> list[RunNode]:
    """The nodes outside of `top`; sets those inside to idle."""
    first, last = top.order, top.last
    kept = []
    for node in nodes:
        if first <= node.order <= last:
            node.status = IDLE
        else:
            kept.append(node)
    return kept
