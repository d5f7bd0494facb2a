"""Rule 4: which of the outcomes that coincide in one round are taken, and which are lost."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from operator import attrgetter

from engine.machine.deciding import Judge
from engine.machine.node import KEEP, BoxNode, Route, RunNode


@dataclass(slots=True)
class _Rivals:
    """Routes that compete in one container: its guards end it, or children's outcomes are kept."""

    ending: list[Route] = field(default_factory=list)
    keeping: dict[RunNode, Route] = field(default_factory=dict)  # by the child that ends


@dataclass(slots=True)
class Contest:
    """Sorts the routes of one round into winners, in the order they are taken, and losers.

    `due` are the nodes whose timeout has expired. A guard that ends a due node wins over the
    timeout; one whose transition stays inside that node loses (rule 5).
    """

    judge: Judge
    due: list[RunNode]
    winners: list[Route] = field(default_factory=list)
    losers: list[Route] = field(default_factory=list)
    _left: list[Route] = field(default_factory=list)  # for step (d) of rule 4
    _rivals: defaultdict[BoxNode, _Rivals] = field(default_factory=lambda: defaultdict(_Rivals))

    def settle(self, routes: Iterable[Route]) -> None:
        """Let the routes compete, innermost containers first."""
        for route in routes:
            container = route.cause.parent
            if route.cause.guard and route.top is not route.cause and container:
                self._rivals[container].ending.append(route)
            else:
                self._pass_on(route)
        while self._rivals:
            box = max(self._rivals, key=attrgetter("depth"))
            self._settle_in(box, self._rivals.pop(box))
        for route in sorted(self._left, key=Route.rank):
            closed = any(winner.top.spans(route.cause) for winner in self.winners)
            lost = closed or self._is_inside_due(route)
            (self.losers if lost else self.winners).append(route)

    def _settle_in(self, box: BoxNode, here: _Rivals) -> None:
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

    def _pass_on(self, route: Route) -> None:
        """Let a route compete in the box that would keep its outcome; others go to step (d)."""
        if route.kind != KEEP or route.box is None:
            self._left.append(route)
            return
        keeping = self._rivals[route.box].keeping
        other = keeping.setdefault(route.top, route)
        if other is not route:
            keeping[route.top] = min(other, route, key=Route.rank)
            self.losers.append(max(other, route, key=Route.rank))

    def _is_inside_due(self, route: Route) -> bool:
        return route.box is not None and any(node.spans(route.box) for node in self.due)
