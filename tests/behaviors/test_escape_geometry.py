"""The Escape trigger and poses against formulas of their own, all around the user."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator

import pytest

from behaviors.escape import escape_poses
from behaviors.escape.zones import in_zone
from behaviors.profile.profile import Profile
from hw.geometry import Pose2
from hw.samples import UserPose
from hw.scene.room import Room
from states.environment.environment import Environment


def places() -> Iterator[tuple[float, float]]:
    """Distances about every limit, by bearings every 4 degrees and close to the edges of view."""
    edges = [sign * (36.0 + off) for sign in (1, -1) for off in (-0.01, 0.01)]
    for bearing in (*range(-178, 180, 4), *edges):
        for distance in (0.3, 1.49, 1.51, 2.0, 2.49, 2.51, 4.0):
            yield distance, math.radians(bearing)


def is_raised(robot: complex, body: complex, view: float) -> bool:
    """R104 in complex numbers: nearer than 1.5 m, or than 2.5 m within 36 degrees of the view."""
    seen = (robot - body) * cmath.exp(-1j * view)
    in_view = seen.real > 0.0 and abs(seen.imag) <= seen.real * math.tan(math.pi / 5)
    return abs(seen) < 1.5 or (in_view and abs(seen) < 2.5)


@pytest.mark.requirement(104)
@pytest.mark.parametrize("view", [0.0, 1.0, math.pi, -2.3])
@pytest.mark.parametrize("body_yaw", [0.0, 2.0])
def test_the_trigger_all_around_the_user(paper: Profile, view: float, body_yaw: float) -> None:
    body = 10.0 + 9.0j
    user = UserPose(Pose2(body.real, body.imag, body_yaw), view)
    raised = 0
    for distance, bearing in places():
        robot = body + cmath.rect(distance, view + bearing)
        expected = is_raised(robot, body, view)

        found = in_zone(paper.settings.escape, user, Pose2(robot.real, robot.imag, 0.4))

        assert found is expected, (distance, math.degrees(bearing))
        raised += expected
    assert raised > 200


@pytest.mark.requirement(104, 112)
def test_a_user_who_sways_at_the_edge_raises_once_and_is_safe_once(paper: Profile) -> None:
    """Between the zone and its hysteresis neither holds: no flicker."""
    escape, robot = paper.settings.escape, Pose2(10.0, 10.0)
    seen = []
    for distance in (3.0, 2.55, 2.45, 2.55, 2.45, 2.6, 2.69, 2.49, 2.69, 2.71):
        user = UserPose(Pose2(10.0 + distance, 10.0, math.pi), math.pi)
        if in_zone(escape, user, robot):
            seen.append("required")
        if not in_zone(escape, user, robot, escape.hysteresis):
            seen.append("safe")

    changes = [now for before, now in zip(["", *seen], seen, strict=False) if now != before]
    assert changes == ["safe", "required", "safe"]


PRINTED = ((2.5, 1.75, 1.0), (20.0, -20.0, 60.0, -60.0))
"""Distances, and angles from the way straight off the user."""


@pytest.mark.requirement(106, 107, 110)
@pytest.mark.parametrize("bearing", [0.0, 0.7, -3.0])
def test_the_twelve_poses_of_the_paper_by_number(paper: Profile, bearing: float) -> None:
    """3 distances times 4 angles, farthest first, from the robot on, its yaw kept."""
    body, robot = 4.0 + 5.0j, 4.0 + 5.0j + cmath.rect(2.0, bearing)
    distances, angles = PRINTED
    expected = [
        robot + cmath.rect(distance, bearing + math.radians(angle))
        for distance in distances
        for angle in angles
    ]

    user = UserPose(Pose2(body.real, body.imag, 0.0), 0.0)
    base = Pose2(robot.real, robot.imag, 1.234)
    found = list(escape_poses.all_poses(paper.settings.escape, user, base))

    assert [complex(p.x, p.y) for p in found] == [pytest.approx(place) for place in expected]
    assert {pose.yaw for pose in found} == {1.234}
    assert all(abs(complex(p.x, p.y) - body) > 2.0 + 0.3 for p in found)


@pytest.mark.requirement(108, 120)
def test_the_free_poses_beside_a_column(
    profile: Profile, environment_of: Callable[..., Environment]
) -> None:
    """Free is 0.77 m from the walls of a square room and from a square column."""
    column = ((6.0, 5.6), (6.4, 5.6), (6.4, 6.0), (6.0, 6.0))
    room = Room(((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)), columns=(column,))
    user, base = UserPose(Pose2(3.0, 5.0), 0.0), Pose2(5.0, 5.0, 0.5)

    def is_clear(pose: Pose2) -> bool:
        to_column = math.hypot(
            max(6.0 - pose.x, 0.0, pose.x - 6.4), max(5.6 - pose.y, 0.0, pose.y - 6.0)
        )
        return min(pose.x, pose.y, 8.0 - pose.x, 8.0 - pose.y, to_column) >= 0.77

    planner = environment_of(profile, room).static_planners["escape"]
    found = escape_poses.poses(profile.settings, planner, user, base)

    every = list(escape_poses.all_poses(profile.settings.escape, user, base))
    assert list(found) == [pose for pose in every if is_clear(pose)]
    assert 0 < len(found) < len(every)
