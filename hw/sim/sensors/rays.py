"""Exact rays of a rotating scanner against segments and discs, float64.

Each beam starts at the sensor's pose at the beam's own time. A segment is tried only with the beams
that can meet it: those within its bearings as seen from the middle of the sweep, widened by
asin(distance moved / distance of the segment) and by the sensor's rotation.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hw.jit import compiled, example
from hw.sim.sensors.track import PastPoses, knots

Floats = NDArray[np.float64]
_TURN = 2.0 * math.pi
_EDGE = 1e-9
"""Share by which segments are extended, so that no ray slips through a corner."""


@compiled
def beams(
    knots: Floats, mount: Floats, start: float, step: float, spacing: float, n: int
) -> Floats:
    """Origins and directions of `n` beams in the map.

    Args:
        knots: (k, 4) the base's time (s from the first beam), x, y, yaw; rising times.
        mount: base_from_sensor as x, y, yaw.
        start: direction of the first beam in the sensor's frame, rad.
        step: from beam to beam, rad.
        spacing: time from beam to beam, s.
        n: how many.

    Returns:
        (n, 5): x, y, direction as cosine and sine, and the yaw of the sensor.
    """
    found = np.empty((n, 5))
    k, last = 1, knots.shape[0] - 1
    before, c, s = math.nan, 1.0, 0.0
    for i in range(n):
        t = i * spacing
        while k < last and knots[k, 0] < t:
            k += 1
        span = knots[k, 0] - knots[k - 1, 0]
        share = 0.0 if span <= 0.0 else min(1.0, max(0.0, (t - knots[k - 1, 0]) / span))
        yaw = knots[k - 1, 3] + share * (knots[k, 3] - knots[k - 1, 3])
        if yaw != before:
            before, c, s = yaw, math.cos(yaw), math.sin(yaw)
        x = knots[k - 1, 1] + share * (knots[k, 1] - knots[k - 1, 1])
        y = knots[k - 1, 2] + share * (knots[k, 2] - knots[k - 1, 2])
        found[i, 0] = x + c * mount[0] - s * mount[1]
        found[i, 1] = y + s * mount[0] + c * mount[1]
        found[i, 4] = yaw + mount[2]
        direction = found[i, 4] + start + i * step
        found[i, 2], found[i, 3] = math.cos(direction), math.sin(direction)
    return found


@compiled
def _to_segment(ray: Floats, segment: Floats) -> float:
    """Length of a ray to a segment, m; inf if it misses.

    Solves o + r d = p + s e for r and s by cross products with e and d.
    """
    ax, ay = segment[0] - ray[0], segment[1] - ray[1]
    ex, ey = segment[2] - segment[0], segment[3] - segment[1]
    across = ray[2] * ey - ray[3] * ex
    if across == 0.0:
        return math.inf
    share = (ax * ray[3] - ay * ray[2]) / across
    if share < -_EDGE or share > 1.0 + _EDGE:
        return math.inf
    way: float = (ax * ey - ay * ex) / across
    return way if way >= 0.0 else math.inf


@compiled
def _to_disc(ray: Floats, x: float, y: float, radius: float) -> float:
    """Length of a ray to a disc, m; inf if it misses or starts inside.

    With the centre `along` and `aside` of the ray it is along - sqrt(radius^2 - aside^2).
    """
    cx, cy = x - ray[0], y - ray[1]
    along: float = cx * ray[2] + cy * ray[3]
    aside: float = cx * ray[3] - cy * ray[2]
    if along <= 0.0 or abs(aside) > radius or cx * cx + cy * cy < radius * radius:
        return math.inf
    return along - math.sqrt(radius * radius - aside * aside)


@compiled
def _bearings(px: float, py: float, segment: Floats, spread: float) -> tuple[float, float, float]:
    """First bearing, angular width and padding of a segment around (px, py), rad."""
    ax, ay = segment[0] - px, segment[1] - py
    ex, ey = segment[2] - segment[0], segment[3] - segment[1]
    square = ex * ex + ey * ey
    along = 0.0 if square == 0.0 else min(1.0, max(0.0, -(ax * ex + ay * ey) / square))
    nearest = math.hypot(ax + along * ex, ay + along * ey)
    if nearest <= spread + 1e-6:
        return 0.0, _TURN, 0.0
    begin, end = math.atan2(ay, ax), math.atan2(ay + ey, ax + ex)
    width = end - begin
    if width > math.pi:
        width -= _TURN
    elif width < -math.pi:
        width += _TURN
    pad = math.asin(spread / nearest) + 1e-6
    return (begin if width >= 0.0 else end), abs(width), pad


@compiled
def cast_discs(ranges: Floats, rays: Floats, discs: Floats) -> None:
    """Shorten lengths of beams to discs, (d, 5): x, y at the first beam and at the last, radius."""
    n = ranges.shape[0]
    for k in range(discs.shape[0]):
        disc = discs[k]
        for i in range(n):
            share = i / (n - 1)
            x = disc[0] + share * (disc[2] - disc[0])
            y = disc[1] + share * (disc[3] - disc[1])
            ranges[i] = min(ranges[i], _to_disc(rays[i], x, y, disc[4]))


@compiled
def cast(rays: Floats, segments: Floats, start: float, step: float) -> Floats:
    """Lengths of all beams to the first segment, m; inf without one.

    Args:
        rays: (n, 5), of `beams`.
        segments: (s, 4) x1, y1, x2, y2.
        start: direction of the first beam in the sensor's frame, rad.
        step: from beam to beam, rad.
    """
    n = rays.shape[0]
    ranges = np.full(n, math.inf)
    px, py = rays[n // 2, 0], rays[n // 2, 1]
    spread, slow, fast = 0.0, math.inf, -math.inf
    for i in range(n):
        spread = max(spread, math.hypot(rays[i, 0] - px, rays[i, 1] - py))
        slow, fast = min(slow, rays[i, 4]), max(fast, rays[i, 4])
    for k in range(segments.shape[0]):
        bearing, width, pad = _bearings(px, py, segments[k], spread)
        low, high = bearing - pad - fast - start, bearing + width + pad - slow - start
        shift = math.floor(high / _TURN) * _TURN
        low, high = low - shift, high - shift  # the end lies within the first turn
        while low <= (n - 1) * step:
            first, last = max(0, math.ceil(low / step)), min(n - 1, math.floor(high / step))
            for i in range(first, last + 1):
                ranges[i] = min(ranges[i], _to_segment(rays[i], segments[k]))
            low, high = low + _TURN, high + _TURN
    return ranges


@compiled
def measured(
    ranges: Floats, noise: Floats, chance: Floats, limits: Floats, sigma: float, outliers: float
) -> Floats:
    """Exact ranges as a scanner reports them, rounded to 1/1024 m; inf out of its limits.

    Args:
        ranges: (n,) m.
        noise: (n,) standard normal.
        chance: (n,) from 0 to 1.
        limits: least and greatest range, m.
        sigma: standard deviation, m.
        outliers: share of beams that are lost, or that return from somewhere before the target,
            half each.
    """
    found = np.empty(ranges.shape[0])
    least, most = limits
    for i in range(ranges.shape[0]):
        r = ranges[i]
        if chance[i] < outliers:
            # the rest of the same random number gives the place
            place = 2.0 * chance[i] / outliers
            r = math.inf if place >= 1.0 else least + place * (min(r, most) - least)
        elif r < math.inf:
            r += sigma * noise[i]
        found[i] = math.floor(1024.0 * r + 0.5) / 1024.0 if least <= r <= most else math.inf
    return found


def nothing_kept(n: int) -> tuple[Floats, Floats, Floats]:
    """What a scanner of `n` beams has kept before its first sweep; see `scan`."""
    return np.full(3, math.nan), np.empty((n, 5)), np.empty(n)


@compiled
def _stays(knots: Floats, pose: Floats) -> bool:
    """Whether a base is at this pose, (3,), all the time."""
    for k in range(knots.shape[0]):
        for i in range(3):
            if knots[k, i + 1] != pose[i]:
                return False
    return True


@compiled
def scan(  # noqa: PLR0913 - a kernel takes all at once
    past: PastPoses,
    span: tuple[int, int],
    mount: Floats,
    turns: tuple[float, float, float],
    bodies: tuple[Floats, Floats],
    chances: tuple[Floats, Floats],
    errors: tuple[Floats, float, float],
    kept: tuple[Floats, Floats, Floats],
) -> None:
    """Write ranges (n,) of one sweep, m, in place of the normal numbers.

    See `beams`, `cast`, `cast_discs`, `measured`. While the base stands, the rays and where they
    meet segments stay as they are.

    Args:
        past: poses of the base, of a `Track`.
        span: instants of the first and the last beam, ns.
        mount: base_from_sensor as x, y, yaw.
        turns: direction of the first beam, rad, and from beam to beam angle, rad, and time, s.
        bodies: segments, which do not change, and discs (d, 5) of `Shapes`.
        chances: (n,) standard normal numbers, and as many from 0 to 1.
        errors: least and greatest range, standard deviation, share of outliers.
        kept: of the sweep before, then of this one: where the base has stood, (3,), NaN if it
            moved; rays (n, 5); their lengths to segments (n,).
    """
    (start, step, spacing), (normal, lots), (limits, sigma, outliers) = turns, chances, errors
    poses, (pose, rays, lengths) = knots(past, span[0], span[1]), kept
    if not _stays(poses, pose):
        pose[:] = poses[0, 1:]
        rays[:] = beams(poses, mount, start, step, spacing, len(normal))
        lengths[:] = cast(rays, bodies[0], start, step)
        if not _stays(poses, pose):
            pose[:] = math.nan
    exact = lengths.copy()
    cast_discs(exact, rays, bodies[1])
    normal[:] = measured(exact, normal, lots, limits, sigma, outliers)


@example
def _example() -> None:
    past, bodies = (np.zeros((2, 4)), 0, 2), (np.ones((1, 4)), np.ones((1, 5)))
    errors = np.array([0.0, 1.0]), 0.0, 0.0
    turns, chances = (0.0, 0.1, 0.01), (np.zeros(4), np.zeros(4))
    scan(past, (0, 1), np.zeros(3), turns, bodies, chances, errors, nothing_kept(4))
