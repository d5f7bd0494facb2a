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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
from engine.files import CODE, FileError, Finding, Place
from engine.files.declared import (
    Fault,
    Item,
    Mismatch,
    Name,
    Written,
    find_file,
    gather,
    known_files,
    load_yaml,
    record,
)
from hw.model import RobotModel
from hw.scene import Room
from states import Localization, Navigation
from states.environment import Environment

if TYPE_CHECKING:
    from hw.connection import Narrowed


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
        parked = None if robot.arm is None else self.robot.parked(robot.arm.model.name)
        if robot.arm is None or parked is None:
            return robot
        return dataclasses.replace(robot, parked=parked)

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
            key = f"charts.{chart.name}.{name}"
            raise FileError([self.finding(key, str(mismatch))]) from None

    def finding(self, key: str, message: str, hint: str = "") -> Finding:
        """A mistake in the value of a key, by its dotted name."""
        return Finding(CODE, f"{key}: {message}", self.places[key], hint)


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
class ProfileFile:
    """A value for every parameter."""

    profile: Name
    """Its name."""
    robot: RobotSettings
    """Limits of the robot; the lower of these and the robot's own applies."""
    safety: SafetySettings
    """The safety chain in front of the wheels."""
    plant: PlantSettings
    """Imperfections of simulated robots."""
    navigation: Navigation
    """The three navigation subsystems."""
    user: UserSettings
    """Estimation and prediction of the user's motion."""
    escape: EscapeSettings
    """The behaviour Escape."""
    chase: ChaseSettings
    """The behaviour Chase."""
    haptic: HapticSettings
    """The behaviour Haptic."""
    localization: Localization = "combined"
    """Scan matching with particles, filter and trackers combined; or AMCL alone."""
    charts: Mapping[str, Mapping[str, Item]] = field(default_factory=dict)
    """Parameters of charts, in place of their defaults."""
    about: str = ""
    """What it is good for."""
    base: Annotated[Item, Written(str)] | None = None
    """The profile that it is merged with, by name or by file."""

    def faults(self) -> Iterator[Fault]:
        if not self.about and self.base is None:
            yield "about", "the key 'about' is missing"


def _profile(item: Item, sets: tuple[str, ...]) -> Profile:
    layers = layered(item, sets)
    read = record(layers.item, ProfileFile)
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
