"""The Chase space: cells around the user where the robot may wait, with weights (R93-R98).

Arrays are in the user's frame: x ahead, y left, m.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from behaviors.profile import ChaseSettings, Settings
from hw import Pose2
from states.environment import Environment
from states.navigation.local import rest_to_rest

Array = NDArray[np.float64]


def grid(environment: Environment, settings: Settings) -> Array:
    """All cells, (n, 3): x, y, weight; best first. Centres are at (i + 1/2) times the cell size."""
    chase = settings.chase
    cells = ring(chase)
    if chase.margin is not None and chase.margin_angle is not None:
        escape = settings.escape
        radius, bearing = np.hypot(*cells.T), np.abs(np.arctan2(cells[:, 1], cells[:, 0]))
        ahead = bearing <= escape.half_view + chase.margin_angle
        near = radius < np.where(ahead, escape.ahead, escape.around) + chase.margin
        cells = cells[~near]
    weigh = WEIGHTS[chase.weight]
    weights = weigh(environment, settings, cells)
    order = np.argsort(-weights, kind="stable")
    return np.column_stack((cells, weights))[order]


def placed(cells: Array, centre: Pose2) -> Array:
    """The cells, (n, 3), moved from the user's frame to the map, around the pose `centre`."""
    c, s = math.cos(centre.yaw), math.sin(centre.yaw)
    x, y, weight = cells.T
    return np.column_stack((centre.x + c * x - s * y, centre.y + s * x + c * y, weight))


def ring(chase: ChaseSettings) -> Array:
    """Cells of the two arcs, (n, 2): between the radii, without the sectors in front and behind."""
    reach = math.ceil(chase.outer / chase.cell)
    centres = (np.arange(-reach, reach) + 0.5) * chase.cell
    x, y = (axis.ravel() for axis in np.meshgrid(centres, centres, indexing="ij"))
    radius, bearing = np.hypot(x, y), np.abs(np.arctan2(y, x))
    kept = (radius >= chase.inner) & (radius <= chase.outer)
    kept &= (bearing >= 0.5 * chase.front) & (bearing <= math.pi - 0.5 * chase.rear)
    return np.column_stack((x[kept], y[kept]))


def angle_radius(_environment: Environment, settings: Settings, cells: Array) -> Array:
    """An angle term times a radius term, each 1 at its best value and decreasing linearly."""
    chase = settings.chase
    radius, bearing = np.hypot(*cells.T), np.abs(np.arctan2(cells[:, 1], cells[:, 0]))
    by_angle = 1.0 - np.abs(bearing - chase.best_angle) / math.pi
    by_radius = 1.0 - np.abs(radius - chase.best_radius) / (chase.outer - chase.inner)
    found: Array = np.clip(by_angle, 0.0, 1.0) * np.clip(by_radius, 0.0, 1.0)
    return found


def time_to_haptic(environment: Environment, settings: Settings, cells: Array) -> Array:
    """room^2 / (1 + t), with t the time, s, to the nearest Haptic pose if a request came now.

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
    found: Array = room**2 / (1.0 + best)
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


WEIGHTS = {"angle_radius": angle_radius, "time_to_haptic": time_to_haptic}
