"""What `doctor --scene` reports of waiting beside a user: the risk that no place in the room takes.

For users all over the floor the place is looked up that Chase would choose if every path were
free, with the risk of `behaviors.person.waiting` there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from behaviors.profile import Settings
    from behaviors.situation import Array, Situation
    from states.environment import Environment

APART, PLACES = 1.0, 150
"""Distance between the places at which a user is looked at, m, or more for so many at most."""
YAWS = 4
"""Number of directions in which they look at each."""


@dataclass(frozen=True, slots=True)
class WaitingReport:
    """Expected cost of a robot that waits where Chase would, s.

    `mean` over all users looked at, `worst` with the place of that user in the map, m. `nowhere` is
    the share of users beside whom no Chase pose is free.
    """

    mean: float
    worst: float
    place: tuple[float, float]
    nowhere: float


def waiting_report(environment: Environment, settings: Settings) -> WaitingReport | None:
    """Look at users all over the room; None if there is no floor for them to stand on."""
    cells = _cells(environment, settings)
    found = [(now, _risk(now, cells)) for now in _users(environment, settings)]
    if not found:
        return None
    risks = [(risk, now) for now, risk in found if risk is not None]
    nowhere = 1.0 - len(risks) / len(found)
    if not risks:
        body = found[0][0].user.body
        return WaitingReport(math.nan, math.nan, (body.x, body.y), nowhere)
    worst, at = max(risks, key=lambda one: one[0])
    mean = sum(risk for risk, _ in risks) / len(risks)
    return WaitingReport(mean, worst, (at.user.body.x, at.user.body.y), nowhere)


def _users(environment: Environment, settings: Settings) -> Iterator[Situation]:
    from behaviors.situation import Situation
    from hw import STILL, USER_RADIUS, Pose2, UserPose

    room = environment.room
    x_low, y_low, x_high, y_high = room.bounds
    apart = max(APART, math.sqrt((x_high - x_low) * (y_high - y_low) / PLACES))
    for i in range(math.ceil((x_high - x_low) / apart)):
        for j in range(math.ceil((y_high - y_low) / apart)):
            x, y = x_low + (i + 0.5) * apart, y_low + (j + 0.5) * apart
            if not room.is_free(x, y) or room.clearance(x, y) < USER_RADIUS:
                continue
            for step in range(YAWS):
                body = Pose2(x, y, step * math.tau / YAWS)
                user = UserPose(body, body.yaw)
                planners = environment.static_planners
                yield Situation(environment, settings, body, STILL, user, STILL, planners)


def _cells(environment: Environment, settings: Settings) -> Array:
    """The cells about a user, (n, 3): x, y and what waiting there costs by the policy."""
    from behaviors.situation import ChaseRing, timed_cells, weighted_cells

    ring, chase = ChaseRing.of(settings.chase), settings.chase
    if settings.policy == "tuned":
        return timed_cells(environment, settings, ring)
    return weighted_cells(ring, chase.best_angle, chase.best_radius) * (1.0, 1.0, -1.0)


def _risk(now: Situation, cells: Array) -> float | None:
    """The risk at the free cell of least cost, s; None without a free cell."""
    from behaviors.chase import free_cells
    from behaviors.person import risks

    free, weighed = free_cells(now, cells), now.settings.policy == "tuned"
    if not len(free):
        return None
    found = risks(now, free[:, :2])
    costs = free[:, 2] + (now.settings.chase.risk * found if weighed else 0.0)
    return float(found[costs.argmin()])
