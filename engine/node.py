"""What one run knows of the vertices of its machine: the state of each node.

A chart never changes while it runs; all that does stands here. Numbers that are needed in every
tick are copied from the vertex.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from engine.machine import Box, Cell, Leaf, Machine, Vertex
from engine.state import NEVER_NS, On, State
from engine.types import Type

if TYPE_CHECKING:
    from engine.context import LeafContext
    from engine.decide import Route, Token

IDLE, CHOSEN, RUNNING, ENDED, WAITING, RETRYING, PUT_OFF = range(7)
"""A node is idle; chosen, to be stepped; running; or it has ended in a box that keeps outcomes. It
may wait for consent or for its next try, or be put off to the next tick (rule 6)."""

Writes = tuple[tuple[Cell, Any], ...]
NEVER_ENTERED = -1


class Substitute(NamedTuple):
    """What runs in place of a leaf's state: makes it, and the types of its outputs."""

    make: Callable[..., State]
    outputs: Mapping[str, Mapping[str, Type]]


class RunNode:
    """The run state that leaves and boxes share.

    Attributes:
        step: the `__next__` of the generator; None where the engine has the next step itself.
        wake: not stepped before this chart time, ns, nor before news of `mask`; 0: at every tick.
        asked: the tick in which it began to wait for what `mask` says.
        silence: what it waits to fall silent, and since which instant of the run, ns.
        entered: the tick in which it was last entered.
        since: chart time of its first entry since it was chosen, ns; `timeout` counts from there.
        tries: further tries made, refusals aside.
        put_off: the last tick in which it was put off, and in how many running.
        waiting: the outcome that waits for consent, and its outputs.
        pending: outputs of an outcome that is kept, to be written when the box ends.
        timed: the nodes with a timeout from here on downwards, outer ones first.
        routes: where outcomes lead, once found out.
    """

    __slots__ = (
        "answer", "asked", "deadline", "depth", "entered", "guard", "last", "mask", "monitor",
        "opening", "order", "parent", "path", "pending", "put_off", "routes", "silence", "since",
        "status", "step", "timed", "tries", "turn", "vertex", "waiting", "wake",
    )  # fmt: skip

    def __init__(self) -> None:
        self.status = IDLE
        self.step: Callable[[], Any] | None = None
        self.wake = 0
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
        """Stand for this vertex from now on; a replacement of the chart gives another one."""
        self.vertex = vertex
        self.parent = parent
        self.path = vertex.path
        self.order, self.last, self.turn = vertex.order, vertex.last, vertex.turn
        self.depth = vertex.depth
        self.monitor, self.guard = vertex.monitor, vertex.guard
        self.timed: tuple[RunNode, ...] = ()
        self.routes: dict[str, Route] = {}
        self.opening: Opening | None = None

    def holds(self, other: RunNode) -> bool:
        """Whether `other` is this node or stands below it."""
        return self.order <= other.order <= self.last

    def __repr__(self) -> str:
        return f"<{self.path or '(top)'}>"


class LeafNode(RunNode):
    """The run state of a leaf; `make` and `produces` may be a stand-in's."""

    __slots__ = ("context", "generator", "interface", "leaf", "listens", "make", "produces")

    def __init__(self, leaf: Leaf) -> None:
        super().__init__()
        self.make: Callable[..., State] = leaf.interface.make
        self.produces: Mapping[str, Mapping[str, Type]] = leaf.interface.outputs
        self.generator: Generator[Any, None, Any] | None = None
        self.context: LeafContext
        self.listens = bool(leaf.interface.reads)

    def bind(self, vertex: Vertex, parent: BoxNode | None) -> None:
        """Stand for this leaf from now on."""
        super().bind(vertex, parent)
        assert isinstance(vertex, Leaf)
        self.leaf = vertex
        self.interface = vertex.interface


class BoxNode(RunNode):
    """The run state of a box: the outcomes of its children that it keeps, by their names.

    `news`: one was kept since its rules were last looked at.
    """

    __slots__ = ("box", "children", "kept", "news")

    def __init__(self) -> None:
        super().__init__()
        self.children: dict[str, RunNode] = {}
        self.kept: dict[str, str] = {}
        self.news = False

    def bind(self, vertex: Vertex, parent: BoxNode | None) -> None:
        """Stand for this box from now on."""
        super().bind(vertex, parent)
        assert isinstance(vertex, Box)
        self.box = vertex
        self.children = {}


class Opening(NamedTuple):
    """What starts together when a node is chosen."""

    nodes: tuple[RunNode, ...]  # all that take part
    queued: tuple[RunNode, ...]  # leaves, and boxes that keep outcomes, in the order of stepping
    monitors: tuple[RunNode, ...]  # of `queued`
    keeping: tuple[BoxNode, ...]  # of `queued`


def opening_of(node: RunNode) -> Opening:
    """What starts with a node, found once."""
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
    """Nodes for all vertices of a machine, by path; those in `known` are taken over."""
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
