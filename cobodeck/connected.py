"""Real parts as a plant: opened by a connection, guarded, and let go of at the end."""

from __future__ import annotations

import importlib
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from cobodeck.console import FAILED, Problem
from hw.connection import Connection, Served
from hw.guarded import CYCLE_NS, GuardedBase
from hw.robot import RobotModel
from hw.safety_limits import SafetyLimits
from hw.sim.surroundings import SimStopLine

Now = Callable[[], int]


class Connected:
    """Parts behind drivers. Wheels get their guard, and a thread that lets it cycle."""

    def __init__(self, parts: dict[str, Any], guard: GuardedBase | None, now: Now) -> None:
        self.parts = parts
        self.latency_ns = 0
        self.finished = False
        self.truth = None
        self.guard = guard
        self._now, self._over = now, threading.Event()
        self._cycling = threading.Thread(target=self._cycle, name="chain", daemon=True)
        if guard is not None:
            self._cycling.start()

    @property
    def person_watched(self) -> bool:
        """Does a part track where people are?"""
        return self.guard is not None and self.guard.chain.limits.watched

    def advance(self, to_ns: int) -> None:
        """The world moves on by itself."""

    def quiet_until(self) -> int:
        """Anything may happen at any time."""
        return 0

    def close(self) -> None:
        """Stand, and let go of the devices."""
        self._over.set()
        if self.guard is not None:
            self._cycling.join()
            self.guard.base.stop()
        for part in self.parts.values():
            if hasattr(part, "close"):
                part.close()

    def _cycle(self) -> None:
        assert self.guard is not None
        while not self._over.wait(0.8e-9 * CYCLE_NS):
            self.guard.cycle(self._now())


def connect(connection: Connection, body: RobotModel, limits: SafetyLimits, now: Now) -> Connected:
    """Open all parts of a connection.

    Raises:
        Problem: a driver cannot be found or opened; what was opened before is closed again.
    """
    parts: dict[str, Any] = {}
    try:
        for name, served in connection.parts.items():
            parts[name] = _opened(name, served, now)
    except Problem:
        Connected(parts, None, now).close()
        raise
    guard = None
    if "base" in parts:
        watched = any("user.pose" in part.signals for part in parts.values())
        parked = body.parked if "arm" in parts else None
        pull = partial(_pull, parts)
        guard = GuardedBase(parts["base"], replace(limits, watched=watched), parked, pull)
        parts["base"] = guard
    parts.setdefault("stop_line", SimStopLine(lambda: guard is None or guard.reset(now())))
    return Connected(parts, guard, now)


def _pull(parts: Mapping[str, Any], reason: str) -> None:
    """A stop of the base's guard stops the other parts, too."""
    parts["stop_line"].pull(reason)


def _opened(name: str, served: Served, now: Now) -> Any:
    try:
        driver = getattr(importlib.import_module(served.module), served.driver)
        return driver(**served.arguments, now=now)
    except Exception as error:  # noqa: BLE001  a driver may raise anything
        told = f"{served.place}: part {name!r} by {served.module}:{served.driver}"
        raise Problem(f"{told}: {type(error).__name__}: {error}", FAILED) from None
