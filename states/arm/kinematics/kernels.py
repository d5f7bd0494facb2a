"""The arm's compiled inner loops: link frames, distances, sweeps along a path.

All are in one file because numba's cache watches only the file of a function: a kernel compiled
against an older version of another file's kernel would not be noticed. Rover frame; m, rad.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw import compiled, compiled_like_numpy

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

SEEN = 2.0
"""Obstacles farther than this from the rover's centre are out of the arm's reach, m."""


class CapsuleSet(NamedTuple):
    """The arm for collision checks: m capsules, and p pairs of them that may touch.

    `base` (4, 4) and `origins` (j, 4, 4) as in `Manipulator`; `links` (m,); `ends` (m, 2, 3) in
    the link's frame; `radii` (m,); `pairs` (p, 2); `reach` (m, j): an upper bound on the distance
    of a capsule's axis from the axis of each joint, at any joint angles; `boxes` (k, 2, 3) are
    parts of the rover. Capsules below `first` are fixed to the rover: checked against the arm only.
    """

    base: Array
    origins: Array
    links: Integers
    ends: Array
    radii: Array
    pairs: Integers
    reach: Array
    boxes: Array
    first: int


class ArmObstacles(NamedTuple):
    """Obstacles around the rover: floor height, walls (w, 6), cylinders (c, 5), limbs (n, 2, 3).

    A wall is an upright rectangle x1, y1, x2, y2, z_low, z_high; a cylinder is x, y, radius, z_low,
    z_high. A limb is a capsule, given by both ends of its axis and, in `thickness` (n,), its
    radius; one without length is a ball.
    """

    floor: float
    walls: Array
    cylinders: Array
    limbs: Array
    thickness: Array


@compiled
def place_links(base: Array, origins: Array, q: Array, frames: Array) -> None:
    """Writes rover_from_link of base and j links into frames (j + 1, 4, 4), upper rows only."""
    for i in range(3):
        for j in range(4):
            frames[0, i, j] = base[i, j]
    for k in range(len(origins)):
        before, here, origin = frames[k], frames[k + 1], origins[k]
        c, s = math.cos(q[k]), math.sin(q[k])
        for i in range(3):
            a, b, d = before[i, 0], before[i, 1], before[i, 2]
            x = a * origin[0, 0] + b * origin[1, 0] + d * origin[2, 0]
            y = a * origin[0, 1] + b * origin[1, 1] + d * origin[2, 1]
            here[i, 0] = c * x + s * y
            here[i, 1] = c * y - s * x
            here[i, 2] = a * origin[0, 2] + b * origin[1, 2] + d * origin[2, 2]
            here[i, 3] = before[i, 3] + a * origin[0, 3] + b * origin[1, 3] + d * origin[2, 3]


@compiled
def place_tcp(base: Array, origins: Array, tip: Array, q: Array, poses: Array) -> None:
    """Writes rover_from_tcp of joints (n, j) into poses (n, 4, 4), which must be zero."""
    frames = np.empty((len(origins) + 1, 4, 4))
    for n in range(len(q)):
        place_links(base, origins, q[n], frames)
        for i in range(3):
            row = frames[len(origins), i]
            for j in range(4):
                poses[n, i, j] = row[0] * tip[0, j] + row[1] * tip[1, j] + row[2] * tip[2, j]
            poses[n, i, 3] += row[3]
        poses[n, 3, 3] = 1.0


@compiled
def slopes(base: Array, origins: Array, tip: Array, q: Array, found: Array) -> None:
    """Writes the geometric Jacobian of joints (n, j) into found (n, 6, j).

    Column k is (z_k x (tcp - o_k), z_k): axis and origin of joint k, in the rover frame.
    """
    frames = np.empty((len(origins) + 1, 4, 4))
    for n in range(len(q)):
        place_links(base, origins, q[n], frames)
        flange = frames[len(origins)]
        tcp = flange[:3, 3] + flange[:3, 0] * tip[0, 3] + flange[:3, 1] * tip[1, 3]
        tcp += flange[:3, 2] * tip[2, 3]
        for k in range(len(origins)):
            frame = frames[k + 1]
            zx, zy, zz = frame[0, 2], frame[1, 2], frame[2, 2]
            x, y, z = tcp[0] - frame[0, 3], tcp[1] - frame[1, 3], tcp[2] - frame[2, 3]
            found[n, 0, k] = zy * z - zz * y
            found[n, 1, k] = zz * x - zx * z
            found[n, 2, k] = zx * y - zy * x
            found[n, 3, k], found[n, 4, k], found[n, 5, k] = zx, zy, zz


@compiled
def missed(pose: Array, target: Array, miss: Array) -> float:
    """Writes by how much a pose (4, 4) misses a target into miss (6,), m and rad; its square.

    The rotation vector is that of `kinematics.rotation_vector`.
    """
    turn = np.empty((3, 3))
    for i in range(3):
        miss[i] = target[i, 3] - pose[i, 3]
        for j in range(3):
            turn[i, j] = (
                target[i, 0] * pose[j, 0] + target[i, 1] * pose[j, 1] + target[i, 2] * pose[j, 2]
            )
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0))
    if sine > 0.0:
        share = 0.5 * angle / sine
        miss[3], miss[4], miss[5] = share * x, share * y, share * z
    else:
        miss[3], miss[4], miss[5] = angle, 0.0, 0.0
    square = 0.0
    for i in range(6):
        square += miss[i] * miss[i]
    return square


@compiled_like_numpy
def solved(matrix: Array, values: Array) -> None:
    """Replaces values (6,) by the solution of matrix (6, 6) x = values, which is spoilt by it."""
    for k in range(6):
        pivot = k
        for i in range(k + 1, 6):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, 6):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            values[k], values[pivot] = values[pivot], values[k]
        for i in range(k + 1, 6):
            share = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, 6):
                matrix[i, j] -= share * matrix[k, j]
            values[i] -= share * values[k]
    for k in range(5, -1, -1):
        for j in range(k + 1, 6):
            values[k] -= matrix[k, j] * values[j]
        values[k] /= matrix[k, k]


@compiled
def damped_step(jac: Array, miss: Array, damping: float, normal: Array, step: Array) -> None:
    """Writes the solution of (J^T J + damping I) step = J^T miss into step (6,)."""
    for i in range(6):
        step[i] = 0.0
        for k in range(6):
            step[i] += jac[k, i] * miss[k]
        for j in range(i + 1):
            square = 0.0
            for k in range(6):
                square += jac[k, i] * jac[k, j]
            normal[i, j] = normal[j, i] = square
        normal[i, i] += damping
    solved(normal, step)


@compiled
def descend(  # noqa: PLR0913 - a chain, a problem and its answer
    base: Array,
    origins: Array,
    tip: Array,
    targets: Array,
    steps: int,
    done: float,
    q: Array,
    worth: Array,
) -> None:
    """Moves joints (n, 6) towards targets (n, 4, 4), see `newton`; writes |e|^2 into worth (n,)."""
    pose, jac = np.zeros((1, 4, 4)), np.empty((1, 6, 6))
    miss, trial, new_miss = np.empty(6), np.empty((1, 6)), np.empty(6)
    normal, step = np.empty((6, 6)), np.empty(6)
    for n in range(len(q)):
        place_tcp(base, origins, tip, q[n : n + 1], pose)
        worth[n] = missed(pose[0], targets[n], miss)
        damping, fresh = 100.0, True
        for _ in range(steps):
            if worth[n] <= done:
                break
            if fresh:
                slopes(base, origins, tip, q[n : n + 1], jac)
            damped_step(jac[0], miss, 1e-15 + damping * worth[n], normal, step)
            for i in range(6):
                trial[0, i] = q[n, i] + step[i]
            place_tcp(base, origins, tip, trial, pose)
            new_worth = missed(pose[0], targets[n], new_miss)
            fresh = new_worth < worth[n]
            if fresh:
                worth[n] = new_worth
                for i in range(6):
                    q[n, i], miss[i] = trial[0, i], new_miss[i]
            damping *= 0.3 if fresh else 3.0


@compiled
def point_velocities(
    base: Array, origins: Array, links: Integers, local: Array, q: Array, slope: Array, found: Array
) -> None:
    """Writes velocities of points of the arm, rover frame, per unit of dq/dx, into found (n, k, 3).

    q and slope = dq/dx are (n, j), points `local` (k, 3) in the frames of their `links` (k,). Each
    joint adds slope_k z_k to the angular velocity w of all links beyond it, and the velocity of a
    point p of a link is v + w x (p - o), with v that of the link's origin o.
    """
    count = len(origins) + 1
    frames, v, w = np.empty((count, 4, 4)), np.zeros((count, 3)), np.zeros((count, 3))
    for n in range(len(q)):
        place_links(base, origins, q[n], frames)
        for k in range(len(origins)):
            before, here = frames[k], frames[k + 1]
            dx, dy, dz = (
                here[0, 3] - before[0, 3],
                here[1, 3] - before[1, 3],
                here[2, 3] - before[2, 3],
            )
            wx, wy, wz = w[k, 0], w[k, 1], w[k, 2]
            v[k + 1, 0] = v[k, 0] + wy * dz - wz * dy
            v[k + 1, 1] = v[k, 1] + wz * dx - wx * dz
            v[k + 1, 2] = v[k, 2] + wx * dy - wy * dx
            for e in range(3):
                w[k + 1, e] = w[k, e] + slope[n, k] * here[e, 2]
        for i in range(len(links)):
            frame, u, turn = frames[links[i]], v[links[i]], w[links[i]]
            x, y, z = local[i, 0], local[i, 1], local[i, 2]
            dx = frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z
            dy = frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z
            dz = frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z
            found[n, i, 0] = u[0] + turn[1] * dz - turn[2] * dy
            found[n, i, 1] = u[1] + turn[2] * dx - turn[0] * dz
            found[n, i, 2] = u[2] + turn[0] * dy - turn[1] * dx


@compiled
def greatest_speeds(
    base: Array, origins: Array, links: Integers, local: Array, q: Array, slope: Array, found: Array
) -> None:
    """Writes the speed of the fastest of these points per unit of dq/dx into found (n,)."""
    moved = np.empty((1, len(links), 3))
    for n in range(len(q)):
        point_velocities(base, origins, links, local, q[n : n + 1], slope[n : n + 1], moved)
        most = 0.0
        for i in range(len(links)):
            x, y, z = moved[0, i]
            most = max(most, x * x + y * y + z * z)
        found[n] = math.sqrt(most)


@compiled
def place_capsules(
    base: Array, origins: Array, links: Integers, local: Array, q: Array, frames: Array, ends: Array
) -> None:
    """Writes both ends of every capsule's axis into ends (m, 2, 3)."""
    place_links(base, origins, q, frames)
    for i in range(len(links)):
        frame = frames[links[i]]
        for e in range(2):
            x, y, z = local[i, e, 0], local[i, e, 1], local[i, e, 2]
            for k in range(3):
                ends[i, e, k] = frame[k, 0] * x + frame[k, 1] * y + frame[k, 2] * z + frame[k, 3]


@compiled
def seen_from_above(
    ends: Array,
    before: Array,
    radii: Array,
    half_length: float,
    half_width: float,
    x: float,
    y: float,
) -> tuple[bool, float, float]:
    """Whether capsules reach out of a rectangle, their gap to a point, and their shift.

    Rover frame, m; the rectangle is about its origin. The gap to (x, y) is below 0 inside; the
    shift is the greatest of an end of `ends` (m, 2, 3) since `before`.
    """
    beyond, gap, shift = False, np.inf, 0.0
    for i in range(len(radii)):
        ax, ay, bx, by = ends[i, 0, 0], ends[i, 0, 1], ends[i, 1, 0], ends[i, 1, 1]
        for e in range(2):
            px, py = ends[i, e, 0], ends[i, e, 1]
            outside = max(abs(px) - half_length, abs(py) - half_width)
            beyond = beyond or outside + radii[i] > 0.0
            shift = max(shift, math.hypot(px - before[i, e, 0], py - before[i, e, 1]))
        gap = min(gap, point_distance(x, y, ax, ay, bx, by) - radii[i])
    return beyond, gap, shift


@compiled
def approaching(  # noqa: PLR0913 - it writes three results
    body: CapsuleSet,
    first: int,
    q: Array,
    velocity: Array,
    x: float,
    y: float,
    towards: Array,
    distance: Array,
    closing: Array,
) -> None:
    """Writes how capsules from `first` on approach an upright axis at (x, y), rover frame.

    For joints and their velocities (n, j): the horizontal unit vector from the nearest point of
    each capsule's axis towards (x, y), (n, k, 2), their distance, m, and the speed at which that
    point comes nearer, m/s, below 0 if it goes away, both (n, k).
    """
    links, local = body.links[first:], body.ends[first:]
    count = len(links)
    frames, ends = np.empty((len(body.origins) + 1, 4, 4)), np.empty((count, 2, 3))
    points, twice = local.copy().reshape(2 * count, 3), np.repeat(links, 2)
    moved = np.empty((1, 2 * count, 3))
    for n in range(len(q)):
        place_capsules(body.base, body.origins, links, local, q[n], frames, ends)
        point_velocities(
            body.base, body.origins, twice, points, q[n : n + 1], velocity[n : n + 1], moved
        )
        for i in range(count):
            ax, ay = ends[i, 0, 0], ends[i, 0, 1]
            ux, uy = ends[i, 1, 0] - ax, ends[i, 1, 1] - ay
            square = ux * ux + uy * uy
            t = clamp(((x - ax) * ux + (y - ay) * uy) / square) if square > 0.0 else 0.0
            dx, dy = x - ax - t * ux, y - ay - t * uy
            away = max(math.hypot(dx, dy), 1e-9)
            nx, ny = dx / away, dy / away
            vx = (1.0 - t) * moved[0, 2 * i, 0] + t * moved[0, 2 * i + 1, 0]
            vy = (1.0 - t) * moved[0, 2 * i, 1] + t * moved[0, 2 * i + 1, 1]
            towards[n, i, 0], towards[n, i, 1] = nx, ny
            distance[n, i], closing[n, i] = away, vx * nx + vy * ny


@compiled
def approaching_limbs(  # noqa: PLR0913 - it writes three results
    body: CapsuleSet,
    first: int,
    q: Array,
    velocity: Array,
    limbs: Array,
    distance: Array,
    closing: Array,
    speed: Array,
    along: Array,
) -> None:
    """Writes how capsules from `first` on approach the axes of limbs (m, 2, 3), rover frame.

    For joints and their velocities (n, j): the distance between both axes, m, the speed at which
    the nearest point of the capsule comes nearer, m/s, below 0 if it goes away, its speed, and
    where the nearest point of the limb is, 0 at its start and 1 at its end; all (n, k, m).
    """
    links, local = body.links[first:], body.ends[first:]
    count = len(links)
    frames, ends = np.empty((len(body.origins) + 1, 4, 4)), np.empty((count, 2, 3))
    points, twice = local.copy().reshape(2 * count, 3), np.repeat(links, 2)
    moved = np.empty((1, 2 * count, 3))
    for n in range(len(q)):
        place_capsules(body.base, body.origins, links, local, q[n], frames, ends)
        point_velocities(
            body.base, body.origins, twice, points, q[n : n + 1], velocity[n : n + 1], moved
        )
        for i in range(count):
            for j in range(len(limbs)):
                s, t = segment_places(ends, i, limbs, j)
                square = rate = fast = 0.0
                for e in range(3):
                    near = ends[i, 0, e] + s * (ends[i, 1, e] - ends[i, 0, e])
                    off = limbs[j, 0, e] + t * (limbs[j, 1, e] - limbs[j, 0, e]) - near
                    v = (1.0 - s) * moved[0, 2 * i, e] + s * moved[0, 2 * i + 1, e]
                    square, rate, fast = square + off * off, rate + off * v, fast + v * v
                away = max(math.sqrt(square), 1e-9)
                distance[n, i, j], closing[n, i, j] = away, rate / away
                speed[n, i, j], along[n, i, j] = math.sqrt(fast), t


@compiled
def pair_gap(pairs: Integers, radii: Array, ends: Array, pair: int) -> float:
    """Distance between the surfaces of two capsules, negative where they overlap, m."""
    i, j = pairs[pair, 0], pairs[pair, 1]
    return float(segment_distance(ends, i, ends, j) - radii[i] - radii[j])


@compiled
def outer_gap(  # noqa: PLR0913 - a tuple would cost more than a distance
    radii: Array,
    boxes: Array,
    floor: float,
    walls: Array,
    cylinders: Array,
    limbs: Array,
    thickness: Array,
    ends: Array,
    i: int,
) -> float:
    """Distance of a capsule's surface to the rover and all obstacles, m; never too large.

    For walls and cylinders the horizontal and the vertical distance are measured separately; the
    root of the sum of their squares is a lower bound, exact where the nearest points coincide.
    """
    ax, ay, az = ends[i, 0, 0], ends[i, 0, 1], ends[i, 0, 2]
    bx, by, bz = ends[i, 1, 0], ends[i, 1, 1], ends[i, 1, 2]
    low, high = min(az, bz), max(az, bz)
    gap = low - floor
    for k in range(len(boxes)):
        gap = min(gap, box_distance(ends, i, boxes, k, gap))
    for k in range(len(walls)):
        upright = max(walls[k, 4] - high, low - walls[k, 5], 0.0)
        gap = min(gap, math.hypot(wall_distance(ax, ay, bx, by, walls, k), upright))
    for k in range(len(cylinders)):
        upright = max(cylinders[k, 3] - high, low - cylinders[k, 4], 0.0)
        across = point_distance(cylinders[k, 0], cylinders[k, 1], ax, ay, bx, by)
        gap = min(gap, math.hypot(max(across - cylinders[k, 2], 0.0), upright))
    for k in range(len(limbs)):
        gap = min(gap, segment_distance(ends, i, limbs, k) - thickness[k])
    return float(gap - radii[i])


@compiled
def gaps(body: CapsuleSet, around: ArmObstacles, q: Array, found: Array, which: Integers) -> None:
    """Writes the least gap of each of n joint sets and where it is: a pair, or p + a capsule."""
    # unpacked once: passing a tuple to another kernel costs more than a distance
    base, origins, links, local, radii, pairs, _, boxes, first = body
    floor, walls, cylinders, limbs, thickness = around
    frames, ends = np.empty((len(origins) + 1, 4, 4)), np.empty((len(links), 2, 3))
    for n in range(len(q)):
        place_capsules(base, origins, links, local, q[n], frames, ends)
        least, where = np.inf, 0
        for k in range(len(pairs)):
            gap = pair_gap(pairs, radii, ends, k)
            if gap < least:
                least, where = gap, k
        for i in range(first, len(links)):
            gap = outer_gap(radii, boxes, floor, walls, cylinders, limbs, thickness, ends, i)
            if gap < least:
                least, where = gap, len(pairs) + i
        found[n], which[n] = least, where


@compiled
def room_within(
    body: CapsuleSet, q: Array, half_length: float, half_width: float, found: Array
) -> None:
    """Writes how far the arm stays inside a rectangle about the rover's centre, (n,), m.

    Seen from above; below 0 where a capsule reaches out of it.
    """
    count = len(body.links)
    frames, ends = np.empty((len(body.origins) + 1, 4, 4)), np.empty((count, 2, 3))
    for n in range(len(q)):
        place_capsules(body.base, body.origins, body.links, body.ends, q[n], frames, ends)
        found[n] = np.inf
        for i in range(len(body.links)):
            for e in range(2):
                room = min(half_length - abs(ends[i, e, 0]), half_width - abs(ends[i, e, 1]))
                found[n] = min(found[n], room - body.radii[i])


@compiled
def walls_around(
    edges: Array, x: float, y: float, yaw: float, within: float, height: float
) -> Array:
    """Edges (w, 4) of the map as walls (n, 6) of this height from the floor, in the rover frame.

    Those farther than `within` from the rover's centre are left out; x, y, yaw: rover_from_map.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    found, n = np.empty((len(edges), 6)), 0
    for k in range(len(edges)):
        for e in (0, 2):
            found[n, e] = x + c * edges[k, e] - s * edges[k, e + 1]
            found[n, e + 1] = y + s * edges[k, e] + c * edges[k, e + 1]
        found[n, 4], found[n, 5] = 0.0, height
        ax, ay, bx, by = found[n, :4]
        if point_distance(0.0, 0.0, ax, ay, bx, by) <= within:
            n += 1
    return found[:n]


@compiled
def free_from(
    body: CapsuleSet,
    around: ArmObstacles,
    rovers: Array,
    joints: Array,
    tried: NDArray[np.bool_],
    margin: float,
    found: NDArray[np.bool_],
) -> None:
    """Writes whether one of the joint sets of each rover pose keeps the margin, (n,).

    Obstacles and rovers (n, 4: x, y, cos and sin of the yaw) are in the map, but limbs are not
    transformed: there must be none. Of the joints (n, k, j) those `tried` (n, k) count. Obstacles
    beyond SEEN of a rover's centre are left out.
    """
    walls, cylinders = around.walls, around.cylinders
    near_walls, near_cylinders = np.empty_like(walls), np.empty_like(cylinders)
    gap, which = np.empty(1), np.empty(1, dtype=np.int64)
    for n in range(len(rovers)):
        x, y, c, s = rovers[n]
        w = 0
        for k in range(len(walls)):
            if point_distance(x, y, walls[k, 0], walls[k, 1], walls[k, 2], walls[k, 3]) > SEEN:
                continue
            for e in (0, 2):
                dx, dy = walls[k, e] - x, walls[k, e + 1] - y
                near_walls[w, e], near_walls[w, e + 1] = c * dx + s * dy, c * dy - s * dx
            near_walls[w, 4:] = walls[k, 4:]
            w += 1
        m = 0
        for k in range(len(cylinders)):
            dx, dy = cylinders[k, 0] - x, cylinders[k, 1] - y
            if math.hypot(dx, dy) - cylinders[k, 2] > SEEN:
                continue
            near_cylinders[m, 0], near_cylinders[m, 1] = c * dx + s * dy, c * dy - s * dx
            near_cylinders[m, 2:] = cylinders[k, 2:]
            m += 1
        seen = ArmObstacles(
            around.floor, near_walls[:w], near_cylinders[:m], around.limbs, around.thickness
        )
        found[n] = False
        for k in range(joints.shape[1]):
            if tried[n, k]:
                gaps(body, seen, joints[n, k : k + 1], gap, which)
                if gap[0] >= margin:
                    found[n] = True
                    break


@compiled
def sweep(
    body: CapsuleSet, around: ArmObstacles, piece: Array, length: float, margin: float, budget: int
) -> tuple[float, int]:
    """How far along q = piece[0] + piece[1] x + piece[2] x^2, 0 <= x <= length, the arm is free.

    Free means: no nearer than half of `margin` to anything at every x, not only at samples. A gap g
    that shrinks at most at `rate` per unit of x stays above margin / 2 up to x + (g - margin / 2) /
    rate, and is measured again only there; a measured gap below `margin` ends the sweep
    (conservative advancement). Returns that x (`length` if all is free, less where the budget of
    joint sets ran out) and the number of joint sets checked.
    """
    base, origins, links, local, radii, pairs, reach, boxes, first = body
    floor, walls, cylinders, limbs, thickness = around
    count, capsules = len(pairs), len(links)
    frames, ends = np.empty((len(origins) + 1, 4, 4)), np.empty((capsules, 2, 3))
    rates = gap_rates(links, pairs, reach, piece, length)
    due = np.zeros(count + capsules)
    due[count : count + first] = np.inf
    x, checks, q = 0.0, 0, np.empty(len(origins))
    while checks < budget:
        for i in range(len(q)):
            q[i] = piece[0, i] + x * (piece[1, i] + x * piece[2, i])
        place_capsules(base, origins, links, local, q, frames, ends)
        checks += 1
        soonest = np.inf
        for k in range(count + capsules):
            if due[k] <= x:
                if k < count:
                    gap = pair_gap(pairs, radii, ends, k)
                else:
                    gap = outer_gap(
                        radii, boxes, floor, walls, cylinders, limbs, thickness, ends, k - count
                    )
                if gap < margin:
                    return x, checks
                due[k] = x + (gap - 0.5 * margin) / rates[k] if rates[k] > 0.0 else np.inf
            soonest = min(soonest, due[k])
        if x >= length:
            return length, checks
        x = min(soonest, length)
    return min(x, length * (1.0 - 1e-12)), checks


@compiled
def gap_rates(links: Integers, pairs: Integers, reach: Array, piece: Array, length: float) -> Array:
    """Bound on the rate at which each gap can shrink along a piece, m per unit of x.

    Pairs first, then capsules. A joint that turns at |dq/dx| moves a point at distance r from its
    axis by at most r |dq/dx|; the joints between both ends of a gap add up. dq/dx is linear in x,
    so its largest value is at one end of the piece.
    """
    count = len(pairs)
    rates = np.zeros(count + len(links))
    for k in range(len(rates)):
        last = k - count if k >= count else pairs[k, 1]
        first = 0 if k >= count else links[pairs[k, 0]]
        for i in range(first, links[last]):
            slope = max(abs(piece[1, i]), abs(piece[1, i] + 2.0 * length * piece[2, i]))
            rates[k] += slope * reach[last, i]
    return rates


@compiled
def segment_places(ends: Array, i: int, others: Array, j: int) -> tuple[float, float]:
    """Where axis i of ends (m, 2, 3) and axis j of others are nearest, as shares of both, 0 to 1.

    Minimises |w + s u - t v|^2 over the unit square: the stationary s, clamped; the best t for it;
    where that lies outside, t is clamped and s found anew. Nearly parallel axes begin at s = 0; an
    axis may be a point.
    """
    ax, ay, az = ends[i, 0, 0], ends[i, 0, 1], ends[i, 0, 2]
    cx, cy, cz = others[j, 0, 0], others[j, 0, 1], others[j, 0, 2]
    ux, uy, uz = ends[i, 1, 0] - ax, ends[i, 1, 1] - ay, ends[i, 1, 2] - az
    vx, vy, vz = others[j, 1, 0] - cx, others[j, 1, 1] - cy, others[j, 1, 2] - cz
    wx, wy, wz = ax - cx, ay - cy, az - cz
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    uv, uw = ux * vx + uy * vy + uz * vz, ux * wx + uy * wy + uz * wz
    vw = vx * wx + vy * wy + vz * wz
    s = t = 0.0
    if uu > 0.0 and vv > 0.0:
        square = uu * vv - uv * uv
        if square > 1e-12 * uu * vv:
            s = clamp((uv * vw - vv * uw) / square)
        t = (uv * s + vw) / vv
        if t < 0.0 or t > 1.0:
            t = clamp(t)
            s = clamp((uv * t - uw) / uu)
    elif vv > 0.0:
        t = clamp(vw / vv)
    elif uu > 0.0:
        s = clamp(-uw / uu)
    return s, t


@compiled
def segment_distance(ends: Array, i: int, others: Array, j: int) -> float:
    """Distance between axis i of ends (m, 2, 3) and axis j of others; an axis may be a point."""
    s, t = segment_places(ends, i, others, j)
    square = 0.0
    for e in range(3):
        a, c = ends[i, 0, e], others[j, 0, e]
        off = (a - c) + s * (ends[i, 1, e] - a) - t * (others[j, 1, e] - c)
        square += off * off
    return math.sqrt(square)


@compiled
def wall_distance(ax: float, ay: float, bx: float, by: float, walls: Array, k: int) -> float:
    """Distance between the segment a-b and a wall, seen from above; 0 where they cross."""
    cx, cy, dx, dy = walls[k, 0], walls[k, 1], walls[k, 2], walls[k, 3]
    ux, uy, vx, vy = bx - ax, by - ay, dx - cx, dy - cy
    c_side, d_side = ux * (cy - ay) - uy * (cx - ax), ux * (dy - ay) - uy * (dx - ax)
    a_side, b_side = vx * (ay - cy) - vy * (ax - cx), vx * (by - cy) - vy * (bx - cx)
    if c_side * d_side < 0.0 and a_side * b_side < 0.0:
        return 0.0
    from_arm = min(point_distance(ax, ay, cx, cy, dx, dy), point_distance(bx, by, cx, cy, dx, dy))
    from_wall = min(point_distance(cx, cy, ax, ay, bx, by), point_distance(dx, dy, ax, ay, bx, by))
    return float(min(from_arm, from_wall))


@compiled
def point_distance(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance of a point from the segment a-b in the plane."""
    ux, uy = bx - ax, by - ay
    square = ux * ux + uy * uy
    t = clamp(((px - ax) * ux + (py - ay) * uy) / square) if square > 0.0 else 0.0
    return math.hypot(px - ax - t * ux, py - ay - t * uy)


@compiled
def box_distance(ends: Array, i: int, boxes: Array, k: int, enough: float) -> float:
    """Distance between a capsule's axis and a box, to 1e-6 of its length and never too large.

    A lower bound where even that is at least `enough`.
    """
    square = 0.0
    for e in range(3):
        low, high = min(ends[i, 0, e], ends[i, 1, e]), max(ends[i, 0, e], ends[i, 1, e])
        square += max(boxes[k, 0, e] - high, low - boxes[k, 1, e], 0.0) ** 2
    if math.sqrt(square) >= enough:
        return math.sqrt(square)
    near, far = 0.0, 1.0
    for _ in range(20):  # the squared distance is convex along the axis: bisect on its slope
        t, slope = 0.5 * (near + far), 0.0
        for e in range(3):
            along = ends[i, 1, e] - ends[i, 0, e]
            p = ends[i, 0, e] + t * along
            slope += along * (p - min(max(p, boxes[k, 0, e]), boxes[k, 1, e]))
        near, far = (near, t) if slope > 0.0 else (t, far)
    square = length = 0.0
    for e in range(3):
        along = ends[i, 1, e] - ends[i, 0, e]
        p = ends[i, 0, e] + 0.5 * (near + far) * along
        square += (p - min(max(p, boxes[k, 0, e]), boxes[k, 1, e])) ** 2
        length += along * along
    return max(math.sqrt(square) - 1e-6 * math.sqrt(length), 0.0)


@compiled
def clamp(t: float) -> float:
    """The value moved into [0, 1]."""
    return min(max(t, 0.0), 1.0)
