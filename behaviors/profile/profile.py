"""Profiles: YAML files that give every parameter a value.

    profile: tuned
    about: what it is good for
    robot: …            # behaviors.profile.settings.RobotSettings
    safety: …           # SafetySettings
    plant: …            # PlantSettings, of simulated robots
    navigation: …       # states.environment.environment.Navigation
    user: …  escape: …  chase: …  haptic: …      # behaviors.profile.settings.Settings
    charts: {chase: {patience: 20 s}}            # parameters of charts, in place of their defaults

Values may have units, as in charts. All sections but `charts` have to be complete, in the file
itself or together with its `base` (`profile_layers.py`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, get_args

from behaviors.profile.profile_layers import FOLDER, layered
from behaviors.profile.settings import (
    ChaseSettings,
    EscapeSettings,
    HapticSettings,
    PlantSettings,
    RobotSettings,
    SafetySettings,
    Settings,
    UserSettings,
)
from engine import builtin_types, convert
from engine.chart import Chart
from engine.files import CODE, FileError, Finding, Place, did_you_mean
from engine.files.declared import (
    Fault,
    Item,
    Mismatch,
    Name,
    find_file,
    gather,
    known_files,
    load_yaml,
    record,
)
from hw import USER_RADIUS
from hw.connection import Narrowed
from hw.model import RobotModel
from hw.scene import Room
from states import Localization, Navigation, SubsystemName
from states.environment import Environment


@dataclass(frozen=True, eq=False)
class Profile:
    """A checked profile.

    `places` has the position of every key in its file, and `values` what is written there, by the
    key's dotted name; `sets` are the values that were set on top of the file, as KEY=VALUE.
    """

    name: str
    about: str
    robot: RobotSettings
    safety: SafetySettings
    plant: PlantSettings
    navigation: Navigation
    localization: Localization
    settings: Settings
    charts: Mapping[str, Mapping[str, Any]]
    places: Mapping[str, Place]
    values: Mapping[str, Any]
    sha256: str
    sets: tuple[str, ...] = ()

    def body(self, robot: RobotModel) -> RobotModel:
        """The robot, with its arm folded as this profile says."""
        parked = None if robot.arm is None else self.robot.parked(robot.arm.shape.name)
        if robot.arm is None or parked is None:
            return robot
        arm = dataclasses.replace(robot.arm, parked=parked)
        return dataclasses.replace(robot, arm=arm)

    def narrowed(self, limits: Narrowed) -> Profile:
        """This profile with the base's speeds and accelerations lowered to these limits."""
        motion = limits.motion(self.robot.limits)
        robot = dataclasses.replace(
            self.robot,
            base_speed=motion.base_speed,
            base_yaw_rate=motion.base_yaw_rate,
            base_acceleration=motion.base_acceleration,
            base_yaw_acceleration=motion.base_yaw_acceleration,
        )
        return dataclasses.replace(self, robot=robot)

    def environment(self, room: Room, robot: RobotModel) -> Environment:
        """The states' environment in this room, with the values of this profile."""
        robot = self.body(robot)
        fastest = min(self.robot.base_speed, robot.base.max_speed)
        navigation = self.navigation.capped(fastest)
        return Environment(
            room,
            robot,
            self.robot.limits,
            navigation,
            localization=self.localization,
            governor=self.safety.governor,
        )

    def apply(self, library: Mapping[str, Chart]) -> dict[str, Chart]:
        """The charts with this profile's values as defaults of their parameters.

        Charts that the profile does not name stay as they are; its values for parameters that a
        chart does not have are ignored.

        Raises:
            FileError: values that do not have the types of their parameters.
        """
        applied = gather(partial(self._applied, chart) for chart in library.values())
        return dict(zip(library, applied, strict=True))

    def _applied(self, chart: Chart) -> Chart:
        values = self.charts.get(chart.name, {})
        given = sorted(values.keys() & chart.parameters.keys())
        gather(partial(self._check, chart, name, values[name]) for name in given)
        parameters = {
            name: dataclasses.replace(parameter, default=values[name], required=False)
            if name in values
            else parameter
            for name, parameter in chart.parameters.items()
        }
        return dataclasses.replace(chart, parameters=parameters)

    def _check(self, chart: Chart, name: str, value: Any) -> None:
        wanted = builtin_types().get(chart.parameters[name].type)
        try:
            if wanted is not None:
                convert(value, wanted)
        except Mismatch as mismatch:
            raise self._error(f"charts.{chart.name}.{name}", str(mismatch)) from None

    def require(self, library: Mapping[str, Chart]) -> None:
        """Check that every chart and parameter that this profile names exists.

        Raises:
            FileError: those that do not, and values of another type than their parameter.
        """
        self._require_all(library, lambda _: True)
        self.apply(library)

    def require_sets(self, library: Mapping[str, Chart]) -> None:
        """Check that every chart and parameter that `sets` name exists.

        Raises:
            FileError: those that do not.
        """
        given = {text.partition("=")[0].strip() for text in self.sets}
        self._require_all(library, given.__contains__)

    def _require_all(self, library: Mapping[str, Chart], wanted: Callable[[str], bool]) -> None:
        named = [(chart, name) for chart, values in self.charts.items() for name in values]
        gather(
            partial(self._require, library, chart, name)
            for chart, name in named
            if wanted(f"charts.{chart}.{name}")
        )

    def _require(self, library: Mapping[str, Chart], chart: str, name: str) -> None:
        key = f"charts.{chart}.{name}"
        if chart not in library:
            raise self._error(key, "no such chart", did_you_mean(chart, library))
        known = library[chart].parameters
        if name not in known:
            raise self._error(key, "no such parameter", did_you_mean(name, known))

    def require_robot(self, robot: RobotModel, *, beside_person: bool = True) -> None:
        """Check that the values suit a robot that drives, beside a person or alone.

        A robot that turns on the spot sweeps a disc whose radius is half its diagonal: every
        subsystem has to keep that from walls, and that plus the person's own radius from the user.
        The arm has to admit the parked joints.

        Raises:
            FileError: the values that do not suit, each with what the robot needs.
        """
        swept = robot.footprint.half_diagonal
        least = {"inflation": swept}
        if beside_person:
            least["user_radius"] = swept + USER_RADIUS
        errors = [
            self._error(
                f"navigation.{name}.{key}",
                f"{value:g} m is too little for {robot.name}, which needs {needed:.4g} m to turn",
            )
            for name in get_args(SubsystemName)
            for key, needed in least.items()
            if (value := getattr(self.navigation.named(name), key)) < needed
        ]
        sensors = {**robot.sensing.lidars, **robot.sensing.trackers}
        errors += [
            self._error(
                f"plant.sensing.mount_error.{name}",
                f"{robot.name} has no such scanner or tracker",
                did_you_mean(name, sensors),
            )
            for name in self.plant.sensing.mount_error
            if name not in sensors
        ]
        parked = None if robot.arm is None else self.robot.parked(robot.arm.shape.name)
        if parked is not None and robot.arm is not None:
            try:
                robot.arm.check(parked)
            except ValueError as refused:
                key = "robot.arm_parked"
                own = f"{key}.{robot.arm.shape.name}"
                key = own if own in self.places else key
                errors.append(self._error(key, f"{robot.name}: {refused}"))
        if errors:
            raise FileError(finding for error in errors for finding in error.findings)

    def _error(self, key: str, message: str, hint: str = "") -> FileError:
        return FileError([Finding(CODE, f"{key}: {message}", self.places[key], hint)])


def profile_names() -> tuple[str, ...]:
    """The names of the shipped profiles and of a project's own."""
    return tuple(known_files(FOLDER, "profile"))


def load_profile(name_or_path: str | Path, sets: Sequence[str] = ()) -> Profile:
    """A profile by name or by file, merged with its base and the single values of `sets`.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    file = find_file(str(name_or_path), FOLDER, "profile")
    return load_yaml(file, lambda item: _profile(item, tuple(sets)))


@dataclass(frozen=True, slots=True)
class _Profile:
    profile: Name
    robot: RobotSettings
    safety: SafetySettings
    plant: PlantSettings
    navigation: Navigation
    user: UserSettings
    escape: EscapeSettings
    chase: ChaseSettings
    haptic: HapticSettings
    localization: Localization = "combined"
    charts: Mapping[str, Mapping[str, Item]] = field(default_factory=dict)
    about: str = ""
    base: Item | None = None

    def faults(self) -> Iterator[Fault]:
        if not self.about and self.base is None:
            yield "about", "the key 'about' is missing"


def _profile(item: Item, sets: tuple[str, ...]) -> Profile:
    layers = layered(item, sets)
    read = record(layers.item, _Profile)
    return Profile(
        name=read.profile,
        about=read.about or layers.about,
        robot=read.robot,
        safety=read.safety,
        plant=read.plant,
        navigation=read.navigation,
        localization=read.localization,
        settings=Settings(user=read.user, escape=read.escape, chase=read.chase, haptic=read.haptic),
        charts={
            chart: {name: value.value for name, value in values.items()}
            for chart, values in read.charts.items()
        },
        places=layers.places,
        values=layers.values,
        sha256=layers.sha256,
        sets=sets,
    )
