"""Runs a machine, tick by tick. The rules are those of engine/README.md, by the same numbers.

A tick is: operator commands, monitors, timeouts, actions. All monitors are stepped before anything
is decided; an action's outcome is decided as soon as it ends. How nodes are stepped:
`stepping.py`; how they start and end: `life.py`; when the next tick is needed: `schedule.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain, starmap, takewhile
from operator import attrgetter
from typing import Any

from engine.machine import (
    ASK,
    CHOSEN,
    ENDED,
    IDLE,
    KEEP,
    REOPEN,
    RETRY,
    BoxNode,
    Contest,
    Judge,
    LeafNode,
    Machine,
    Route,
    RunNode,
    Substitute,
    Writes,
    nodes_of,
)
from engine.run.command import Command
from engine.run.context import Part
from engine.run.errors import Newest
from engine.run.life import Life
from engine.run.run_queue import RunQueue, is_monitor
from engine.run.schedule import Schedule
from engine.run.stepping import StepEnd, Stepper
from engine.run.trace import BATCH
from engine.signals import Board
from engine.state import NEVER_NS


class ChartRun:
    """One run of a machine.

    Args:
        machine: the chart; other runs may share it.
        board: the signals; by default there are none.
        parts: the robot's parts by name, to be commanded by the states that declare them.
        level: the operator's autonomy level; `None`: no outcome waits for consent, unless locked.
        freezers: functions that make values immutable, by class of the value.
        stand_ins: replacements for the states of leaves, by path.

    Attributes:
        nodes: the run state of all nodes, by path.
        outcome: of the chart, once there is one; `results` are its outputs.
        ended_by: the path of the node that caused it, and that node's own outcome.
        schedule: when the next tick is needed.
        carried_out: the operator's newest commands, with the instants of their effect, ns.
        paused: chart time stands still, except in the one tick that is `stepping`.
        attended: an operator attends the run, so that breakpoints pause it.
        breakpoints: those that the operator has set (True) or removed (False), by path; the others
            are as the chart says.
        over: it has ended or was closed, and ticks do nothing.
    """

    def __init__(
        self,
        machine: Machine,
        board: Board | None = None,
        parts: Mapping[str, Part] | None = None,
        level: int | None = None,
        freezers: Mapping[type, Callable[[Any], Any]] | None = None,
        stand_ins: Mapping[str, Substitute] | None = None,
    ) -> None:
        self.machine = machine
        self.board = board if board is not None else Board()
        self.life = Life(self.board, parts or {})
        self.trace, self.errors, self.notes = self.life.trace, self.life.errors, self.life.notes
        self.parts, self.entered = self.life.parts, self.life.entered
        self.judge = Judge(level, dict(freezers or {}), self.life.report)
        self.queue = RunQueue(self.life)
        stepper = Stepper(self.life)
        self._step, self._step_all = stepper.step, stepper.step_all
        self.outcome: str | None = None
        self.over = False
        self.ended_by: tuple[str, str] | None = None
        self.results: dict[str, Any] = {}
        self.paused = False
        self._paused_until = 0
        self.stepping = False
        self.attended = False
        self.breakpoints: dict[str, bool] = {}
        self.carried_out: Newest[tuple[int, Command]] = Newest()
        self.commands = self.life.commands
        self.schedule = Schedule(self)
        self.stand_ins = dict(stand_ins or {})
        self.nodes: dict[str, RunNode] = {}
        self.adopt(machine, nodes_of(machine, {}))
        self.queue.put_off.append(self.nodes[""])

    # -- ticks ---------------------------------------------------------------------------------

    def tick(self, now: int, between: bool = False) -> str | None:
        """Run one tick at `now`, in ns since the start; returns the outcome once there is one.

        `between`: an added tick, off the grid (rule 13). Only leaves whose `On` has got news are
        stepped, nodes with a due timeout end, and what these lead to is entered.
        """
        if between:
            return self._tick_between(now)
        board, life = self.board, self.life
        board.now = now
        board.ticks += 1
        board.interval += 1
        if board.inbox or board.fresh:
            board.refresh()
        if life.early and self._begin():
            return self.outcome
        nodes = iter(self.queue.nodes)
        if now - board.paused_ns >= life.due:
            self._decide(self._step_all(takewhile(is_monitor, nodes)))
            self._rounds()
            self._time_out()
            nodes = self.queue.actions
        ended = self._step(nodes)  # without a timeout, monitors and actions in one go
        if ended is None:
            return self.outcome
        while ended is not None and ended[0].monitor:
            self._decide(self._step_all(takewhile(is_monitor, nodes), ended))
            nodes = chain(self.queue.take_monitors(), self.queue.actions)
            ended = self._step(nodes)  # the monitors chosen by it, and the actions
        if ended is not None:
            self._act(nodes, ended)
        return self.outcome

    def recorded_tick(self, now: int) -> str | None:
        """Like `tick`, but adds the tick itself to the trace, too."""
        life = self.life
        life.add(("tick", now, life.root))
        if not self.board.ticks % BATCH:
            life.trim()
        return self.tick(now)

    def _tick_between(self, now: int) -> str | None:
        board, queue = self.board, self.queue
        board.begin(now, between=True)
        if self.over or self.paused:
            return self.outcome
        fresh = board.fresh
        chosen = {node for node in queue.nodes if node.status == CHOSEN}

        def waited(node: RunNode) -> bool:
            return bool(node.wake and node.mask & fresh)

        def has_to_act(node: RunNode) -> bool:
            is_new = node.status == CHOSEN and node not in chosen
            looks = isinstance(node, BoxNode) and node.news
            return is_new or looks or waited(node)

        monitors = takewhile(is_monitor, queue.nodes)
        self._decide(self._step_all(filter(waited, monitors)))
        self._rounds()
        if board.chart_now >= self.life.due:
            self._time_out()
        self._act(filter(has_to_act, queue.actions))
        return self.outcome

    def command(self, command: Command) -> None:
        """Queue a command for the start of the next tick, before anything is stepped.

        Safe to call from other threads.
        """
        self.commands.append(command)
        self.life.early = True

    def _begin(self) -> bool:
        """Carry out commands, and choose what was put off; True if the tick ends here."""
        life = self.life
        if life.interrupt is not None:
            interrupt, life.interrupt = life.interrupt, None
            raise interrupt
        if self.over:
            self.take_late()
            return True
        if self.paused:  # rule 11: chart time stands still
            self._pass_time()
        life.early = False  # before the commands are looked at: others may come meanwhile
        while self.commands:
            command = self.commands.popleft()
            self.carried_out.append((self.board.now, command))
            command.carry_out(self)
            if self.over:
                break
        if self.over or self.paused:
            life.early = True
            if not self.stepping or self.over:
                return True
        queue = self.queue
        put_off, queue.put_off = queue.put_off, []
        for node in put_off:
            node.status = IDLE
            queue.choose(node)
        queue.fresh.clear()
        return False

    # -- passes --------------------------------------------------------------------------------

    def _act(self, nodes: Iterable[RunNode], ended: StepEnd | None = None) -> None:
        """Step actions; the outcome of each is decided as soon as it ends.

        `ended`, a node that ended before the first of `nodes` was stepped, is decided first.
        """
        queue = self.queue
        queue.acting = True
        going = self._in_place(iter(nodes))
        if ended is None:
            ended = self._step(going)
        while ended is not None:
            node, value = ended
            self._carry_out(self.judge.conclude(node, value))
            ended = self._step(going)
        queue.acting = False

    def _in_place(self, nodes: Iterator[RunNode]) -> Iterator[RunNode]:
        """The nodes still to be stepped, each preceded by those chosen meanwhile.

        Rule 6: what is chosen during the action pass starts within it, monitors first.
        """
        queue = self.queue
        while True:
            while queue.fresh:
                fresh = queue.first_fresh()
                if fresh.monitor:
                    self._rounds()
                else:
                    queue.fresh.remove(fresh)
                    yield fresh
            node = next(nodes, None)
            if node is None:
                return
            if queue.still_has(node):
                yield node

    def _rounds(self) -> None:
        """Step the monitors just chosen and decide; repeat until none is left."""
        while self.queue.fresh and (monitors := self.queue.take_monitors()):
            self._decide(self._step_all(iter(monitors)))

    def _decide(self, ended: list[StepEnd]) -> None:
        """Rule 4: decide which of the monitors that ended in one round win, and carry it out."""
        if not ended:
            return
        due = [] if self.queue.acting else self.life.due_nodes()
        routes = list(starmap(self.judge.conclude, ended))
        if len(routes) == 1 and not due and routes[0].kind != KEEP:
            self._carry_out(routes[0])
            return
        contest = Contest(self.judge, due)
        contest.settle(routes)
        ends = {node: outcome for route in contest.losers for node, outcome in route.ends}
        for node in self.life.lose(ends):
            self.queue.drop(node)
        for winner in contest.winners:
            self._carry_out(winner)

    def _time_out(self) -> None:
        """Rule 5: end the nodes whose timeout is due, outer ones first."""
        for node in self.life.due_nodes():
            if node.deadline == NEVER_NS or self.over:
                continue
            self.follow(node, self.life.abort(node, "timeout", "timeout"))
        self._rounds()

    # -- carrying out --------------------------------------------------------------------------

    def _carry_out(self, route: Route) -> None:
        """Carry out a route: end what ends, and choose, keep, ask, try again or finish."""
        life, queue = self.life, self.queue
        top, kind, writes = route.top, route.kind, route.writes
        ends = self._keep(route, route) if route.joined else route.ends
        for node, outcome in ends:
            writes = life.end(node, outcome, writes, route)
        queue.drop(top)
        if top.timed:
            again = kind in (ASK, RETRY, REOPEN)
            for timed in top.timed:
                if not again or timed is not top:
                    timed.deadline = NEVER_NS
        box, target = route.box, route.target
        if target is None or box is None:
            self._carry_out_here(route, writes)
            return
        if not route.ends:  # else the record of the last end has the move
            life.add(("move", self.board.now, box, route))
        if writes:
            life.write(writes, box)
        queue.choose(target)

    def _keep(self, route: Route, by: Route) -> list[tuple[RunNode, str]]:
        """Let a list keep the outcomes by which it matches; the nodes that end by the match.

        `by` is the route that all this is part of.
        """
        count = 0
        for keeping in route.joined:
            box, writes = keeping.box, keeping.writes
            assert box is not None
            for node, outcome in self._keep(keeping, by):
                writes = self.life.end(node, outcome, writes, by)
            keeping.top.pending = writes
            box.kept[keeping.top.vertex.name] = keeping.outcome
            count += len(keeping.ends)
        return route.ends[count:]

    def _carry_out_here(self, route: Route, writes: Writes) -> None:
        """Carry out a route without a target: keep, ask, try again or finish."""
        queue, top, kind, box = self.queue, route.top, route.kind, route.box
        if kind == KEEP and box is not None:
            top.status = ENDED
            top.pending = writes
            box.kept[top.vertex.name] = route.outcome
            box.news = True
        elif kind == ASK:
            queue.ask(top, route.outcome, writes)
        elif kind == RETRY:
            queue.try_again(top, counted=bool(route.ends))
        elif kind == REOPEN:
            queue.choose(top, again=True)
        else:
            self.life.write(writes, self.life.root)
            self.ended_by = (route.cause.path, route.came)
            self.finish(route.outcome)

    # -- what commands do ------------------------------------------------------------------------

    def follow(self, node: RunNode, outcome: str, writes: Writes = ()) -> None:
        """Carry out what `outcome` leads to; the end of `node` itself is recorded already."""
        route = self.judge.resolve(node, outcome, ended=True)
        route.writes = writes
        self._carry_out(route)

    def pause(self) -> None:
        """Hold the parts and step nothing until `resume`."""
        if not self.paused:
            self.paused = True
            self._paused_until = self.board.now
            self.life.tell("paused")
            self.life.hold()

    def resume(self) -> None:
        """Go on after a pause."""
        if self.paused:
            self.paused = self.stepping = False
            self.queue.notice(self.queue.nodes)
            self.life.tell("resumed")

    def step_once(self) -> None:
        """In a pause, let this tick take place; the pause goes on with the next one."""
        if self.paused and not self.stepping:
            self.stepping = True
            self.queue.notice(self.queue.nodes)

    def _pass_time(self) -> None:
        """Let a tick's time pass in a pause: chart time goes on only after the tick of a step."""
        if self.stepping:
            self.stepping = False
            self.life.hold()
        else:
            self.board.paused_ns += self.board.now - self._paused_until
        self._paused_until = self.board.now

    def finish(self, outcome: str) -> None:
        """End the run, and stop all parts."""
        self.outcome, self.over = outcome, True
        life = self.life
        life.early = True
        for key in self.machine.chart.outputs.get(outcome, ()):
            self.results[key] = life.data[self.machine.root.cells[key]]
        self.queue.drop(life.root)
        life.tell("over")
        life.hold()

    def forget_routes(self) -> None:
        """Clear the cached routes, after a change of locks or level."""
        for node in self.nodes.values():
            node.routes.clear()

    def adopt(self, machine: Machine, nodes: dict[str, RunNode]) -> None:
        """Continue with these nodes of a machine; running nodes keep their state."""
        self.machine, self.nodes = machine, nodes
        self.life.adopt(nodes)
        for path, stand_in in self.stand_ins.items():
            self.put_in(path, stand_in)

    def put_in(self, path: str, stand_in: Substitute) -> None:
        """Let a stand-in run in place of the state at `path`, from its next entry on."""
        self.stand_ins[path] = stand_in
        node = self.nodes.get(path)
        if isinstance(node, LeafNode):
            node.make, node.produces = stand_in

    # -- the whole -----------------------------------------------------------------------------

    def close(self) -> None:
        """After the last tick: let running states clean up, and stop all parts.

        A run without an outcome keeps none; further ticks do nothing.
        """
        self.over = self.life.early = True
        self.life.close_all()
        self.life.tell("over")
        self.life.hold()

    def take_late(self) -> None:
        """After the end: carry out the commands that are late, and none of the others."""
        while self.commands:
            command = self.commands.popleft()
            if command.is_late:
                self.carried_out.append((self.board.now, command))
                command.carry_out(self)

    def hold(self) -> None:
        """Stop every part, even if one of them raises."""
        self.life.hold()

    def note(self, node: Any, text: str) -> None:
        """Add a note to the trace; it affects neither the run nor the hash."""
        self.life.note(node, text)

    def value_of(self, key: str, path: str = "") -> Any:
        """The value of a data key of the chart that begins at `path`."""
        node = self.nodes[path]
        assert isinstance(node, BoxNode), f"{path!r} is a leaf"
        return self.life.data[node.box.cells[key]]

    @property
    def running(self) -> list[LeafNode]:
        """The leaves that run, in document order."""
        leaves = [node for node in self.entered if isinstance(node, LeafNode)]
        return sorted(leaves, key=attrgetter("order"))

    @property
    def active(self) -> list[str]:
        """The paths of the running leaves, in document order."""
        return [node.path for node in self.running]
