"""Joins chart, scene, robot and profile to something that can be run.

Only the signals that a reachable state or the recorder can ask for are built, and only their
samples are handed to the run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from behaviors.profile import Profile, load_profile
from behaviors.signals import signals
from cobodeck.catalogue import Catalogue, catalogue
from cobodeck.console import Problem
from cobodeck.library import open_chart, reached
from engine.chart import Chart
from engine.machine import Box, Leaf, Machine, Vertex
from engine.run import Run
from engine.signals import Board, Signal, declare
from hw.guarded import GuardedBase
from hw.interfaces import Part, Parts
from hw.robot import RobotModel, load_robot
from hw.samples import is_finite
from hw.scene import Scene, load_scene
from states.site import Site

CHART, SCENE, PROFILE = "cobodeck", "lab_a", "tuned"
TICK_HZ = 30


@dataclass(frozen=True)
class Setup:
    """What is to be run, and where; checked."""

    chart: Chart
    library: Mapping[str, Chart]
    catalogue: Catalogue
    scene: Scene
    robot: RobotModel
    profile: Profile
    tick_hz: int = TICK_HZ

    @cached_property
    def site(self) -> Site:
        """What the states need of the place."""
        site = self.profile.site(self.scene.room, self.robot)
        return replace(site, period=1.0 / self.tick_hz, latency=self.profile.plant.latency)

    @cached_property
    def signals(self) -> dict[str, Signal]:
        """All signals there are, by name.

        Raises:
            Problem: a signal of one's own clashes with another or rests on nothing.
        """
        try:
            return declare(
                (*signals(self.site, self.profile.settings), *self.catalogue.own_signals)
            )
        except ValueError as error:
            raise Problem(str(error)) from None

    @cached_property
    def chart_sha256(self) -> str:
        """Hash of the text of the chart and of all charts it uses."""
        digest = hashlib.sha256()
        for name in sorted(reached({self.chart.name}, self.library)):
            digest.update(self.library[name].source.text.encode() + b"\0")
        return digest.hexdigest()

    def machine(self, parameters: Mapping[str, Any] | None = None) -> Machine:
        """The chart bound for one run."""
        known = self.catalogue
        return Machine(self.chart, self.library, known.interfaces, parameters, known.types)


def open_setup(
    chart: str = CHART,
    scene: str | None = None,
    profile: str | None = None,
    tick_hz: int = TICK_HZ,
) -> Setup:
    """Read and check everything a run needs.

    Raises:
        Problem: the chart cannot run; ValueError of `hw` and `behaviors`: a file is wrong.
    """
    known = catalogue()
    used_profile = load_profile(profile or PROFILE)
    opened, library = open_chart(chart, known)
    place = load_scene(scene or SCENE)
    applied = used_profile.apply(library)
    return Setup(
        chart=applied[opened.name],
        library=applied,
        catalogue=known,
        scene=place,
        robot=load_robot(place.robot),
        profile=used_profile,
        tick_hz=tick_hz,
    )


class WithoutMotion:
    """A part that cannot move, with the `stop` that the engine wants of every part."""

    def __init__(self, part: Part) -> None:
        self._part = part

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)

    def stop(self) -> None:
        """Nothing moves."""


@dataclass(frozen=True, slots=True)
class Wired:
    """A run with its board, where its samples come from, and the base that listens to them."""

    run: Run
    board: Board
    sources: tuple[Part, ...]
    base: GuardedBase | None = None

    def deliver(self, now_ns: int) -> None:
        """Hand the samples that have arrived to the run; those with NaN have not arrived."""
        board, base = self.board, self.base
        slots, inbox = board.slots, board.inbox
        for part in self.sources:
            for sample in part.samples(now_ns):
                name, stamp, value = sample
                if not is_finite(value):
                    continue
                if name in slots:
                    inbox.append((name, value, stamp))
                if base is not None and name in base.hears:
                    base.hear(sample, now_ns)

    def tick(self, now_ns: int) -> str | None:
        """One tick of the run, and then who drives; the chart's outcome once there is one."""
        try:
            return self.run.tick(now_ns)
        except BaseException:
            self.run.hold()
            raise
        finally:
            if self.base is not None:
                self.base.tick(now_ns)


def wire(
    setup: Setup,
    parts: Parts,
    *,
    eager: bool = False,
    recorded: Iterable[str] = (),
    clock: Callable[[], int] | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Wired:
    """A run of the setup's chart on these parts.

    Args:
        setup: what to run.
        parts: the robot, and what is around it.
        eager: build and compute every signal in every tick, asked for or not.
        recorded: signals that somebody else than the chart wants.
        clock: ns; only to report where the time goes.
        parameters: of the chart.
    """
    machine = setup.machine(parameters)
    wanted = {name for leaf in reachable(machine) for name in leaf.interface.reads}
    board = Board(setup.signals, wanted | set(recorded), eager)
    if clock is not None:
        board.clock = clock
    run = Run(machine, board, commanded(parts), freezers=freezers())
    board.put("site", setup.site, 0)
    board.put("settings", setup.profile.settings, 0)
    needed = tuple(
        part
        for part in parts.all()
        if any(name in parts.base.hears or board.needs(name) for name in part.signals)
    )
    return Wired(run, board, needed, parts.base)


def commanded(parts: Parts) -> dict[str, Any]:
    """The parts that states may command, by name."""
    named = {
        "base": parts.base,
        "arm": parts.arm,
        "gripper": parts.gripper,
        "vr": WithoutMotion(parts.vr),
        "stop_line": WithoutMotion(parts.stop_line),
        "operator": WithoutMotion(parts.operator),
    }
    return {name: part for name, part in named.items() if part is not None}


def freezers() -> dict[type, Callable[[Any], Any]]:
    """How values of foreign classes are made immutable when they enter a chart's data."""
    import sys

    if "numpy" not in sys.modules:
        return {}
    import numpy as np

    def freeze(array: Any) -> Any:
        fixed = array.copy()
        fixed.setflags(write=False)
        return fixed

    return {np.ndarray: freeze}


def reachable(machine: Machine) -> list[Leaf]:
    """The leaves that can be entered at all, taking every outcome for possible."""
    seen: dict[Vertex, None] = {}
    waiting: list[Vertex] = [machine.root]
    while waiting:
        vertex = waiting.pop()
        if vertex in seen:
            continue
        seen[vertex] = None
        waiting += vertex.go.values()
        if isinstance(vertex, Box):
            waiting += vertex.children[:1] if vertex.form == "states" else vertex.children
    return [vertex for vertex in seen if isinstance(vertex, Leaf)]
