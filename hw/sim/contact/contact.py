"""Contact of robot and person: the footprint with foam against the person's cylinder, swept.

The footprint is the plain rectangle of R3, without the foam's rounded corners, so that a touch is
found early rather than late (by at most 4.2 cm at a corner, if the foam is round there).

Between two instants robot and person are assumed to move uniformly. The robot's rotation is cut
into pieces of at most 0.02 rad, in which the person moves straight in the robot's frame. For a
rotation t and a relative displacement w in a piece, at d from base_link, the error is at most (t^2
d + 2 t w) / 8: the sagitta of the true arc. That is 0.6 mm at 4 m/s relative speed. True
acceleration a adds at most a dt^2 / 8: 0.4 mm for 3 m/s2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from hw.geometry import Pose2, Twist2, wrap
from hw.model import Footprint
from hw.samples import USER_RADIUS

_TURN = 0.02
_HALVINGS = 24
"""Bisections of a step to find the instant of a touch."""

Sweep = tuple[Pose2, Pose2]
"""Poses at the start and at the end of a step, in the map."""


class FirstTouch(NamedTuple):
    """How robot and person came into contact within a step.

    `share` of the step at the contact, its place in the map (m), and the closing speeds of the
    touching points along the contact normal (m/s; negative: moving away).
    """

    share: float
    x: float
    y: float
    robot_closing: float
    person_closing: float


def rectangle_distance(half_length: float, half_width: float, x: float, y: float) -> float:
    """Distance of a point to a rectangle about the origin, m; 0 inside."""
    return math.hypot(max(0.0, abs(x) - half_length), max(0.0, abs(y) - half_width))


def rectangle_segment_distance(
    half_length: float, half_width: float, start: tuple[float, float], end: tuple[float, float]
) -> float:
    """Distance of a segment to a rectangle about the origin, m; 0 if they intersect."""
    (x1, y1), (x2, y2) = start, end
    if _crosses(half_length, half_width, start, end):
        return 0.0
    nearest = min(
        rectangle_distance(half_length, half_width, x1, y1),
        rectangle_distance(half_length, half_width, x2, y2),
    )
    dx, dy = x2 - x1, y2 - y1
    square = dx * dx + dy * dy
    if square == 0.0:
        return nearest
    for cx, cy in (
        (half_length, half_width),
        (half_length, -half_width),
        (-half_length, half_width),
        (-half_length, -half_width),
    ):
        along = min(1.0, max(0.0, ((cx - x1) * dx + (cy - y1) * dy) / square))
        nearest = min(nearest, math.hypot(x1 + along * dx - cx, y1 + along * dy - cy))
    return nearest


def gap(
    footprint: Footprint, robot: Pose2, x: float, y: float, radius: float = USER_RADIUS
) -> float:
    """Gap between the footprint and a cylinder about (x, y), m; at most 0 in contact."""
    px, py = _seen_from(robot.x, robot.y, robot.yaw, x, y)
    return rectangle_distance(footprint.half_length, footprint.half_width, px, py) - radius


def swept_gap(
    footprint: Footprint, robot: Sweep, person: Sweep, radius: float = USER_RADIUS
) -> float:
    """The least gap while both move from their first pose to their second, m."""
    (a, b), (p, q) = robot, person
    turn = wrap(b.yaw - a.yaw)
    pieces = max(1, math.ceil(abs(turn) / _TURN))
    least = math.inf
    before = _seen_from(a.x, a.y, a.yaw, p.x, p.y)
    for piece in range(1, pieces + 1):
        share = piece / pieces
        after = _seen_from(
            a.x + share * (b.x - a.x),
            a.y + share * (b.y - a.y),
            a.yaw + share * turn,
            p.x + share * (q.x - p.x),
            p.y + share * (q.y - p.y),
        )
        least = min(
            least,
            rectangle_segment_distance(footprint.half_length, footprint.half_width, before, after),
        )
        before = after
    return least - radius


def first_touch(
    footprint: Footprint, robot: Sweep, person: Sweep, span_s: float, radius: float = USER_RADIUS
) -> FirstTouch:
    """The start of a contact that `swept_gap` has found in a step of span_s seconds.

    The closing speeds are the displacements of the touching points along the normal over span_s;
    a rotation of the robot moves its point by `Nearness.lever` times the angle.
    """
    from hw.safety import nearness  # compiled; of no use to who only checks a scene

    early, late = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (early + late)
        parts = _part(robot, early, middle), _part(person, early, middle)
        if swept_gap(footprint, *parts, radius) <= 0.0:
            late = middle
        else:
            early = middle
    (a, b), (p, q) = robot, person
    base, body = a.between(b, late), p.between(q, late)
    seen = _seen_from(base.x, base.y, base.yaw, body.x, body.y)
    near = nearness(footprint.half_length, footprint.half_width, *seen, radius)
    normal = Twist2(near.nx, near.ny).rotated(base.yaw)
    # a step without duration has no speeds
    per_s = 1.0 / span_s if span_s > 0.0 else 0.0
    driven = normal.vx * (b.x - a.x) + normal.vy * (b.y - a.y) + near.lever * wrap(b.yaw - a.yaw)
    walked = normal.vx * (q.x - p.x) + normal.vy * (q.y - p.y)
    deep = near.gap + radius
    return FirstTouch(
        late,
        body.x - deep * normal.vx,
        body.y - deep * normal.vy,
        per_s * driven,
        -per_s * walked,
    )


def _part(sweep: Sweep, start: float, end: float) -> Sweep:
    before, after = sweep
    return before.between(after, start), before.between(after, end)


def _seen_from(x: float, y: float, yaw: float, px: float, py: float) -> tuple[float, float]:
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = px - x, py - y
    return c * dx + s * dy, c * dy - s * dx


def _crosses(
    half_length: float, half_width: float, start: tuple[float, float], end: tuple[float, float]
) -> bool:
    low, high = 0.0, 1.0
    for half, a, b in ((half_length, start[0], end[0]), (half_width, start[1], end[1])):
        change = b - a
        if change == 0.0:
            if abs(a) > half:
                return False
            continue
        first, second = sorted(((-half - a) / change, (half - a) / change))
        low, high = max(low, first), min(high, second)
    return low <= high
