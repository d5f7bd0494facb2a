"""Joint sets spread over the range of an arm, and which parts of it meet at any of them.

Of an arm by URDF nobody has proven which links cannot touch, as has been done for UR arms. Of
links at most `NEAR` joints apart, parts that overlap at every one of `TRIED` joint sets are taken
to be grown together, for capsules are fatter than what they enclose, and parts that are never
nearer than `CLEAR` are taken never to touch. All others are checked.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from states.arm.kinematics.kernels import Array, CapsuleSet, pair_gap, place_capsules

TRIED = 4096
"""Joint sets tried."""
NEAR = 2
"""Joints between two links up to which that many joint sets leave no gaps."""
CLEAR = 0.05
"""Least gap of parts that never touch, m."""


def drawn(lower: Array, upper: Array, count: int) -> Array:
    """Joint sets (count, j) spread evenly over the limits, at most a whole turn of each joint.

    A rank-1 sequence: each joint has its own irrational step, powers of 1 / phi with phi^(j + 1) =
    phi + 1.
    """
    joints, phi = len(lower), 2.0
    for _ in range(60):
        phi = (1.0 + phi) ** (1.0 / (joints + 1))
    steps = phi ** -np.arange(1.0, joints + 1.0)
    shares = (0.5 + np.arange(count)[:, None] * steps) % 1.0
    middle, half = 0.5 * (lower + upper), np.minimum(0.5 * (upper - lower), np.pi)
    return np.asarray(middle + (2.0 * shares - 1.0) * half)


def never_and_always(
    body: CapsuleSet, lower: Array, upper: Array
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """True for pairs that never touch, and for those that always do, (p,) each: see the module."""
    least, most = np.full(len(body.pairs), np.inf), np.full(len(body.pairs), -np.inf)
    _extremes(body, drawn(lower, upper, TRIED), least, most)
    first, second = body.links[body.pairs].T
    near = second - first <= NEAR
    return near & (least >= CLEAR), near & (most < 0.0)


@compiled
def _extremes(body: CapsuleSet, q: Array, least: Array, most: Array) -> None:
    """Lowers and raises the least and the greatest gap of each pair, (p,), by those at q (n, j)."""
    base, origins, links, local, radii, pairs, _, _, _ = body
    frames, ends = np.empty((len(origins) + 1, 4, 4)), np.empty((len(links), 2, 3))
    for n in range(len(q)):
        place_capsules(base, origins, links, local, q[n], frames, ends)
        for k in range(len(pairs)):
            gap = pair_gap(pairs, radii, ends, k)
            least[k], most[k] = min(least[k], gap), max(most[k], gap)
