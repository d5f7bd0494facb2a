"""A second chart that sees the same signals and decides beside the running one.

It commands stand-ins, and has a board of its own, fed with the same samples. In each tick it
decides after the chart that runs, and what both have decided is compared, as far as both have the
nodes. Whenever the running chart decides, the shadow is set to its place. If the shadow decides
first, or otherwise, it stands still until the running chart's next decision, as from then on it
would be elsewhere. What it decides does not touch the run, and it ends alone if it raises; but it
takes its time within the tick, about as much as the running chart takes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cobodeck.fitness import require
from cobodeck.loop import Loop, Ticked, Wired, wire
from cobodeck.run.decisions import Decision, DecisionReader
from cobodeck.run.stand_in import Answers, Overheard, StandIn
from cobodeck.setup import Setup
from engine.operator import Replace, place_of, set_place
from engine.run import ChartRun, text_of
from hw import Sample

GOES_ON = "goes on"


@dataclass(frozen=True, slots=True)
class ShadowRow:
    """Where both differed: at which instant, over which node, and what each of them decided."""

    at_ns: int
    path: str
    ran: str
    shadow: str

    def __str__(self) -> str:
        at = f"at {self.at_ns / 1e9:.3f} s, {self.path or 'the chart'}"
        return f"{at}: ran {self.ran!r}, shadow {self.shadow!r}"


class Shadow:
    """A chart that decides beside a run; see the module.

    Args:
        setup: of the shadow: as that of the run, with another chart, or with other values.
        tell: called with a message if the shadow raises.

    Raises:
        Problem: an input of the chart has no value.

    Attributes:
        rows: where both differed.
        decided, same, later: ticks in which the running chart decided anything; in which the shadow
            decided the same, or had done so before.
        ended: why the shadow has ended before the run; None if it has not.
        note: called with the fields of each row; a recorder's, if one records the run.
    """

    def __init__(self, setup: Setup, tell: Callable[[str], object]) -> None:
        require("begin", setup=setup)
        self.setup = setup
        self.rows: list[ShadowRow] = []
        self.decided = self.same = self.later = 0
        self.ended: str | None = None
        self.note: Callable[[int, str, str, str], object] = _unheard
        self._tell = tell
        self._answers: Answers = {}
        self._held: list[Decision] | None = None
        self._commands_read = 0
        self._last_ns = -1
        self._loop: Loop
        self._wired: Wired

    def tap(self, name: str, part: Any) -> Any:
        """A wrapper of a running part, of which the answers become those of its stand-in."""
        return Overheard(name, part, self._answers)

    def attend(self, loop: Loop, localizing: int | None, *, eager: bool) -> None:
        """Decide beside the run of a loop; call it before the first tick, and before a recorder's.

        `localizing` is the seed of the run's localization, None without one.

        Raises:
            Problem: the chart needs signals, or commands parts, that the run does not have.
        """
        flowing = loop.wired.inlet.flowing
        parts = {
            name: StandIn(name, tuple(s for s in part.signals if s in flowing), self._answers)
            for name, part in loop.plant.parts.items()
        }
        self._wired = wire(replace(self.setup, localizing=localizing), parts, eager=eager)
        self._loop = loop
        self._running = DecisionReader(loop.wired.run)
        self._decisions = DecisionReader(self._wired.run)
        loop.taps = (self, *loop.taps)
        loop.wired.inlet.taps.append(self.sample)

    def sample(self, sample: Sample, now_ns: int, refused: str | None) -> None:
        """A sample has arrived."""
        if refused is None:
            self._guarded(lambda: self._take(sample, now_ns))

    def _take(self, sample: Sample, now_ns: int) -> None:
        self._wired.board.interval = self._loop.wired.board.interval
        self._wired.inlet.deliver(sample, now_ns)

    def failed(self, part: str, error: BaseException) -> None:
        """Do nothing; a part of the run has raised."""

    def tick(self, ticked: Ticked) -> None:
        """The run has ticked: decide, and compare."""
        if ticked.kind == "end":
            self._guarded(self._wired.run.close)
        elif ticked.kind != "taken":
            self._guarded(lambda: self._tick(ticked))

    def figures(self) -> dict[str, Any]:
        """How often both decided alike; `differed` counts the rows."""
        return {
            "chart": self.setup.chart.name,
            "decided": self.decided,
            "same": self.same,
            "later": self.later,
            "differed": len(self.rows),
            "first": str(self.rows[0]) if self.rows else None,
            "ended": self.ended,
        }

    # -- a tick ----------------------------------------------------------------------------------

    def _tick(self, ticked: Ticked) -> None:
        running, run = self._loop.wired.run, self._wired.run
        carried_out = running.carried_out.since(self._commands_read)
        self._commands_read = running.carried_out.total
        all_ran = self._running.new()
        ran = [one for one in all_ran if one.path in run.nodes]
        did: list[Decision] = []
        if self._held is None:
            for _, command in carried_out:
                if not isinstance(command, Replace):
                    run.command(command)
            for instant in self._left_out(ticked.at_ns):
                self._step(instant)
            self._step(ticked.at_ns, between=ticked.kind == "added")
            did = [one for one in self._decisions.new() if one.path in running.nodes]
        self._last_ns = ticked.at_ns
        self._compare(ticked.at_ns, ran, did)
        if all_ran or (did and self._held is None):
            self._follow(running)

    def _step(self, now_ns: int, *, between: bool = False) -> None:
        self._wired.run.tick(now_ns, between)

    def _left_out(self, now_ns: int) -> Iterator[int]:
        """Instants without samples, at which the run had nothing to do, and the shadow has."""
        grid, schedule = self._loop.grid, self._wired.run.schedule
        due = max(schedule.next_due(), self._last_ns + 1)
        while self._last_ns >= 0 and grid.instant(grid.first(due)) < now_ns:
            instant = grid.instant(grid.first(due))
            yield instant
            due = max(schedule.next_due(), instant + 1)

    def _compare(self, at_ns: int, ran: Sequence[Decision], did: Sequence[Decision]) -> None:
        self.decided += bool(ran)
        held = self._held
        if held is not None:
            if not ran:
                return
            self._held = None
            if _told(ran) == _told(held):
                self.later += 1
            else:
                self._differ(at_ns, ran, held)
        elif _told(ran) == _told(did):
            self.same += bool(ran)
        else:
            self._differ(at_ns, ran, did)
            if not ran:
                self._held = list(did)

    def _differ(self, at_ns: int, ran: Sequence[Decision], did: Sequence[Decision]) -> None:
        """Note the first decision that the other has not."""
        alike = 0
        for one, other in zip(_told(ran), _told(did), strict=False):
            if one != other:
                break
            alike += 1
        first, second = (next(iter(some[alike:]), None) for some in (ran, did))
        path = (first or second or ran[0]).path
        row = ShadowRow(at_ns, path, _shown(first, path), _shown(second, path))
        self.rows.append(row)
        self.note(row.at_ns, row.path, row.ran, row.shadow)

    def _follow(self, running: ChartRun) -> None:
        """Be where the run is."""
        self._held = None
        self._wired.board.now = running.board.now
        set_place(self._wired.run, place_of(running))
        self._decisions.new()

    def _guarded(self, act: Callable[[], object]) -> None:
        """Call `act`; what it raises ends the shadow, not the run."""
        if self.ended is not None:
            return
        try:
            act()
        except Exception as error:  # noqa: BLE001  whatever the shadow's code raises
            self.ended = f"{type(error).__name__}: {text_of(error)}"
            self._tell(f"the shadow has ended: {self.ended}")


def shadow_rows(figures: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What people are told of the figures of a shadow, if there was one."""
    found = figures.get("shadow")
    if found is None:
        return
    alike = f"{found['same']} of {found['decided']} times decided alike"
    later = f", {found['later']} earlier" if found["later"] else ""
    yield "shadow", f"{found['chart']}: {alike}{later}, {found['differed']} differences"
    if found["first"] is not None:
        yield "  first", found["first"]
    if found["ended"] is not None:
        yield "  ended", found["ended"]


def _told(decisions: Sequence[Decision]) -> list[tuple[str, str, str]]:
    return [(one.path, one.kind, one.text) for one in decisions]


def _shown(decision: Decision | None, path: str) -> str:
    if decision is None:
        return GOES_ON
    return decision.text if decision.path == path else str(decision)


def _unheard(*_: object) -> None:
    """Nobody records it."""
