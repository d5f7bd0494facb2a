"""Configuration of a filter (sources, noise, initial state), measurements, and verdicts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import chdtri

from states.localization.filter.filter_kernels import Array, Integers

UpdateOutcome = Literal["accepted", "rejected", "reacquired", "duplicate", "too_old", "empty"]


@dataclass(frozen=True, slots=True)
class MeasurementSource:
    """A source of measurements of `axes`, entries of the state by name.

    `gate`: share of correct measurements that pass; None lets all pass. `reacquire_after`: after
    this many rejections in a row the next one is accepted, with its squared innovation added to the
    covariance first. `yields_to`: sources whose acceptance resets that count, so that a source that
    has jumped cannot take over the filter from one that fits. `correlation`: correlation time of
    its errors, s; faster measurements count less.
    """

    name: str
    axes: tuple[str, ...]
    gate: float | None = 0.997
    reacquire_after: int = 5
    yields_to: tuple[str, ...] = ()
    correlation: float = 0.0


@dataclass(frozen=True, slots=True)
class ProcessNoise:
    """Variances added to the state, SI units squared, one per axis.

    Per second, per metre travelled and per radian turned: slip comes with motion.
    """

    per_second: tuple[float, ...]
    per_metre: tuple[float, ...]
    per_radian: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class FilterConfig:
    """Sources, process noise and initial state of a filter.

    `initial`: standard deviations of the state, of mean 0, at the first measurement. `history`:
    how late a measurement may be, s.
    """

    sources: tuple[MeasurementSource, ...]
    noise: ProcessNoise
    initial: tuple[float, ...]
    history: float = 1.0


class Measurement(NamedTuple):
    """Values of a source's axes at a stamp, with their covariance (m, m) or variances (m,).

    An axis is left out if its value is not finite or beyond 1e12, or if its variance is negative,
    not finite or beyond 1e100: drivers mark unmeasured axes in these ways. Variances are clamped to
    1e-9 to 1e9.
    """

    stamp_ns: int
    source: str
    values: Sequence[float] | Array
    covariance: Sequence[float] | Array


class Verdict(NamedTuple):
    """The result of a measurement, and its Mahalanobis distance, in standard deviations.

    `empty`: no usable axis; `duplicate`: the source has had a measurement of this stamp already,
    and the first one counts.
    """

    outcome: UpdateOutcome
    distance: float


class KnownSource(NamedTuple):
    """A source in the form that the kernels take."""

    order: int
    axes: Integers
    gates: Array
    source: MeasurementSource
    yielding: tuple[int, ...]


def known_sources(
    sources: tuple[MeasurementSource, ...], axes: tuple[str, ...]
) -> dict[str, KnownSource]:
    """Sources by name, checked and in the form of the kernels.

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
    """Gates for 0 to `most` axes: chi-square quantiles of the share."""
    if share is None:
        return np.full(most + 1, np.inf)
    gates = chdtri(np.arange(most + 1, dtype=np.float64).clip(1.0), 1.0 - share)
    return np.asarray(gates, np.float64)
