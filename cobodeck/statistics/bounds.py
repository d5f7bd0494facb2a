"""Bounds of proportions and means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import special

RESAMPLES = 9999
"""Resamples of a bootstrap."""
AT_ONCE = 1_000_000
"""Values that are drawn at once."""


def proportion_bounds(hits: int, number: int, confidence: float = 0.95) -> tuple[float, float]:
    """Two-sided bounds of a proportion, by Clopper and Pearson (1934): exact, never too narrow.

    Raises:
        ValueError: not 0 <= hits <= number, or number is 0.
    """
    if not 0 <= hits <= number or number == 0:
        raise ValueError(f"needs 0 <= hits <= number and a number above 0, not {hits} of {number}")
    tail = 0.5 * (1.0 - confidence)
    low = 0.0 if hits == 0 else float(special.betaincinv(hits, number - hits + 1, tail))
    high = 1.0 if hits == number else float(special.betaincinv(hits + 1, number - hits, 1.0 - tail))
    return low, high


def bounded_share(hits: int | None, number: int | None) -> dict[str, float] | None:
    """A share with its bounds of 95 %; of more hits than one each, the bounds are those of all.

    None if either is unknown, or there are none to hit.
    """
    if hits is None or not number:
        return None
    low, high = proportion_bounds(min(hits, number), number)
    return {"share": hits / number, "low": low, "high": high}


def mean_bounds(
    values: Sequence[float], confidence: float = 0.95, seed: int = 0
) -> tuple[float, float]:
    """Two-sided bounds of a mean, by the percentiles of the means of bootstrap resamples.

    Raises:
        ValueError: there are no values.
    """
    if not len(values):
        raise ValueError("no values, no mean")
    chance, found = np.random.default_rng(seed), np.asarray(values, dtype=np.float64)
    rows = max(1, AT_ONCE // len(found))
    sizes = [min(rows, RESAMPLES - done) for done in range(0, RESAMPLES, rows)]
    means = [chance.choice(found, (size, len(found))).mean(axis=1) for size in sizes]
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(np.concatenate(means), (tail, 1.0 - tail)).tolist()
    return low, high
