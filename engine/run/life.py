"""How nodes start and end: entry, deadlines, data, clean-up, and the trace of it.

The rules are those of engine/README.md. Which node is stepped when, and what its end leads to,
is not decided here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from types import GeneratorType
from typing import Any

from engine.machine import (
    EVERY_TICK,
    IDLE,
    RUNNING,
    BoxNode,
    Cell,
    Leaf,
    LeafNode,
    Route,
    RunNode,
    Token,
    Writes,
)
from engine.run.command import Command
from engine.run.context import LeafContext, Listeners, Part
from engine.run.errors import Newest, Raised, raised
from engine.run.trace import KEPT, Trace
from engine.signals import Board
from engine.state import NEVER_NS, RunNews

BEGUN = Token("begun")


class Life:
    """The nodes of one run that have been entered and have not ended.

    Attributes:
        entered: these nodes, in the order of their start.
        data: the values of all data keys.
        due: lower bound of all deadlines, chart time, ns. It is lowered when a node with a timeout
            is entered, and computed again only once it is reached.
        early: the next tick has something to do before anything is stepped.
        interrupt: a Ctrl-C caught while a state was stepped; raised again by the next tick, so
            that no tick is left half done.
        errors: the newest exceptions that states and parts have raised, and their `total`.
        commands: what the operator wants done at the start of the next tick.
        breaks: what the entry of a node with a breakpoint wants done then, by path.
        listeners: who hears of a pause, a resumption and the end, and the states that asked for it.
        notes: the last text that each state has yielded, or its last error, by path.
    """

    def __init__(self, board: Board, parts: Mapping[str, Part]) -> None:
        self.board = board
        self.parts = dict(parts)
        self.trace = Trace()
        self.raw, self.add = self.trace.raw, self.trace.add
        self.entered: dict[RunNode, None] = {}
        self.data: dict[Cell, Any] = {}
        self.due = NEVER_NS
        self.early = True
        self.commands: deque[Command] = deque()
        self.breaks: Mapping[str, Command] = {}
        self.interrupt: KeyboardInterrupt | None = None
        self.errors: Newest[Raised] = Newest()
        self.notes: dict[str, str] = {}
        self.listeners: Listeners = []
        self.root: RunNode

    def adopt(self, nodes: Mapping[str, RunNode]) -> None:
        """Take over the nodes of a machine; all data keys get their initial values."""
        self.root, self.data = nodes[""], {}
        for node in nodes.values():
            if isinstance(node, BoxNode):
                self.data |= {cell: cell.initial for cell in node.box.cells.values()}
            elif isinstance(node, LeafNode) and not hasattr(node, "context"):
                node.context = LeafContext(node, self.board, self.parts, self.add, self.listeners)

    # -- starting ------------------------------------------------------------------------------

    def begin(self, node: LeafNode) -> Any:
        """Enter a leaf and its enclosing boxes; returns `BEGUN`, or an instant state's result."""
        self._enter(node)
        leaf = node.leaf
        for name in leaf.interface.commands:
            if name in self.parts:
                self.parts[name].stop()  # rule 7: it stands still before a new state starts
        if node.listens:
            node.context.begin()
        try:
            if leaf.has_in:
                found = self._run_with_in(node, leaf)
            else:
                parameters = leaf.parameters
                state = node.make(**parameters) if parameters else node.make()
                found = state.run(node.context)
        except StopIteration as stop:
            raise RuntimeError("raised StopIteration") from stop  # not to be taken for an outcome
        if type(found) is not GeneratorType:
            return found
        node.generator = found
        node.step = found.__next__
        return BEGUN

    def _run_with_in(self, node: LeafNode, leaf: Leaf) -> Any:
        """Make and start a state, some of whose parameters or inputs are given by `in`."""
        bound = {name: self.data[cell] for name, cell in leaf.bound}
        state = node.make(**leaf.parameters, **bound)
        return state.run(node.context, **self.inputs_of(leaf))

    def inputs_of(self, leaf: Leaf) -> dict[str, Any]:
        """The current values of a leaf's inputs, by their Python names."""
        return {**leaf.given, **{name: self.data[cell] for name, cell in leaf.inputs}}

    def _enter(self, node: RunNode) -> None:
        """Enter a node, after those of its enclosing boxes that do not run yet.

        The timeout of a node spans all its tries, so it counts from the first of them.
        """
        parent = node.parent
        if parent is not None and parent.status != RUNNING:
            self._enter(parent)
        if isinstance(node, BoxNode) and node.box.cells:
            self._open_scope(node)
        board = self.board
        now = board.now
        node.status = RUNNING
        node.entered = board.ticks
        self.entered[node] = None
        self.add(("enter", now, node))
        if self.breaks and node.path in self.breaks:
            self.commands.append(self.breaks[node.path])
            self.early = True
        if len(self.raw) > KEPT:
            self.trim()
        if node.since is None:
            node.since = now - board.paused_ns
            timeout = node.vertex.timeout_ns
            if timeout is not None:
                self.set_deadline(node, node.since + timeout)

    def _open_scope(self, node: BoxNode) -> None:
        """Initialize the data of the chart that begins with this box; inputs come from outside."""
        data = self.data
        for cell in node.box.cells.values():
            data[cell] = cell.initial
        for cell, outer in node.box.inputs:
            data[cell] = data[outer]

    # -- deadlines -----------------------------------------------------------------------------

    def set_deadline(self, node: RunNode, at: int) -> None:
        """Let `node` time out at this chart time, ns."""
        node.deadline = at
        if at < self.due:
            self.due = at

    def first_deadline(self) -> int:
        """The earliest deadline, chart time, ns; `due` is set to it."""
        self.due = min((node.deadline for node in self.root.timed), default=NEVER_NS)
        return self.due

    def due_nodes(self) -> list[RunNode]:
        """The nodes whose timeout has expired, outer ones first."""
        now = self.board.now - self.board.paused_ns
        if now < self.due or now < self.first_deadline():
            return []
        return [node for node in self.root.timed if node.deadline <= now]

    # -- ending --------------------------------------------------------------------------------

    def end(self, node: RunNode, outcome: str, writes: Writes, route: Route) -> Writes:
        """End one node, as part of a route; returns the outputs to be written outside of it."""
        if isinstance(node, LeafNode):
            node.generator = None
            closed: tuple[RunNode, ...] = ()
        else:
            assert isinstance(node, BoxNode)
            closed = self.close(node, node.order + 1)
            if node.kept or node.box.cells:
                writes = self._collect(node, outcome, writes)
        self.add(("end", self.board.now, node, outcome, closed, route))
        self.entered.pop(node, None)
        node.status = IDLE
        node.step = None
        if writes and outcome in ("error", "timeout"):
            return ()
        return writes

    def _collect(self, node: BoxNode, outcome: str, writes: Writes) -> Writes:
        """Outputs of an ending box for outside; those of its own chart are written here."""
        if node.kept:
            children = [c for name, c in node.children.items() if name in node.kept]
            writes = tuple(write for child in children for write in child.pending) + writes
        if node.box.cells and node.parent is not None:
            self.write(writes, node)
            named = node.box.outputs.get(outcome, ())
            writes = tuple((outer, self.data[inner]) for inner, outer in named)
        return writes

    def lose(self, ends: Mapping[RunNode, str]) -> list[RunNode]:
        """Record the leaves whose outcomes are lost, and return them, in document order."""
        lost: list[RunNode] = [n for n in ends if isinstance(n, LeafNode) and n in self.entered]
        lost.sort(key=lambda node: node.order)
        for node in lost:
            self.add(("lost", self.board.now, node, ends[node]))
            del self.entered[node]
        return lost

    def abort(self, top: RunNode, reason: str, outcome: str) -> str:
        """Close all of `top` for `reason`; returns `outcome`, or `error` if leaf `top` raised."""
        before = self.errors.total
        for node in self.close(top, top.order):
            self.add(("exit", self.board.now, node, reason))
        top.status = IDLE
        raised_now = {error.path for error in self.errors.since(before)}
        own = isinstance(top, LeafNode) and top.path in raised_now
        ended = "error" if own else outcome
        self.add(("outcome", self.board.now, top, ended))
        return ended

    def close(self, top: RunNode, first: int) -> tuple[RunNode, ...]:
        """Rule 7: close what runs in `top`, from the `order` `first` up, last started first."""
        last = top.last
        closed = tuple([node for node in reversed(self.entered) if first <= node.order <= last])
        for node in closed:
            if isinstance(node, LeafNode):
                self.close_leaf(node)
            del self.entered[node]
            node.status = IDLE
            node.wake = EVERY_TICK
        return closed

    def close_leaf(self, node: LeafNode) -> None:
        """Let the generator of a leaf clean up, if it has one."""
        generator, node.generator, node.step = node.generator, None, None
        if generator is None:
            return
        try:
            generator.close()
        except BaseException as error:  # noqa: BLE001  rule 7: the others still get their clean-up
            self.report(node, error)

    def close_all(self) -> None:
        """After the last tick: let all that still runs clean up, last started first.

        No node ends, and nothing is recorded except what a clean-up raises.
        """
        for node in reversed(list(self.entered)):
            if isinstance(node, LeafNode):
                self.close_leaf(node)

    def tell(self, news: RunNews) -> None:
        """Tell the states that listen what becomes of the run, even if one of them raises."""
        listeners = list(self.listeners)
        if news == "over":
            self.listeners.clear()
        for node, listener in listeners:
            try:
                listener(news)
            except BaseException as error:  # noqa: BLE001
                self.record(node, error)  # the state, if it still runs, goes on

    def hold(self) -> None:
        """Stop every part, even if one of them raises."""
        for part in self.parts.values():
            try:
                part.stop()
            except BaseException as error:  # noqa: BLE001
                self.report(self.root, error)

    # -- recording -----------------------------------------------------------------------------

    def write(self, writes: Writes, box: RunNode) -> None:
        """Write values to data keys, and record them."""
        for cell, value in writes:
            self.data[cell] = value
            self.add(("data", self.board.now, box, cell.key, value))

    def note(self, node: Any, text: str) -> None:
        """Add a note to the trace; it affects neither the run nor the hash."""
        self.add(("note", self.board.now, node, text))
        self.trim()

    def trim(self) -> None:
        """Let old records of the trace go, so that it does not grow without bound."""
        try:
            self.trace.trim()
        except OSError as error:
            self.errors.append(raised(self.board.now, "trace", error))

    def report(self, node: RunNode, error: BaseException) -> None:
        """Rule 8: record what a state or a part has raised, and close the state."""
        self.record(node, error)
        if isinstance(node, LeafNode):
            self.close_leaf(node)

    def record(self, node: RunNode, error: BaseException) -> None:
        """Record what a state or a part has raised, SystemExit included."""
        self.add(("error", self.board.now, node, type(error).__name__))
        cls, waits = (
            (node.interface.make, node.generator) if isinstance(node, LeafNode) else (None, None)
        )
        cls = cls if isinstance(cls, type) else None
        found = raised(self.board.now, node.path, error, cls, waits)
        self.errors.append(found)
        self.trim()
        self.notes[node.path] = f"{found.kind}: {found.text}" if found.text else found.kind
        if isinstance(error, KeyboardInterrupt):
            self.interrupt, self.early = error, True
