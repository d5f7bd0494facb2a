"""A profile: are there the charts that it names, do its values suit the robot, what they mean."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, get_args

from cobodeck.fitness import BAD, FIT, CheckResult
from engine.files import FileError, Finding, did_you_mean
from hw import USER_RADIUS
from hw.model import RobotModel
from states import SubsystemName

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from cobodeck.setup import Uses
    from engine.chart import Chart

WHAT = "profile"


def named(profile: Profile, library: Mapping[str, Chart]) -> Iterator[CheckResult]:
    """Whether every chart and parameter that it names exists, and its values have their types."""
    findings = tuple(_unknown(profile, library, _parameters(profile)))
    if findings:
        yield from _bad(findings)
        return
    try:
        profile.apply(_sound(library))
    except FileError as error:
        yield from _bad(error.findings)


def _sound(library: Mapping[str, Chart]) -> dict[str, Chart]:
    """The charts for which the default profile will do; others have mistakes of their own."""
    from behaviors.profile import load_profile

    tuned, found = load_profile("tuned"), {}
    for name, chart in library.items():
        with suppress(FileError):
            tuned.apply({name: chart})
            found[name] = chart
    return found


def set_by_name(profile: Profile, library: Mapping[str, Chart]) -> Iterator[CheckResult]:
    """Whether every chart and parameter exists that is set on top of its file, as KEY=VALUE."""
    given = {text.partition("=")[0].strip() for text in profile.sets}
    asked = {key: which for key, which in _parameters(profile).items() if key in given}
    yield from _bad(_unknown(profile, library, asked))


def _parameters(profile: Profile) -> dict[str, tuple[str, str]]:
    """Chart and name of each parameter that it gives a value, by the dotted name of its key."""
    return {
        f"charts.{chart}.{name}": (chart, name)
        for chart, values in profile.charts.items()
        for name in values
    }


def _unknown(
    profile: Profile, library: Mapping[str, Chart], parameters: Mapping[str, tuple[str, str]]
) -> Iterator[Finding]:
    """The parameters that do not exist, or whose chart does not."""
    for key, (chart, name) in parameters.items():
        if chart not in library:
            yield profile.finding(key, "no such chart", did_you_mean(chart, library))
        elif name not in library[chart].parameters:
            hint = did_you_mean(name, library[chart].parameters)
            yield profile.finding(key, "no such parameter", hint)


def getting_away(robot: RobotModel, profile: Profile) -> Iterator[CheckResult]:
    """Time to move aside from standstill, at the profile's acceleration and at the brakes'.

    From rest at constant acceleration a, a distance d takes sqrt(2 d / a).
    """
    away, own = profile.settings.escape.contact, robot.base.brake_deceleration
    chosen = profile.robot.base_acceleration
    slow, fast = (math.sqrt(2.0 * away / limit) for limit in (chosen, max(chosen, own)))
    about = (
        f"{away:g} m aside takes {slow:.2f} s at {profile.name}'s {chosen:g} m/s2; "
        f"it would be {fast:.2f} s with its brakes' {own:g} m/s2"
    )
    yield CheckResult("escape", FIT, about)


def suited(profile: Profile, robot: RobotModel, uses: Uses | None = None) -> Iterator[CheckResult]:
    """Whether the values suit a robot that drives, beside a person or alone.

    `uses` of a chart that does not command the base raises no question.
    """
    if uses is not None and "base" not in uses.commands:
        return
    beside_person = uses is None or uses.person
    yield from _bad(
        (
            *_too_near(profile, robot, beside_person),
            *_mounted_nowhere(profile, robot),
            *_not_parked(profile, robot),
        )
    )


def _bad(found: Iterable[Finding]) -> Iterator[CheckResult]:
    """One bad answer for all mistakes in its file, if there are any."""
    findings = tuple(found)
    if findings:
        yield CheckResult(WHAT, BAD, str(FileError(findings)), findings=findings)


def _too_near(profile: Profile, robot: RobotModel, beside_person: bool) -> Iterator[Finding]:
    """Distances that are too little.

    A robot that turns on the spot sweeps a disc whose radius is half its diagonal: every subsystem
    has to keep that from walls, and that plus the person's own radius from the user.
    """
    swept = robot.footprint.half_diagonal
    least = {"inflation": swept}
    if beside_person:
        least["user_radius"] = swept + USER_RADIUS
    for name in get_args(SubsystemName):
        for key, needed in least.items():
            value = getattr(profile.navigation.named(name), key)
            if value < needed:
                about = f"{value:g} m is too little for {robot.name}"
                needs = f"which needs {needed:.4g} m to turn"
                yield profile.finding(f"navigation.{name}.{key}", f"{about}, {needs}")


def _mounted_nowhere(profile: Profile, robot: RobotModel) -> Iterator[Finding]:
    """Mount errors of sensors that it does not have."""
    sensors = {**robot.sensing.lidars, **robot.sensing.trackers}
    for name in profile.plant.sensing.mount_error:
        if name not in sensors:
            key, hint = f"plant.sensing.mount_error.{name}", did_you_mean(name, sensors)
            yield profile.finding(key, f"{robot.name} has no such scanner or tracker", hint)


def _not_parked(profile: Profile, robot: RobotModel) -> Iterator[Finding]:
    """Parked joints that its arm does not admit."""
    parked = None if robot.arm is None else profile.robot.parked(robot.arm.model.name)
    if parked is None or robot.arm is None:
        return
    try:
        robot.arm.check(parked)
    except ValueError as refused:
        key = "robot.arm_parked"
        own = f"{key}.{robot.arm.model.name}"
        yield profile.finding(own if own in profile.places else key, f"{robot.name}: {refused}")
