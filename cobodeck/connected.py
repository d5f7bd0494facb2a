"""Real parts as a plant: opened by a connection, guarded, and let go of at the end."""

from __future__ import annotations

import importlib
import os
import threading
from collections import deque
from collections.abc import Callable, Collection, Container, Iterable, Mapping, Sequence
from dataclasses import replace
from inspect import signature
from typing import Any, Protocol

from cobodeck.console import FAILED, Problem
from cobodeck.wiring import Uses
from hw.connection import REFERS, Connection, RunInfo, ServedPart
from hw.interfaces import StopLine
from hw.reckoner import Reckoner
from hw.safety.guarded import CYCLE_NS, HEARD, GuardedBase
from hw.safety.stop_line import StopLatch
from hw.samples import Sample
from hw.sim.devices import ScriptedOperator
from hw.truth import Truth

Now = Callable[[], int]
ALWAYS = frozenset(("stop_line", "operator"))
"""Opened whatever the chart uses."""
OWN_HOST = "loopback"
CLOSING_S = 1.0
"""The chain has this long to finish its last cycle, s."""


class Stops:
    """The stop line in front of all parts: who pulls it also stops them, at once.

    `line` is the connection's own, or a latch of software. A reset first asks the parts that have
    something to `acknowledge`, each of them, and the guard of the wheels. `pull` may be called from
    any thread.
    """

    def __init__(self, line: StopLine, parts: Mapping[str, Any], now: Now) -> None:
        self.signals = line.signals
        self.guard: GuardedBase | None = None
        self.reason: str | None = None
        self._line, self._parts, self._now = line, parts, now

    def pull(self, reason: str) -> None:
        """Stop everything and stay so; a part that cannot stop does not keep the others from it."""
        if self.guard is not None:
            self.guard.halt(reason)  # even if it is pulled: a reset may be under way
        if self.reason is not None:
            return
        self.reason = reason
        self._line.pull(reason)
        for part in self._parts.values():
            if part is not self and hasattr(part, "stop"):
                try_to(part.stop)

    def stop(self) -> None:
        """It does not move."""

    def reset(self) -> bool:
        """Let the robot move again; False while a cause holds."""
        asked = [part for part in self._parts.values() if hasattr(part, "acknowledge")]
        answers = [part.acknowledge() for part in asked]
        if not all(answers):
            return False
        if self.guard is not None and not self.guard.reset(self._now()):
            return False
        reason, self.reason = self.reason, None  # who pulls from now on is heard
        if self._line.reset():
            return self.reason is None
        self.reason = self.reason or reason
        return False

    def samples(self, now_ns: int) -> Iterable[Sample]:
        """Those of the line."""
        return self._line.samples(now_ns)

    def close(self) -> None:
        """Let go of the line."""
        getattr(self._line, "close", _nothing)()


class WorldHost(Protocol):
    """The peer that hosts the world of fakes; see `hw.fakes.world.WorldPeer`."""

    truth: Truth | None
    truth_ns: int
    finished: bool
    failures: list[Exception]

    def advance(self) -> None:
        """Take what it has told."""
        ...

    def push_off(self) -> None:
        """An operator pushes the robot off somebody."""
        ...


class Connected:
    """Parts behind drivers; the wheels' guard cycles in a thread of its own, or in a process.

    `world` is that of fakes: it alone knows the truth, and when all is over.
    """

    def __init__(
        self,
        parts: dict[str, Any],
        guard: GuardedBase | None,
        now: Now,
        beside: Sequence[Any] = (),
    ) -> None:
        self.parts = parts
        self._beside = beside
        self.latency_ns = 0
        self.paced = True
        self.world: WorldHost | None = next((p for p in beside if hasattr(p, "truth")), None)
        self.attendant: ScriptedOperator | None = None
        self.guard = guard
        self.cycles = None if guard is None else guard.cycles
        self._failures: deque[tuple[str, Exception]] = deque(maxlen=100)
        self._told = 0
        self._now, self._over = now, threading.Event()
        self._cycling = threading.Thread(target=self._cycle, name="chain", daemon=True)
        if guard is not None and guard.cycled:
            self._cycling.start()

    @property
    def person_watched(self) -> bool:
        """Does a part track where people are?"""
        return self.guard is not None and self.guard.limits.watched

    @property
    def truth(self) -> Truth | None:
        """How things are in the world of the fakes; nobody knows in the real one."""
        return None if self.world is None else self.world.truth

    @property
    def truth_ns(self) -> int | None:
        """The instant that the truth is of, in the time of the run."""
        return None if self.world is None else self.world.truth_ns

    @property
    def finished(self) -> bool:
        """Has the person of the fakes, or the dummy, done what they were going to do?"""
        return any(getattr(shared, "finished", False) for shared in self._beside)

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """What parts have raised in threads of their own since the last look."""
        return [self._failures.popleft() for _ in range(len(self._failures))]

    def advance(self, to_ns: int) -> None:
        """The world moves on by itself; of that of the fakes the news are taken."""
        if self.world is not None:
            self.world.advance()
            self._failures += [("world", error) for error in self.world.failures[self._told :]]
            self._told = len(self.world.failures)
        if self.attendant is not None:
            self.attendant.step(to_ns)

    def quiet_until(self) -> int:
        """Anything may happen at any time."""
        return 0

    def close(self) -> None:
        """Stand, and let go of the devices; one that cannot does not keep the others from it."""
        self._over.set()
        if self.guard is not None:
            if self.guard.cycled:
                self._cycling.join(CLOSING_S)
            self._try("base", self.guard.base.stop)
        for name, part in self.parts.items():
            if hasattr(part, "close"):
                self._try(name, part.close)
        for shared in reversed(self._beside):
            if hasattr(shared, "close"):
                self._try(type(shared).__name__, shared.close)

    def _cycle(self) -> None:
        """Whatever the driver of the base raises, the chain goes on, and the robot is stopped."""
        assert self.guard is not None
        told = None
        while not self._over.wait(0.8e-9 * CYCLE_NS):
            try:
                self.guard.cycle(self._now())
            except Exception as error:  # noqa: BLE001
                if repr(error) != told:
                    told = repr(error)
                    self._failures.append(("base", error))
                try_to(self.guard.base.stop)
                self.parts["stop_line"].pull(f"base: {told}")

    def _try(self, name: str, act: Callable[[], object]) -> None:
        error = try_to(act)
        if error is not None:
            self._failures.append((name, error))


def refuse_strange_drivers(connection: Connection, packages: Container[str]) -> None:
    """Look whether all drivers are in some packages, before any of them is imported.

    Raises:
        Problem: one is not.
    """
    for entry, place, driver in connection.drivers:
        package = driver.partition(".")[0].partition(":")[0]
        if package not in packages:
            group, _, name = entry.partition(".")
            raise Problem(
                f"{place}: {group.removesuffix('s')} {name!r} by {driver}: {package!r} is the "
                "package of no project, so nothing of it is imported; run this in the project's "
                "folder, without --no-project",
                FAILED,
            )


def connect(connection: Connection, opening: RunInfo, uses: Uses) -> Connected:
    """Open the parts of a connection that a chart uses, and those that its stop depends on.

    `opening.safety.watched` counts for nothing: a part that tracks people is there, or it is not.

    Raises:
        Problem: a driver cannot be found or opened; what was opened before is closed again.
    """
    drivers = {name: _driver(name, served) for name, served in connection.parts.items()}
    needed = {name: d for name, d in drivers.items() if is_needed(name, d, uses)}
    watched = any("user.pose" in (_given_by(driver) or ()) for driver in needed.values())
    opening = replace(opening, safety=replace(opening.safety, watched=watched))
    links = _needed_links(connection, needed)
    beside: dict[str, Any] = {}
    parts: dict[str, Any] = {}
    try:
        open_all(connection.peers, connection.peers, opening, beside, beside)
        open_all(links, connection.links, opening, beside, beside)
        open_all(needed, connection.parts, opening, beside, parts)
        return _guarded(parts, opening, list(beside.values()))
    except BaseException:
        for opened in (*parts.values(), *reversed(beside.values())):
            try_to(getattr(opened, "close", _nothing))
        raise


def open_all(
    names: Collection[str],
    served: Mapping[str, ServedPart],
    opening: RunInfo,
    beside: Mapping[str, Any],
    opened: dict[str, Any],
) -> None:
    """Open some entries; those that start in the background start side by side.

    Raises:
        Problem: a driver cannot be found or opened.
    """
    for name in names:
        driver = _driver(name, served[name])
        opened[name] = _opened(name, served[name], driver, opening, beside)
    for name in names:
        error = try_to(getattr(opened[name], "wait", _nothing))
        if error is not None:
            raise _problem(name, served[name], error)


def _given_by(driver: Any) -> tuple[str, ...] | None:
    """The signals of a part, told by its class; None: they are not known before it is opened."""
    given = getattr(driver, "signals", None)
    return given if isinstance(given, tuple) else None


def _needed_links(connection: Connection, needed: Container[str]) -> list[str]:
    """The links that some parts lead to, in the order of the file."""
    wanted: set[str] = set()
    entries = [served for name, served in connection.parts.items() if name in needed]
    while entries:
        named = {str(entries[0].arguments.get(key)) for key in REFERS}
        named &= connection.links.keys() - wanted
        wanted |= named
        entries = [*entries[1:], *(connection.links[name] for name in named)]
    return [name for name in connection.links if name in wanted]


def is_needed(name: str, driver: Any, uses: Uses) -> bool:
    """Is a part commanded, read, or listened to? Whose signals are not known beforehand is."""
    given = _given_by(driver)
    if name in ALWAYS or name in uses.commands or given is None:
        return True
    heard = HEARD if "base" in uses.commands else frozenset[str]()
    return not (uses.signals | uses.welcome | heard).isdisjoint(given)


def finds_itself(connection: Connection) -> bool:
    """Do the wheels of a connection measure their way alone, and not where they are?

    Raises:
        Problem: their driver cannot be found.
    """
    served = connection.parts.get("base")
    given = None if served is None else signals_of("base", served)
    return given is not None and "base.odometry" in given and "base.pose" not in given


def signals_of(name: str, served: ServedPart) -> tuple[str, ...] | None:
    """The signals that a part can give, before it is opened; None: they are not known then.

    Raises:
        Problem: its driver cannot be found.
    """
    return _given_by(_driver(name, served))


def _guarded(parts: dict[str, Any], opening: RunInfo, beside: Sequence[Any]) -> Connected:
    guard, now, body = None, opening.now, opening.body
    line: StopLine = parts.get("stop_line") or StopLatch(lambda: True)
    stops = parts["stop_line"] = Stops(line, parts, now)
    if "base" in parts:
        watched = any("user.pose" in part.signals for part in parts.values())
        parked = body.parked if "arm" in parts else None
        safety = replace(opening.safety, watched=watched)
        guard = GuardedBase(parts["base"], safety, parked, stops.pull)
        parts["base"] = stops.guard = guard
        if "base.pose" not in guard.base.signals and "base.odometry" in guard.base.signals:
            guard.locate_by(Reckoner(opening.tracking))
    for part in parts.values():
        if hasattr(part, "line"):
            part.line = stops
    return Connected(parts, guard, now, beside)


def try_to(act: Callable[[], object]) -> Exception | None:
    """Call it; what it raised, if it did."""
    try:
        act()
    except Exception as error:  # noqa: BLE001  a driver may raise anything
        return error
    return None


def _driver(name: str, served: ServedPart) -> Any:
    try:
        return getattr(importlib.import_module(served.module), served.driver)
    except Exception as error:  # noqa: BLE001
        raise _problem(name, served, error) from None


def _opened(
    name: str, served: ServedPart, driver: Any, opening: RunInfo, beside: Mapping[str, Any]
) -> Any:
    given = {key: _placed(value) for key, value in served.arguments.items()}
    given |= {key: beside[given[key]] for key in REFERS if given.get(key) in beside}
    offered = {"now": opening.now, "opening": opening}
    try:
        wanted = signature(driver).parameters
        given |= {key: value for key, value in offered.items() if key in wanted}
        return driver(**given)
    except Exception as error:  # noqa: BLE001
        raise _problem(name, served, error) from None


def _placed(value: Any) -> Any:
    """A value of a connection file with an address of this run in place of `loopback`."""
    if isinstance(value, dict):
        return {key: _placed(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_placed(inner) for inner in value]
    return own_host() if value == OWN_HOST else value


def own_host() -> str:
    """An address of this machine that no other process takes: all of 127/8 is its own."""
    number = os.getpid() % 0x3F_FF_FE + 1
    return f"127.{64 + (number >> 16)}.{number >> 8 & 255}.{number & 255}"


def _problem(name: str, served: ServedPart, error: Exception) -> Problem:
    return Problem(f"{_told(name, served)}: {type(error).__name__}: {error}", FAILED)


def _told(name: str, served: ServedPart) -> str:
    return f"{served.place}: part {name!r} by {served.module}:{served.driver}"


def _nothing() -> None:
    """There is nothing to close."""
