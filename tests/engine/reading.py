"""A second reading of DESIGN 4: the rules of a tick once more, slow and plain.

Written from the text of the rules (engine/README.md) for comparison with `engine.run.chart_run`,
with which it shares no code: it takes charts as plain mappings, keeps no lists of turns, caches
nothing, and finds everything anew by walking the tree. Leaves end as a script says. Data, locks,
consent and signals are not modelled.

Every record carries the number of the rule that it follows from, so that a difference can be
reported with its rule. A node that is put off has a record here, though not in the engine's trace.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

HZ = 10
RAISES = "raises"
"""What a script gives for a leaf that is to raise."""
BUSY = 3
"""Put off in more than so many ticks running is a busy loop."""


class Entry(NamedTuple):
    """One record of a trace, and the rule it follows from."""

    tick: int
    record: tuple[str, ...]
    rule: int


@dataclass(eq=False)
class Item:
    """A node of a chart, and what a run knows about it."""

    path: str
    name: str
    form: str  # do, watch, states, any, all
    parent: Item | None
    next: Mapping[str, str] = field(default_factory=dict)
    priority: int = 0
    timeout: int | None = None  # ns
    tries_allowed: int = 0
    tries_on: tuple[str, ...] = ()
    tries_wait: int = 0  # ns
    keeps: bool = False
    breaks: bool = False
    rules: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    children: list[Item] = field(default_factory=list)
    order: int = 0
    # of the run
    chosen: bool = False  # to be stepped for the first time
    running: bool = False
    retry_at: int | None = None
    deadline: int | None = None
    tries: int = 0
    entered_in: int = -1
    put_off_in: tuple[int, int] = (-1, 0)  # last tick, and how many running
    kept: str | None = None  # the outcome that `when` or `all` keeps
    looks: bool = False  # an outcome of a child was kept since the rules were looked at

    @property
    def leaf(self) -> bool:
        return self.form in ("do", "watch")

    @property
    def depth(self) -> int:
        return 0 if self.parent is None else self.parent.depth + 1

    @property
    def guard(self) -> bool:
        return self.form == "watch" and self.parent is not None and self.parent.form != "states"

    def walk(self) -> Iterator[Item]:
        """This node and all below, in document order."""
        yield self
        for child in self.children:
            yield from child.walk()

    def holds(self, other: Item | None) -> bool:
        """Whether `other` is this node or is somewhere in it."""
        while other is not None and other is not self:
            other = other.parent
        return other is self

    def starts(self) -> list[Item]:
        """The children that begin with this container."""
        return self.children[:1] if self.form == "states" else self.children


@dataclass
class Route:
    """Where the end of `cause` leads.

    Attributes:
        cause: the leaf that ended; of a list that matches, the best of its causes.
        ends: nodes that end by it with their outcomes, inside out.
        top: the last of them.
        kind: go, keep, retry or finish.
    """

    cause: Item
    ends: list[tuple[Item, str]]
    top: Item
    outcome: str
    kind: str
    target: str = ""

    @property
    def place(self) -> int:
        """Depth of the container that the transition is in; -1 for the end of the chart."""
        return self.top.depth - 1


class Reading:
    """One run of a chart by the rules.

    Args:
        chart: as in a chart file, as plain values.
        library: charts it uses, by name.

    Attributes:
        entries: what has happened.
        ties: rounds in which three or more guards of one container would have ended it.
    """

    def __init__(self, chart: Mapping[str, Any], library: Mapping[str, Mapping[str, Any]]) -> None:
        self.library = library
        self.root = self._item(chart, "", "", None)
        for order, item in enumerate(self.root.walk()):
            item.order = order
        self.entries: list[Entry] = []
        self.started: list[Item] = []  # entered and not left, in the order of their start
        self.put_off: list[Item] = [self.root]
        self.in_place: list[Item] = []  # chosen by the action pass and not yet begun
        self.script: dict[str, list[str]] = {}
        self.number = -1
        self.now = 0
        self.acting = False
        self.outcome: str | None = None
        self.ties = 0

    def _item(self, node: Mapping[str, Any], name: str, path: str, parent: Item | None) -> Item:
        inner = self.library[node["use"]] if "use" in node else node
        form = next(f for f in ("do", "watch", "states", "any", "all") if f in inner)
        item = Item(path, name, form, parent, node.get("next", {}), node.get("priority", 0))
        item.timeout = nanoseconds(node["timeout"]) if "timeout" in node else None
        item.breaks = node.get("break", False)
        if retry := node.get("retry"):
            item.tries_allowed, item.tries_on = retry["times"], tuple(retry["on"])
            item.tries_wait = nanoseconds(retry["wait"])
        if item.leaf:
            return item
        item.keeps = form == "all" or "when" in inner
        item.rules = [(rule["outcome"], rule["if"]) for rule in inner.get("when", [])]
        for key, child in inner[form].items():
            item.children.append(self._item(child, key, f"{path}/{key}".lstrip("/"), item))
        return item

    # -- rule 3: the phases of a tick --------------------------------------------------------------

    def tick(self, ends: Mapping[str, str]) -> None:
        """One tick; `ends`: how leaves end at their next step, added to what was said before."""
        for path, outcome in ends.items():
            self.script.setdefault(path, []).append(outcome)
        self.number += 1
        if self.outcome is not None or not self.begin(self.number * 10**9 // HZ):
            return
        put_off, self.put_off = self.put_off, []
        for item in put_off:
            self.choose(item)
        self.monitor_pass([m for m in self.monitors(self.root) if self.has_turn(m)])
        self.time_out()
        self.action_pass()

    def begin(self, now: int) -> bool:
        """The operator's commands (`tests.engine.operated`); False: the tick ends with them."""
        self.now = now
        return True

    def monitors(self, box: Item) -> Iterator[Item]:
        """Rule 3: a container's own monitors, then those of the containers in it."""
        yield from (child for child in box.children if child.form == "watch")
        for child in box.children:
            yield from self.monitors(child)

    def actions(self) -> list[Item]:
        """Rule 4: actions in document order, containers behind what is in them."""
        found = []

        def visit(item: Item) -> None:
            for child in item.children:
                visit(child)
            if item.form != "watch":
                found.append(item)

        visit(self.root)
        return found

    def has_turn(self, item: Item) -> bool:
        """Whether a leaf is to be stepped now."""
        return item.chosen or item.running or (item.retry_at or self.now + 1) <= self.now

    def monitor_pass(self, monitors: list[Item]) -> None:
        """Step all of them, decide, and again for those that are chosen thereby."""
        while monitors:
            ended = [(m, outcome) for m in monitors if (outcome := self.step(m)) is not None]
            if ended:
                self.decide(ended)
            monitors = [m for m in self.monitors(self.root) if m.chosen]

    def action_pass(self) -> None:
        self.acting = True
        for item in [a for a in self.actions() if not a.leaf or self.has_turn(a)]:
            if not item.leaf or (self.has_turn(item) and item.entered_in != self.number):
                self.act(item)
                self.begin_in_place()
        self.acting = False

    def begin_in_place(self) -> None:
        """Rule 6: what the action pass chooses is stepped in place, monitors first."""
        while True:
            if fresh := [m for m in self.monitors(self.root) if m.chosen]:
                self.monitor_pass(fresh)
                continue
            waiting = [a for a in self.actions() if a in self.in_place]
            if not waiting:
                return
            self.in_place.remove(waiting[0])
            self.act(waiting[0])

    def act(self, item: Item) -> None:
        """The turn of an action; of a container, to be tried again or to look at its rules."""
        if item.leaf:
            outcome = self.step(item)
            if outcome is not None:
                self.take(self.route(item, outcome))
        elif item.retry_at is not None:
            if item.retry_at <= self.now:
                item.retry_at = None
                tries = item.tries
                self.choose(item, again=True)
                item.tries = tries
        elif item.looks:
            item.looks = False
            kept = {child.name: child.kept for child in item.children if child.kept is not None}
            outcome = self.match(item, kept)
            if outcome is not None:
                self.take(self.route(item, outcome))

    # -- stepping and entering ---------------------------------------------------------------------

    def step(self, leaf: Item) -> str | None:
        """Step a leaf; its outcome if it ends."""
        if not leaf.running:
            leaf.chosen, leaf.retry_at = False, None
            self.enter(leaf)
        ends = self.script.get(leaf.path)
        outcome = ends.pop(0) if ends else None
        if outcome == RAISES:
            self.record(8, "error", leaf.path, "RuntimeError")
            return "error"
        return outcome

    def enter(self, item: Item) -> None:
        """Rule 7: a container is entered with the first step of its first leaf."""
        if item.parent is not None and not item.parent.running:
            self.enter(item.parent)
        item.running, item.entered_in = True, self.number
        self.started.append(item)
        self.record(7, "enter", item.path)
        if item.timeout is not None and item.deadline is None:
            item.deadline = self.now + item.timeout

    def choose(self, item: Item, *, again: bool = False) -> None:
        """Rule 6: make it the next to be stepped; put it off if it was entered in this tick."""
        if item.entered_in == self.number and not again:
            last, running = item.put_off_in
            running = running + 1 if last == self.number - 1 else 1
            item.put_off_in = self.number, running
            self.put_off.append(item)
            self.record(6, "put off", item.path)
            if running > BUSY:
                self.record(6, "note", item.path, "busy-loop")
            return
        item.tries, item.kept = 0, None
        if item.leaf:
            item.chosen = True
            if self.acting and item.form == "do":
                self.in_place.append(item)
            return
        item.looks = False
        for child in item.children:
            child.kept = None
        for child in item.starts():
            self.choose(child)
        if self.acting and item.keeps:
            self.in_place.append(item)

    # -- rule 4: deciding --------------------------------------------------------------------------

    def route(self, item: Item, outcome: str, *, ended: bool = False) -> Route:
        """Follow an outcome to its one transition; `ended`: its own end is already recorded."""
        cause, ends = item, []
        while True:
            if not ended:
                ends.append((item, outcome))
                if outcome in item.tries_on and item.tries < item.tries_allowed:
                    return Route(cause, ends, item, outcome, "retry")
            ended = False
            if item.parent is None:
                return Route(cause, ends, item, outcome, "finish")
            target = item.next.get(outcome)
            if target is None and item.parent.keeps:
                return Route(cause, ends, item, outcome, "keep")
            if target is not None and not target.startswith("."):
                return Route(cause, ends, item, outcome, "go", target)
            outcome = outcome if target is None else target[1:]
            item = item.parent

    def match(self, box: Item, kept: Mapping[str, str]) -> str | None:
        """An error first, then the list; `all` alone ends when all have ended."""
        if "error" in kept.values():
            return "error"
        for outcome, conditions in box.rules:
            if all(kept.get(name) == wanted for name, wanted in conditions.items()):
                return outcome
        if box.form == "all" and not box.rules and len(kept) == len(box.children):
            return "done"
        return None

    def decide(self, ended: list[tuple[Item, str]]) -> None:
        """Rule 4, for monitors that ended in one pass."""
        routes = [self.route(item, outcome) for item, outcome in ended]
        due = [] if self.acting else self.due()
        lost: list[Route] = []
        containers = [item for item in self.root.walk() if not item.leaf]
        for box in sorted(containers, key=lambda box: (-box.depth, box.order)):
            matched = self.looked_at(box, routes)
            out = self.outdone(box, routes, matched, due)
            lost += out
            routes = [route for route in routes if route not in out]
        winners: list[Route] = []
        for route in sorted(routes, key=self.rank):
            closed = any(winner.top.holds(route.cause) for winner in winners)
            (lost if closed or self.forbidden(route, due) else winners).append(route)
        self.lose(lost, due)
        for route in winners:
            self.take(route)

    def outdone(
        self, box: Item, routes: list[Route], matched: Route | None, due: list[Item]
    ) -> list[Route]:
        """Rule 4 (c): of the routes by which guards of a container end it, all but the first."""
        rivals = [
            route for route in routes if route.cause.parent is box and self.competes(route, box)
        ]
        if len([route for route in rivals if route is not matched]) >= 3:
            self.ties += 1
        free = [route for route in rivals if not self.forbidden(route, due)]
        stays = min(free or rivals, key=self.rank_in_container, default=None)
        return [route for route in rivals if route is not stays]

    def looked_at(self, box: Item, routes: list[Route]) -> Route | None:
        """Rule 4 (b): if the list matches with what is kept now, one route in place of these."""
        kept: dict[str, Route] = {}
        for route in sorted(routes, key=self.rank):
            if route.kind == "keep" and route.top.parent is box:
                kept.setdefault(route.top.name, route)
        if not kept:
            return None
        before = {child.name: child.kept for child in box.children if child.kept is not None}
        outcome = self.match(box, before | {name: route.outcome for name, route in kept.items()})
        if outcome is None:
            return None
        found = self.route(box, outcome)
        joined = sorted(kept.values(), key=lambda route: route.top.order)
        found.cause = min(
            (route.cause for route in joined), key=lambda cause: self.best(cause, box)
        )
        found.ends = [end for route in joined for end in route.ends] + found.ends
        for route in kept.values():
            routes.remove(route)
        routes.append(found)
        return found

    def best(self, cause: Item, box: Item) -> tuple[int, ...]:
        """Of the causes of a list: its own guards first, by priority, then the outer ones."""
        return cause.depth, -cause.priority if cause.parent is box else 0, cause.order

    def competes(self, route: Route, box: Item) -> bool:
        """Whether it is a route of one of the container's guards that ends the container."""
        return route.cause.guard and route.top.holds(box)

    def rank_in_container(self, route: Route) -> tuple[int, ...]:
        """Rule 4 (c)."""
        return -route.cause.priority, route.place, route.cause.order

    def rank(self, route: Route) -> tuple[int, ...]:
        """Rule 4 (d)."""
        return route.place, route.cause.depth, route.cause.order

    def forbidden(self, route: Route, due: list[Item]) -> bool:
        """Rule 5: it only hands over inside a node that is due."""
        return any(item.holds(route.top.parent) for item in due if route.top.parent is not None)

    def lose(self, routes: list[Route], due: list[Item]) -> None:
        """Losers are recorded in document order, before any winner's transition."""
        leaves = [
            (route, item, outcome) for route in routes for item, outcome in route.ends if item.leaf
        ]
        for route, item, outcome in sorted(leaves, key=lambda end: end[1].order):
            rule = 5 if self.forbidden(route, due) else 4
            self.record(rule, "outcome", item.path, outcome)
            self.leave(item, "lost", rule)

    # -- rule 5: timeouts --------------------------------------------------------------------------

    def due(self) -> list[Item]:
        """What is due, the outer first."""
        found = [i for i in self.root.walk() if i.deadline is not None and i.deadline <= self.now]
        return sorted(found, key=lambda i: (i.depth, i.order))

    def time_out(self) -> None:
        for item in self.due():
            if item.deadline is None or self.outcome is not None:
                continue
            for inside in reversed([s for s in self.started if item.holds(s)]):
                self.leave(inside, "timeout", 5)
            self.forget(item)
            self.record(5, "outcome", item.path, "timeout")
            self.take(self.route(item, "timeout", ended=True))
        self.monitor_pass([m for m in self.monitors(self.root) if m.chosen])

    # -- rules 6 and 7: transitions ----------------------------------------------------------------

    def take(self, route: Route) -> None:
        """Record the ends, close what is inside, and choose what follows."""
        for item, outcome in route.ends:
            self.record(8 if outcome == "error" else 7, "outcome", item.path, outcome)
            for inside in reversed([s for s in self.started if item.holds(s) and s is not item]):
                self.leave(inside, "preempted", 7)
            self.leave(item, "error" if outcome == "error" else "outcome", 7)
        top = route.top
        deadline = top.deadline
        self.forget(top)
        if route.kind == "retry":
            top.tries += 1
            top.deadline = deadline
            top.retry_at = self.now + max(top.tries_wait, 1)
        elif route.kind == "keep":
            assert top.parent is not None
            top.kept, top.parent.looks = route.outcome, True
        elif route.kind == "go":
            assert top.parent is not None
            self.record(6, "move", top.parent.path, top.name, route.outcome, route.target)
            self.choose(next(c for c in top.parent.children if c.name == route.target))
        else:
            self.outcome = route.outcome

    def leave(self, item: Item, reason: str, rule: int) -> None:
        if item in self.started:
            self.started.remove(item)
            self.record(rule, "exit", item.path, reason)
        item.running = False

    def forget(self, top: Item) -> None:
        """Nothing in `top` has a turn or a deadline any more."""
        for item in top.walk():
            item.chosen = item.running = item.looks = False
            item.deadline = item.retry_at = None
        self.in_place = [i for i in self.in_place if not top.holds(i)]
        self.put_off = [i for i in self.put_off if not top.holds(i)]

    def record(self, rule: int, *record: str) -> None:
        self.entries.append(Entry(self.number, record, rule))

    @property
    def active(self) -> list[Item]:
        """The running leaves."""
        return [item for item in self.root.walk() if item.leaf and item.running]


def nanoseconds(text: str) -> int:
    """A duration such as `300 ms`."""
    number, unit = text.split()
    assert unit == "ms"
    return int(number) * 10**6
