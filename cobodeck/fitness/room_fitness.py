"""Checks whether a robot with a profile's values fits a room (R3, R124, R126)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from engine.files import FileError

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from cobodeck.fitness.floor_space import FloorReport
    from cobodeck.setup import RunPlace
    from hw.model import RobotModel
    from states.floors import Untouchable

FIT, MISSING, BAD = "ok", "missing", "bad"
PRINTED = 60
"""Angle of the Haptic pose that the paper names for a user facing a wall, deg (5.2.2)."""
SHOWN = 6
"""Number of places without a Haptic pose that are listed."""

DoctorLine = tuple[str, str, str]


def room_checks(
    scene_name: str, profile_name: str, sets: Sequence[str] = ()
) -> Iterator[DoctorLine]:
    """One line per check: what was checked, its state, an explanation.

    Raises:
        FileError: the scene or the profile is wrong.
    """
    from cobodeck.fitness.floor_space import floor_report
    from cobodeck.setup import open_place, profile_with
    from hw.model import load_robot

    scene, profile = open_place(scene_name).scene, profile_with(profile_name, sets)
    robot = load_robot(scene.robot)
    yield "robot", FIT, _outline(robot)
    try:
        profile.require_robot(robot)
    except FileError as error:
        yield "profile", BAD, str(error)
    yield "escape", FIT, _getting_away(robot, profile)
    yield from _floor(floor_report(scene_name, profile), profile)
    yield from _waiting(open_place(scene_name), robot, profile)


def tracking_checks(path: Path) -> Iterator[DoctorLine]:
    """Check that the residuals of a calibrated tracking system are small enough.

    Raises:
        FileError: the file is wrong.
    """
    from hw.model import load_tracking
    from states.localization.calibration import GREATEST_OFFSET, GREATEST_TURN

    held = load_tracking(path)
    off, turn = held.residual.position, held.residual.yaw
    fits = off <= GREATEST_OFFSET and turn <= GREATEST_TURN
    text = f"fits to {1e3 * off:.1f} mm and {math.degrees(turn):.2f} deg"
    if not fits:
        most = f"{1e3 * GREATEST_OFFSET:g} mm and {math.degrees(GREATEST_TURN):g} deg"
        text += f"; {most} are allowed: `cobodeck calibrate LOG` makes another one"
    yield f"tracking {held.tracking}", FIT if fits else BAD, text


def _outline(robot: RobotModel) -> str:
    outline = robot.footprint
    return (
        f"{robot.name}: {outline.length:g} x {outline.width:g} m with its foam, corners "
        f"{outline.half_diagonal:.3f} m from its centre, {outline.enclosing_radius:g} m kept"
    )


def _getting_away(robot: RobotModel, profile: Profile) -> str:
    """Time to move aside from standstill, at the profile's acceleration and at the brakes'.

    From rest at constant acceleration a, a distance d takes sqrt(2 d / a).
    """
    away, own = profile.settings.escape.contact, robot.base.brake_deceleration
    chosen = profile.robot.base_acceleration
    slow, fast = (math.sqrt(2.0 * away / limit) for limit in (chosen, max(chosen, own)))
    return (
        f"{away:g} m aside takes {slow:.2f} s at {profile.name}'s {chosen:g} m/s2; "
        f"it would be {fast:.2f} s with its brakes' {own:g} m/s2"
    )


def _floor(report: FloorReport, profile: Profile) -> Iterator[DoctorLine]:
    space, lack = report.space, report.shortcoming
    yield f"room {report.name}", BAD if lack else FIT, lack or "large enough for all behaviours"
    usable = f"{space.usable_m2:.1f} of {space.free_m2:.1f} m2"
    yield "floor", FIT, f"{usable} usable at {space.inflation:g} m from walls"
    yield "wall ahead", FIT, _facing_a_wall(report.wall_ahead, profile)
    yield "haptic poses", FIT, _untouchable(report.untouchable)


def _waiting(place: RunPlace, robot: RobotModel, profile: Profile) -> Iterator[DoctorLine]:
    """What a robot that waits beside a user risks in this room, if it has an arm to serve them."""
    from cobodeck.fitness.waiting_places import waiting_report
    from cobodeck.setup import environment_at

    found = waiting_report(environment_at(place, profile, robot), profile.settings)
    if found is None:
        return
    text = (
        f"where Chase waits a user who sets off is expected to cost {found.mean:.2f} s on average, "
        f"too late to move aside or with an Escape; {found.worst:.2f} s beside one at "
        f"({found.place[0]:.2f}, {found.place[1]:.2f})"
    )
    if found.nowhere > 0.0:
        text += f"; no Chase pose is free beside {found.nowhere:.0%} of users"
    yield "waiting", FIT, text


def _facing_a_wall(distances: Mapping[int, float], profile: Profile) -> str:
    haptic, drive = profile.settings.haptic, profile.navigation.haptic
    angle = min(distances, key=lambda angle: abs(angle - PRINTED))
    beyond = haptic.radius * math.cos(math.radians(angle))
    parts = (haptic.deep_ahead, beyond, drive.inflation, drive.tolerance)
    summands = " + ".join(f"{part:.2f}" for part in parts)
    others = ", ".join(f"{m:.2f} m at {a} deg" for a, m in distances.items() if a != angle)
    return (
        f"a user who faces it needs {distances[angle]:.2f} m for the Haptic pose at {angle} deg "
        f"({summands}); {others}"
    )


def _untouchable(found: Untouchable) -> str:
    if found.overall is None:
        return "there is no place for a user to stand"
    shares = found.share.tolist()
    places = sorted(zip(shares, found.x.tolist(), found.y.tolist(), strict=True), reverse=True)
    without = [place for place in places if place[0] > 0.0]
    text = f"none for {found.overall:.1%} of user poses, at {len(without)} of {len(places)} places"
    if not without:
        return text
    listed = ", ".join(f"({x:.2f}, {y:.2f}) in {share:.0%}" for share, x, y in without[:SHOWN])
    return f"{text}; a request there ends with `failed`. Worst places: {listed}"
