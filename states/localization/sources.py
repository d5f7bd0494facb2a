"""What a filter is told: sources, noise and ignorance once, then measurements; and its verdicts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import chdtri

from states.localization.filter_kernels import Array, Integers

UpdateOutcome = Literal["accepted", "rejected", "reacquired", "duplicate", "too_old", "empty"]


@dataclass(frozen=True, slots=True)
class MeasurementSource:
    """Whatever measures `axes`, entries of the state by name.

    `gate`: the share of right measurements that are to pass, or None to let all pass.
    `reacquire_after`: so many rejections in a row, and the next one is believed: what it was missed
    by is added to the filter's uncertainty first. `yields_to`: sources by whose acceptance that
    count starts anew, so that a source that jumped does not take the filter away from one that
    fits. `correlation`: for so long errors stay alike, s; measurements that come faster count less.
    """

    name: str
    axes: tuple[str, ...]
    gate: float | None = 0.997
    reacquire_after: int = 5
    yields_to: tuple[str, ...] = ()
    correlation: float = 0.0


@dataclass(frozen=True, slots=True)
class ProcessNoise:
    """Variances that a state gains, SI units squared, one per axis.

    Per second, per metre gone and per radian turned: slip comes with motion.
    """

    per_second: tuple[float, ...]
    per_metre: tuple[float, ...]
    per_radian: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class FilterConfig:
    """What a filter is told once: its sources, its process noise, its ignorance at the start.

    `initial`: standard deviations of the state, of mean 0, at the first measurement. `history`: how
    late a measurement may come, s.
    """

    sources: tuple[MeasurementSource, ...]
    noise: ProcessNoise
    initial: tuple[float, ...]
    history: float = 1.0


class Measurement(NamedTuple):
    """Values of a source's axes at a stamp, with their covariance (m, m) or variances (m,).

    An axis whose value is not finite, or beyond 1e12, is left out, and so is one whose variance is
    negative, not finite or beyond 1e100, as drivers mark what they do not measure. Variances are
    brought into 1e-9 to 1e9.
    """

    stamp_ns: int
    source: str
    values: Sequence[float] | Array
    covariance: Sequence[float] | Array


class Verdict(NamedTuple):
    """What became of a measurement, and its Mahalanobis distance, in standard deviations.

    `empty`: no axis was left; `duplicate`: this source has told of this stamp, the first counts.
    """

    outcome: UpdateOutcome
    distance: float


class KnownSource(NamedTuple):
    """A source as the kernels want it."""

    order: int
    axes: Integers
    gates: Array
    source: MeasurementSource
    yielding: tuple[int, ...]


def known_sources(
    sources: tuple[MeasurementSource, ...], axes: tuple[str, ...]
) -> dict[str, KnownSource]:
    """Sources by name, for the kernels.

    Raises:
        ValueError: a mistake in one of them.
    """
    names = [source.name for source in sources]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"sources: {names}; at least one is needed, each with a name of its own")
    known = {}
    for at, source in enumerate(sources):
        where = f"source {source.name}"
        wrong = [axis for axis in source.axes if axis not in axes]
        if wrong or not source.axes or len(set(source.axes)) < len(source.axes):
            raise ValueError(f"{where}: axes {source.axes}; different ones of {', '.join(axes)}")
        if source.gate is not None and not 0.0 < source.gate < 1.0:
            raise ValueError(f"{where}: gate {source.gate}; a share between 0 and 1, or None")
        if not 0.0 <= source.correlation < math.inf or source.reacquire_after < 0:
            raise ValueError(f"{where}: correlation and reacquire_after must not be negative")
        unknown = [name for name in source.yields_to if name not in names]
        if unknown:
            raise ValueError(f"{where}: yields to {unknown[0]}; sources: {', '.join(names)}")
        index = np.array([axes.index(axis) for axis in source.axes], np.int64)
        yielding = tuple(i for i, s in enumerate(sources) if source.name in s.yields_to)
        known[source.name] = KnownSource(
            at, index, _gates(source.gate, len(axes)), source, yielding
        )
    return known


def _gates(share: float | None, most: int) -> Array:
    """Greatest squared distance of 0 to `most` axes."""
    if share is None:
        return np.full(most + 1, np.inf)
    gates = chdtri(np.arange(most + 1, dtype=np.float64).clip(1.0), 1.0 - share)
    return np.asarray(gates, np.float64)
