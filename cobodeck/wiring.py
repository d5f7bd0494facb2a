"""Joins chart, scene, robot and profile to something that can be run.

Only the signals that a reachable state or the recorder can ask for are built, and only their
samples are handed to the run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from behaviors.profile import Profile, load_profile
from behaviors.signals import ESTIMATE, MEASURED, signals
from cobodeck.catalogue import Catalogue, catalogue
from cobodeck.console import FAILED, Problem
from cobodeck.inlet import Inlet
from cobodeck.library import open_chart, reached
from cobodeck.places import RunPlace, environment_at, open_place
from cobodeck.plants import Inert
from engine.board import Board
from engine.chart import Chart
from engine.files.finding import FileError
from engine.machine import Box, Leaf, Machine, Vertex
from engine.run import ChartRun
from engine.signals import Measured, Signal, closure, declare, roots
from engine.slots import compute
from hw.connection import Connection, Narrowed
from hw.interfaces import RobotPart
from hw.robot import RobotModel, load_robot
from hw.safety.guarded import GuardedBase
from hw.samples import PoseSigma, Sample
from hw.scene import Scene
from hw.tracking import Tracking
from states.environment import Environment
from states.localization.estimates import Localizes

ValueTap = Callable[[str, Any], Any]
"""Makes what stands in front of a part, from its name and the part."""
CHART, SCENE, PROFILE = "cobodeck", "lab_a", "tuned"
TICK_HZ = 30


@dataclass(frozen=True, slots=True)
class Uses:
    """What a chart needs of a robot: parts by name, and signals that parts have to measure.

    `welcome` are all that can be of use to it, those that it can do without included.
    """

    commands: frozenset[str]
    signals: frozenset[str]
    welcome: frozenset[str] = frozenset()

    @property
    def person(self) -> bool:
        """Does it involve a person?"""
        asked = (*self.commands, *self.signals)
        return any(name == "vr" or name.startswith(("user.", "vr.")) for name in asked)


@dataclass(frozen=True)
class Setup:
    """What is to be run, and where; checked. `given` is what it was asked for by.

    `localizing` is the seed of localization where the base does not know where it is, else None.
    Robot and profile have the limits of the `connection`, if one was named.
    """

    chart: Chart
    library: Mapping[str, Chart]
    catalogue: Catalogue
    place: RunPlace | None
    robot: RobotModel
    profile: Profile
    tick_hz: int = TICK_HZ
    given: Mapping[str, Any] = field(default_factory=dict)
    localizing: int | None = None
    connection: Connection | None = None

    @property
    def limits(self) -> Narrowed:
        """Those of the connection."""
        return Narrowed() if self.connection is None else self.connection.limits

    @property
    def scene(self) -> Scene | None:
        """The room, and who and what is in it."""
        return None if self.place is None else self.place.scene

    @cached_property
    def body(self) -> RobotModel:
        """The robot, with its arm folded as the profile says."""
        return self.profile.body(self.robot)

    @cached_property
    def environment(self) -> Environment:
        """What the states need of the place.

        Raises:
            Problem: there is no scene.
        """
        if self.place is None:
            raise Problem(f"chart {self.chart.name} needs a room; give one with --scene")
        environment = environment_at(self.place, self.profile, self.robot)
        noise, calibrated = self.profile.plant.pose_noise, self.place.scene.calibration
        return replace(
            environment,
            period=1.0 / self.tick_hz,
            latency=self.profile.plant.latency,
            pose_sigma=PoseSigma(noise, 0.5 * noise),
            calibration=None if calibrated is None else calibrated.poses(),
        )

    @property
    def tracking(self) -> Tracking:
        """Where the tracking system lies in the map, and its trackers on the robot."""
        return Tracking.of(self.robot.sensing) if self.place is None else self.environment.tracking

    @cached_property
    def signals(self) -> dict[str, Signal]:
        """All signals there are, by name; without a scene, of the shipped ones the measured.

        Raises:
            Problem: a signal of one's own clashes with another or rests on nothing.
        """
        return self._declared(scanning=True)

    @cached_property
    def signals_without_scans(self) -> dict[str, Signal]:
        """The same where nothing gives `base.scan`: planners then wait for no pose."""
        return self._declared(scanning=False)

    def _declared(self, scanning: bool) -> dict[str, Signal]:
        shipped: tuple[Signal, ...] = MEASURED
        if self.scene is not None:
            localizer = None if self.localizing is None else self.localizer
            settings = self.profile.settings
            shipped = signals(self.environment, settings, localizer, scanning=scanning)
        try:
            return declare((*shipped, *self.catalogue.own_signals))
        except ValueError as error:
            raise Problem(str(error)) from None

    def localizer(self) -> Localizes:
        """A new one, for one run; it starts where the scene says that the robot stands."""
        assert self.scene is not None
        assert self.localizing is not None
        return self.environment.localizer(self.scene.robot_start, self.localizing)

    @cached_property
    def chart_sha256(self) -> str:
        """Hash of the text of the chart and of all charts it uses."""
        digest = hashlib.sha256()
        for name in sorted(reached({self.chart.name}, self.library)):
            digest.update(self.library[name].source.text.encode() + b"\0")
        return digest.hexdigest()

    @property
    def constants(self) -> dict[str, Callable[[], Any]]:
        """Values that are put once, at the start, if anybody reads them."""
        found: dict[str, Callable[[], Any]] = {"settings": lambda: self.profile.settings}
        return found if self.scene is None else {**found, "environment": lambda: self.environment}

    def uses(self, parameters: Mapping[str, Any] | None = None) -> Uses:
        """What the reachable states of the chart command and read."""
        leaves = reachable(self.machine(parameters))
        reads = {name for leaf in leaves for name in leaf.interface.reads}
        commands = {part for leaf in leaves for part in leaf.interface.commands}
        known = self.signals
        used = (known[name] for name in closure(known, reads & known.keys()))
        welcome = frozenset(s.name for s in used if isinstance(s, Measured))
        return Uses(frozenset(commands), frozenset(roots(known, reads)), welcome)

    def machine(self, parameters: Mapping[str, Any] | None = None) -> Machine:
        """The chart bound for one run."""
        known = self.catalogue
        return Machine(self.chart, self.library, known.interfaces, parameters, known.types)


def open_setup(  # noqa: PLR0913  one call says all there is to say
    chart: str = CHART,
    scene: str | None = None,
    profile: str | None = None,
    tick_hz: int = TICK_HZ,
    robot: str | Connection | None = None,
    charts: Mapping[str, Chart] | None = None,
    known: Catalogue | None = None,
    sets: Sequence[str] = (),
) -> Setup:
    """Read and check everything a run needs.

    `robot` takes the place of the scene's; given alone, there is no scene at all. That of a
    connection has its limits; it has to be the scene's, and the connection may name a scene.
    `charts`: those of an earlier run by name, in place of files; `chart` is one of them. What
    charts may name is `known`; by default all there is around the present folder. `sets` are
    single values of the profile, KEY=VALUE.

    Raises:
        Problem: the chart cannot run; FileError: a file or a value of `sets` is wrong.
    """
    known = known or catalogue()
    with _blaming_sets():
        used_profile = load_profile(profile or PROFILE, sets)
    if charts is None:
        opened, charts = open_chart(chart, known)
        chart = opened.name
        with _blaming_sets():
            used_profile.require_sets(charts)
    connection = robot if isinstance(robot, Connection) else None
    named = robot.model if isinstance(robot, Connection) else robot
    if connection is not None:
        scene = scene or connection.scene
    place = open_place(scene or SCENE) if scene is not None or robot is None else None
    body = load_robot(named or (place.scene.robot if place is not None else ""))
    if connection is not None:
        refuse_other_body(connection, body, place)
        body = connection.limits.body(body)
        used_profile = used_profile.narrowed(connection.limits)
    with _blaming_sets():
        applied = used_profile.apply(charts)
    return Setup(
        chart=applied[chart],
        library=applied,
        catalogue=known,
        place=place,
        robot=_in_place(body, place),
        profile=used_profile,
        tick_hz=tick_hz,
        given={
            "scene": scene,
            "profile": profile,
            "robot": named,
            "set": list(sets),
            "connection": None if connection is None else connection.known_as,
        },
        connection=connection,
    )


@contextmanager
def _blaming_sets() -> Iterator[None]:
    """Mistakes in values of the command line alone are mistakes in its use."""
    try:
        yield
    except FileError as error:
        if all(finding.place.file.startswith("--set ") for finding in error.findings):
            raise Problem(str(error)) from None
        raise


def refuse_other_body(connection: Connection, body: RobotModel, place: RunPlace | None) -> None:
    """Look whether scene and connection are of one robot; a map is of none.

    Raises:
        Problem: they are not.
    """
    if connection.model is None or place is None or place.map is not None:
        return
    scenes = load_robot(place.scene.robot).name
    if scenes != body.name:
        raise Problem(
            f"scene {place.scene.name} is made for robot {scenes}, connection {connection.name} "
            f"is of {body.name}; take a scene whose robot is {body.name}"
        )


def _in_place(robot: RobotModel, place: RunPlace | None) -> RobotModel:
    """A robot with its scanners as they were found to be turned where it is used."""
    calibrated = None if place is None else place.scene.calibration
    if calibrated is None or not calibrated.scanner_yaws:
        return robot
    return replace(robot, sensing=robot.sensing.turned(calibrated.scanner_yaws))


class WithoutMotion:
    """A part that cannot move, with the `stop` that the engine needs from every part."""

    def __init__(self, part: RobotPart) -> None:
        self._part = part

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)

    def stop(self) -> None:
        """Nothing moves."""


@dataclass(frozen=True, slots=True)
class Wired:
    """A run with its board, the way in for its samples, and what its states drive the base by.

    `show` is that of the virtual world, where it wants to be called in every tick (see `Vr`).
    """

    run: ChartRun
    board: Board
    inlet: Inlet
    base: GuardedBase | None = None
    show: Callable[[int], None] | None = None

    def pass_on(self, stamp_ns: int) -> None:
        """In every tick: what the base has to do from this instant on, and what the VR shows."""
        if self.base is not None:
            if self.base.reckons and ESTIMATE in self.board.slots:
                self._locate(self.base, stamp_ns)
            self.base.tick(stamp_ns)
        if self.show is not None:
            self.show(stamp_ns)

    def _locate(self, base: GuardedBase, now_ns: int) -> None:
        """Tell the safety chain where localization takes the base to have been."""
        slot = self.board.slots[ESTIMATE]
        compute(slot)  # what it raises, the states that read it get
        found = slot.newest
        if found is None:
            base.locate(0, None, None)
            return
        pose, sigma = found.value
        base.locate(found.stamp, pose, sigma)
        self.inlet.tell(Sample("base.pose", found.stamp, pose), now_ns)
        self.inlet.tell(Sample("base.pose_sigma", found.stamp, sigma), now_ns)

    def tick(self, now_ns: int, stamp_ns: int, between: bool = False) -> str | None:
        """One tick of the run, and then who drives; the chart's outcome once there is one.

        `stamp_ns` is the instant of the robot, which may stand between two ticks; `between`: the
        tick is none of the grid (rule 13).
        """
        try:
            return self.run.tick(now_ns, between)
        except BaseException:
            self.run.hold()
            raise
        finally:
            self.pass_on(stamp_ns)


def wire(
    setup: Setup,
    parts: Mapping[str, Any],
    *,
    eager: bool = False,
    clock: Callable[[], int] | None = None,
    parameters: Mapping[str, Any] | None = None,
    tap: ValueTap | None = None,
) -> Wired:
    """A run of the setup's chart on these parts.

    Args:
        setup: what to run.
        parts: the robot and what is around it, by name.
        eager: build and compute every signal in every tick, asked for or not.
        clock: ns; only to report where the time goes.
        parameters: of the chart.
        tap: makes what states are given in place of a part.

    Raises:
        Problem: the chart commands parts, or reads signals, that are not there; all are named.
    """
    machine = setup.machine(parameters)
    leaves = reachable(machine)
    constants = setup.constants
    hint = "; give a room with --scene" if setup.scene is None else ""
    scanning = any("base.scan" in part.signals for part in parts.values())
    declared = setup.signals if scanning else setup.signals_without_scans
    refuse_what_is_missing(leaves, declared, parts, constants, hint)
    wanted = {name for leaf in leaves for name in leaf.interface.reads}
    if setup.localizing is not None:
        wanted.add(ESTIMATE)  # the safety chain goes by it
    board = Board(declared, wanted, eager)
    if clock is not None:
        board.clock = clock
    given = commanded(parts)
    if tap is not None:
        given = {name: tap(name, part) for name, part in given.items()}
    run = ChartRun(machine, board, given, freezers=freezers())
    hears = [(name, part.hear) for part in parts.values() for name in getattr(part, "hears", ())]
    heard = {name for name, _ in hears}
    needed = {
        key: part
        for key, part in parts.items()
        if any(board.needs(name) or name in heard for name in part.signals)
    }
    inlet = Inlet(board, needed, hears)
    for name, value in constants.items():
        if board.needs(name):
            inlet.put(name, value(), 0)
    show = getattr(parts.get("vr"), "show", None)
    return Wired(run, board, inlet, guarded(parts), show)


def guarded(parts: Mapping[str, Any]) -> GuardedBase | None:
    """The base, if there is one.

    Raises:
        TypeError: whoever opened its wheels has not put a guard in front of them.
    """
    base = parts.get("base")
    if isinstance(base, Inert):
        return None
    if base is not None and not isinstance(base, GuardedBase):
        raise TypeError(
            f"part base is a {type(base).__name__}; wrap it in hw.safety.guarded.GuardedBase"
        )
    return base


def refuse_what_is_missing(
    leaves: Iterable[Leaf],
    signals: Mapping[str, Signal],
    parts: Mapping[str, Any],
    constants: Iterable[str],
    hint: str = "",
) -> None:
    """Look whether everything is there that the reachable states command and read.

    Raises:
        Problem: it is not; the text names every part and signal, and a state that needs it.
    """
    given = {name for part in parts.values() for name in part.signals} | set(constants)
    lacking: dict[str, None] = {}
    for leaf in leaves:
        who = leaf.interface.name
        for name in leaf.interface.commands:
            if name not in parts:
                lacking[f"this robot lacks part {name!r}, commanded by {who}"] = None
        for name in leaf.interface.reads:
            for root in sorted(roots(signals, (name,)) - given):
                through = "" if root == name else f" through {name!r}"
                lacking[f"nothing gives signal {root!r}, read by {who}{through}"] = None
    if lacking:
        told = "\n  ".join(lacking)
        raise Problem(f"this chart cannot run here{hint}:\n  {told}", FAILED)


def refuse_slow_ticks(setup: Setup, uses: Uses, latency: float = 0.0) -> None:
    """Look whether the velocity of the base is renewed before the safety chain drops it.

    Args:
        setup: what is to be run.
        uses: of the chart; one that does not command the base may tick as slowly as it likes.
        latency: from a tick to the robot, s, where that is simulated.

    Raises:
        Problem: it is not, and the base would stop and go.
    """
    oldest = 1.0 / setup.tick_hz + latency
    limits = setup.profile.safety.limits(setup.robot, setup.profile.robot.limits)
    if "base" in uses.commands and oldest >= limits.command_age:
        raise Problem(
            f"at {setup.tick_hz} Hz a velocity of the base is {oldest * 1e3:.1f} ms old before the "
            f"next one comes; the safety chain stops the base if that is not less than "
            f"{limits.command_age * 1e3:g} ms: raise --tick-hz"
        )


def commanded(parts: Mapping[str, Any]) -> dict[str, Any]:
    """The parts as states command them, by name."""
    return {
        name: part if hasattr(part, "stop") else WithoutMotion(part) for name, part in parts.items()
    }


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
