"""Profiles: YAML files that give every parameter a value.

    profile: tuned
    about: what it is good for
    policy: tuned       # whose decisions it has values for: the paper's, or ours
    chart: cobodeck     # the chart that is run where none is named
    robot: …            # behaviors.profile.settings.RobotSettings
    safety: …           # SafetySettings
    plant: …            # PlantSettings, of simulated robots
    navigation: …       # states.environment.environment.Navigation
    user: …  escape: …  chase: …  haptic: …  inform: …   # behaviors.profile.settings.Settings
    charts: {chase: {patience: 20 s}}            # parameters of charts, in place of their defaults

Values may have units, as in charts, and charts pick them by name, as `$profile.escape.ahead`. What
a file leaves out is as in its `base` (`profile_layers.py`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from behaviors.profile.chart_constants import (
    PREFIX,
    missing_constants,
    place_of_constant,
)
from behaviors.profile.profile_layers import BASE, FOLDER, NO_PROFILE, SET, layered
from behaviors.profile.settings import (
    POLICIES,
    ChaseSettings,
    EscapeSettings,
    HapticSettings,
    InformSettings,
    PlantSettings,
    Policy,
    RobotSettings,
    SafetySettings,
    Settings,
    UserSettings,
)
from engine import Constant, ConstantMismatch, convert, known_types
from engine.chart import Chart, Parameter, Reference
from engine.files import CODE, FileError, Finding, Place, not_found
from engine.files.declared import (
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
from states import Localization, LocalizerEffort, Navigation
from states.environment import Environment

if TYPE_CHECKING:
    from hw.connection import Narrowed


@dataclass(frozen=True, eq=False)
class Profile:
    """A checked profile: the `policy` that its values are for, and the top `chart` of that policy.

    `places` has the position of every key in its file, and `values` what is written there, by the
    key's dotted name; `sets` are the values that were set on top of the file, as KEY=VALUE.
    """

    name: str
    about: str
    policy: Policy
    chart: str
    robot: RobotSettings
    safety: SafetySettings
    plant: PlantSettings
    navigation: Navigation
    localization: Localization
    localizer: LocalizerEffort
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
            effort=self.localizer,
            governor=self.safety.governor,
        )

    @cached_property
    def constants(self) -> dict[str, Constant]:
        """The values by the names that charts pick them by, such as `profile.escape.ahead`."""
        return {PREFIX + key: Constant(v, self.origin(key)) for key, v in self.values.items()}

    def origin(self, key: str) -> str:
        """Where the value of a key is written: `tuned: chase.inner` or `--set chase.inner=2 m`."""
        file = self.places[key].file
        return file if file.startswith(SET) else f"{Path(file).stem}: {key}"

    def apply(
        self, library: Mapping[str, Chart], used: Collection[str] | None = None
    ) -> dict[str, Chart]:
        """The charts with this profile's values as defaults of their parameters.

        They are those of its section `charts`, and those that charts pick by name. Values for
        parameters that a chart does not have are ignored. Of charts that are not `used` what they
        pick may be missing or of another type; None: all are used.

        Raises:
            FileError: values that do not have the types of their parameters, or are missing.
        """
        applied = gather(
            partial(self._applied, chart, used is None or name in used)
            for name, chart in library.items()
        )
        return dict(zip(library, applied, strict=True))

    def _applied(self, chart: Chart, is_used: bool) -> Chart:
        parameters = gather(
            partial(self._with_value, chart, parameter, is_used)
            for parameter in chart.parameters.values()
        )
        applied = dataclasses.replace(chart, parameters={p.name: p for p in parameters})
        missing = tuple(missing_constants(applied, self.constants, self.name)) if is_used else ()
        if missing:
            raise FileError(missing)
        return applied

    def _with_value(self, chart: Chart, parameter: Parameter, is_used: bool) -> Parameter:
        """A parameter with this profile's value, if it has one, as its default."""
        key = f"charts.{chart.name}.{parameter.name}"
        own, picked = self.charts.get(chart.name, {}), parameter.default
        at, told = None, ""
        if parameter.name in own:
            default = own[parameter.name]
        elif isinstance(picked, Reference) and picked.name in self.constants:
            key, default = picked.name.removeprefix(PREFIX), self.constants[picked.name].value
            at = chart.place(chart.declared_mark("parameters", parameter.name, "default"))
            told = f"{parameter.name}: {picked} ({self.origin(key)})"
        else:
            return parameter
        wanted = known_types({}).get(parameter.type)
        try:
            if wanted is not None:
                convert(default, wanted)
        except Mismatch as mismatch:
            if at is not None and not is_used:
                return parameter
            if at is not None and self.is_shipped(key):
                raise FileError([Finding("N09", f"{told}: {mismatch}", at)]) from None
            raise FileError([self.finding(key, str(mismatch))]) from None
        return dataclasses.replace(
            parameter, default=default, required=False, origin=self.origin(key)
        )

    def chart_values(self, library: Mapping[str, Chart]) -> dict[str, Constant]:
        """What the section `charts` says of the parameters of these charts, as `chase.near`."""
        return {
            f"{chart}.{name}": Constant(value, self.origin(f"charts.{chart}.{name}"))
            for chart, values in self.charts.items()
            if chart in library
            for name, value in values.items()
            if name in library[chart].parameters
        }

    def refused(self, mismatch: ConstantMismatch, charts: Iterable[Chart]) -> Finding | None:
        """The mistake in a value that is picked by name, or in the chart that picks a shipped one.

        None: no chart does, and so it is picked from outside.
        """
        key = mismatch.name.removeprefix(PREFIX)
        if not self.is_shipped(key):
            return Finding(CODE, str(mismatch), self.places[key])
        at = place_of_constant(charts, mismatch.name)
        return None if at is None else Finding("N09", str(mismatch), at)

    def is_shipped(self, key: str) -> bool:
        """Whether the value of a key is that of a shipped profile, and no mistake of the user's."""
        return Path(self.places[key].file).resolve().parent == FOLDER.resolve()

    def finding(self, key: str, message: str, hint: str = "") -> Finding:
        """A mistake in the value of a key, by its dotted name."""
        return Finding(CODE, f"{key}: {message}", self.places[key], hint)


def profile_names() -> tuple[str, ...]:
    """The names of the shipped profiles and of a project's own, all of which can be run."""
    return tuple(name for name, file in known_files(FOLDER, "profile").items() if not is_base(file))


def resting_on_base() -> tuple[str, ...]:
    """The names of the shipped profiles; each of them is merged with the base."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.yaml") if not is_base(file)))


def is_base(file: Path) -> bool:
    """Whether this file is no profile, but what the shipped ones share."""
    return file.resolve() == BASE.resolve()


def load_profile(name_or_path: str | Path, sets: Sequence[str] = ()) -> Profile:
    """A profile by name or by file, merged with its base and the single values of `sets`.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    file = find_file(str(name_or_path), FOLDER, "profile")
    if is_base(file):
        raise not_found(str(name_or_path), *NO_PROFILE)
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
    inform: InformSettings
    """The behaviour Inform."""
    localization: Localization = "combined"
    """Scan matching with particles, filter and trackers combined; or AMCL alone."""
    localizer: LocalizerEffort = field(default_factory=LocalizerEffort)
    """How much it computes."""
    charts: Mapping[str, Mapping[str, Item]] = field(default_factory=dict)
    """Parameters of charts, in place of their defaults."""
    policy: Policy = POLICIES[0]
    """Whose decisions its values are for: those of the paper, or what measured best."""
    chart: Name = "cobodeck"
    """The chart that is run where none is named."""
    about: str = ""
    """What it is good for; else how it differs from its base."""
    base: Annotated[Item, Written(str)] | None = None
    """The profile that it is merged with, by name or by file; else the shipped one of its
    policy."""


def _profile(item: Item, sets: tuple[str, ...]) -> Profile:
    layers = layered(item, sets)
    read = record(layers.item, ProfileFile)
    return Profile(
        name=read.profile,
        about=read.about or layers.about,
        policy=read.policy,
        chart=read.chart,
        robot=read.robot,
        safety=read.safety,
        plant=read.plant,
        navigation=read.navigation,
        localization=read.localization,
        localizer=read.localizer,
        settings=Settings(
            read.user, read.escape, read.chase, read.haptic, read.inform, read.policy
        ),
        charts={
            chart: {name: value.value for name, value in values.items()}
            for chart, values in read.charts.items()
        },
        places=layers.places,
        values=layers.values,
        sha256=layers.sha256,
        sets=sets,
    )
