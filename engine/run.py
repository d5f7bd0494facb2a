"""Runs a machine, tick by tick. The rules are those of engine/README.md, by the same numbers.

A tick is: operator commands, monitors, timeouts, actions. Monitors all have their turn before
anything is decided; actions decide in place. A change of what is active makes a new list of turns,
so that a pass can go on over the old one. How nodes start and end: `lifecycle.py`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from engine.board import Board
from engine.contest import Contest
from engine.context import Part
from engine.decide import KEEP
from engine.lifecycle import Lifecycle
from engine.machine import CHOSEN, IDLE, RUNNING, WAITING, Box, Leaf, Machine, Vertex
from engine.state import NEVER_NS, On, Until
from engine.turns import rank

if TYPE_CHECKING:
    from engine.commands import Command


class ChartRun(Lifecycle):
    """One run of a machine.

    Args:
        machine: a machine of this run's own; ValueError if another run has it.
        board: the signals; by default none.
        parts: the robot's parts by name, to be commanded by the states that declare them.
        level: the operator's autonomy level; `None` means that nobody is asked.
        freezers: makes values of a class immutable, by class.

    `carried_out` holds the operator's commands with the instants at which they took effect, ns.
    """

    def __init__(
        self,
        machine: Machine,
        board: Board | None = None,
        parts: Mapping[str, Part] | None = None,
        level: int | None = None,
        freezers: Mapping[type, Callable[[Any], Any]] | None = None,
    ) -> None:
        super().__init__(machine, board, parts, level, freezers)
        self.paused = False
        self.pauses: list[tuple[int, int]] = []
        self.carried_out: list[tuple[int, Command]] = []
        self._commands: deque[Command] = deque()
        self._ended: list[tuple[Vertex, Any]] = []
        self._settling = False
        self._rests = (-1, 0)  # tick, and until when nothing is due after it

    def tick(self, now: int, between: bool = False) -> str | None:  # noqa: C901, PLR0915  the hot loop, in one piece
        """Run one tick at `now`, in ns since the start; the outcome once there is one.

        `between`: it is none of the grid. Only leaves that wait with `On` for news that came are
        stepped, timeouts end what is due, and what that leads to is entered.
        """
        if between:
            return self._tick_between(now)
        board = self.board
        board.now = now
        board.ticks += 1
        if board.inbox or board.fresh:
            board.refresh()
        if self._early and self._begin():
            return self.outcome
        now -= board.paused_ns
        fresh = board.fresh
        turns = self.turns
        for leaf in turns.monitors:
            if leaf.wake:
                if not leaf.mask & fresh and (leaf.wake > now or self._still_heard(leaf)):
                    continue
                leaf.wake = 0
            try:
                yielded = leaf.step()
                if yielded is not None:
                    self._wait(leaf, yielded)
            except StopIteration as stop:
                self._ended.append((leaf, stop.value))
            except BaseException as error:  # noqa: BLE001  rule 8: whatever a state raises is an outcome
                self._ended.append((leaf, self._raised(leaf, error)))
        if self._ended:
            self._decide()
        if now >= self._deadline:
            self._time_out()
        actions = turns.actions
        for leaf in actions:
            if leaf.wake:
                if not leaf.mask & fresh and (leaf.wake > now or self._still_heard(leaf)):
                    continue
                leaf.wake = 0
            try:
                yielded = leaf.step()
                if yielded is not None:
                    self._wait(leaf, yielded)
            except StopIteration as stop:
                ended = self._hand_over(leaf, stop.value)
                if ended is not None:
                    self._act_on(*ended, actions[actions.index(leaf) + 1 :])
                    break
            except BaseException as error:  # noqa: BLE001
                token = self._raised(leaf, error)
                self._act_on(leaf, token, actions[actions.index(leaf) + 1 :])
                break
        return self.outcome

    def recorded_tick(self, now: int) -> str | None:
        """Like `tick`, and leaves a record of it."""
        self.trace.add(("tick", now, self.machine.root))
        return self.tick(now)

    def _tick_between(self, now: int) -> str | None:
        board, turns = self.board, self.turns
        board.begin(now, between=True)
        if self.outcome is not None or self.paused:
            return self.outcome
        fresh = board.fresh
        for leaf in turns.monitors:
            if leaf.wake and leaf.mask & fresh:
                leaf.wake = 0
                self._step_monitor(leaf)
        before = [vertex for vertex in turns.actions if vertex.status == CHOSEN]
        if self._ended:
            self._decide()
        if board.chart_now >= self._deadline:
            self._time_out()
        self._acting = True
        for vertex in turns.actions:
            is_new = vertex.status == CHOSEN and vertex not in before
            looks = isinstance(vertex, Box) and vertex.news
            waited = vertex.wake and vertex.mask & fresh
            if (is_new or looks or waited) and turns.still_has(vertex):
                self._step_action(vertex)
        self._acting = False
        return self.outcome

    def wants_news(self) -> bool:
        """Whether something has arrived that a state waits for: it deserves a tick between."""
        if self.paused or self.outcome is not None:
            return False
        arrived, turns = self.board.arrived(), self.turns
        return any(v.wake and v.mask & arrived for v in (*turns.monitors, *turns.actions))

    def next_deadline(self) -> int:
        """The instant of the first timeout, ns; `NEVER_NS` if there is none."""
        if self.paused or self.outcome is not None:
            return NEVER_NS
        return min(self._deadline + self.board.paused_ns, NEVER_NS)

    def leave_out(self, now: int) -> bool:
        """Let an instant of the grid pass without a tick, if nothing is due and nothing is new.

        What has arrived is taken all the same. False: this instant needs its tick.
        """
        board = self.board
        if self._commands or self._interrupt is not None:
            return False
        if self._rests[0] != board.ticks or now >= self._rests[1]:
            self._rests = board.ticks, self._due_inside()
        return now < self._rests[1] and board.rest(now)

    def next_due(self) -> int:
        """The instant from which on a tick has something to do, ns, if nothing comes from outside.

        Rule 13: ticks before it change nothing and may be left out, unless a sample or a command
        comes for them. At most the present instant: the next tick is needed. `NEVER_NS`: none is.
        """
        if self.outcome is None and (self._commands or self.board.inbox):
            return self.board.now
        return self._due_inside()

    def _due_inside(self) -> int:
        board, turns = self.board, self.turns
        if self.outcome is not None or self.paused:
            return NEVER_NS
        if turns.put_off:
            return board.now
        due = self._deadline
        for vertex in (*turns.monitors, *turns.actions):
            if vertex.wake:
                self._still_heard(vertex)
                due = min(due, vertex.wake)
            elif vertex.status != WAITING and (not isinstance(vertex, Box) or vertex.news):
                return board.now
        return min(due + board.paused_ns, NEVER_NS)

    def chart_time(self, at: int) -> int:
        """The chart time of an instant that is over, ns."""
        return at - sum(min(until, at) - since for since, until in self.pauses if since < at)

    def command(self, command: Command) -> None:
        """Have it carried out at the start of the next tick, before anything is stepped.

        Safe to call from other threads.
        """
        self._commands.append(command)
        self._early = True

    def _begin(self) -> bool:
        """Commands, and what was put off; whether the tick ends here."""
        if self._interrupt is not None:
            interrupt, self._interrupt = self._interrupt, None
            raise interrupt
        if self.outcome is not None:
            return True
        if self.paused:
            self._stand_still()
        self._early = False  # before the commands are looked at: others may come meanwhile
        while self._commands:
            command = self._commands.popleft()
            self.carried_out.append((self.board.now, command))
            command.carry_out(self)
            if self.outcome is not None:
                break
        if self.outcome is not None or self.paused:
            self._early = True
            return True
        turns = self.turns
        put_off, turns.put_off = turns.put_off, []
        for vertex in put_off:
            vertex.status = IDLE
            self._choose(vertex)
        turns.fresh_monitors.clear()
        return False

    def _stand_still(self) -> None:
        """Rule 11: in a pause, chart time does not go on."""
        since, until = self.pauses[-1]
        self.pauses[-1] = (since, self.board.now)
        self.board.paused_ns += self.board.now - until

    def _hand_over(self, leaf: Vertex, value: Any) -> tuple[Vertex, Any] | None:
        """One plain action follows another in a sequence, as most edges are.

        Does at once what the rules above would do; what has ended otherwise, if anything has.
        """
        target = leaf.plain.get(value) if type(value) is str else None
        board = self.board
        tick = board.ticks
        if target is None or target.entered == tick:
            return leaf, value
        self.trace.add(("hand_over", board.now, leaf, value, target))
        leaf.status = IDLE
        target.status = RUNNING
        target.entered = tick
        del self.entered[leaf]
        self.entered[target] = None
        self.turns.replace(leaf, target)
        try:
            yielded = self._first_step(target)
            if yielded is not None:
                self._wait(target, yielded)
        except StopIteration as stop:
            return target, stop.value
        except BaseException as error:  # noqa: BLE001
            return target, self._raised(target, error)
        return None

    def _act_on(self, vertex: Vertex, value: Any, rest: list[Vertex]) -> None:
        """An action has ended: decide in place, then go on with the `rest` of the pass."""
        self._acting = True
        self._act_ended(vertex, value)
        for other in rest:
            if self.turns.still_has(other):
                self._step_action(other)
        self._acting = False

    def _step_action(self, leaf: Vertex) -> None:
        if leaf.wake:
            asleep = leaf.wake > self.board.chart_now or self._still_heard(leaf)
            if asleep and not leaf.mask & self.board.fresh:
                return
            leaf.wake = 0
        try:
            yielded = leaf.step()
            if yielded is not None:
                self._wait(leaf, yielded)
        except StopIteration as stop:
            self._act_ended(leaf, stop.value)
        except BaseException as error:  # noqa: BLE001
            self._act_ended(leaf, self._raised(leaf, error))

    def _act_ended(self, vertex: Vertex, value: Any) -> None:
        self._take(self.judge.conclude(vertex, value))
        self._settle()

    def _settle(self) -> None:
        """Rule 6: what the action pass has chosen starts in place, monitors first."""
        if self._settling:
            return
        self._settling = True
        turns = self.turns
        while turns.fresh_monitors or turns.fresh_actions:
            if turns.fresh_monitors:
                self._rounds()
                continue
            vertex = turns.next_fresh_action()
            if vertex.status == CHOSEN or isinstance(vertex, Box):
                self._step_action(vertex)
        self._settling = False

    def _decide(self) -> None:
        """Rule 4, and further rounds for the monitors that are entered by it."""
        self._decide_round()
        self._rounds()

    def _rounds(self) -> None:
        """Step monitors that have just been chosen, decide, and again until none is left."""
        turns = self.turns
        while turns.fresh_monitors:
            fresh, turns.fresh_monitors = turns.fresh_monitors, []
            if len(fresh) > 1:
                fresh.sort(key=rank)
            for leaf in fresh:
                self._step_monitor(leaf)
            if self._ended:
                self._decide_round()

    def _step_monitor(self, leaf: Vertex) -> None:
        try:
            yielded = leaf.step()
            if yielded is not None:
                self._wait(leaf, yielded)
        except StopIteration as stop:
            self._ended.append((leaf, stop.value))
        except BaseException as error:  # noqa: BLE001
            self._ended.append((leaf, self._raised(leaf, error)))

    def _decide_round(self) -> None:
        ended, self._ended = self._ended, []
        due = self._due() if self._timed and not self._acting else []
        if len(ended) == 1 and not due:
            vertex, value = ended[0]
            decision = self.judge.conclude(vertex, value)
            if decision.kind != KEEP:
                self._take(decision)
                return
            decisions = [decision]
        else:
            decisions = [self.judge.conclude(vertex, value) for vertex, value in ended]
        contest = Contest(self.judge, due)
        contest.hold(decisions)
        self._lose(contest.losers)
        for winner in contest.winners:
            self._take(winner)

    def _time_out(self) -> None:
        """Rule 5: what is due ends, the outer one first."""
        for vertex in self._due():
            if vertex not in self._timed or self.outcome is not None:
                continue
            outcome = self.abort(vertex, "timeout", "timeout")
            self._take(self.judge.resolve(vertex, outcome, ended=True))
        self._rounds()

    def _due(self) -> list[Vertex]:
        now = self.board.chart_now
        if now < self._deadline:
            return []
        return sorted((v for v in self._timed if v.deadline <= now), key=_depth)

    def _wait(self, leaf: Vertex, yielded: Any) -> None:
        """A state said when it wants to be stepped next.

        Raises:
            TypeError, LookupError: it said something without meaning.
        """
        kind = type(yielded)
        if kind is Until:
            leaf.wake, leaf.mask = (yielded.ns, 0) if yielded.ns > self.board.chart_now else (0, 0)
            leaf.silence = None
        elif kind is On:
            assert isinstance(leaf, Leaf)
            leaf.wake, leaf.mask = max(yielded.until, 1), leaf.context.bits(yielded.signals)
            leaf.asked = self.board.ticks
            leaf.silence = None
            if yielded.older != NEVER_NS:
                self._await_silence(leaf, yielded)
        elif kind is str:
            self.notes[leaf.path] = yielded
        else:
            message = f"yielded a {kind.__name__}; only None, Until, On and text mean something"
            raise TypeError(message)

    def _await_silence(self, leaf: Leaf, on: On) -> None:
        for name in on.signals:
            self.board.accept(name, on.older)
        leaf.silence = on, self.board.now
        self._still_heard(leaf)

    def _still_heard(self, leaf: Vertex) -> bool:
        """Whether a leaf that waits for silence, or for an instant, has to go on waiting.

        It wakes when the signals would have been silent for too long if nothing came; when
        something did, it is put off.
        """
        if leaf.silence is None:
            return False
        board, (on, since) = self.board, leaf.silence
        silent_at = board.silent_at(leaf.mask, on.older, since) - board.paused_ns
        leaf.wake = max(1, min(on.until, silent_at))
        return leaf.wake > board.chart_now


def _depth(vertex: Vertex) -> tuple[int, int]:
    return vertex.depth, vertex.order
