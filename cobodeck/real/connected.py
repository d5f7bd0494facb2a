"""Parts behind drivers as the loop's plant: opened by a connection, guarded, closed at the end."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from cobodeck.real.health import Health, fault_of
from cobodeck.real.open_connection import (
    drivers_of,
    given_by,
    is_needed,
    needed_links,
    nothing,
    open_all,
    try_to,
)
from cobodeck.setup import Uses
from hw import Sample, StopLine, Truth
from hw.connection import Connection, RunInfo
from hw.motion import Reckoner
from hw.safety import CYCLE_NS, GuardedBase, StopLatch
from hw.sim.sensors import ScriptedOperator

Now = Callable[[], int]
CLOSING_S = 1.0
"""The chain has this long to finish its last cycle, s."""


class Stops:
    """The stop line in front of all parts: pulling it stops every part at once.

    `line` is the connection's own stop line, or a software latch. A reset first calls `acknowledge`
    of each part that has one, then resets the guard of the wheels; `why` says why it was refused.
    `pull` may be called from any thread; the operator is told why it stops, whatever the chart does
    about it, and why it stays.
    """

    def __init__(
        self, line: StopLine, parts: Mapping[str, Any], now: Now, tell: Callable[[str], None]
    ) -> None:
        self.signals = line.signals
        self.guard: GuardedBase | None = None
        self.health: Health | None = None
        self.reason: str | None = None
        self.why: str | None = None
        self._line, self._parts, self._now, self._tell = line, parts, now, tell

    @property
    def child(self) -> Any:
        """The process behind it, None without one."""
        return getattr(self._line, "child", None)

    def pull(self, reason: str) -> None:
        """Stop all parts until the reset; if the `stop` of one raises, the others still stop."""
        if self.guard is not None:
            self.guard.chain.pull(reason)  # even if already pulled: a reset may be in progress
        if self.reason is not None:
            return
        self.reason, self.why = reason, None
        self._line.pull(reason)
        for part in self._parts.values():
            if part is not self and hasattr(part, "stop"):
                try_to(part.stop)
        self._tell(f"stopped until the reset: {reason}")

    def blame(self, fault: str) -> None:
        """Stop for a fault that was found; it is told even if something else stopped before."""
        if self.reason not in (None, fault):
            self._tell(fault)
        self.pull(fault)

    def stop(self) -> None:
        """Do nothing; a stop line moves nothing."""

    def reset(self) -> bool:
        """Let the robot move again; returns False while the cause persists."""
        before, self.why = self.why, self._refusal()
        if self.why not in (None, before):  # a script asks again and again
            self._tell(f"not reset: {self.why}")
        return self.why is None

    def _refusal(self) -> str | None:
        """Why it cannot be reset; None: it is reset."""
        asked = [(n, part) for n, part in self._parts.items() if hasattr(part, "acknowledge")]
        refusing = [(name, part) for name, part in asked if not part.acknowledge()]
        if refusing:
            name, part = refusing[0]
            return f"{fault_of(part) or f'part {name} is not ready'}; reset again once it is"
        fault = None if self.health is None else self.health.fault
        if fault is not None:
            return fault
        if self.guard is not None and not self.guard.chain.reset(self._now()):
            return self._cause()
        reason, self.reason = self.reason, None  # a pull from now on counts again
        if self._line.reset():
            return self.reason
        self.reason = self.reason or reason
        return self._cause()

    def _cause(self) -> str:
        """Why the line or the guard holds."""
        why: str | None = getattr(self._line, "why", None)
        return why or self.reason or "the cause still holds"

    def samples(self, now_ns: int) -> Iterable[Sample]:
        """The samples of the line."""
        return self._line.samples(now_ns)

    def close(self) -> None:
        """Close the line."""
        getattr(self._line, "close", nothing)()


class WorldLink(Protocol):
    """The peer that runs the world around the fakes; see `hw.fakes.world_peer.WorldPeer`."""

    truth: Truth | None
    truth_ns: int
    finished: bool
    failures: list[Exception]

    def advance(self) -> None:
        """Take its newest messages."""
        ...

    def push_off(self) -> None:
        """The operator pushes the robot away from a person whom it touches."""
        ...


class Connected:
    """Parts behind drivers; the guard of the wheels cycles in a thread or process of its own.

    `world` is the simulated world around fakes, None with real devices. It alone knows the ground
    truth. `beside` are the open links and peers; `health` watches all that is open.
    """

    def __init__(
        self,
        parts: dict[str, Any],
        guard: GuardedBase | None,
        now: Now,
        beside: Sequence[Any] = (),
        health: Health | None = None,
    ) -> None:
        self.parts = parts
        self.beside, self._health = beside, health
        self.latency_ns = 0
        self.paced = True
        self.world: WorldLink | None = next((p for p in beside if hasattr(p, "truth")), None)
        self.attendant: ScriptedOperator | None = None
        self.guard = guard
        self.cycles = None if guard is None else guard.chain.cycles
        self._failures: deque[tuple[str, Exception]] = deque(maxlen=100)
        self._taken = 0
        self._now, self._over = now, threading.Event()
        self._cycling = threading.Thread(target=self._cycle, name="chain", daemon=True)
        if guard is not None and guard.cycled:
            self._cycling.start()

    @property
    def person_watched(self) -> bool:
        """True if a part tracks people."""
        return self.guard is not None and self.guard.chain.limits.watched

    @property
    def truth(self) -> Truth | None:
        """Ground truth of the world around the fakes; None with real devices."""
        return None if self.world is None else self.world.truth

    @property
    def truth_ns(self) -> int | None:
        """The instant of `truth`, ns since the start of the run."""
        return None if self.world is None else self.world.truth_ns

    @property
    def finished(self) -> bool:
        """True once the person beside the fakes, or the dummy, has finished."""
        return any(getattr(shared, "finished", False) for shared in self.beside)

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """Exceptions raised in the parts' own threads since the last call."""
        return [self._failures.popleft() for _ in range(len(self._failures))]

    def advance(self, to_ns: int) -> None:
        """Take the newest messages of the fakes' world; look for faults; step the operator."""
        if self.world is not None:
            self.world.advance()
            self._failures += [("world", error) for error in self.world.failures[self._taken :]]
            self._taken = len(self.world.failures)
        if self._health is not None:
            self._health.look()
        if self.attendant is not None:
            self.attendant.step(to_ns)

    leap = None

    def quiet_until(self) -> int:
        """Return 0: anything may happen at any time, so no tick can be left out."""
        return 0

    def close(self) -> None:
        """Stop the base and close all devices; one that raises does not keep the others open."""
        self._over.set()
        if self.guard is not None:
            if self.guard.cycled:
                self._cycling.join(CLOSING_S)
            self._try("base", self.guard.base.stop)
        for name, part in self.parts.items():
            if hasattr(part, "close"):
                self._try(name, part.close)
        for shared in reversed(self.beside):
            if hasattr(shared, "close"):
                self._try(type(shared).__name__, shared.close)

    def _cycle(self) -> None:
        """Cycle the chain. A driver's exception stops the robot; the chain goes on."""
        assert self.guard is not None
        reported = None
        while not self._over.wait(0.8e-9 * CYCLE_NS):
            try:
                self.guard.cycle(self._now())
            except Exception as error:  # noqa: BLE001
                if repr(error) != reported:
                    reported = repr(error)
                    self._failures.append(("base", error))
                try_to(self.guard.base.stop)
                self.parts["stop_line"].pull(f"base: {reported}")

    def _try(self, name: str, act: Callable[[], object]) -> None:
        error = try_to(act)
        if error is not None:
            self._failures.append((name, error))


def connect(connection: Connection, opening: RunInfo, uses: Uses) -> Connected:
    """Open the parts of a connection that a chart uses, and those needed for stopping.

    `opening.tell` gets what stops the robot, and why a stop stays. `opening.safety.watched` is
    ignored: whether people are tracked follows from the parts.

    Raises:
        Problem: a driver cannot be found or opened; what was opened before is closed again.
    """
    needed = {name: d for name, d in drivers_of(connection).items() if is_needed(name, d, uses)}
    # links may hold the safety chain, so they must know `watched` before any part is opened
    opening = _watching(opening, needed.values())
    links = needed_links(connection, needed)
    beside: dict[str, Any] = {}
    parts: dict[str, Any] = {}
    try:
        open_all("peer", connection.peers, connection.peers, opening, beside, beside)
        open_all("link", links, connection.links, opening, beside, beside)
        open_all("part", needed, connection.parts, opening, beside, parts)
        return _guarded(parts, _watching(opening, parts.values()), beside)
    except BaseException:
        for opened in (*parts.values(), *reversed(beside.values())):
            try_to(getattr(opened, "close", nothing))
        raise


def _watching(opening: RunInfo, givers: Iterable[Any]) -> RunInfo:
    """The run info; `watched` is set if one of these parts or drivers gives the user's pose."""
    watched = any("user.pose" in (given_by(giver) or ()) for giver in givers)
    return replace(opening, safety=replace(opening.safety, watched=watched))


def _guarded(parts: dict[str, Any], opening: RunInfo, beside: Mapping[str, Any]) -> Connected:
    guard, now = None, opening.now
    watched = {**beside, **{f"part {name}": part for name, part in parts.items()}}
    line: StopLine = parts.get("stop_line") or StopLatch(lambda: True)
    stops = parts["stop_line"] = Stops(line, parts, now, opening.tell)
    stops.health = Health(watched, stops.blame)
    if "base" in parts:
        parked = opening.body.parked if "arm" in parts else None
        modes = opening.body.base.modes
        guard = GuardedBase(parts["base"], opening.safety, parked, stops.pull, modes)
        parts["base"] = stops.guard = guard
        if "base.pose" not in guard.base.signals and "base.odometry" in guard.base.signals:
            guard.chain.locate_by(Reckoner(opening.tracking))
    for part in parts.values():
        if hasattr(part, "line"):
            part.line = stops
    return Connected(parts, guard, now, list(beside.values()), stops.health)
