"""Rule 4: which of the outcomes that come together in one round are taken, and which are lost."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from operator import attrgetter

from engine.decide import KEEP, Decision, Judge
from engine.machine import Box, Vertex


@dataclass(slots=True)
class _Rivals:
    """What is to happen in one container: its guards end it, or outcomes of children are kept."""

    ending: list[Decision] = field(default_factory=list)
    keeping: dict[Vertex, Decision] = field(default_factory=dict)  # by the child that ends


@dataclass(slots=True)
class Contest:
    """Sorts the decisions of one round into winners, in the order they are taken, and losers.

    `due` are the nodes whose timeout has come. A guard that ends a due node wins over the timeout;
    one that only hands over inside it loses (rule 5).
    """

    judge: Judge
    due: list[Vertex]
    winners: list[Decision] = field(default_factory=list)
    losers: list[Decision] = field(default_factory=list)
    _left: list[Decision] = field(default_factory=list)  # for the last step, (d)
    _rivals: defaultdict[Box, _Rivals] = field(default_factory=lambda: defaultdict(_Rivals))

    def hold(self, decisions: Iterable[Decision]) -> None:
        """Let the decisions compete, innermost containers first."""
        for decision in decisions:
            container = decision.cause.parent
            if decision.cause.guard and decision.top is not decision.cause and container:
                self._rivals[container].ending.append(decision)
            else:
                self._pass_on(decision)
        while self._rivals:
            box = max(self._rivals, key=attrgetter("depth"))
            self._settle(box, self._rivals.pop(box))
        for decision in sorted(self._left, key=Decision.rank):
            closed = any(winner.top.holds(decision.cause) for winner in self.winners)
            lost = closed or self._is_inside_due(decision)
            (self.losers if lost else self.winners).append(decision)

    def _settle(self, box: Box, here: _Rivals) -> None:
        """Rule 4 (b) and (c) in one container."""
        keeping = list(here.keeping.values())
        matched = self.judge.match(box, keeping) if keeping else None
        if matched is None:
            self._left += keeping
        elif matched.cause.guard and matched.cause.parent is box:
            here.ending.append(matched)
        else:
            self._pass_on(matched)
        if here.ending:
            here.ending.sort(key=lambda d: (self._is_inside_due(d), *d.precedence()))
            self._pass_on(here.ending[0])
            self.losers += here.ending[1:]

    def _pass_on(self, decision: Decision) -> None:
        """Let a decision compete where it leads to."""
        if decision.kind != KEEP or decision.box is None:
            self._left.append(decision)
            return
        keeping = self._rivals[decision.box].keeping
        other = keeping.setdefault(decision.top, decision)
        if other is not decision:
            keeping[decision.top] = min(other, decision, key=Decision.rank)
            self.losers.append(max(other, decision, key=Decision.rank))

    def _is_inside_due(self, decision: Decision) -> bool:
        return decision.box is not None and any(node.holds(decision.box) for node in self.due)
