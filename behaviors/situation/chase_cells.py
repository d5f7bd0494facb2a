"""The Chase space: cells around the user where the robot may wait (R93-R98), and their worth.

Arrays are in the user's frame, x ahead and y left, m, if nothing else is said.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from behaviors.profile import Settings
from behaviors.situation.chase_ring import ChaseRing
from hw import Pose2
from states.environment import Environment
from states.navigation.local import rest_to_rest

Array = NDArray[np.float64]


def cells_of(ring: ChaseRing) -> Array:
    """The cells, (n, 2). Centres are at (i + 1/2) times the cell size (R94)."""
    reach = math.ceil(ring.outer / ring.cell)
    centres = (np.arange(-reach, reach) + 0.5) * ring.cell
    x, y = (axis.ravel() for axis in np.meshgrid(centres, centres, indexing="ij"))
    radius, bearing = np.hypot(x, y), np.abs(np.arctan2(y, x))
    kept = (radius >= ring.inner) & (radius <= ring.outer)
    kept &= (bearing >= 0.5 * ring.front) & (bearing <= math.pi - 0.5 * ring.rear)
    return np.column_stack((x[kept], y[kept]))


@lru_cache(maxsize=8)
def weighted_cells(ring: ChaseRing, best_angle: float, best_radius: float) -> Array:
    """The paper's space, (n, 3): x, y, weight from 0 to 1 (R95).

    The weight is an angle term times a radius term, each 1 at its best value, rad and m, and
    decreasing linearly.
    """
    cells = cells_of(ring)
    radius, bearing = np.hypot(*cells.T), np.abs(np.arctan2(cells[:, 1], cells[:, 0]))
    by_angle = 1.0 - np.abs(bearing - best_angle) / math.pi
    by_radius = 1.0 - np.abs(radius - best_radius) / (ring.outer - ring.inner)
    weights = np.clip(by_angle, 0.0, 1.0) * np.clip(by_radius, 0.0, 1.0)
    return np.column_stack((cells, weights))


@lru_cache(maxsize=8)
def timed_cells(environment: Environment, settings: Settings, ring: ChaseRing) -> Array:
    """Our space, (n, 3): x, y, and what waiting there costs of response, s.

    No cell lies in an Escape zone that is widened by the profile's margins (R103).
    """
    cells, chase, escape = cells_of(ring), settings.chase, settings.escape
    radius, bearing = np.hypot(*cells.T), np.abs(np.arctan2(cells[:, 1], cells[:, 0]))
    ahead = bearing <= escape.half_view + chase.margin_angle
    near = radius < np.where(ahead, escape.ahead, escape.around) + chase.margin
    cells = cells[~near]
    return np.column_stack((cells, response_costs(environment, settings, cells)))


def placed(cells: Array, centre: Pose2) -> Array:
    """The cells, (n, 3), moved from the user's frame to the map, around the pose `centre`."""
    c, s = math.cos(centre.yaw), math.sin(centre.yaw)
    x, y, worth = cells.T
    return np.column_stack((centre.x + c * x - s * y, centre.y + s * x + c * y, worth))


def response_costs(environment: Environment, settings: Settings, cells: Array) -> Array:
    """(1 + t) / room^2, s, with t the time to the nearest Haptic pose if a request came now, s.

    `room` is radius / best_radius, at most 1: nearer to the user there is less time to escape. The
    robot drives and turns at the same time, so t is the longer of the two, from rest to rest.
    """
    subsystem, limits = environment.navigation.haptic, environment.limits
    haptic = settings.haptic
    best = np.full(len(cells), math.inf)
    for angle in haptic.angles:
        x = haptic.deep_ahead + haptic.radius * math.cos(angle)
        y = haptic.radius * math.sin(angle)
        length = length_around(cells, (x, y), subsystem.user_radius)
        drive = rest_to_rest(length, subsystem.max_speed, limits.base_acceleration)
        # either long side may face the user: the yaw counts modulo pi
        tangent = np.arctan2(cells[:, 1], cells[:, 0]) + 0.5 * math.pi
        turn = np.abs((angle + math.pi - tangent + 0.5 * math.pi) % math.pi - 0.5 * math.pi)
        rotate = rest_to_rest(turn, limits.base_yaw_rate, limits.base_yaw_acceleration)
        best = np.minimum(best, np.maximum(drive, rotate))
    room = np.minimum(1.0, np.hypot(*cells.T) / settings.chase.best_radius)
    found: Array = 1.0 / (room**2 / (1.0 + best))
    return found


def length_around(starts: Array, goal: tuple[float, float], radius: float) -> Array:
    """Lengths of the shortest paths from `starts` to `goal` around a disc at the origin, m.

    From radius r the tangent to the disc of radius R has the length sqrt(r^2 - R^2) and touches it
    acos(R / r) further around. What the two tangents leave of the angle between start and goal is
    an arc; if nothing is left, the straight line misses the disc.
    """
    start_radius = np.maximum(np.hypot(*starts.T), radius)
    goal_radius = max(math.hypot(*goal), radius)
    apart = np.abs(np.arctan2(starts[:, 1], starts[:, 0]) - math.atan2(goal[1], goal[0]))
    apart = np.minimum(apart, 2.0 * math.pi - apart)
    straight = np.hypot(starts[:, 0] - goal[0], starts[:, 1] - goal[1])
    arc = apart - np.arccos(radius / start_radius) - math.acos(radius / goal_radius)
    starts_leg = np.sqrt(np.maximum(0.0, start_radius**2 - radius**2))  # squares are rounded
    legs = starts_leg + math.sqrt(max(0.0, goal_radius**2 - radius**2))
    found: Array = np.where(arc > 0.0, legs + radius * arc, straight)
    return found
