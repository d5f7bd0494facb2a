"""Rank tests of independent groups: Kruskal-Wallis, Jonckheere-Terpstra, and Holm's adjustment.

Sources: Hollander, Wolfe and Chicken, Nonparametric Statistical Methods (3rd ed.), chapter 6; Holm
(1979), Scandinavian Journal of Statistics 6; the effect sizes are r = |z| / sqrt(N) (Field) and
epsilon squared (Tomczak and Tomczak, 2014).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special, stats

Array = np.ndarray[Any, np.dtype[np.float64]]
LARGEST_EXACT = 10_000_000
"""Largest number of (ways to fill the groups) x (values of 2 J) for the exact distribution."""


@dataclass(frozen=True, slots=True)
class KruskalWallis:
    """Whether groups differ at all: H with ties corrected, degrees of freedom, and p.

    `epsilon_squared` = (H - k + 1) / (N - k) is the size of the effect; None if N = k.
    """

    h: float
    df: int
    p: float
    epsilon_squared: float | None


@dataclass(frozen=True, slots=True)
class Trend:
    """Jonckheere and Terpstra's test that later groups have larger values; p is one-sided.

    Attributes:
        j: number of pairs of values in the predicted order, ties counted half.
        mean: of J if the groups do not differ; `variance` likewise, ties corrected.
        z: (J - mean) / sqrt(variance).
        p: P(Z >= z) by the normal distribution.
        p_exact: P(J' >= J) over all ways to deal the values to the groups; None if there are too
            many (`LARGEST_EXACT`).
        r: |z| / sqrt(N), the size of the effect.
    """

    j: float
    mean: float
    variance: float
    z: float
    p: float
    p_exact: float | None
    r: float


def kruskal_wallis(groups: Sequence[Sequence[float]]) -> KruskalWallis:
    """Compare two or more groups.

    Raises:
        ValueError: fewer than two groups, an empty one, values that are not finite or all equal.
    """
    _checked(groups)
    h, p = stats.kruskal(*groups)
    k, number = len(groups), sum(map(len, groups))
    effect = (float(h) - k + 1) / (number - k) if number > k else None
    return KruskalWallis(float(h), k - 1, float(p), effect)


def jonckheere_terpstra(groups: Sequence[Sequence[float]]) -> Trend:
    """Test groups in the predicted order, from the least values to the largest.

    With two groups it is the Mann-Whitney test.

    Raises:
        ValueError: as `kruskal_wallis`.
    """
    pooled = _checked(groups)
    sizes = [len(group) for group in groups]
    _, ties = np.unique(pooled, return_counts=True)
    j = _pairs_in_order(groups)
    number = len(pooled)
    mean = (number**2 - sum(n**2 for n in sizes)) / 4.0
    variance = _variance(sizes, ties.tolist())
    z = (j - mean) / math.sqrt(variance)
    return Trend(
        j=j,
        mean=mean,
        variance=variance,
        z=z,
        p=float(special.ndtr(-z)),
        p_exact=_exact(j, sizes, ties.tolist()),
        r=abs(z) / math.sqrt(number),
    )


def holm(values: Mapping[str, float]) -> dict[str, float]:
    """p-values of a family of tests, adjusted by Holm's method, by their names."""
    adjusted: dict[str, float] = {}
    largest = 0.0
    for rank, name in enumerate(sorted(values, key=lambda name: values[name])):
        largest = max(largest, min(1.0, (len(values) - rank) * values[name]))
        adjusted[name] = largest
    return {name: adjusted[name] for name in values}


def _checked(groups: Sequence[Sequence[float]]) -> Array:
    """All values of the groups together."""
    if len(groups) < 2 or not all(map(len, groups)):
        raise ValueError("needs two groups or more, none of them empty")
    pooled = np.concatenate([np.asarray(group, dtype=np.float64) for group in groups])
    if not np.isfinite(pooled).all():
        raise ValueError("needs finite values")
    if (pooled == pooled[0]).all():
        raise ValueError("all values are equal, so ranks tell nothing")
    return pooled


def _pairs_in_order(groups: Sequence[Sequence[float]]) -> float:
    """Number of pairs, the first of an earlier group, that rise; half of those that are equal."""
    found = 0
    for later in range(1, len(groups)):
        above = np.asarray(groups[later], dtype=np.float64)
        for group in groups[:later]:
            below = np.sort(np.asarray(group, dtype=np.float64))
            found += int(np.searchsorted(below, above, "left").sum())
            found += int(np.searchsorted(below, above, "right").sum())
    return found / 2.0


def _variance(sizes: Sequence[int], ties: Sequence[int]) -> float:
    """Of J if the groups do not differ; Hollander, Wolfe and Chicken (6.19)."""
    n = sum(sizes)

    def cubes(numbers: Sequence[int]) -> int:
        return sum(m * (m - 1) * (2 * m + 5) for m in numbers)

    def triples(numbers: Sequence[int]) -> int:
        return sum(m * (m - 1) * (m - 2) for m in numbers)

    def pairs(numbers: Sequence[int]) -> int:
        return sum(m * (m - 1) for m in numbers)

    variance = (cubes([n]) - cubes(sizes) - cubes(ties)) / 72.0
    if n > 2:
        variance += triples(sizes) * triples(ties) / (36.0 * triples([n]))
    return variance + pairs(sizes) * pairs(ties) / (8.0 * pairs([n]))


def _exact(j: float, sizes: Sequence[int], ties: Sequence[int]) -> float | None:
    """P(J' >= j) over all ways to deal the pooled values, with their ties, to the groups.

    Values are dealt from the least to the largest, all equal ones at once. What is left to come
    depends only on how many values each group has so far, so the ways that agree in this are kept
    together, as counts by 2 J. Without ties the counts are the coefficients of a product of
    Gaussian binomials. Counts are positive and only added, so their relative error is about 1e-15.
    """
    most = 2 * sum(a * b for i, a in enumerate(sizes) for b in sizes[:i])
    states = math.prod(n + 1 for n in sizes)
    if states * (most + 1) > LARGEST_EXACT or sum(sizes) > 150:  # counts would overflow
        return None
    ways = {(0,) * len(sizes): np.eye(1, most + 1)[0]}
    for tie in ties:
        after: dict[tuple[int, ...], Array] = {}
        for placed, counts in ways.items():
            room = [n - has for n, has in zip(sizes, placed, strict=True)]
            for share in _shares(tie, room):
                reached = tuple(has + new for has, new in zip(placed, share, strict=True))
                gain, number = _gain(placed, share), _multinomial(share)
                sum_ = after.setdefault(reached, np.zeros(most + 1))
                sum_[gain:] += number * counts[: most + 1 - gain]
        ways = after
    (counts,) = ways.values()
    return float(counts[round(2 * j) :].sum() / counts.sum())


def _shares(number: int, room: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """All ways to split a number among groups that have room for so many."""
    if len(room) == 1:
        if number <= room[0]:
            yield (number,)
        return
    for first in range(min(number, room[0]) + 1):
        for rest in _shares(number - first, room[1:]):
            yield (first, *rest)


def _gain(placed: Sequence[int], share: Sequence[int]) -> int:
    """Growth of 2 J as each group is dealt its share of equal values, larger than all placed."""
    found = below = equal = 0
    for has, new in zip(placed, share, strict=True):
        found += new * (2 * below + equal)
        below += has
        equal += new
    return found


def _multinomial(share: Sequence[int]) -> float:
    """Number of ways to choose which of the equal values each group is dealt."""
    found, left = 1, sum(share)
    for number in share:
        found *= math.comb(left, number)
        left -= number
    return float(found)
