"""How nodes of a machine start and end: the lasting part of a run, without its ticks.

The rules are those of engine/README.md. What is active stands in two lists, in the order of
stepping (`turns`); `run.py` steps them, and decides what is to start and to end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from engine.board import Board
from engine.context import LeafContext, Part
from engine.decide import (
    AGAIN,
    HOLD,
    KEEP,
    MATCHED,
    RAISED,
    REOPEN,
    RETRY,
    Decision,
    Judge,
    Token,
    Writes,
)
from engine.errors import Raised, raised
from engine.machine import (
    CHOSEN,
    ENDED,
    IDLE,
    PUT_OFF,
    RETRYING,
    RUNNING,
    WAITING,
    Box,
    Leaf,
    Machine,
    Opening,
    Vertex,
    open_up,
    plain_edges,
)
from engine.state import NEVER_NS
from engine.trace import Trace
from engine.turns import Turns

ENDINGS = frozenset(("end", "outcome", "hand_over"))  # records of the trace that tell an outcome
BUSY_TICKS = 3  # a node may be put off in so many ticks running before it is called a busy loop


class Lifecycle:
    """What runs in a machine, since when and until when, with its trace.

    `entered` are the nodes that have begun and not ended, in the order of their start; `errors` is
    all that states and parts have raised; `ended_by` the node that led to the outcome of the chart,
    and its own. `_early` tells the next tick that something is to be done before anything is
    stepped, `_acting` that the actions have their turn.
    """

    def __init__(
        self,
        machine: Machine,
        board: Board | None = None,
        parts: Mapping[str, Part] | None = None,
        level: int | None = None,
        freezers: Mapping[type, Callable[[Any], Any]] | None = None,
    ) -> None:
        self.machine = machine
        self.board = board if board is not None else Board()
        self.parts = dict(parts or {})
        self.judge = Judge(level, dict(freezers or {}), self._raised)
        self.trace = Trace()
        self.notes: dict[str, str] = {}
        self.errors: list[Raised] = []
        self.outcome: str | None = None
        self.ended_by: tuple[str, str] | None = None
        self.results: dict[str, Any] = {}
        self.turns = Turns(self.board)
        self.turns.put_off.append(machine.root)
        self.entered: dict[Vertex, None] = {}
        self._timed: dict[Vertex, None] = {}
        self._deadline = NEVER_NS
        self._acting = False
        self._early = True
        self._interrupt: KeyboardInterrupt | None = None
        self._bind(machine)

    def _bind(self, machine: Machine) -> None:
        if machine.bound:
            raise ValueError("a machine belongs to one run; make another of the same chart")
        machine.bound = True
        for leaf in machine.leaves:
            leaf.context = LeafContext(leaf, self.board, self.parts)
            leaf.starter = partial(self._start, leaf)

    # -- starting ------------------------------------------------------------------------------

    def _choose(self, vertex: Vertex, *, again: bool = False) -> None:
        """Make `vertex` the next to be stepped, with all that starts with it."""
        tick, tries = self.board.ticks, vertex.tries
        opening = vertex.opening or open_up(vertex)
        for other in opening.vertices:
            if other.entered == tick:
                self._choose_some(vertex, again=again)
                break
        else:
            self._select(opening)
        if again:
            vertex.tries = tries

    def _choose_some(self, vertex: Vertex, *, again: bool) -> None:
        """Rule 6: something in `vertex` has been entered in this tick, and is put off."""
        if vertex.entered == self.board.ticks and not again:
            self._delay(vertex)
            return
        if isinstance(vertex, Box):
            below = vertex.children[:1] if vertex.form == "states" else vertex.children
            for child in below:
                self._choose(child)
            if vertex.keeps:
                self._select(Opening((), (), (vertex,), (vertex,), (), ()))
            vertex.tries = 0

    def _select(self, opening: Opening) -> None:
        for leaf in opening.leaves:
            leaf.status = CHOSEN
            leaf.step = leaf.starter
            leaf.wake = leaf.tries = 0
        for box in opening.keeping:
            box.status = CHOSEN
            box.kept.clear()
            box.news = False
            box.wake = 0
            box.step = partial(_look, box)
        for trying in opening.trying:
            trying.tries = 0
        self.turns.add(opening.monitors, opening.actions, in_place=self._acting)

    def _delay(self, vertex: Vertex) -> None:
        vertex.status = PUT_OFF
        tick, running = vertex.put_off
        running = running + 1 if tick == self.board.ticks - 1 else 1
        vertex.put_off = (self.board.ticks, running)
        if running > BUSY_TICKS:
            self.note(vertex, "busy-loop")
        self.turns.put_off.append(vertex)
        self._early = True

    def _start(self, leaf: Leaf) -> Any:
        """The first step of a leaf: it is entered now, and so is what encloses it."""
        parent = leaf.parent
        assert parent is not None
        if parent.status != RUNNING:
            self._enter_boxes(parent)
        leaf.status = RUNNING
        leaf.entered = self.board.ticks
        self.entered[leaf] = None
        self.trace.add(("enter", self.board.now, leaf))
        if leaf.timeout_ns is not None and not leaf.tries and leaf.deadline == NEVER_NS:
            self._set_deadline(leaf)
        return self._first_step(leaf)

    def _first_step(self, leaf: Leaf) -> Any:
        context = leaf.context
        if leaf.commands:
            self._claim(leaf)
        if leaf.reads:
            context.begin()
        try:
            state = leaf.make(**leaf.parameters)
            if leaf.inputs:
                run = state.run(context, **{name: cell.value for name, cell in leaf.inputs})
            else:
                run = state.run(context)
        except StopIteration as stop:
            raise RuntimeError("raised StopIteration") from stop  # it is no outcome
        if leaf.instant:
            raise StopIteration(run)
        leaf.generator = run
        leaf.step = step = run.__next__
        return step()

    def _enter_boxes(self, box: Box) -> None:
        above: list[Box] = []
        while box.status != RUNNING:
            above.append(box)
            if box.parent is None:
                break
            box = box.parent
        for entered in reversed(above):
            if entered.cells:
                entered.reset_data()
            entered.status = RUNNING
            entered.entered = self.board.ticks
            self.entered[entered] = None
            self.trace.add(("enter", self.board.now, entered))
            if entered.timeout_ns is not None and entered.deadline == NEVER_NS:
                self._set_deadline(entered)

    def _claim(self, leaf: Leaf) -> None:
        """Rule 7: a part stands still before anything new starts on it."""
        for name in leaf.commands:
            if name in self.parts:
                self.parts[name].stop()

    def _set_deadline(self, vertex: Vertex) -> None:
        assert vertex.timeout_ns is not None
        vertex.deadline = self.board.chart_now + vertex.timeout_ns
        self.watch_deadline(vertex)

    def watch_deadline(self, vertex: Vertex) -> None:
        """Have `vertex` end when its deadline has come."""
        self._timed[vertex] = None
        self._deadline = min(self._deadline, vertex.deadline)

    # -- ending --------------------------------------------------------------------------------

    def _take(self, decision: Decision) -> None:
        top, kind, writes = decision.top, decision.kind, decision.writes
        for vertex, outcome in decision.ends:
            writes = self._end(vertex, outcome, writes)
        self.turns.drop(top)
        if self._timed:
            self._clear_deadlines(top, inclusive=kind not in (HOLD, RETRY, REOPEN))
        box, target = decision.box, decision.target
        if target is not None and box is not None:
            move = ("move", self.board.now, box, top.name, decision.outcome, target.name)
            self.trace.add(move)
            if writes:
                self._write(writes, box)
            self._choose(target)
        elif kind == KEEP and box is not None:
            top.status = ENDED
            top.pending = writes
            box.kept[top] = decision.outcome
            box.news = True
        elif kind == HOLD:
            self._ask(top, decision.outcome, writes)
        elif kind == RETRY:
            self._try_again(top, counted=bool(decision.ends))
        elif kind == REOPEN:
            self._choose(top, again=True)
        else:
            self._write(writes, self.machine.root)
            self.ended_by = (decision.cause.path, self._outcome_of(decision.cause))
            self.finish(decision.outcome)

    def _end(self, vertex: Vertex, outcome: str, writes: Writes) -> Writes:
        """Record the end of one vertex; what is to be written outside of it."""
        closed: tuple[Vertex, ...] = ()
        if isinstance(vertex, Box):
            if vertex.keeps:
                kept = [child.pending for child in vertex.children if child in vertex.kept]
                writes = tuple(write for pending in kept for write in pending) + writes
            closed = self._close(vertex, vertex.order + 1)
            if vertex.cells and vertex.parent is not None:
                self._write(writes, vertex)
                named = vertex.outputs.get(outcome, ())
                writes = tuple((outer, inner.value) for inner, outer in named)
        self.trace.add(("end", self.board.now, vertex, outcome, closed))
        self.entered.pop(vertex, None)
        vertex.status = IDLE
        vertex.generator = None
        if writes and outcome in ("error", "timeout"):
            return ()
        return writes

    def _try_again(self, vertex: Vertex, *, counted: bool) -> None:
        wait = vertex.retry[2] if counted and vertex.retry else 0
        vertex.tries += 1 if counted else 0
        vertex.status = RETRYING
        vertex.wake = self.board.chart_now + max(wait, 1)
        vertex.mask, vertex.silence = 0, None
        vertex.step = vertex.starter if isinstance(vertex, Leaf) else partial(end_with, AGAIN)
        self.turns.insert(vertex)

    def _ask(self, vertex: Vertex, outcome: str, writes: Writes) -> None:
        vertex.status = WAITING
        vertex.waiting = (outcome, writes)
        vertex.wake = 0
        vertex.step = _nothing_yet
        self.turns.wait(vertex)
        self.note(vertex, f"asks to end with {outcome}")

    def _lose(self, decisions: list[Decision]) -> None:
        """Record the leaves whose outcomes are lost, in document order."""
        ends = {vertex: outcome for decision in decisions for vertex, outcome in decision.ends}
        for vertex in sorted(ends, key=_order):
            if isinstance(vertex, Leaf) and vertex in self.entered:
                self.trace.add(("lost", self.board.now, vertex, ends[vertex]))
                del self.entered[vertex]
                self.turns.drop(vertex)

    def _raised(self, vertex: Vertex, error: BaseException) -> Token:
        """Rule 8: whatever a state raises is its outcome `error`, SystemExit included.

        Ctrl-C is raised again at the start of the next tick, so that no tick is left half done.
        """
        self.trace.add(("error", self.board.now, vertex, type(error).__name__))
        cls = vertex.interface.make if isinstance(vertex, Leaf) else None
        found = raised(self.board.now, vertex.path, error, cls if isinstance(cls, type) else None)
        self.errors.append(found)
        self.notes[vertex.path] = f"{found.kind}: {found.text}" if found.text else found.kind
        if isinstance(error, KeyboardInterrupt):
            self._interrupt, self._early = error, True
        if vertex.generator is not None:
            self._close_leaf(vertex)
        return RAISED

    def _close(self, top: Vertex, first: int) -> tuple[Vertex, ...]:
        """Rule 7: close what runs in `top` from `first` on, last started first."""
        last = top.last
        closed = tuple([v for v in reversed(self.entered) if first <= v.order <= last])
        for vertex in closed:
            if vertex.generator is not None:
                self._close_leaf(vertex)
            del self.entered[vertex]
            vertex.status = IDLE
            vertex.wake = 0
        return closed

    def _close_leaf(self, leaf: Vertex) -> None:
        generator, leaf.generator = leaf.generator, None
        assert generator is not None
        try:
            generator.close()
        except BaseException as error:  # noqa: BLE001  rule 7: the others still get their clean-up
            self._raised(leaf, error)

    def abort(self, top: Vertex, reason: str, outcome: str) -> str:
        """Close all of `top` for `reason`; its outcome, `error` if its own clean-up raised."""
        before = len(self.trace.raw)
        for vertex in self._close(top, top.order):
            self.trace.add(("exit", self.board.now, vertex, reason))
        top.status = IDLE
        self.turns.drop(top)
        raised = any(r[0] == "error" and r[2] is top for r in self.trace.raw[before:])
        ended = "error" if raised and isinstance(top, Leaf) else outcome
        self.trace.add(("outcome", self.board.now, top, ended))
        return ended

    def force(self, vertex: Vertex, outcome: str, writes: Writes) -> None:
        """Follow the outcome of a vertex that has just been aborted."""
        decision = self.judge.resolve(vertex, outcome, ended=True)
        decision.writes = writes
        self._take(decision)

    def _clear_deadlines(self, top: Vertex, *, inclusive: bool = True) -> None:
        first = top.order if inclusive else top.order + 1
        for vertex in [v for v in self._timed if first <= v.order <= top.last]:
            vertex.deadline = NEVER_NS
            del self._timed[vertex]
        self._deadline = min((v.deadline for v in self._timed), default=NEVER_NS)

    def _write(self, writes: Writes, box: Box) -> None:
        for cell, value in writes:
            cell.value = value
            self.trace.add(("data", self.board.now, box, cell.key, value))

    def _outcome_of(self, vertex: Vertex) -> str:
        """What a vertex has ended with, by its last record."""
        ends = (r[3] for r in reversed(self.trace.raw) if r[0] in ENDINGS and r[2] is vertex)
        return next(ends, "")

    def finish(self, outcome: str) -> None:
        """End the run; the robot is held."""
        self.outcome = outcome
        self._early = True
        root = self.machine.root
        for key in self.machine.chart.outputs.get(outcome, ()):
            self.results[key] = root.cells[key].value
        self.turns.drop(root)
        self._clear_deadlines(root)
        self.hold()

    def close(self) -> None:
        """Nothing ticks any more: clean up what still runs, last started first, and hold the parts.

        It ends nothing and leaves no records, but for what a clean-up raises.
        """
        for vertex in reversed(list(self.entered)):
            if vertex.generator is not None:
                self._close_leaf(vertex)
        self.hold()

    def hold(self) -> None:
        """Stop every part; one that cannot does not keep the others from it."""
        for part in self.parts.values():
            try:
                part.stop()
            except BaseException as error:  # noqa: BLE001
                self._raised(self.machine.root, error)

    # -- the whole ------------------------------------------------------------------------------

    def note(self, vertex: Vertex, text: str) -> None:
        """Something worth knowing; it changes nothing and is not in the hash."""
        self.trace.add(("note", self.board.now, vertex, text))

    def forget_routes(self) -> None:
        """After a change of locks or level: outcomes may lead elsewhere now."""
        for vertex in self.machine.vertices.values():
            vertex.routes.clear()
            vertex.plain = {} if self.judge.locks else plain_edges(vertex)

    def adopt(self, machine: Machine, entered: list[Vertex], added: list[Vertex]) -> None:
        """Go on with another machine, whose vertices already hold what was running."""
        self.machine = machine
        self.entered = dict.fromkeys(entered)
        self._timed.clear()
        self._deadline = NEVER_NS
        self._bind(machine)
        self.forget_routes()
        self.turns = Turns(self.board)
        for vertex in entered:
            if isinstance(vertex, Leaf):
                self.turns.insert(vertex)
            elif isinstance(vertex, Box) and vertex.keeps:
                vertex.step = partial(_look, vertex)
                self.turns.insert(vertex)
        self.turns.put_off += added if entered else [machine.root]
        self._early = True

    @property
    def active(self) -> list[str]:
        """The paths of the running leaves, in document order."""
        leaves = [v for v in self.entered if isinstance(v, Leaf)]
        return [leaf.path for leaf in sorted(leaves, key=_order)]


def _nothing_yet() -> None:
    return None


def end_with(token: Token) -> None:
    """A step that ends with something no generator returns."""
    raise StopIteration(token)


def _look(box: Box) -> None:
    """The turn of a box that keeps outcomes, after those of all its children."""
    if box.news:
        box.news = False
        if box.match(box.kept) is not None:
            raise StopIteration(MATCHED)


def _order(vertex: Vertex) -> int:
    return vertex.order
