"""Profiles: YAML files that give every settled reading a value.

    profile: tuned
    about: what it is good for
    robot: …            # behaviors.settings.RobotSettings
    safety: …           # SafetySettings
    plant: …            # PlantSettings, of simulated robots
    navigation: …       # states.site.Navigation
    user: …  escape: …  chase: …  haptic: …      # behaviors.settings.Settings
    charts: {chase: {patience: 20 s}}            # parameters of charts, in place of their defaults

Values may carry units, as in charts. All sections but `charts` are complete.
"""

from __future__ import annotations

import dataclasses
import hashlib
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from behaviors.ranges import contradiction, fault_of
from behaviors.settings import (
    ChaseSettings,
    EscapeSettings,
    HapticSettings,
    PlantSettings,
    RobotSettings,
    SafetySettings,
    Settings,
    UserSettings,
)
from engine.chart import Chart
from engine.files.finding import did_you_mean
from engine.files.source import Map, Mark, Source, read
from engine.types import Mismatch, builtin_types, convert, from_annotation
from hw.robot import RobotModel
from hw.room import Room
from states.site import Navigation, Site

FOLDER = Path(__file__).parent.parent / "charts" / "profiles"
T = TypeVar("T")


class ProfileError(ValueError):
    """A profile is wrong or missing; the text starts with `file:line:column:`."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A checked profile; `places` says where the parameters of charts stand in its file."""

    name: str
    about: str
    robot: RobotSettings
    safety: SafetySettings
    plant: PlantSettings
    navigation: Navigation
    settings: Settings
    charts: Mapping[str, Mapping[str, Any]]
    places: Mapping[tuple[str, str], str]
    sha256: str

    def body(self, robot: RobotModel) -> RobotModel:
        """The robot, with its arm folded as this profile says."""
        if self.robot.arm_parked is None:
            return robot
        arm = dataclasses.replace(robot.arm, parked=self.robot.arm_parked)
        return dataclasses.replace(robot, arm=arm)

    def site(self, room: Room, robot: RobotModel) -> Site:
        """What the states need of a place, with the values of this profile."""
        robot = self.body(robot)
        fastest = min(self.robot.base_speed, robot.base.max_speed)
        return Site(room, robot, self.robot.limits, self.navigation.capped(fastest))

    def apply(self, library: Mapping[str, Chart]) -> dict[str, Chart]:
        """The charts with this profile's values as defaults of their parameters.

        Charts that the profile does not know, and parameters that a chart of one's own has not,
        stay as they are.

        Raises:
            ProfileError: a value is not what its parameter takes.
        """
        return {name: self._applied(chart) for name, chart in library.items()}

    def _applied(self, chart: Chart) -> Chart:
        values = self.charts.get(chart.name, {})
        for name in sorted(values.keys() & chart.parameters.keys()):
            self._check(chart, name, values[name])
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
            raise self._fail(chart.name, name, str(mismatch)) from None

    def require(self, library: Mapping[str, Chart]) -> None:
        """Look whether every chart and parameter it names is there.

        Raises:
            ProfileError: the first that is not, or has another type.
        """
        for chart, name in self.places:
            if chart not in library:
                raise self._fail(chart, name, f"no such chart; {did_you_mean(chart, library)}")
            known = library[chart].parameters
            if name not in known:
                raise self._fail(chart, name, f"no such parameter; {did_you_mean(name, known)}")
        self.apply(library)

    def _fail(self, chart: str, name: str, message: str) -> ProfileError:
        return ProfileError(f"{self.places[chart, name]}: charts.{chart}.{name}: {message}")


def profile_names() -> tuple[str, ...]:
    """The profiles that come with the project."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_profile(name_or_path: str | Path) -> Profile:
    """A profile by name or by file.

    Raises:
        ProfileError: with file, line, key and what would be right.
    """
    name = str(name_or_path)
    path = (
        Path(name) if name.endswith((".yaml", ".yml")) or "/" in name else FOLDER / f"{name}.yaml"
    )
    try:
        data = path.read_bytes()
    except OSError as error:
        hint = did_you_mean(name, profile_names())
        raise ProfileError(f"{name}: no such profile ({error.strerror}); {hint}") from None
    source = read(data, str(path))
    if source.findings:
        first = source.findings[0]
        raise ProfileError(f"{first.place}: {first.message}")
    return _Reader(source).profile(hashlib.sha256(data).hexdigest())


class _Reader:
    """Turns one file into a `Profile`."""

    def __init__(self, source: Source) -> None:
        self.source = source

    def profile(self, sha256: str) -> Profile:
        raw = self.source.value
        if not isinstance(raw, Map):
            raise self.fail((1, 1, 2), "a profile is a mapping; begin with `profile: NAME`")
        sections = ("robot", "safety", "plant", "navigation", "user", "escape", "chase", "haptic")
        self.keys(raw, ("profile", "about", *sections), ("charts",), "a profile")
        return Profile(
            name=str(raw["profile"]),
            about=str(raw["about"]),
            robot=self.section(raw, "robot", RobotSettings),
            safety=self.section(raw, "safety", SafetySettings),
            plant=self.section(raw, "plant", PlantSettings),
            navigation=self.section(raw, "navigation", Navigation),
            settings=Settings(
                user=self.section(raw, "user", UserSettings),
                escape=self.section(raw, "escape", EscapeSettings),
                chase=self.section(raw, "chase", ChaseSettings),
                haptic=self.section(raw, "haptic", HapticSettings),
            ),
            charts=self.charts(raw),
            places=self.places(raw),
            sha256=sha256,
        )

    def section(self, raw: Map, key: str, kind: type[T]) -> T:
        inside = self.mapping(raw, key)
        hints = typing.get_type_hints(kind, include_extras=True)
        self.keys(inside, tuple(hints), (), repr(key))
        found: dict[str, Any] = {}
        for name, hint in hints.items():
            if dataclasses.is_dataclass(hint):
                found[name] = self.section(inside, name, typing.cast("type[Any]", hint))
                continue
            try:
                found[name] = convert(inside[name], from_annotation(hint))
            except Mismatch as mismatch:
                raise self.fail(inside.values_at[name], f"{key}.{name}: {mismatch}") from None
            fault = fault_of(kind, name, found[name])
            if fault is not None:
                raise self.fail(inside.values_at[name], f"{key}.{name}: {fault}")
        made = kind(**found)
        if (odd := contradiction(made)) is not None:
            raise self.fail(inside.values_at[odd[0]], f"{key}.{odd[0]}: {odd[1]}")
        return made

    def charts(self, raw: Map) -> Mapping[str, Mapping[str, Any]]:
        if "charts" not in raw:
            return {}
        inside = self.mapping(raw, "charts")
        return {chart: dict(self.mapping(inside, chart)) for chart in inside}

    def places(self, raw: Map) -> Mapping[tuple[str, str], str]:
        if "charts" not in raw:
            return {}
        inside = self.mapping(raw, "charts")
        return {
            (chart, name): str(self.source.place(mark))
            for chart in inside
            for name, mark in self.mapping(inside, chart).values_at.items()
        }

    def mapping(self, raw: Map, key: str) -> Map:
        value = raw[key]
        if not isinstance(value, Map):
            raise self.fail(raw.values_at.get(key, raw.at), f"{key!r} is a mapping of values")
        return value

    def keys(
        self, raw: Map, required: tuple[str, ...], optional: tuple[str, ...], where: str
    ) -> None:
        for key in raw:
            if key not in required and key not in optional:
                hint = did_you_mean(key, (*required, *optional))
                raise self.fail(raw.keys_at[key], f"unknown key {key!r} in {where}; {hint}")
        missing = [key for key in required if key not in raw]
        if missing:
            raise self.fail(raw.at, f"{where} has no value for {', '.join(missing)}")

    def fail(self, mark: Mark, message: str) -> ProfileError:
        return ProfileError(f"{self.source.place(mark)}: {message}")
