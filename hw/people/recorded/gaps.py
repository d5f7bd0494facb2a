"""Gaps of a recorded walk: drop-outs of tracking, and jumps that no person can make."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

FASTEST, NOISE = 6.0, 0.3
"""A step between two rows is a jump if it is longer than NOISE, m, and what a person runs at
FASTEST, m/s, meanwhile. Radio noise of 0.15 m at 5 Hz gives steps of up to 5.1 m/s and 0.97 m."""
CROSSING = 2.0
"""A jump lasts until they can have walked across it at this speed, m/s."""

GapKind = Literal["drop-out", "jump"]


class Gap(NamedTuple):
    """Without samples from one row to the next, at these stamps, ns."""

    since_ns: int
    until_ns: int
    kind: GapKind


def drop_out_ns(stamps_ns: Sequence[int]) -> int:
    """Stamps farther apart than this have a tracking drop-out between them, ns."""
    spacings = sorted(later - sooner for sooner, later in pairwise(stamps_ns))
    return max(100_000_000, 3 * spacings[len(spacings) // 2]) if spacings else 100_000_000


def across_jumps(
    stamps_ns: Sequence[int], xs: Sequence[float], ys: Sequence[float]
) -> tuple[list[int], list[int]]:
    """The rows that remain without jumps, and those of them after which a jump is crossed.

    Positions in m. After a jump, rows are left out until a person can have walked there; where the
    walk ends first, it ends before the jump.
    """
    kept, jumps = [0], []
    row, end = 1, len(stamps_ns)
    while row < end:
        before = kept[-1]
        if _is_within(before, row, stamps_ns, xs, ys, FASTEST, NOISE):
            kept.append(row)
            row += 1
            continue
        while row < end and not _is_within(before, row, stamps_ns, xs, ys, CROSSING, 0.0):
            row += 1
        if row < end:
            jumps.append(before)
            kept.append(row)
            row += 1
    return kept, jumps


def _is_within(
    before: int,
    row: int,
    stamps_ns: Sequence[int],
    xs: Sequence[float],
    ys: Sequence[float],
    speed: float,
    noise: float,
) -> bool:
    """True if a person at this speed, m/s, can have made this step, up to a noise in m."""
    far = math.hypot(xs[row] - xs[before], ys[row] - ys[before])
    return far <= noise + speed * (stamps_ns[row] - stamps_ns[before]) * 1e-9
