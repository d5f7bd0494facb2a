"""The one loop: the plant advances, its samples reach the board, the chart decides.

Tick n is at instant n of the grid. Before it the plant advances to that instant, its samples go to
the board, and observers run. In virtual time, ticks in which nothing is due are left out: the plant
still advances, but the chart does not run. In real time the loop sleeps until the next tick, sample
or deadline; a sample that a state waits for adds a tick at once. A late tick takes the clock's
reading as its instant; missed ticks are counted and never made up for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from cobodeck.loop.clocks import Clock, Virtual
from cobodeck.loop.plant import Plant
from cobodeck.loop.stopwatch import Stopwatch
from cobodeck.loop.ticked import Kind, Observer, Tap, Ticked
from cobodeck.loop.wiring import Wired
from engine import TickGrid
from engine.operator import Operator
from engine.run import Raised, raised
from hw.safety import GuardedBase

LATE_NS = 1_000_000
"""A tick later than this, ns, takes the clock's reading as its instant."""
MEMORY_S = 0.5
"""Repeats older than this, s, matter to nobody whom a leap passes over; see `engine/LEAPS.md`."""
CTRL_C = "SIGINT"
"""Who ends a run by Ctrl-C; other signals have their names, too."""
PROGRESS = 1024
"""Ticks between two progress messages."""


@dataclass(slots=True)
class Loop:
    """One run on one plant; see the module.

    Attributes:
        leave_out: leave out ticks in which nothing is due; only in virtual time.
        tell: called with each error of states and parts, as it occurs.
        taps: notified of each tick.
        ticks: instants of the grid so far; at `left_out` of them the chart did not run, and of
            these the loop leapt over `leapt`; `missed` were skipped altogether. `added` counts
            ticks off the grid.
        stopwatch: measures where the time goes; without one, as by default in virtual time, no
            clock is read.
        busy: within a tick, or a clean-up.
    """

    plant: Plant
    wired: Wired
    grid: TickGrid
    observers: Sequence[Observer] = ()
    clock: Clock = field(default_factory=Virtual)
    leave_out: bool = True
    tell: Callable[[Raised], None] | None = None
    taps: Sequence[Tap] = ()
    ticks: int = 0
    left_out: int = 0
    leapt: int = 0
    missed: int = 0
    added: int = 0
    now_ns: int = -1
    stopwatch: Stopwatch | None = None
    busy: bool = False
    _told: int = 0
    _plant_ns: int = 0
    _late_ns: int = 0
    _leaps: bool = False
    _stopping: str | None = None

    def __post_init__(self) -> None:
        if self.clock.waits and self.stopwatch is None:
            self.stopwatch = Stopwatch()

    @property
    def next_ns(self) -> int:
        """The instant of the next tick."""
        return self.grid.instant(self.ticks)

    @property
    def finished(self) -> bool:
        """Whether the chart has ended, or the plant has nothing left to do."""
        return self.wired.run.outcome is not None or self.plant.finished

    def stop(self, by: str = "") -> None:
        """End the run cleanly at the next tick; may be called from a signal handler.

        `by`: who wants it, for the record.
        """
        self._stopping = by
        self.clock.wake()

    def tick(self) -> str | None:
        """One tick of the grid, at its instant; the chart's outcome once there is one."""
        return self._tick(self.next_ns)

    def go(self, end_ns: int, progress: Callable[[str], None] | None = None) -> int:
        """Tick until the run ends, at `end_ns` at the latest; returns the last tick's instant, ns.

        Whatever ends it, exceptions included, the parts are stopped and the plant is closed.
        """
        self._leaps = self._all_leap()
        wake = self.clock.wake
        for part in self.plant.parts.values():
            if hasattr(part, "wake"):
                part.wake = wake
        try:
            while self.now_ns < end_ns and not self.finished:
                try:
                    self._next(end_ns)
                except KeyboardInterrupt:  # it has interrupted a state that did not return
                    self.stop(CTRL_C)
                if progress is not None and not self.ticks % PROGRESS:
                    progress(f"{self.now_ns / 1e9:.0f} s")
        finally:
            self.busy = True  # a clean-up may block as well
            if self.wired.run.outcome is None:
                self.wired.run.close()
            self.busy = False  # switching devices off takes a while
            self.plant.close()
            self._report_errors()
            self.wired.run.take_late()  # what the operator did meanwhile
            self._end(Ticked(self.now_ns, self.ticks, "end"))
        return self.now_ns

    def _all_leap(self) -> bool:
        """Whether none that looks at the plant needs to see what is repeated."""
        if self.taps or self.wired.inlet.taps or self.plant.latency_ns:
            return False
        return all(getattr(observer, "leaps", False) for observer in self.observers)

    def _next(self, end_ns: int) -> None:
        if not self.clock.waits:
            if self.leave_out and not self.clock.paced:
                self._jump(end_ns)
            self._tick(self.clock.wait(self.next_ns))
            return
        due = self.next_ns
        now = self.clock.wait(min(due, self.wired.run.schedule.next_deadline()))
        if now >= due:
            self._tick(now)
        else:
            self._add(now)

    def _jump(self, end_ns: int) -> None:
        """Skip ticks up to the next instant at which plant or chart has something to do."""
        plant = self.plant
        if plant.leap is not None:
            if self.wired.board.rested > MEMORY_S * self.grid.hz:
                self._leap(plant.leap, end_ns)
            return
        if self._stopping is not None or plant.quiet_until() <= self.next_ns:
            return
        until = min(plant.quiet_until(), self.wired.run.schedule.next_due(), end_ns)
        self._skip(self.grid.first(until) - self.ticks)

    def _leap(self, leap: Callable[[int], None], end_ns: int) -> None:
        """Pass over whole seconds in which all samples are repeated: see `engine/LEAPS.md`."""
        board, hz = self.wired.board, self.grid.hz
        if self._stopping is not None or not self._leaps:
            return
        due = self.wired.run.schedule.next_due(board.steady)
        until = min(self.plant.quiet_until(), due, end_ns)
        seconds = self.grid.seconds(self.grid.first(until) - self.ticks)
        if seconds <= 0 or not board.leaps(MEMORY_S):
            return
        ticks = seconds * hz
        span_ns = self.grid.instant(ticks)
        self._skip(ticks)
        self.leapt += ticks
        board.leap(ticks, span_ns)
        leap(span_ns)
        for observer in self.observers:
            observer.watch(self.grid.instant(self.ticks - 1))

    def _skip(self, ticks: int) -> None:
        if ticks > 0:
            self.ticks += ticks
            self.left_out += ticks

    def _tick(self, now: int) -> str | None:
        watch, self.busy = self.stopwatch, True
        if watch is not None:
            watch.begin()
        before = self.missed
        now = self._begin(now)
        if watch is not None:
            watch.lap(0)
        self.wired.inlet.poll(now)
        if watch is not None:
            watch.lap(1)
        for observer in self.observers:
            observer.watch(now)
        if watch is not None:
            watch.lap(2)
        kind: Kind = "grid"
        try:
            kind = "grid" if self._decide(now) else "left_out"
        finally:  # a tick that Ctrl-C interrupts counts as well
            if self.taps:
                self._end(Ticked(now, self.ticks - 1, kind, self.missed - before, self._late_ns))
        if watch is not None:
            watch.end(self.grid.period_ns)
        self.busy = False
        return self.wired.run.outcome

    def _end(self, ticked: Ticked) -> None:
        for tap in self.taps:
            tap.tick(ticked)

    def _begin(self, now: int) -> int:
        """Advance the plant to the latest instant of the grid; returns the tick's instant, ns."""
        number = self.ticks
        instant = self.grid.instant(number)
        self._late_ns = now - instant
        if self._late_ns > LATE_NS:
            number = self.grid.last(now)
            self.missed += number - self.ticks
            instant, on_grid = now, self.grid.instant(number)
        else:
            on_grid = instant
        self.now_ns = instant
        self.ticks = number + 1
        self.wired.board.interval = number
        self._advance(on_grid)
        return instant

    def _advance(self, to_ns: int) -> None:
        """Advance the plant to an instant, ns; with a latency it may be beyond it already."""
        if to_ns > self._plant_ns:
            self._plant_ns = to_ns
        self.plant.advance(self._plant_ns)

    def _stamp(self, now: int) -> int:
        """The instant from which commands decided at `now` apply, ns: never ahead of the plant."""
        return now if self.plant.paced or now < self._plant_ns else self._plant_ns

    def _decide(self, now: int) -> bool:
        """Run the chart unless it has nothing to do; returns whether it ran."""
        if self.plant.latency_ns:
            self._advance(now + self.plant.latency_ns)
        if self._stopping is not None:
            by, self._stopping = self._stopping, None
            Operator(self.wired.run, by).stop()
        nothing = self.leave_out and not self.clock.waits and self.wired.run.schedule.leave_out(now)
        if nothing:
            self.left_out += 1
            self.wired.pass_on(self._stamp(now))
        else:
            self.wired.tick(now, self._stamp(now))
        self._report_errors()
        return not nothing

    def _add(self, now: int) -> None:
        """Take samples off the grid; tick if a state waits for one of them or a timeout is due."""
        self.wired.inlet.poll(now)
        schedule = self.wired.run.schedule
        if now <= self.now_ns or not (schedule.next_deadline() <= now or schedule.wants_news()):
            self._end(Ticked(now, self.ticks, "taken"))
            return
        watch, self.busy = self.stopwatch, True
        if watch is not None:
            watch.begin()
        self.now_ns = now
        self.added += 1
        self.wired.tick(now, self._stamp(now), between=True)
        self._report_errors()
        self._end(Ticked(now, self.ticks, "added"))
        if watch is not None:
            watch.end(self.grid.period_ns)
        self.busy = False

    def _report_errors(self) -> None:
        """Report new errors; a part that has raised stops the robot."""
        errors, inlet = self.wired.run.errors, self.wired.inlet
        failures = self.plant.failures
        if inlet.failures:
            failures, inlet.failures = [*inlet.failures, *failures], []
        for name, failure in failures:
            errors.append(raised(self.now_ns, f"part {name}", failure, self._class_of(name)))
            for tap in self.taps:
                tap.failed(name, failure)
            if "stop_line" in self.plant.parts:
                self.plant.parts["stop_line"].pull(f"part {name}: {errors[-1].kind}")
        if errors.total > self._told:
            new, self._told = errors.since(self._told), errors.total
            if self.tell is not None:
                for error in new:
                    self.tell(error)

    def _class_of(self, name: str) -> type | None:
        """The class of a part or, for the guarded base, of its driver."""
        part = self.plant.parts.get(name)
        if isinstance(part, GuardedBase):
            part = part.base
        return None if part is None else type(part)
