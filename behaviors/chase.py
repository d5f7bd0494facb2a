"""Chase: choosing where to wait near the user, and following them (paper 4.4.2)."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from behaviors.situation import (
    CHANGES,
    CHASE_SPACE,
    READS,
    WAYS,
    ChaseCell,
    ChaseSpace,
    Situation,
    situation,
)
from engine import Action, Context, Monitor, On, Run
from engine.files import Duration, Length
from hw import OLD_S, Pose2, Pose3, UserPose, wrap
from hw.scene import Point
from states.environment import BASE_REFUSAL, HAPTIC_REQUEST, planner_key
from states.navigation import DRIVES, command_of, place_near, user_disc
from states.signals import PREDICTORS

if TYPE_CHECKING:
    from behaviors.situation import Array

TRIES = 30
"""How many of the best free cells are tried for a path before giving up."""
CELLS = 400
"""About how many cells' risk is computed."""


def tangent_yaw(centre: Pose2, place: Point, now: float) -> float:
    """Yaw at `place` with a long side facing the user at `centre`, rad (R99).

    Of the two possible ones it is the one that takes the smaller turn from the yaw `now`.
    """
    radial = math.atan2(place[1] - centre.y, place[0] - centre.x)
    options = (wrap(radial + 0.5 * math.pi), wrap(radial - 0.5 * math.pi))
    return min(options, key=lambda yaw: abs(wrap(yaw - now)))


def best_cell(now: Situation, space: ChaseSpace, most: int = CELLS) -> Point | None:
    """The reachable free cell with the largest weight (R96); None if there is none.

    Weights within the profile's `tie` of the largest count as equal; the shortest path decides.
    Risk is computed of about `most` cells.
    """
    planner, chase = now.planners["chase"], now.settings.chase
    here = (now.pose.x, now.pose.y)
    cells: Iterable[ChaseCell]
    if chase.risk > 0.0:
        cells = drives_weighed(now, out_of_the_way(now, space.all_free(), most))
    else:
        cells = space.free()
    if chase.pick == "sample":
        cells = _sampled(list(cells), chase.seed, now.user)
    best, shortest, least = None, math.inf, -math.inf
    for tries, (x, y, weight) in enumerate(cells):
        if weight < least or (best is None and tries >= TRIES):
            break
        if math.dist((x, y), here) >= shortest:
            continue
        path = planner.plan(here, (x, y), now.user_disc("chase", (x, y)))
        if path is None or path.length >= shortest:
            continue
        if best is None:
            least = weight - chase.tie if chase.pick == "largest" else math.inf
        best, shortest = (x, y), path.length
    return best


def out_of_the_way(now: Situation, cells: Array, most: int = CELLS) -> Array:
    """About `most` of the cells (n, 3), with weights that include the risk of standing there.

    Best first.
    """
    from behaviors.person import risks

    some = cells[:: max(1, len(cells) // most)]
    return _with_costs(some, now.settings.chase.risk * risks(now, some[:, :2]))


def drives_weighed(now: Situation, cells: Array) -> list[ChaseCell]:
    """The cells (n, 3), with weights that include the risk of the drive there; best first."""
    import numpy as np

    from behaviors.person import way_risks
    from states.navigation.local import rest_to_rest

    subsystem, limits = now.environment.navigation.chase, now.environment.limits
    lengths = np.hypot(cells[:, 0] - now.pose.x, cells[:, 1] - now.pose.y)
    times = rest_to_rest(lengths, subsystem.max_speed, limits.base_acceleration)
    risk = way_risks(now, cells[:, :2], subsystem.user_radius, times)
    weighed: list[ChaseCell] = _with_costs(cells, now.settings.chase.risk * risk).tolist()
    return weighed


def _with_costs(cells: Array, costs: Array) -> Array:
    """Cells (n, 3) with costs, s, added to the times that their weights are reciprocals of."""
    import numpy as np

    weights = 1.0 / (1.0 / np.maximum(cells[:, 2], 1e-9) + costs)
    order = np.argsort(-weights, kind="stable")
    return np.column_stack((cells[:, :2], weights))[order]


def _sampled(cells: Sequence[ChaseCell], seed: int, user: UserPose) -> list[ChaseCell]:
    """Cells in a random order weighted by their weights (R96), the same for the same user pose.

    Sorting by u^(1 / weight), u uniform, descending, is weighted sampling without replacement
    (Efraimidis and Spirakis 2006).
    """
    chance = random.Random(repr((seed, user.body)))
    return sorted(cells, key=lambda cell: -(chance.random() ** (1.0 / max(cell[2], 1e-9))))


class HapticRequest(Monitor):
    """`requested` while the user asks for a touch, except for the request `refused` before.

    A request is a level: one that comes during an Escape is served afterwards (R60, R73).
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


class ChooseChasePose(Action):
    """The best free cell of the Chase space, and a yaw with a long side to the user (R96, R99)."""

    outcomes = ("chosen", "none")
    outputs = {"chosen": {"pose": Pose2, "user": UserPose}, "none": {"user": UserPose}}
    reads = {**WAYS, CHASE_SPACE: OLD_S}

    def run(self, ctx: Context) -> Run:
        while True:
            now, space = situation(ctx, "chase", "escape"), ctx.value(CHASE_SPACE)
            if now is not None and space is not None:
                break
            yield On(planner_key("chase"), CHASE_SPACE, *CHANGES)
        found = best_cell(now, space)
        if found is None:
            return "none", {"user": now.user}
        goal = Pose2(*found, tangent_yaw(space.centre, found, now.pose.yaw))
        return "chosen", {"pose": goal, "user": now.user}


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
    """

    outcomes = ("near", "no_path", "lost")
    reads = {**WAYS, **DRIVES}
    commands = ("base",)

    def __init__(self, near: Length = 3.0, ahead: Duration = 0.0) -> None:
        self.near, self.ahead = near, ahead

    def run(self, ctx: Context) -> Run:
        from states.navigation import driver_of

        base, driver = ctx.part("base"), None
        try:
            while (now := situation(ctx, "chase")) is not None:
                if distance_soon(now, self.ahead) <= self.near:
                    return "near"
                goal = self._goal(now)
                if goal is None:
                    return "no_path"
                driver = driver or driver_of(now.environment, "chase", now.planners["chase"])
                driver.planner = now.planners["chase"]
                driver.go_to(goal)
                disc = user_disc(now.user, now.environment.navigation.chase)
                command = command_of(ctx, driver, now.around, disc, now.environment.period)
                if driver.status == "arrived":
                    return "near"  # within the tolerance of the drive
                base.drive(command, "chase")
                yield ctx.value(BASE_REFUSAL)
        finally:
            base.release("chase")
        return "lost"

    def _goal(self, now: Situation) -> Pose2 | None:
        """The first place within `near` on the path to the predicted user; None without a path."""
        soon, here = user_soon(now, self.ahead), (now.pose.x, now.pose.y)
        place = place_near(now.planners["chase"], here, (soon.x, soon.y), self.near)
        return None if place is None else Pose2(*place, now.pose.yaw)
