"""Tier 0: no world, only samples at given times."""

from __future__ import annotations

from collections.abc import Iterable

from hw.samples import Sample


class ScriptedSignals:
    """A part that gives prepared samples at their stamps.

    Raises:
        ValueError: the stamps fall, or one is before the start.
    """

    def __init__(self, samples: Iterable[Sample]) -> None:
        self._samples = tuple(samples)
        self.signals: tuple[str, ...] = tuple(dict.fromkeys(s.name for s in self._samples))
        self._next = 0
        last = 0
        for index, sample in enumerate(self._samples):
            if sample.stamp_ns < last:
                raise ValueError(
                    f"scripted sample {index} ({sample.name}) at {sample.stamp_ns} ns comes "
                    f"before {last} ns; sort them by time"
                )
            last = sample.stamp_ns

    @property
    def finished(self) -> bool:
        """True once all samples were given."""
        return self._next == len(self._samples)

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples up to now_ns that were not given yet."""
        start = self._next
        while self._next < len(self._samples) and self._samples[self._next].stamp_ns <= now_ns:
            self._next += 1
        return list(self._samples[start : self._next])
