"""Haptic: where to stand for a touch, and when it is over (paper 4.4.1)."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

from behaviors import person
from behaviors.choice import cheapest
from behaviors.profile import CloseSettings, HapticSettings, Settings
from behaviors.situation import CHANGES, WAYS, Situation, situation
from engine import Action, Context, Monitor, On, Run, Yielded
from engine.files import Angle, Length
from engine.files.declared import ABOVE_0
from hw import Pose2, Pose3, wrap
from states import SubsystemName
from states.environment import HAPTIC_REQUEST, RELEASE, planner_key
from states.navigation import comes_in, way_in

if TYPE_CHECKING:
    from states.navigation import GlobalPlanner

CLOSE: SubsystemName = "escape"
"""The subsystem with whose inflation and user radius the second choice is made and driven to."""


def all_poses(haptic: HapticSettings, deep: Pose3) -> Iterator[Pose2]:
    """All Haptic rover poses in order: a half circle in front of the DEEP (R75).

    Angle 0 is on the line from the user through the DEEP; the robot faces the DEEP (R76, R85).
    """
    return half_circle(deep, haptic.radius, haptic.angles)


def half_circle(deep: Pose3, radius: float, angles: Iterable[float]) -> Iterator[Pose2]:
    """Rover poses that face the DEEP at this distance, m, and at these angles, rad, in order."""
    return (_pose(deep, radius, angle) for angle in angles)


def round_poses(close: CloseSettings, deep: Pose3) -> Iterator[Pose2]:
    """All poses of the second choice, all round the DEEP."""
    radii = range(math.floor((close.outer - close.inner) / close.step + 1e-9) + 1)
    angles = range(math.ceil(math.tau / close.turn - 1e-9))
    return (
        _pose(deep, close.inner + close.step * i, close.turn * k) for i in radii for k in angles
    )


def close_poses(now: Situation, deep: Pose3) -> tuple[Pose2, ...]:
    """The free poses of the second choice, with what Escape keeps clear."""
    close, planner = now.settings.haptic.close, now.planners[CLOSE]
    found = outside(now, CLOSE, round_poses(close, deep))
    return tuple(pose for pose in found if planner.is_free((pose.x, pose.y)))


def _pose(deep: Pose3, radius: float, angle: float) -> Pose2:
    direction = deep.yaw + angle
    x, y = deep.x + radius * math.cos(direction), deep.y + radius * math.sin(direction)
    return Pose2(x, y, wrap(direction + math.pi))


def outside(now: Situation, name: SubsystemName, free: Iterable[Pose2]) -> tuple[Pose2, ...]:
    """Those of the poses that lie outside of the disc around the user that a subsystem avoids."""
    body, radius = now.user.body, now.environment.navigation.named(name).user_radius
    return tuple(pose for pose in free if pose.distance_to(body) >= radius)


def within_reach(now: Situation, poses: tuple[Pose2, ...], deep: Pose3) -> tuple[Pose2, ...]:
    """Those of the poses from which the arm would reach the DEEP if nothing were in its way."""
    found = now.environment.workspace.reached(poses, deep)
    return tuple(pose for pose, reached in zip(poses, found, strict=True) if reached)


def is_blocked(now: Situation, deep: Pose3) -> bool:
    """True if the DEEP is in or behind a wall as seen from the user, or too near for the prop."""
    room, body = now.environment.room, now.user.body
    if not room.sees(body.x, body.y, deep.x, deep.y):
        return True
    ends, radii = now.environment.workspace.held(deep)
    lines = ends[:, :, :2].reshape(-1, 4).tolist()
    return any(room.way_clearance(*line) < r for line, r in zip(lines, radii, strict=True))


def is_walled(now: Situation, poses: tuple[Pose2, ...], deep: Pose3) -> bool:
    """True if only walls keep the prop from the DEEP, from whichever of these poses."""
    arm = now.environment.workspace
    near = within_reach(now, poses, deep)
    return bool(near) and not arm.reached(near, deep, walled=True).any()


def poses(settings: Settings, planner: GlobalPlanner, deep: Pose3) -> tuple[Pose2, ...]:
    """The Haptic rover poses that are free by Haptic's planner, in order (R77)."""
    return tuple(p for p in all_poses(settings.haptic, deep) if planner.is_free((p.x, p.y)))


def reachable(
    now: Situation, name: SubsystemName, free: Iterable[Pose2], *, round_user: bool = False
) -> dict[Pose2, float]:
    """The poses that the robot can drive to, in order, each with the time of the drive, s.

    `name` is the subsystem with whose planner and distance from the user. With `round_user` it goes
    round them with Haptic's distance, and comes in from outside, no faster than the safety chain
    will admit.
    """
    found = {}
    for goal in free:
        outside = goal
        if round_user and not comes_in(now.pose, now.user, goal):
            outside = way_in(now.user, goal, now.environment.navigation.haptic.user_radius)
        length = _way_length(now, name, outside, goal)
        if length is not None:
            turn = abs(wrap(goal.yaw - now.pose.yaw))
            closing = max(0.0, outside.distance_to(now.user.body) - goal.distance_to(now.user.body))
            found[goal] = drive_time(now, length, turn) + person.closing_time(now, goal, closing)
    return found


def _way_length(now: Situation, name: SubsystemName, outside: Pose2, goal: Pose2) -> float | None:
    """Length of the path to the place outside of which the goal is, m; None without a way."""
    planner, here, place = now.planners[name], (now.pose.x, now.pose.y), (outside.x, outside.y)
    keeps: SubsystemName = name if outside is goal else "haptic"
    path = planner.plan(here, place, now.user_disc(keeps, place))
    if path is None or (outside is not goal and not planner.allows(place, (goal.x, goal.y))):
        return None
    return path.length


def first_pose(now: Situation, free: Sequence[Pose2]) -> Pose2 | None:
    """The first of the free poses that the robot can drive to (R76); None if it can to none."""
    planner, here = now.planners["haptic"], (now.pose.x, now.pose.y)

    def total(i: int) -> int | None:
        place = (free[i].x, free[i].y)
        return None if planner.plan(here, place, now.user_disc("haptic", place)) is None else i

    first = cheapest(range(len(free)), total)
    return None if first is None else free[first]


def soonest_pose(now: Situation, times: dict[Pose2, float], deep: Pose3) -> Pose2 | None:
    """The pose with the prop at the DEEP soonest; None if the arm reaches it from none of them."""
    goals = tuple(times)
    drive = now.environment.navigation.haptic
    tolerance = (drive.tolerance, drive.yaw_tolerance)
    drives = tuple(times.values())
    best = now.environment.workspace.best(goals, drives, deep, now.user.body, tolerance)
    return None if best is None else goals[best]


def drive_time(now: Situation, length: float, turn: float) -> float:
    """Time of a drive of `length`, m, from rest to rest, while turning by `turn`, rad; s."""
    from states.navigation.local import rest_to_rest

    limits, fastest = now.environment.limits, now.environment.navigation.haptic.max_speed
    drive = rest_to_rest(length, fastest, limits.base_acceleration)
    turning = rest_to_rest(turn, limits.base_yaw_rate, limits.base_yaw_acceleration)
    return float(max(drive, turning))


class Released(Monitor):
    """`released` when the user lets go, whatever the robot is doing for them (R61, R83).

    Args:
        since: the stamp of the request that is served, as `HapticRequest` outputs it, ns.

    Outcomes:
        released: the user has let go, or the request is gone or is another one.
    """

    outcomes = ("released",)
    reads = {RELEASE: None, HAPTIC_REQUEST: None}

    def run(self, ctx: Context, since: int) -> Run:
        while not ctx.events(RELEASE) and self._is_asked(ctx, since):
            yield On(RELEASE, HAPTIC_REQUEST)
        return "released"

    def _is_asked(self, ctx: Context, since: int) -> bool:
        sample = ctx.sample(HAPTIC_REQUEST)
        return sample is not None and sample.value is not None and sample.stamp == since


class _ChoosesPose(Action):
    """Chooses among Haptic rover poses on a half circle in front of the DEEP.

    Args:
        radius: of the half circle; by default the profile's.
        angles: of the poses, off the line from the user through the DEEP; by default the profile's.
        deep: where the hand will meet the prop, in the map.

    Outcomes:
        chosen: there is a pose.
        no_pose: no rover pose is free.

    Outputs:
        pose: where to drive, map_from_base.
    """

    reads = WAYS

    def __init__(
        self,
        radius: Annotated[Length, ABOVE_0] | None = None,
        angles: tuple[Angle, ...] | None = None,
    ) -> None:
        self.radius, self.angles = radius, angles

    def _free(self, now: Situation, deep: Pose3) -> tuple[Pose2, ...]:
        """The free poses outside of the user's disc, in order (R77)."""
        haptic, planner = now.settings.haptic, now.planners["haptic"]
        angles = haptic.angles if self.angles is None else self.angles
        every = half_circle(deep, self.radius or haptic.radius, angles)
        return outside(now, "haptic", (p for p in every if planner.is_free((p.x, p.y))))


class ChooseFirstHapticPose(_ChoosesPose):
    """The paper's choice: the first Haptic rover pose that is free and can be reached (R75-R77).

    Poses are on a half circle in front of the DEEP, of this `radius`, in the order of their
    `angles` off the line from the user through the DEEP.

    Outcomes:
        deep_blocked: the DEEP is in or behind a wall, or so near to one that the prop would touch
            it.
        no_way: none of the free poses can be reached.
    """

    policy = "paper"
    outcomes = ("chosen", "deep_blocked", "no_pose", "no_way")
    outputs = {"chosen": {"pose": Pose2}}

    def run(self, ctx: Context, deep: Pose3) -> Run:
        now = yield from _now(ctx, "haptic")
        if is_blocked(now, deep):
            return "deep_blocked"
        free = self._free(now, deep)
        best = first_pose(now, free)
        if best is not None:
            return "chosen", {"pose": best}
        return "no_way" if free else "no_pose"


class ChooseHapticPose(_ChoosesPose):
    """The Haptic rover pose with the prop at the DEEP soonest, by the exact reach of the arm.

    Poses are on a half circle in front of the DEEP, of this `radius`, at these `angles` off the
    line from the user through the DEEP.

    Outcomes:
        close: none of these will do, but one of the profile's `close` ones, with the distances from
            walls and user that Escape keeps.
        deep_blocked: the DEEP is in or behind a wall, or so near to one that the prop would touch
            it, or that they leave the arm no room.
        no_way: walls or the user cut off the poses from which the arm would reach the DEEP.
        out_of_reach: the arm reaches the DEEP from none of the free poses.
    """

    policy = "tuned"
    outcomes = ("chosen", "close", "deep_blocked", "no_pose", "no_way", "out_of_reach")
    outputs = {"chosen": {"pose": Pose2}, "close": {"pose": Pose2}}

    def run(self, ctx: Context, deep: Pose3) -> Run:
        now = yield from _now(ctx, "haptic")
        if is_blocked(now, deep):
            return "deep_blocked"
        times = reachable(now, "haptic", self._free(now, deep))
        best = soonest_pose(now, times, deep)
        if best is not None:
            return "chosen", {"pose": best}
        if times:
            yield None  # what follows is more than the work of one tick
        now = yield from _now(ctx, CLOSE)
        free = close_poses(now, deep)
        near = within_reach(now, free, deep)
        for round_user in (True, False):
            yield None
            left = (p for p in near if p not in times)
            ways = reachable(now, CLOSE, left, round_user=round_user)
            best = yield from _close_pose(now, ways, deep)
            if best is not None:
                return "close", {"pose": best}
            times |= ways
        if not free:
            return "no_pose"
        if is_walled(now, tuple(times), deep):
            return "deep_blocked"
        return "no_way" if near else "out_of_reach"


def _now(ctx: Context, name: SubsystemName) -> Generator[Yielded, None, Situation]:
    """The situation with this subsystem's planner, as soon as all of it is known."""
    while (now := situation(ctx, name)) is None:
        yield On(planner_key(name), *CHANGES)
    return now


def _close_pose(
    now: Situation, times: dict[Pose2, float], deep: Pose3
) -> Generator[Yielded, None, Pose2 | None]:
    """The pose with the prop at the DEEP soonest, of those with the shortest drives.

    Some poses in a tick, shortest drives first, until the arm reaches the DEEP from one of them.
    """
    goals, at_once = sorted(times, key=times.__getitem__), now.settings.haptic.close.at_once
    for first in range(0, len(goals), at_once):
        yield None
        some = {goal: times[goal] for goal in goals[first : first + at_once]}
        best = soonest_pose(now, some, deep)
        if best is not None:
            return best
    return None
