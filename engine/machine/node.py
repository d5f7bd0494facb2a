"""Nodes: the run-time state of each vertex of a machine, in one run.

A machine never changes while it runs; everything that does is kept here. Numbers needed in every
tick are copied from the vertex.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from operator import attrgetter
from typing import Any, NamedTuple, Protocol

from engine.machine.machine import Machine
from engine.machine.vertices import Box, Cell, Leaf, Vertex
from engine.state import NEVER_NS, Context, On, State
from engine.types import Type

IDLE, CHOSEN, RUNNING, ENDED, WAITING, RETRYING, PUT_OFF = range(7)
"""Status of a node: idle; chosen to be entered; running; ended, in a box that keeps its outcome;
waiting for consent; waiting for its next try; put off to the next tick (rule 6)."""

EVERY_TICK, AT_ONCE = 0, 1
"""In `RunNode.wake`: it waits for nothing; it waits, but the time it waits for has come."""

Writes = tuple[tuple[Cell, Any], ...]
NEVER_ENTERED = -1

GO, KEEP, ASK, RETRY, REOPEN, FINISH = range(6)
"""What a route does: see `Route`."""


class Token:
    """Sentinel that an engine-internal step ends with instead of an outcome."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        return self.name


class Substitute(NamedTuple):
    """A stand-in for a leaf's state: its factory, and its output types by outcome and name."""

    make: Callable[..., State]
    outputs: Mapping[str, Mapping[str, Type]]


class RunNode:
    """Run-time state that leaves and boxes share.

    Attributes:
        step: the `__next__` of the generator; None while the engine handles the next step itself.
        wake: skipped until this chart time, ns, or until news of `mask`; or `EVERY_TICK`.
        mask: bits of the measured signals whose news wake it.
        asked: the tick in which it began to wait for `mask`.
        silence: the `On` that waits for silence, and the run time at which it was yielded, ns.
        entered: the tick in which it was last entered.
        since: chart time of its first entry since it was chosen, ns; `timeout` counts from there.
        tries: further tries made, not counting those after a refusal.
        put_off: the last tick in which it was put off, and in how many consecutive ticks.
        waiting: the outcome that waits for consent, and its outputs.
        pending: outputs of a kept outcome, to be written when the box ends.
        timed: the nodes with a timeout among this one and those below, outer ones first.
        routes: routes found so far, by outcome.
    """

    __slots__ = (
        "answer", "asked", "deadline", "depth", "entered", "guard", "last", "mask", "monitor",
        "opening", "order", "parent", "path", "pending", "put_off", "routes", "silence", "since",
        "status", "step", "timed", "tries", "turn", "vertex", "waiting", "wake",
    )  # fmt: skip

    def __init__(self) -> None:
        self.status = IDLE
        self.step: Callable[[], Any] | None = None
        self.wake = EVERY_TICK
        self.mask = 0
        self.asked = NEVER_ENTERED
        self.silence: tuple[On, int] | None = None
        self.entered = NEVER_ENTERED
        self.since: int | None = None
        self.deadline = NEVER_NS
        self.tries = 0
        self.put_off = (NEVER_ENTERED, 0)
        self.waiting: tuple[str, Writes] = ("", ())
        self.answer: Token | None = None
        self.pending: Writes = ()

    def bind(self, vertex: Vertex, parent: BoxNode | None) -> None:
        """Attach to this vertex; called again when the chart is replaced."""
        self.vertex = vertex
        self.parent = parent
        self.path = vertex.path
        self.order, self.last, self.turn = vertex.order, vertex.last, vertex.turn
        self.depth = vertex.depth
        self.monitor, self.guard = vertex.monitor, vertex.guard
        self.timed: tuple[RunNode, ...] = ()
        self.routes: dict[str, Route] = {}
        self.opening: Opening | None = None

    def spans(self, other: RunNode) -> bool:
        """Whether `other` is this node or below it."""
        return self.order <= other.order <= self.last

    def __repr__(self) -> str:
        return f"<{self.path or '(top)'}>"


class LeafView(Context, Protocol):
    """The context of a leaf as the engine uses it."""

    def begin(self) -> None:
        """On entry of the leaf: deliver events from this tick on."""
        ...

    def bits(self, names: tuple[str, ...]) -> int:
        """The bits of the measured signals that these depend on."""
        ...


class LeafNode(RunNode):
    """Run-time state of a leaf; `make` and `produces` are its stand-in's, if it has one."""

    __slots__ = ("context", "generator", "interface", "leaf", "listens", "make", "produces")

    def __init__(self, leaf: Leaf) -> None:
        super().__init__()
        self.make: Callable[..., State] = leaf.interface.make
        self.produces: Mapping[str, Mapping[str, Type]] = leaf.interface.outputs
        self.generator: Generator[Any, None, Any] | None = None
        self.context: LeafView
        self.listens = bool(leaf.interface.reads)

    def bind(self, vertex: Vertex, parent: BoxNode | None) -> None:
        """Attach to this leaf."""
        super().bind(vertex, parent)
        assert isinstance(vertex, Leaf)
        self.leaf = vertex
        self.interface = vertex.interface


class BoxNode(RunNode):
    """Run-time state of a box. `kept`: the outcomes it keeps, by name of the ended child.

    `news`: an outcome was kept since the rules were last evaluated.
    """

    __slots__ = ("box", "children", "kept", "news")

    def __init__(self) -> None:
        super().__init__()
        self.children: dict[str, RunNode] = {}
        self.kept: dict[str, str] = {}
        self.news = False

    def bind(self, vertex: Vertex, parent: BoxNode | None) -> None:
        """Attach to this box; `nodes_of` fills in the children."""
        super().bind(vertex, parent)
        assert isinstance(vertex, Box)
        self.box = vertex
        self.children = {}


class Opening(NamedTuple):
    """The nodes that start together when one is chosen."""

    nodes: tuple[RunNode, ...]  # all of them
    queued: tuple[RunNode, ...]  # leaves, and boxes that keep outcomes, in the order of stepping
    monitors: tuple[RunNode, ...]  # of `queued`
    keeping: tuple[BoxNode, ...]  # of `queued`


def opening_of(node: RunNode) -> Opening:
    """The nodes that start with `node`; computed once."""
    if node.opening is None:
        nodes = tuple(_starting(node))
        stepped = [n for n in nodes if not isinstance(n, BoxNode) or n.box.keeps]
        queued = tuple(sorted(stepped, key=attrgetter("turn")))
        monitors = tuple(n for n in queued if n.monitor)
        keeping = tuple(n for n in queued if isinstance(n, BoxNode))
        node.opening = Opening(nodes, queued, monitors, keeping)
    return node.opening


def _starting(node: RunNode) -> Iterator[RunNode]:
    yield node
    if isinstance(node, BoxNode):
        for child in node.box.first:
            yield from _starting(node.children[child.name])


def nodes_of(machine: Machine, known: Mapping[str, RunNode]) -> dict[str, RunNode]:
    """Nodes for all vertices of a machine, by path; those in `known` are reused."""
    nodes: dict[str, RunNode] = {}

    def grow(vertex: Vertex, parent: BoxNode | None) -> list[RunNode]:
        node = known.get(vertex.path)
        if node is None:
            node = LeafNode(vertex) if isinstance(vertex, Leaf) else BoxNode()
        node.bind(vertex, parent)
        nodes[node.path] = node
        timed = [node] if vertex.timeout_ns is not None else []
        if parent is not None:
            parent.children[vertex.name] = node
        if isinstance(vertex, Box):
            assert isinstance(node, BoxNode)
            for child in vertex.children:
                timed += grow(child, node)
        node.timed = tuple(sorted(timed, key=attrgetter("depth", "order")))
        return timed

    grow(machine.root, None)
    return nodes


class Route:
    """What follows when `cause` ends with the outcome `came`.

    Attributes:
        kind: `GO` to `target`, `KEEP` the outcome in its box, `ASK` until the operator consents,
            `RETRY`, `REOPEN` a box for its further try, or `FINISH` the run.
        top: the outermost node that ends, or tries again, or waits.
        outcome: what `top` ends with.
        box: the container of the transition; None at the end of the run.
        ends: the nodes that end with it and their outcomes, inner ones first.
        writes: outputs that come with it.
        joined: where a list of `top` matches: the routes whose outcomes it keeps in this round.
    """

    __slots__ = (
        "box", "came", "cause", "ends", "joined", "kind", "outcome", "target", "top", "writes",
    )  # fmt: skip

    def __init__(self, kind: int, cause: RunNode, came: str, top: RunNode, outcome: str) -> None:
        self.kind = kind
        self.cause = cause
        self.came = came
        self.top = top
        self.outcome = outcome
        self.box = top.parent
        self.target: RunNode | None = None
        self.ends: list[tuple[RunNode, str]] = []
        self.writes: Writes = ()
        self.joined: tuple[Route, ...] = ()

    def precedence(self) -> tuple[int, int, int]:
        """Sort key of rule 4 (c), among the guards of one container: the smallest is taken."""
        return -self.cause.vertex.priority, self._depth(), self.cause.order

    def rank(self) -> tuple[int, int, int]:
        """Sort key of rule 4 (d), among all that is left: outer transition, then outer monitor."""
        return self._depth(), self.cause.depth, self.cause.order

    def _depth(self) -> int:
        return -1 if self.box is None else self.box.depth
