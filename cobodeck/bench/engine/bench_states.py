"""The states of the benchmark's charts: they do next to nothing, so that the engine shows."""

from __future__ import annotations

import time
from typing import ClassVar

from engine import Action, Context, Monitor, On, Run, State
from engine.files import Length


class Watch(Monitor):
    """Never sees anything."""

    outcomes = ("seen",)

    def run(self, ctx: Context) -> Run:
        while True:
            yield None


class Working(Action):
    """Never done."""

    outcomes = ("done",)

    def run(self, ctx: Context) -> Run:
        while True:
            yield None


class Once(Action):
    """Done at its second step."""

    outcomes = ("done",)

    def run(self, ctx: Context) -> Run:
        yield None
        return "done"


class Trip(Monitor):
    """Trips at its second step."""

    outcomes = ("seen",)

    def run(self, ctx: Context) -> Run:
        yield None
        return "seen"


class Take(Action):
    """Reads its input, and is done at its second step."""

    outcomes = ("done",)

    def run(self, ctx: Context, value: object) -> Run:
        yield None
        return "done"


class Give(Action):
    """Makes a value of so many numbers: a float for one, a tuple for more."""

    outcomes = ("given",)
    outputs = {"given": {"value": object}}

    def __init__(self, size: int) -> None:
        self.size = size

    def run(self, ctx: Context) -> Run:
        yield None
        value: object = 0.5 if self.size == 1 else tuple(float(n) for n in range(self.size))
        return "given", {"value": value}


class Go(Action):
    """Stands for any action of a large chart."""

    outcomes = ("arrived", "blocked")

    def __init__(self, distance: Length = 0.1) -> None:
        self.distance = distance

    def run(self, ctx: Context) -> Run:
        yield None
        return "arrived"


class Delay(Monitor):
    """Notes how old each sample of `probe`, a wall clock's reading, is at the step for it, ns."""

    outcomes = ("seen",)
    reads = {"probe": None}
    noted: ClassVar[list[int]] = []

    def run(self, ctx: Context) -> Run:
        self.noted.clear()
        while True:
            yield On("probe")
            self.noted.append(time.perf_counter_ns() - ctx.value("probe"))


STATES: tuple[type[State], ...] = (Watch, Working, Once, Trip, Take, Give, Go)
