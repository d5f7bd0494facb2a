"""Where the end of a node leads (rules 4, 8, 11 and 12); nothing is carried out here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from engine.machine.node import (
    ASK,
    FINISH,
    GO,
    KEEP,
    REOPEN,
    RETRY,
    BoxNode,
    LeafNode,
    Route,
    RunNode,
    Token,
    Writes,
)
from engine.machine.outputs import checked, shown

RAISED = Token("raised")
MATCHED = Token("matched")
GRANTED = Token("granted")
REFUSED = Token("refused")
AGAIN = Token("again")


class UndeclaredOutcome(Exception):
    """A state returned an outcome, or outputs, that its class does not declare."""


class Judge:
    """Resolves the outcomes of one run into routes.

    Attributes:
        level: the operator's autonomy level; `None`: no outcome waits for consent, unless locked.
        locks: paths in which every outcome waits for consent.

    Routes are cached in the nodes. They depend on level and locks, so every change of these has to
    clear the caches (`ChartRun.forget_routes`).
    """

    def __init__(
        self,
        level: int | None,
        freezers: Mapping[type, Callable[[Any], Any]],
        report: Callable[[RunNode, BaseException], None],
    ) -> None:
        self.level = level
        self.locks: set[str] = set()
        self.freezers = freezers
        self._report = report

    def conclude(self, node: RunNode, value: Any) -> Route:
        """The route that follows from the value, or the token, that a step has ended with."""
        if type(value) is str:
            known = node.routes.get(value)
            if known is not None:
                return known
        if type(value) is Token:
            return self._follow(node, value)
        assert isinstance(node, LeafNode)
        try:
            outcome, writes = self._result(node, value)
        except BaseException as error:  # noqa: BLE001  rule 8: whatever it returned
            self._report(node, error)
            outcome, writes = "error", ()
        route = self.resolve(node, outcome)
        route.writes = writes
        if type(value) is not str or outcome != value:
            return route
        if not any(end.vertex.retry for end, _ in route.ends):
            node.routes[outcome] = route  # with `retry`, it would depend on the tries made
        return route

    def _follow(self, node: RunNode, token: Token) -> Route:
        if token is RAISED:
            return self.resolve(node, "error")
        if token is MATCHED:
            assert isinstance(node, BoxNode)
            outcome = node.box.match(node.kept)
            assert outcome is not None
            return self.resolve(node, outcome)
        if token is GRANTED:
            outcome, writes = node.waiting
            route = self.resolve(node, outcome, ended=True, free=True)
            route.writes = writes
            return route
        return Route(RETRY if token is REFUSED else REOPEN, node, "", node, "")

    def _result(self, node: LeafNode, value: Any) -> tuple[str, Writes]:
        given: Mapping[str, Any] = {}
        if type(value) is tuple and len(value) == 2:
            value, given = value
        if isinstance(value, str):
            value = str.__str__(value)  # a member of a StrEnum counts as its text
        declared = node.interface.outcomes
        if type(value) is not str or value not in declared:
            right = f"declared: {', '.join(declared)}" if declared else "it declares no `outcomes`"
            raise UndeclaredOutcome(f"{node.path} returned {shown(value)}; {right}")
        produced = node.produces.get(value, {})
        if not isinstance(given, Mapping) or set(given) != set(produced):
            came = list(given) if isinstance(given, Mapping) else f"a {type(given).__name__}"
            raise UndeclaredOutcome(f"{value!r} came with {came}, declared: {list(produced)}")
        if not produced:
            return value, ()
        frozen = checked(given, produced, self.freezers)
        return value, tuple((cell, frozen[name]) for name, cell in node.leaf.outputs[value])

    def resolve(
        self, node: RunNode, outcome: str, *, ended: bool = False, free: bool = False
    ) -> Route:
        """Follow `outcome` outwards until it is kept, held, retried, ends the run, or leads on.

        `ended`: the end of the node itself is recorded already; it neither waits nor tries again.
        `free`: no lock holds the outcome on its way out; see `must_ask`.
        """
        cause, came = node, outcome
        free = free or node.guard or outcome in ("error", "timeout")
        ends: list[tuple[RunNode, str]] = []
        while True:
            kind, target = FINISH, None
            if not ended:
                ends.append((node, outcome))
                retry = node.vertex.retry
                if retry and outcome in retry[1] and node.tries < retry[0]:
                    kind = RETRY
                elif (self.locks or self.level is not None) and self.must_ask(node, outcome, free):
                    kind = ASK
            ended = False
            parent = node.parent
            if kind == FINISH and parent is not None:
                vertex = node.vertex
                up = vertex.leave.get(outcome)
                if outcome in vertex.go:
                    kind, target = GO, parent.children[vertex.go[outcome].name]
                elif up is None and parent.box.keeps:
                    kind = KEEP
                else:
                    node, outcome = parent, up or outcome
                    continue
            route = Route(kind, cause, came, node, outcome)
            route.ends, route.target = ends, target
            return route

    def must_ask(self, node: RunNode, outcome: str, free: bool = False) -> bool:
        """Whether the operator has to consent first, by autonomy level (rule 12) or lock.

        `free`: no lock holds the outcome, because it began as an error, a timeout or a guard's
        outcome, under whatever name it goes on, or because of a consent given further inside.
        """
        if node.guard or outcome in ("error", "timeout"):
            return False
        if self.level is not None and node.vertex.autonomy.get(outcome, -1) >= self.level:
            return True
        return not free and any(_inside(node.path, lock) for lock in self.locks)

    def match(self, box: BoxNode, keeping: list[Route]) -> Route | None:
        """How `box` ends if these outcomes of its children are kept, too; None: it goes on.

        The route competes as the best of its causes: the outermost, then the one of the highest
        priority if they are guards of `box` itself, then the first in document order.
        """
        keeping = sorted(keeping, key=lambda route: route.top.order)
        kept = box.kept | {route.top.vertex.name: route.outcome for route in keeping}
        outcome = box.box.match(kept)
        if outcome is None:
            return None
        ending = self.resolve(box, outcome, free=any(route.cause.guard for route in keeping))
        best = min(keeping, key=lambda route: _as_cause(route.cause, box))
        ending.cause, ending.came = best.cause, best.came
        ending.joined = tuple(keeping)
        ending.ends = [end for route in keeping for end in route.ends] + ending.ends
        return ending


def _as_cause(cause: RunNode, box: BoxNode) -> tuple[int, int, int]:
    priority = cause.vertex.priority if cause.parent is box else 0
    return cause.depth, -priority, cause.order


def _inside(path: str, lock: str) -> bool:
    return lock in ("", path) or path.startswith(lock + "/")
