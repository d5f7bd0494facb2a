"""A Kalman filter over measurements that may be late, doubled, broken or wrong.

Each measurement observes entries of the state at its own stamp. Measurements are applied in the
order of stamps, whatever their order of arrival: a late one is inserted and later ones are
replayed, so that the result equals that of the right order bit for bit. A gate rejects outliers,
but not forever. `planar.py` and `spatial.py` have the two filters.

The gate: with innovation v = z - H x and its covariance S = H P Hᵀ + R, vᵀ S⁻¹ v is chi-square
distributed with as many degrees of freedom as there are axes; the gate is its quantile at the share
of correct measurements that are to pass.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable

import numpy as np

from states.localization.filter.filter_kernels import Array, News, write_covariance
from states.localization.filter.measurement_sources import (
    FilterConfig,
    KnownSource,
    Measurement,
    UpdateOutcome,
    Verdict,
    known_sources,
)

LONGEST = 4096
"""Largest number of measurements in the history."""

FilterStep = Callable[..., tuple[float, int]]


class _Entry:
    """A measurement, the state after it, and per source: rejections in a row, last stamp."""

    __slots__ = ("covariance", "key", "known", "last", "rejections", "state", "values", "verdict")

    key: tuple[int, int]
    known: KnownSource
    values: Array
    covariance: Array
    state: Array
    rejections: tuple[int, ...]
    last: tuple[int | None, ...]
    verdict: Verdict


_NO_NEWS = News(
    np.empty(0, np.int64), np.empty(0), np.empty(0), np.empty((0, 0)), factor=1.0, trusted=False
)


class KalmanFilter:
    """An extended Kalman filter: the axes and the compiled step of one motion model."""

    def __init__(self, config: FilterConfig, axes: tuple[str, ...], step: FilterStep) -> None:
        for what, values in (
            ("initial", config.initial),
            ("noise per second", config.noise.per_second),
            ("noise per metre", config.noise.per_metre),
            ("noise per radian", config.noise.per_radian),
        ):
            if len(values) != len(axes) or not all(0.0 <= v < math.inf for v in values):
                raise ValueError(
                    f"{what}: {values}; {len(axes)} numbers that are not negative are needed, "
                    f"for {', '.join(axes)}"
                )
        self._config = config
        self._step = step
        self._noise = np.array(
            [config.noise.per_second, config.noise.per_metre, config.noise.per_radian], np.float64
        )
        self._sources = known_sources(config.sources, axes)
        self._history_ns = round(config.history * 1e9)
        self._entries: list[_Entry] = []
        self.counts: Counter[tuple[str, UpdateOutcome]] = Counter()
        # compile now, not in a tick
        state = self._beginning(0).state
        self._step(state, 1e-3, self._noise, _NO_NEWS, np.empty_like(state))
        _covariance(state)

    @property
    def stamp_ns(self) -> int | None:
        """Stamp of the newest measurement; None before the first."""
        return self._entries[-1].key[0] if self._entries else None

    @property
    def mean(self) -> Array:
        """The newest state (n,); all 0 before the first measurement."""
        return np.array(self._newest()[0])

    @property
    def covariance(self) -> Array:
        """Covariance (n, n) of the newest state: symmetric, without negative eigenvalues."""
        return _covariance(self._newest())

    def at(self, stamp_ns: int) -> tuple[Array, Array] | None:
        """Mean (n,) and covariance (n, n) at a stamp, from the measurements up to it.

        After the newest measurement the state is predicted; None before the history.
        """
        state = self._predicted(stamp_ns)
        return None if state is None else (state[0], _covariance(state))

    def reset(self) -> None:
        """Forget everything; the next measurement starts the filter, so it should be a good one."""
        self._entries.clear()

    def correct(self, measurement: Measurement) -> Verdict:
        """Apply a measurement, which may be late.

        Raises:
            ValueError: unknown source, or not one value and one variance per axis.
        """
        entry = self._entry(measurement)
        entries = self._entries
        place = len(entries)
        if not entries:
            entries.append(self._beginning(measurement.stamp_ns))
            place = 1
        elif entry.key <= entries[-1].key:
            place = bisect_left(entries, entry.key, key=_key_of)
            if place < len(entries) and entries[place].key == entry.key:
                return self._counted(measurement.source, Verdict("duplicate", 0.0))
            if place == 0:
                return self._counted(measurement.source, Verdict("too_old", 0.0))
        entries.insert(place, entry)
        self._take_from(place)
        if entry.verdict.outcome == "empty":
            self._drop(place)
        self._forget()
        return self._counted(measurement.source, entry.verdict)

    def _predicted(self, stamp_ns: int) -> Array | None:
        entries = self._entries
        place = len(entries)
        if not entries or stamp_ns < entries[-1].key[0]:
            place = bisect_left(entries, (stamp_ns, len(self._sources)), key=_key_of)
        if place == 0:
            return None
        entry = entries[place - 1]
        state: Array = np.empty(entry.state.shape)
        dt = (stamp_ns - entry.key[0]) * 1e-9
        self._step(entry.state, dt, self._noise, _NO_NEWS, state)
        return state

    def _newest(self) -> Array:
        return (self._entries[-1] if self._entries else self._beginning(0)).state

    def _counted(self, source: str, verdict: Verdict) -> Verdict:
        self.counts[source, verdict.outcome] += 1
        return verdict

    def _entry(self, measurement: Measurement) -> _Entry:
        known = self._sources.get(measurement.source)
        if known is None:
            names = ", ".join(self._sources)
            raise ValueError(f"no source {measurement.source!r}; known: {names}")
        entry = _Entry()
        entry.key, entry.known = (measurement.stamp_ns, known.order), known
        entry.values = np.array(measurement.values, np.float64, order="C")
        covariance = np.array(measurement.covariance, np.float64, order="C")
        entry.covariance = np.diag(covariance) if covariance.ndim == 1 else covariance
        m = len(known.axes)
        if entry.values.shape != (m,) or entry.covariance.shape != (m, m):
            raise ValueError(
                f"{known.source.name}: values {entry.values.shape} with covariance "
                f"{covariance.shape}; {m} values are needed, for {', '.join(known.source.axes)}"
            )
        return entry

    def _beginning(self, stamp_ns: int) -> _Entry:
        entry = _Entry()
        entry.key = (stamp_ns, -1)
        entry.state = np.vstack(
            (np.zeros(len(self._config.initial)), np.diag(np.square(self._config.initial)))
        )
        entry.rejections = (0,) * len(self._sources)
        entry.last = (None,) * len(self._sources)
        return entry

    def _take_from(self, place: int) -> None:
        entries = self._entries
        for at in range(place, len(entries)):
            self._predict_and_correct(entries[at - 1], entries[at])

    def _drop(self, place: int) -> None:
        """Undo a measurement, as if it had never come."""
        del self._entries[place]
        self._take_from(place)
        if self._entries[-1].key[1] < 0:  # the beginning that was made for it
            self._entries.clear()

    def _predict_and_correct(self, before: _Entry, entry: _Entry) -> None:
        """Predict from one entry to the next, and correct by the latter's measurement."""
        known, stamp = entry.known, entry.key[0]
        at, last = known.order, before.last[known.order]
        factor = 1.0 if last is None else _factor(known.source.correlation, stamp - last)
        dt = (stamp - before.key[0]) * 1e-9
        entry.state = np.empty(before.state.shape)
        entry.rejections, entry.last = before.rejections, before.last
        news = News(known.axes, known.gates, entry.values, entry.covariance, factor, trusted=False)
        square, m = self._step(before.state, dt, self._noise, news, entry.state)
        distance = math.sqrt(square)
        if m == 0:
            entry.verdict = Verdict("empty", 0.0)
            return
        outcome: UpdateOutcome = "accepted"
        if not square <= known.gates[m]:
            rejections = before.rejections[at] + 1
            if rejections <= known.source.reacquire_after:
                entry.verdict = Verdict("rejected", distance)
                entry.rejections = _with(before.rejections, (at,), rejections)
                return
            outcome = "reacquired"
            trusted = news._replace(trusted=True)
            self._step(before.state, dt, self._noise, trusted, entry.state)
        entry.verdict = Verdict(outcome, distance)
        entry.rejections = _with(before.rejections, (at, *known.yielding), 0)
        if known.source.correlation > 0.0:
            entry.last = (*before.last[:at], stamp, *before.last[at + 1 :])

    def _forget(self) -> None:
        entries = self._entries
        if not entries:
            return
        oldest = entries[-1].key[0] - self._history_ns
        count = len(entries)
        gone = count - LONGEST if count > LONGEST else 0
        while gone + 1 < count and entries[gone + 1].key[0] <= oldest:
            gone += 1
        if gone:
            del entries[:gone]


def _covariance(state: Array) -> Array:
    whole: Array = np.empty((state.shape[1], state.shape[1]))
    write_covariance(state, whole)
    return whole


def _key_of(entry: _Entry) -> tuple[int, int]:
    return entry.key


def _with(numbers: tuple[int, ...], places: tuple[int, ...], value: int) -> tuple[int, ...]:
    for place in places:
        if numbers[place] != value:
            return tuple(value if at in places else n for at, n in enumerate(numbers))
    return numbers


def _factor(correlation: float, elapsed_ns: int) -> float:
    """Factor on the variance of a measurement whose errors correlate in time.

    The mean of n samples of an AR(1) process with correlation r between neighbours has, for large
    n, (1 + r) / (1 - r) times the variance of a mean of independent ones. With r = exp(-t / T) for
    the interval t and the correlation time T that is coth(t / 2T).
    """
    if correlation <= 0.0:
        return 1.0
    return 1.0 / math.tanh(max(0.5e-9 * elapsed_ns / correlation, 1e-6))
