"""The objective of the Timed Elastic Band (Roesmann et al. 2012, 2013; teb_local_planner).

A band is (n, 4): poses x, y, yaw and the time dt to the next pose. Its cost is the sum over all
terms of weight * residual^2; names, terms and defaults are those of the published planner's
configuration (which differs from its code in places). Velocities and accelerations are in the
robot's frame at the pose. m, s, rad.

Obstacles are (m, 7): a segment from x1, y1 to x2, y2 (a point: both the same), a radius to be
subtracted from distances, and a velocity; moving ones are predicted for the time at which the band
reached the pose when its nearest obstacles were last determined.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from states.navigation.exact import Array, distance_to_side, turn_between

Integers = NDArray[np.int64]

NEAR = 4
"""Number of nearest obstacles that count at each pose."""

TIME, LENGTH, VELOCITY, NONHOLONOMIC, FORWARD, ROTATION = 0, 1, 2, 5, 6, 7
ACCELERATION, START_ACCELERATION, VIA, NEAR_VELOCITY, OBSTACLE = 8, 11, 14, 15, 17
ROWS = OBSTACLE + 2 * NEAR
"""Residuals per pose; velocity and accelerations have three each, near-velocity two."""


class TebValues(NamedTuple):
    """Parameters under their published names; all numbers, so that compiled code can take them.

    One is an addition, off by default (0): `acc_lim_trans` limits the acceleration as a vector in
    one frame. As published it is limited per axis, each velocity in the frame of its own pose, so
    that a holonomic robot gains a factor 1.4 on diagonals and mistakes turning for braking.
    """

    dt_ref: float = 0.3
    dt_hysteresis: float = 0.1
    min_samples: int = 3
    max_samples: int = 500
    max_vel_x: float = 0.4
    max_vel_x_backwards: float = 0.2
    max_vel_y: float = 0.0
    max_vel_trans: float = 0.0
    max_vel_theta: float = 0.3
    acc_lim_x: float = 0.5
    acc_lim_y: float = 0.5
    acc_lim_theta: float = 0.5
    min_obstacle_dist: float = 0.5
    inflation_dist: float = 0.6
    dynamic_obstacle_inflation_dist: float = 0.6
    obstacle_proximity_ratio_max_vel: float = 1.0
    obstacle_proximity_lower_bound: float = 0.0
    obstacle_proximity_upper_bound: float = 0.5
    no_inner_iterations: int = 5
    no_outer_iterations: int = 4
    penalty_epsilon: float = 0.1
    weight_max_vel_x: float = 2.0
    weight_max_vel_y: float = 2.0
    weight_max_vel_theta: float = 1.0
    weight_acc_lim_x: float = 1.0
    weight_acc_lim_y: float = 1.0
    weight_acc_lim_theta: float = 1.0
    weight_kinematics_nh: float = 1000.0
    weight_kinematics_forward_drive: float = 1.0
    weight_optimaltime: float = 1.0
    weight_shortest_path: float = 0.0
    weight_obstacle: float = 50.0
    weight_inflation: float = 0.1
    weight_dynamic_obstacle: float = 50.0
    weight_dynamic_obstacle_inflation: float = 0.1
    weight_velocity_obstacle_ratio: float = 0.0
    weight_viapoint: float = 1.0
    weight_prefer_rotdir: float = 50.0
    weight_adapt_factor: float = 2.0
    prefer_rotdir: float = 0.0
    acc_lim_trans: float = 0.0


class TebScene(NamedTuple):
    """Inputs of the residuals other than the band itself.

    `ends` (2, 3): velocities at start and goal in the robot's frame. `near` (n, NEAR): obstacles
    of each pose, -1 none. `times` (n,): when each pose is reached. `via` (n, 2): the via point of
    each pose, NaN none. `factor` multiplies the obstacles' weights; `holonomic` (omni) or not.
    """

    ends: Array
    obstacles: Array
    near: Integers
    times: Array
    via: Array
    factor: float
    holonomic: bool


@compiled
def outside(value: float, low: float, high: float, epsilon: float) -> float:
    """How far a value is outside the interval [low + epsilon, high - epsilon]; 0 inside."""
    return max(0.0, low + epsilon - value, value - (high - epsilon))


@compiled
def below(value: float, low: float, epsilon: float) -> float:
    """How far a value is below low + epsilon; 0 above."""
    return max(0.0, low + epsilon - value)


@compiled
def velocity(band: Array, i: int, holonomic: bool) -> tuple[float, float, float]:
    """Velocity from pose i to the next, in its frame; signed by a steep sigmoid if differential."""
    dx, dy = band[i + 1, 0] - band[i, 0], band[i + 1, 1] - band[i, 1]
    c, s = math.cos(band[i, 2]), math.sin(band[i, 2])
    dt = band[i, 3]
    omega = turn_between(band[i, 2], band[i + 1, 2]) / dt
    ahead = c * dx + s * dy
    if holonomic:
        return ahead / dt, (c * dy - s * dx) / dt, omega
    scaled = 100.0 * ahead
    return math.hypot(dx, dy) / dt * scaled / (1.0 + abs(scaled)), 0.0, omega


@compiled
def turned(motion: tuple[float, float, float], angle: float) -> tuple[float, float, float]:
    """A velocity given in a frame that is turned by `angle`, expressed in the unturned frame."""
    c, s = math.cos(angle), math.sin(angle)
    return c * motion[0] - s * motion[1], s * motion[0] + c * motion[1], motion[2]


@compiled
def motion_rows(band: Array, i: int, v: TebValues, holonomic: bool, row: Array) -> None:
    """Time, length, velocity limits and kinematics between pose i and the next."""
    dx, dy = band[i + 1, 0] - band[i, 0], band[i + 1, 1] - band[i, 1]
    yaw, next_yaw = band[i, 2], band[i + 1, 2]
    row[TIME] = math.sqrt(v.weight_optimaltime) * band[i, 3]
    row[LENGTH] = math.sqrt(v.weight_shortest_path) * math.hypot(dx, dy)
    vx, vy, omega = velocity(band, i, holonomic)
    most_x, most_back, most_y = v.max_vel_x, v.max_vel_x_backwards, v.max_vel_y
    if holonomic:
        trans = max(v.max_vel_trans, v.max_vel_x) if v.max_vel_trans == 0.0 else v.max_vel_trans
        rest_x = math.sqrt(max(0.0, trans * trans - vy * vy))
        rest_y = math.sqrt(max(0.0, trans * trans - vx * vx))
        most_x, most_back, most_y = min(rest_x, most_x), min(rest_x, most_back), min(rest_y, most_y)
    epsilon = v.penalty_epsilon
    row[VELOCITY] = math.sqrt(v.weight_max_vel_x) * outside(vx, -most_back, most_x, epsilon)
    row[VELOCITY + 1] = math.sqrt(v.weight_max_vel_y) * outside(vy, -most_y, most_y, 0.0)
    row[VELOCITY + 2] = math.sqrt(v.weight_max_vel_theta) * outside(
        omega, -v.max_vel_theta, v.max_vel_theta, epsilon
    )
    sideways = (math.cos(yaw) + math.cos(next_yaw)) * dy - (math.sin(yaw) + math.sin(next_yaw)) * dx
    row[NONHOLONOMIC] = math.sqrt(v.weight_kinematics_nh) * abs(sideways)
    ahead = dx * math.cos(yaw) + dy * math.sin(yaw)
    row[FORWARD] = math.sqrt(v.weight_kinematics_forward_drive) * below(ahead, 0.0, 0.0)
    if v.prefer_rotdir != 0.0 and i < 3:
        turned = v.prefer_rotdir * turn_between(yaw, next_yaw)
        row[ROTATION] = math.sqrt(v.weight_prefer_rotdir) * below(turned, 0.0, 0.0)


@compiled
def acceleration_rows(
    first: tuple[float, float, float],
    second: tuple[float, float, float],
    time: float,
    v: TebValues,
    row: Array,
) -> None:
    """Acceleration limits between two velocities that are `time` apart."""
    ax, ay = (second[0] - first[0]) / time, (second[1] - first[1]) / time
    turning = (second[2] - first[2]) / time
    most_x, most_y = v.acc_lim_x, v.acc_lim_y
    if v.acc_lim_trans > 0.0:
        most_x = min(most_x, math.sqrt(max(0.0, v.acc_lim_trans**2 - ay * ay)))
        most_y = min(most_y, math.sqrt(max(0.0, v.acc_lim_trans**2 - ax * ax)))
    epsilon = v.penalty_epsilon
    row[0] = math.sqrt(v.weight_acc_lim_x) * outside(ax, -most_x, most_x, epsilon)
    row[1] = math.sqrt(v.weight_acc_lim_y) * outside(ay, -most_y, most_y, epsilon)
    row[2] = math.sqrt(v.weight_acc_lim_theta) * outside(
        turning, -v.acc_lim_theta, v.acc_lim_theta, epsilon
    )


@compiled
def distance_to(obstacle: Array, x: float, y: float, time: float) -> float:
    """Distance to an obstacle at its position after `time`, less its radius."""
    x -= obstacle[5] * time
    y -= obstacle[6] * time
    return float(distance_to_side(x, y, obstacle) - obstacle[4])


@compiled
def obstacle_rows(band: Array, i: int, v: TebValues, scene: TebScene, row: Array) -> None:
    """Distances to the obstacles of pose i, and the speed allowed near the nearest."""
    nearest = math.inf
    for k in range(NEAR):
        index = scene.near[i, k]
        if index < 0:
            continue
        obstacle = scene.obstacles[index]
        moves = obstacle[5] != 0.0 or obstacle[6] != 0.0
        distance = distance_to(obstacle, band[i, 0], band[i, 1], scene.times[i] if moves else 0.0)
        nearest = min(nearest, distance)
        weight, soft, reach = v.weight_obstacle, v.weight_inflation, v.inflation_dist
        if moves:
            weight, soft = v.weight_dynamic_obstacle, v.weight_dynamic_obstacle_inflation
            reach = v.dynamic_obstacle_inflation_dist
        near = below(distance, v.min_obstacle_dist, v.penalty_epsilon)
        row[OBSTACLE + 2 * k] = math.sqrt(weight * scene.factor) * near
        row[OBSTACLE + 2 * k + 1] = math.sqrt(soft) * below(distance, reach, 0.0)
    if v.weight_velocity_obstacle_ratio > 0.0 and nearest < math.inf:
        low, high = v.obstacle_proximity_lower_bound, v.obstacle_proximity_upper_bound
        part = min(1.0, max(0.0, (nearest - low) / (high - low)))
        part *= v.obstacle_proximity_ratio_max_vel
        vx, vy, omega = velocity(band, i, scene.holonomic)
        weight = math.sqrt(v.weight_velocity_obstacle_ratio)
        speed, most = math.hypot(vx, vy), part * v.max_vel_x
        row[NEAR_VELOCITY] = weight * outside(speed, -most, most, 0.0)
        turning = part * v.max_vel_theta
        row[NEAR_VELOCITY + 1] = weight * outside(omega, -turning, turning, 0.0)


@compiled
def residuals(band: Array, v: TebValues, scene: TebScene) -> Array:
    """Residuals times the roots of their weights, (n, ROWS); their squares add up to the cost."""
    count = len(band)
    rows = np.zeros((count, ROWS))
    for i in range(count - 1):
        motion_rows(band, i, v, scene.holonomic, rows[i])
        now = velocity(band, i, scene.holonomic)
        if i == 0:
            start = (scene.ends[0, 0], scene.ends[0, 1], scene.ends[0, 2])
            acceleration_rows(start, now, band[0, 3], v, rows[0, START_ACCELERATION:])
        if i == count - 2:
            goal = (scene.ends[1, 0], scene.ends[1, 1], scene.ends[1, 2])
            acceleration_rows(now, goal, band[i, 3], v, rows[i, ACCELERATION:])
        else:
            following = velocity(band, i + 1, scene.holonomic)
            if v.acc_lim_trans > 0.0:
                following = turned(following, turn_between(band[i, 2], band[i + 1, 2]))
            time = 0.5 * (band[i, 3] + band[i + 1, 3])
            acceleration_rows(now, following, time, v, rows[i, ACCELERATION:])
        if i > 0:
            obstacle_rows(band, i, v, scene, rows[i])
        if not math.isnan(scene.via[i, 0]):
            off = math.hypot(band[i, 0] - scene.via[i, 0], band[i, 1] - scene.via[i, 1])
            rows[i, VIA] = math.sqrt(v.weight_viapoint) * off
    return rows
