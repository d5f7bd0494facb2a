"""A room with a profile's values: is it large enough, and where is what not possible (R124, R126).

`cobodeck.checks.floor_space` and `cobodeck.checks.waiting_places` measure; here is what it means.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.fitness import BAD, FIT, CheckResult
from cobodeck.terminal import FAILED
from engine.files import FileError
from hw.model import RobotModel

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from cobodeck.checks.floor_space import FloorReport
    from cobodeck.setup import Options, RunPlace, Setup
    from hw.model import TrackingFile

PRINTED = 60
"""Angle of the Haptic pose that the paper names for a user facing a wall, deg (5.2.2)."""
SHOWN = 6
"""Number of places without a Haptic pose that are listed."""


def large_enough(floor: FloorReport) -> Iterator[CheckResult]:
    """Whether all behaviours have room (R124)."""
    state, about = FIT, "large enough for all behaviours"
    if floor.shortcoming is not None:
        state, about = BAD, floor.shortcoming
    yield CheckResult(f"room {floor.name}", state, about)


def enough_for_chart(setup: Setup) -> Iterator[CheckResult]:
    """Whether a chart that brings things to people has as much room as its profile asks for."""
    quarter = setup.profile.navigation.quarter
    if setup.scene is None or not {"base", "vr"} <= setup.uses().commands:
        return
    lack = _lack(setup, quarter)
    if lack is not None:
        enough = "set the radius that has to do, --set 'navigation.quarter=2 m'"
        remedy = f"to run all the same, {enough}"
        what = f"scene {setup.scene.name}"
        yield CheckResult(what, BAD, lack, remedy, f"{what}: {lack}\n{remedy}", FAILED)


def fits_on_cells(setup: Setup, options: Options) -> Iterator[CheckResult]:
    """Whether the room is not too large for costmaps, where scanners or planners need them."""
    from cobodeck.setup import FULL
    from states import SUBSYSTEMS
    from states.maps import grid_over

    if setup.scene is None or "base" not in setup.uses().commands:
        return
    used = [setup.environment.navigation.named(name) for name in SUBSYSTEMS]
    exact = all(subsystem.planner == "exact" for subsystem in used)
    if exact and options.tier != FULL and options.connection is None:
        return
    try:
        grid_over([setup.scene.room.outer], min(one.costmap.resolution for one in used))
    except ValueError as error:
        about = f"the room is too large for costmaps: {error}"
        remedy = "draw the part of it that is used, or run it at tier 1 with the planner exact"
        what = f"scene {setup.scene.name}"
        yield CheckResult(what, BAD, about, remedy, f"{what}: {about}\n{remedy}", FAILED)


def small_floor(setup: Setup) -> str | None:
    """Why the floor is too small for all behaviours where the profile is content with less."""
    from states import QUARTER

    if setup.profile.navigation.quarter >= QUARTER:
        return None
    return _lack(setup, QUARTER)


def _lack(setup: Setup, quarter: float) -> str | None:
    """Why the floor has no quarter of a circle of this radius about the user, m; None: it has."""
    from states.floors import Floor, shortcoming

    if setup.place is None or setup.scene is None:
        return None
    floor: Floor
    if setup.place.map is None:
        from states.floors import RoomFloor

        floor = RoomFloor(setup.scene.room)
    else:
        from states.floors import MapFloor

        floor = MapFloor(setup.place.map)
    return shortcoming(floor, setup.profile.navigation.haptic.inflation, quarter)


def usable(floor: FloorReport) -> Iterator[CheckResult]:
    """The area that the robot's centre can be in."""
    space = floor.space
    area = f"{space.usable_m2:.1f} of {space.free_m2:.1f} m2"
    yield CheckResult("floor", FIT, f"{area} usable at {space.inflation:g} m from walls")


def facing_a_wall(floor: FloorReport, profile: Profile) -> Iterator[CheckResult]:
    """How far from a wall a user who faces it has to stand (R126)."""
    distances = floor.wall_ahead
    haptic, drive = profile.settings.haptic, profile.navigation.haptic
    angle = min(distances, key=lambda angle: abs(angle - PRINTED))
    beyond = haptic.radius * math.cos(math.radians(angle))
    parts = (haptic.deep_ahead, beyond, drive.inflation, drive.tolerance)
    summands = " + ".join(f"{part:.2f}" for part in parts)
    others = ", ".join(f"{m:.2f} m at {a} deg" for a, m in distances.items() if a != angle)
    about = (
        f"a user who faces it needs {distances[angle]:.2f} m for the Haptic pose at {angle} deg "
        f"({summands}); {others}"
    )
    yield CheckResult("wall ahead", FIT, about)


def untouchable(floor: FloorReport) -> Iterator[CheckResult]:
    """The places where a request would fail (R126)."""
    found = floor.untouchable
    if found.overall is None:
        yield CheckResult("haptic poses", FIT, "there is no place for a user to stand")
        return
    shares = found.share.tolist()
    places = sorted(zip(shares, found.x.tolist(), found.y.tolist(), strict=True), reverse=True)
    without = [place for place in places if place[0] > 0.0]
    text = f"none for {found.overall:.1%} of user poses, at {len(without)} of {len(places)} places"
    if without:
        listed = ", ".join(f"({x:.2f}, {y:.2f}) in {share:.0%}" for share, x, y in without[:SHOWN])
        text += f"; a request there ends with `failed`. Worst places: {listed}"
    yield CheckResult("haptic poses", FIT, text)


def waiting(place: RunPlace, robot: RobotModel, profile: Profile) -> Iterator[CheckResult]:
    """What a robot that waits beside a user risks in this room, if it has an arm to serve them."""
    from cobodeck.checks.waiting_places import waiting_report
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
    yield CheckResult("waiting", FIT, text)


def staged(scene_file: Path) -> Iterator[CheckResult]:
    """Whether a scene's robot touches no wall at its start, and its user stays on the floor."""
    from hw.sim import check_scene

    try:
        check_scene(scene_file)
    except FileError as error:
        yield CheckResult("scene", BAD, str(error), findings=error.findings)


def tracked(tracking: TrackingFile) -> Iterator[CheckResult]:
    """Whether the residuals of a calibrated tracking system are small enough."""
    from states.localization.calibration import GREATEST_OFFSET, GREATEST_TURN

    off, turn = tracking.residual.position, tracking.residual.yaw
    about = f"fits to {1e3 * off:.1f} mm and {math.degrees(turn):.2f} deg"
    what = f"tracking {tracking.tracking}"
    if off <= GREATEST_OFFSET and turn <= GREATEST_TURN:
        yield CheckResult(what, FIT, about)
        return
    most = f"{1e3 * GREATEST_OFFSET:g} mm and {math.degrees(GREATEST_TURN):g} deg"
    remedy = "`cobodeck calibrate LOG` makes another one"
    yield CheckResult(what, BAD, f"{about}; {most} are allowed: {remedy}")
