"""Chase: choosing where to wait near the user, and following them (paper 4.4.2)."""

from __future__ import annotations

import math
from typing import Annotated

from behaviors.situation import CHANGES, READS, WAYS, ChaseRing, Situation, situation
from engine import Action, Context, Monitor, On, Run
from engine.files import Angle, Duration, Length
from engine.files.declared import ABOVE_0, FROM_0
from hw import Pose2, Pose3, UserPose, wrap
from hw.scene import Point
from states.environment import BASE_REFUSAL, HAPTIC_REQUEST, planner_key
from states.navigation import DRIVES, BaseDrive, place_near
from states.signals import PREDICTORS


def tangent_yaw(centre: Pose2, place: Point, now: float) -> float:
    """Yaw at `place` with a long side facing the user at `centre`, rad (R99).

    Of the two possible ones it is the one that takes the smaller turn from the yaw `now`.
    """
    radial = math.atan2(place[1] - centre.y, place[0] - centre.x)
    options = (wrap(radial + 0.5 * math.pi), wrap(radial - 0.5 * math.pi))
    return min(options, key=lambda yaw: abs(wrap(yaw - now)))


class HapticRequest(Monitor):
    """`requested` while the user asks for a touch, except for the request `refused` before.

    A request is a level: one that comes during an Escape is served afterwards (R60, R73).

    Args:
        refused: the `since` of a request that is not to be taken up again.

    Outcomes:
        requested: the user asks for a touch.

    Outputs:
        deep: where the hand will meet the prop, in the map.
        since: the stamp of the request, ns.
    """

    outcomes = ("requested",)
    outputs = {"requested": {"deep": Pose3, "since": int}}
    reads = {HAPTIC_REQUEST: None}

    def run(self, ctx: Context, refused: int | None = None) -> Run:
        while True:
            sample = ctx.sample(HAPTIC_REQUEST)
            asked = sample is not None and sample.value is not None
            if sample is not None and asked and sample.stamp != refused:
                return "requested", {"deep": sample.value, "since": sample.stamp}
            yield On(HAPTIC_REQUEST)


class _ChoosesCell(Action):
    """Chooses a cell of the Chase space, and a yaw with a long side to the user (R96, R99).

    Args:
        inner: no nearer to the user than this; by default the profile's.
        outer: no farther from the user than this; by default the profile's.
        front: the angle of the sector ahead of the user to leave free; by default the profile's.
        rear: the angle of the sector behind the user to leave free; by default the profile's.

    Outcomes:
        chosen: there is a place.
        none: no place is free and can be reached.

    Outputs:
        pose: where to wait, map_from_base.
        user: the pose of the user for whom it was chosen.
    """

    outcomes = ("chosen", "none")
    outputs = {"chosen": {"pose": Pose2, "user": UserPose}, "none": {"user": UserPose}}
    reads = WAYS

    def __init__(
        self,
        inner: Annotated[Length, ABOVE_0] | None = None,
        outer: Annotated[Length, ABOVE_0] | None = None,
        front: Annotated[Angle, FROM_0] | None = None,
        rear: Annotated[Angle, FROM_0] | None = None,
    ) -> None:
        self.ring = inner, outer, front, rear

    def run(self, ctx: Context) -> Run:
        while (now := situation(ctx, "chase", "escape")) is None:
            yield On(planner_key("chase"), planner_key("escape"), *CHANGES)
        found = self._best(now, ChaseRing.of(now.settings.chase, *self.ring))
        if found is None:
            return "none", {"user": now.user}
        goal = Pose2(*found, tangent_yaw(now.user.body, found, now.pose.yaw))
        return "chosen", {"pose": goal, "user": now.user}

    def _best(self, now: Situation, ring: ChaseRing) -> Point | None:
        """The chosen cell, m, in the map."""
        raise NotImplementedError


class ChooseChasePose(_ChoosesCell):
    """The free place around the user from which a touch would be served soonest, with least risk.

    `{do: ChooseChasePose, with: {inner: 2 m, front: 60 deg}, out: {pose: goal}, next: …}`.
    Places lie between the radii `inner` and `outer`, without the sectors `front` ahead of the user
    and `rear` behind them. The cost of a place is the time that a response from there would take,
    and the profile's `risk` times what waiting there and the drive there are expected to cost,
    should the user walk off (R96, R99, R103).
    """

    policy = "tuned"

    def _best(self, now: Situation, ring: ChaseRing) -> Point | None:
        from behaviors.chase.waiting_place import chase_place

        return chase_place(now, ring)


class ChooseChaseCell(_ChoosesCell):
    """The paper's Chase pose: the free cell of the largest weight that can be reached (R95, R96).

    The weight is an angle term, 1 at `best_angle` to either side of the user's view, times a radius
    term, 1 at `best_radius`; of equal ones the one with the shortest path. The space is as for
    `ChooseChasePose`.

    Args:
        best_angle: the best direction, off the user's view; by default the profile's.
        best_radius: the best distance from the user; by default the profile's.
        sample: the seed of a random order, in which a cell is the likelier the larger its weight
            is; by default the largest weight is taken.
    """

    policy = "paper"

    def __init__(
        self,
        inner: Annotated[Length, ABOVE_0] | None = None,
        outer: Annotated[Length, ABOVE_0] | None = None,
        front: Annotated[Angle, FROM_0] | None = None,
        rear: Annotated[Angle, FROM_0] | None = None,
        best_angle: Annotated[Angle, FROM_0] | None = None,
        best_radius: Annotated[Length, ABOVE_0] | None = None,
        sample: Annotated[int, FROM_0] | None = None,
    ) -> None:
        super().__init__(inner, outer, front, rear)
        self.best_angle, self.best_radius, self.sample = best_angle, best_radius, sample

    def _best(self, now: Situation, ring: ChaseRing) -> Point | None:
        from behaviors.chase.waiting_place import chase_cell

        chase = now.settings.chase
        angle = chase.best_angle if self.best_angle is None else self.best_angle
        radius = chase.best_radius if self.best_radius is None else self.best_radius
        return chase_cell(now, ring, angle, radius, self.sample)


def user_soon(now: Situation, ahead: float) -> Pose2:
    """The user's pose in the map `ahead` seconds from now, by the first likely predictor."""
    predictor = PREDICTORS[now.settings.user.likely[0]]
    return predictor.at(now.user.body, now.velocity, ahead, now.pose)


def distance_soon(now: Situation, ahead: float) -> float:
    """The greater of the user's distances now and in `ahead` seconds, m."""
    return max(now.distance, now.pose.distance_to(user_soon(now, ahead)))


class UserFar(Monitor):
    """`far` once the user is farther away than `beyond`, or will be in `ahead` seconds.

    Paper 4.4.2, second criterion (R90).

    Args:
        beyond: farther away than this.
        ahead: how far ahead to predict the user.

    Outcomes:
        far: the user is farther away than `beyond`, or will be.
    """

    outcomes = ("far",)
    reads = READS

    def __init__(self, beyond: Length = 4.0, ahead: Duration = 0.0) -> None:
        self.beyond, self.ahead = beyond, ahead

    def run(self, ctx: Context) -> Run:
        news = On(*CHANGES)
        while True:
            now = situation(ctx)
            if now is not None and distance_soon(now, self.ahead) > self.beyond:
                return "far"
            yield news


class Approach(Action):
    """Follow a user who has walked away until they are within `near` (R90, R91).

    Their predicted position in `ahead` seconds counts too, so that a walking user is kept up with.

    Args:
        near: how near to come.
        ahead: how far ahead to predict the user; they have to be near now and then.

    Outcomes:
        near: the user is within `near`, now and in `ahead` seconds.
        no_path: no path leads to them.
        lost: the pose of base or user is lost.
    """

    outcomes = ("near", "no_path", "lost")
    reads = {**WAYS, **DRIVES}
    commands = ("base",)

    def __init__(self, near: Length = 3.0, ahead: Duration = 0.0) -> None:
        self.near, self.ahead = near, ahead

    def run(self, ctx: Context) -> Run:
        with BaseDrive(ctx, "chase", "chase", patience=None) as drive:
            while (now := situation(ctx, "chase")) is not None:
                if distance_soon(now, self.ahead) <= self.near:
                    return "near"
                goal = self._goal(now)
                if goal is None:
                    return "no_path"
                if drive.towards(goal, now=now.around) == "arrived":
                    return "near"  # within the tolerance of the drive
                yield ctx.value(BASE_REFUSAL)
        return "lost"

    def _goal(self, now: Situation) -> Pose2 | None:
        """The first place within `near` on the path to the predicted user; None without a path."""
        soon, here = user_soon(now, self.ahead), (now.pose.x, now.pose.y)
        place = place_near(now.planners["chase"], here, (soon.x, soon.y), self.near)
        return None if place is None else Pose2(*place, now.pose.yaw)
