"""Where the end of a state leads (rules 4, 8, 11 and 12); nothing is carried out here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from engine.machine import Box, Cell, Leaf, Vertex
from engine.outputs import checked

Writes = tuple[tuple[Cell, Any], ...]


class Token:
    """What a step that is no generator's can end with."""

    def __init__(self, name: str) -> None:
        self.name = name


RAISED = Token("raised")
MATCHED = Token("matched")
GRANTED = Token("granted")
REFUSED = Token("refused")
AGAIN = Token("again")

GO, KEEP, HOLD, RETRY, REOPEN, FINISH = range(6)


class Decision:
    """Where the end of `cause` leads: `ends` are the vertices that end with it, inside out."""

    __slots__ = ("box", "cause", "ends", "kind", "outcome", "target", "top", "writes")

    def __init__(self, kind: int, cause: Vertex, top: Vertex, outcome: str) -> None:
        self.kind = kind
        self.cause = cause
        self.top = top
        self.outcome = outcome
        self.box = top.parent
        self.target: Vertex | None = None
        self.ends: list[tuple[Vertex, str]] = []
        self.writes: Writes = ()

    def precedence(self) -> tuple[int, int, int]:
        """Rule 4 (c), between the guards of one container: smaller goes first."""
        return -self.cause.priority, self._depth(), self.cause.order

    def rank(self) -> tuple[int, int, int]:
        """Rule 4 (d), between all that is left: the outer transition, then the outer monitor."""
        return self._depth(), self.cause.depth, self.cause.order

    def _depth(self) -> int:
        return -1 if self.box is None else self.box.depth


class UndeclaredOutcome(Exception):
    """A state returned something that its class does not declare."""


class Judge:
    """Follows outcomes to what they lead to, for one run.

    Attributes:
        level: the operator's autonomy level; `None` means that nobody is asked.
        locks: paths in which every outcome waits for consent.
    """

    def __init__(
        self,
        level: int | None,
        freezers: Mapping[type, Callable[[Any], Any]],
        report: Callable[[Vertex, BaseException], Token],
    ) -> None:
        self.level = level
        self.locks: set[str] = set()
        self.freezers = freezers
        self._report = report

    def conclude(self, vertex: Vertex, value: Any) -> Decision:
        """What follows from the end of one step."""
        if type(value) is str and value in vertex.routes:
            route: Decision = vertex.routes[value]
            return route
        if type(value) is Token:
            return self._conclude_token(vertex, value)
        assert isinstance(vertex, Leaf)
        try:
            outcome, writes = self._result(vertex, value)
        except BaseException as error:  # noqa: BLE001  rule 8: whatever it returned
            self._report(vertex, error)
            outcome, writes = "error", ()
        decision = self.resolve(vertex, outcome)
        decision.writes = writes
        if outcome == value and not self._asking() and not any(v.retry for v, _ in decision.ends):
            vertex.routes[outcome] = decision
        return decision

    def _asking(self) -> bool:
        """Whether an outcome may have to wait for somebody."""
        return self.level is not None or bool(self.locks)

    def _conclude_token(self, vertex: Vertex, token: Token) -> Decision:
        if token is RAISED:
            return self.resolve(vertex, "error")
        if token is MATCHED:
            assert isinstance(vertex, Box)
            outcome = vertex.match(vertex.kept)
            assert outcome is not None
            return self.resolve(vertex, outcome)
        if token is GRANTED:
            outcome, writes = vertex.waiting
            decision = self.resolve(vertex, outcome, ended=True)
            decision.writes = writes
            return decision
        if token is REFUSED:
            return Decision(RETRY, vertex, vertex, "")
        return Decision(REOPEN, vertex, vertex, "")

    def _result(self, leaf: Leaf, value: Any) -> tuple[str, Writes]:
        given: Mapping[str, Any] = {}
        if type(value) is tuple and len(value) == 2:
            value, given = value
        if isinstance(value, str):
            value = str.__str__(value)  # a member of a StrEnum counts as its text
        if value not in leaf.interface.outcomes:
            declared = ", ".join(leaf.interface.outcomes)
            raise UndeclaredOutcome(f"{leaf.path} returned {value!r}; declared: {declared}")
        produced = leaf.produces.get(value, {})
        if not isinstance(given, Mapping) or set(given) != set(produced):
            came = list(given) if isinstance(given, Mapping) else f"a {type(given).__name__}"
            raise UndeclaredOutcome(f"{value!r} came with {came}, declared: {list(produced)}")
        if not produced:
            return value, ()
        frozen = checked(given, produced, self.freezers)
        return value, tuple((cell, frozen[name]) for name, cell in leaf.outputs[value])

    def resolve(
        self, vertex: Vertex, outcome: str, *, ended: bool = False, guarded: bool = False
    ) -> Decision:
        """Follow `outcome` outwards to the one thing that it leads to.

        `ended`: the vertex itself has already been recorded and may neither wait nor try again.
        `guarded`: a guard has led to this, so that no lock holds it up; see `must_ask`.
        """
        cause, asking = vertex, self._asking()
        free = guarded or vertex.guard or outcome in ("error", "timeout")
        ends: list[tuple[Vertex, str]] = []
        while True:
            kind = FINISH
            target = None
            if not ended:
                ends.append((vertex, outcome))
                if vertex.retry and outcome in vertex.retry[1] and vertex.tries < vertex.retry[0]:
                    kind = RETRY
                elif asking and self.must_ask(vertex, outcome, free=free):
                    kind = HOLD
            ended = False
            parent = vertex.parent
            if kind == FINISH and parent is not None:
                target = vertex.go.get(outcome)
                up = vertex.leave.get(outcome)
                if target is not None:
                    kind = GO
                elif up is None and parent.keeps:
                    kind = KEEP
                else:
                    vertex, outcome = parent, up or outcome
                    continue
            decision = Decision(kind, cause, vertex, outcome)
            decision.ends = ends
            decision.target = target
            return decision

    def must_ask(self, vertex: Vertex, outcome: str, *, free: bool = False) -> bool:
        """Rule 12, and locks: whether somebody has to consent first.

        `free`: it began with an error, a timeout or a guard, and locks hold none of these on their
        way out, whatever they are called there.
        """
        if vertex.guard or outcome in ("error", "timeout"):
            return False
        if self.level is not None and vertex.autonomy.get(outcome, -1) >= self.level:
            return True
        return not free and any(_inside(vertex.path, lock) for lock in self.locks)

    def match(self, box: Box, keeping: list[Decision]) -> Decision | None:
        """How `box` ends if these outcomes of its children are kept, too; None: it goes on.

        It competes as the best of its causes: the outermost, by priority where these are its own
        guards.
        """
        outcome = box.match(box.kept | {k.top: k.outcome for k in keeping})
        if outcome is None:
            return None
        keeping = sorted(keeping, key=lambda k: k.top.order)
        causes = [k.cause for k in keeping]
        ending = self.resolve(box, outcome, guarded=any(cause.guard for cause in causes))
        ending.cause = min(
            causes, key=lambda c: (c.depth, -c.priority if c.parent is box else 0, c.order)
        )
        for k in keeping:
            k.top.pending = k.writes
            box.kept[k.top] = k.outcome
        ending.ends = [end for k in keeping for end in k.ends] + ending.ends
        return ending


def _inside(path: str, lock: str) -> bool:
    return lock in ("", path) or path.startswith(lock + "/")
