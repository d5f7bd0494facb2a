"""The setup of a run: chart, scene, robot and profile, read and checked."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from behaviors import MEASURED, signals
from behaviors.profile import Profile
from cobodeck.fitness import require
from cobodeck.project import PLACE, Catalogue, catalogue, open_chart, reached
from cobodeck.setup.defaults import PROFILE, SCENE, TICK_HZ
from cobodeck.setup.open_scene import RunPlace, environment_at, open_place
from cobodeck.setup.run_profile import blaming_sets, profile_with
from cobodeck.terminal import FAILED, Problem
from engine import ConstantMismatch
from engine.chart import Chart, Library, text_without_breaks
from engine.files import FileError
from engine.files.declared import Mismatch
from engine.machine import Box, Leaf, Machine, NamedValues, Vertex, shared_part
from engine.signals import Measured, Signal, closure, roots, types_of
from hw import Pose2, PoseSigma
from hw.connection import Connection, Narrowed
from hw.model import RobotModel, Tracking, load_robot
from hw.scene import Scene
from states.environment import Environment
from states.localization import Localizes


@dataclass(frozen=True, slots=True)
class Uses:
    """What a chart needs of a robot: parts that it commands, signals that parts must measure.

    `welcome` are all measured signals that it can use, including those that it can do without.
    `person`: whether it deals with a person where there is one; `needs_person`: not without one.
    """

    commands: frozenset[str]
    signals: frozenset[str]
    welcome: frozenset[str] = frozenset()

    @property
    def person(self) -> bool:
        """Whether a person is involved, if there is one."""
        return _of_person((*self.commands, *self.signals, *self.welcome))

    @property
    def needs_person(self) -> bool:
        """Whether there has to be a person."""
        return _of_person((*self.commands, *self.signals))


def _of_person(names: Iterable[str]) -> bool:
    return any(name == "vr" or name.startswith(("user.", "vr.")) for name in names)


@dataclass(frozen=True)
class Setup:
    """The checked setup of a run.

    `given` holds the names and files by which it was requested. `localizing` is the seed of the
    localization if the base does not measure its own pose, else None. If a `connection` was named,
    its limits are already applied to robot and profile. `inputs` of the chart are as in a chart.
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
    inputs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def limits(self) -> Narrowed:
        """The limits of the connection."""
        return Narrowed() if self.connection is None else self.connection.limits

    @property
    def scans(self) -> bool:
        """True if there are scanners: simulated ones at tier 2, or real ones."""
        return self.localizing is not None or self.connection is not None

    @property
    def scene(self) -> Scene | None:
        """The room with its people and objects; None without a room."""
        return None if self.place is None else self.place.scene

    @cached_property
    def body(self) -> RobotModel:
        """The robot, with its arm folded as the profile says."""
        return self.profile.body(self.robot)

    @cached_property
    def environment(self) -> Environment:
        """The room, robot and values that states work with.

        Raises:
            Problem: there is no scene.
        """
        if self.place is None:
            raise Problem(f"chart {self.chart.name} needs a room; give one with --scene")
        environment = environment_at(self.place, self.profile, self.robot)
        plant, calibrated = self.profile.plant, self.place.scene.calibration
        noise = plant.pose_noise
        return replace(
            environment,
            period=1.0 / self.tick_hz,
            latency=plant.latency,
            pose_sigma=PoseSigma(noise, 0.5 * noise),
            user_sigma=plant.tracking_noise,
            user_delay=plant.tracking_delay,
            calibration=None if calibrated is None else calibrated.poses(),
        )

    @property
    def tracking(self) -> Tracking:
        """The tracking system's pose in the map, and the trackers' poses on the robot."""
        return Tracking.of(self.robot.sensing) if self.place is None else self.environment.tracking

    @cached_property
    def signals(self) -> dict[str, Signal]:
        """All signals by name; without a scene, the shipped ones are limited to measured ones.

        Raises:
            Problem: a signal of a project clashes with another, or depends on an unknown one.
        """
        return self._declared(scanning=True)

    @cached_property
    def signals_without_scans(self) -> dict[str, Signal]:
        """As `signals`, for parts without `base.scan`: planners then do not wait for a pose."""
        return self._declared(scanning=False)

    def _declared(self, scanning: bool) -> dict[str, Signal]:
        shipped: tuple[Signal, ...] = MEASURED
        if self.scene is not None:
            localizer = None if self.localizing is None else self.localizer
            settings = self.profile.settings
            shipped = signals(self.environment, settings, localizer, scanning=scanning)
        return self.catalogue.declared(shipped)

    def localizer(self) -> Localizes:
        """A new localizer for one run; it starts at the scene's robot pose."""
        assert self.scene is not None
        assert self.localizing is not None
        return self.environment.localizer(self.scene.robot_start, self.localizing)

    @cached_property
    def chart_sha256(self) -> str:
        """Hash of the text of the chart and of all charts it uses, but for their breakpoints."""
        digest = hashlib.sha256()
        for name in sorted(reached({self.chart.name}, self.library)):
            digest.update(text_without_breaks(self.library[name]).encode() + b"\0")
        return digest.hexdigest()

    @property
    def constants(self) -> dict[str, Callable[[], Any]]:
        """Values that are put on the board once, at the start, if they are read."""
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
        needed = {name for leaf in leaves for name in leaf.interface.needed}
        return Uses(frozenset(commands), frozenset(roots(known, needed)), welcome)

    def beside(self, chart: str) -> Setup:
        """The same setup with another chart, by name or file, and the inputs that both have.

        Raises:
            Problem: the chart cannot run; FileError: a file is wrong.
        """
        given = self.given
        main, library = open_chart(chart, self.catalogue)
        return open_setup(
            chart,
            given["scene"],
            given["profile"],
            self.tick_hz,
            given["robot"] if self.connection is None else self.connection,
            known=self.catalogue,
            sets=given["set"],
            inputs={name: self.inputs[name] for name in self.inputs.keys() & main.inputs.keys()},
            opened=lambda *_: (main, library),
        )

    def machine(self, parameters: Mapping[str, Any] | None = None) -> Machine:
        """The chart with its parameters and inputs, ready to run; without parameters built once.

        Raises:
            Mismatch: a value is wrong, or names something that is not there.
        """
        return self._built(parameters) if parameters else self._own_machine

    @cached_property
    def _own_machine(self) -> Machine:
        return self._built(None)

    def _built(self, parameters: Mapping[str, Any] | None) -> Machine:
        known = self.catalogue
        return Machine(
            self.chart,
            self.library,
            known.interfaces,
            parameters,
            known.types,
            inputs=self.inputs,
            around=self.named_values,
        )

    @cached_property
    def named_values(self) -> NamedValues:
        """What names in the values of charts stand for in this run."""
        places = {} if self.scene is None else self.scene.places
        return NamedValues(
            constants=self.profile.constants,
            signals=types_of(self.signals),
            named={PLACE: places},
        )


def open_setup(  # noqa: PLR0913  one call says all there is to say
    chart: str | None = None,
    scene: str | None = None,
    profile: str | None = None,
    tick_hz: int = TICK_HZ,
    robot: str | Connection | None = None,
    charts: Mapping[str, Chart] | None = None,
    known: Catalogue | None = None,
    sets: Sequence[str] = (),
    inputs: Mapping[str, Any] | None = None,
    opened: Callable[[str, Catalogue], tuple[Chart, Library]] = open_chart,
) -> Setup:
    """Read and check everything that a run needs; without `chart` it is the profile's.

    `robot` replaces the scene's; given without `scene`, there is no scene. A connection's limits
    apply to its robot, which must be the scene's; the connection may name a scene. `charts` are
    those of an earlier run by name, in place of files; `chart` is one of them. `known` is what
    charts may name, by default everything found from the current folder. `sets` are single values
    of the profile, as KEY=VALUE. `inputs` are values for the chart's inputs, as in a chart.
    `opened` opens a chart; who makes many setups of one chart may keep it.

    Raises:
        Problem: the chart cannot run; FileError: a file or a value of `sets` is wrong.
    """
    known = known or catalogue()
    recorded = charts is not None
    used_profile = profile_with(profile or PROFILE, sets)
    chart = chart or used_profile.chart
    if charts is None:
        main, charts = opened(chart, known)
        chart = main.name
        with blaming_sets():
            require("setup", profile=used_profile, library=charts)
    connection = robot if isinstance(robot, Connection) else None
    named = robot.model if isinstance(robot, Connection) else robot
    if connection is not None:
        scene = scene or connection.scene
    place = open_place(scene or SCENE) if scene is not None or robot is None else None
    body = load_robot(named or (place.scene.robot if place is not None else ""))
    if connection is not None:
        if place is not None:
            require("setup", connection=connection, robot=body, place=place)
        body = connection.limits.body(body)
        used_profile = used_profile.narrowed(connection.limits)
    with blaming_sets():
        applied = used_profile.apply(charts, reached({chart}, charts))
    setup = Setup(
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
        inputs=inputs or {},
    )
    if not recorded:  # the states of an earlier run may be unknown here
        with blaming_sets():
            _require_values(setup)
    return setup


def _require_values(setup: Setup) -> None:
    """Check that all values have the types that they need, and that no part is commanded twice.

    Raises:
        Problem: a value is wrong; the text names it. FileError: one of the profile is.
    """
    library, name = setup.library, setup.chart.name
    try:
        shared = shared_part(setup.machine())
    except Mismatch as mismatch:
        finding = None
        if isinstance(mismatch, ConstantMismatch):
            charts = [library[used] for used in sorted(reached({name}, library))]
            finding = setup.profile.refused(mismatch, charts)
        if finding is not None:
            raise FileError([finding]) from None
        raise Problem(f"chart {name}: {mismatch}") from None
    if shared:
        raise Problem(f"chart {name}: {shared}", FAILED)


def _in_place(robot: RobotModel, place: RunPlace | None) -> RobotModel:
    """The robot with the scanner yaws that were calibrated for this place, if any."""
    calibrated = None if place is None else place.scene.calibration
    if calibrated is None or not calibrated.scanner_yaws:
        return robot
    turned = {name: Pose2(0.0, 0.0, yaw) for name, yaw in calibrated.scanner_yaws.items()}
    return replace(robot, sensing=robot.sensing.moved(turned))


def reachable(machine: Machine) -> list[Leaf]:
    """The leaves that can be entered, assuming that every outcome is possible."""
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
