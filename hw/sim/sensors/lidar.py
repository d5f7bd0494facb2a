"""Laser scanners: exact rays from the base's pose at the time of each beam."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hw.model import LidarErrors, LidarModel
from hw.samples import Sample, Scan
from hw.sim.sensors.rays import beams, cast, measured
from hw.sim.sensors.scanned_shapes import Shapes
from hw.sim.sensors.streams import Rhythm, Stream
from hw.sim.sensors.track import Track


class SimLidar:
    """The scanners of a robot; each turns at its own rate and phase.

    A scan is computed only when samples are taken.
    """

    signals: tuple[str, ...] = ("base.scan",)

    def __init__(
        self,
        lidars: Mapping[str, LidarModel],
        track: Track,
        shapes: Shapes,
        errors: LidarErrors,
        seed: int,
    ) -> None:
        self._track = track
        self._scanners = [
            _Scanner(name, model, shapes, errors, seed) for name, model in lidars.items()
        ]

    def samples(self, now_ns: int) -> list[Sample]:
        """The scans completed since the last call, by their stamps."""
        found = [sample for one in self._scanners for sample in one.samples(self._track, now_ns)]
        return sorted(found, key=lambda sample: sample.stamp_ns) if len(found) > 1 else found


class _Scanner:
    def __init__(
        self, name: str, model: LidarModel, shapes: Shapes, errors: LidarErrors, seed: int
    ) -> None:
        source = f"base.scan/{name}"
        self._sweep_ns = round((model.beams - 1) * model.beam_time * 1e9)
        self._rhythm = Rhythm(model.rate, seed, source, self._sweep_ns + round(errors.delay * 1e9))
        self._stream = Stream(seed, source)
        self._name, self._model, self._shapes, self._errors = name, model, shapes, errors
        self._mount = np.array([model.mount.x, model.mount.y, model.mount.yaw])
        self._limits = np.array([model.min_range, model.max_range])

    def samples(self, track: Track, now_ns: int) -> list[Sample]:
        due = self._rhythm.due(now_ns, track.oldest_ns)
        return [Sample("base.scan", stamp, self._scan(track, n, stamp)) for n, stamp in due]

    def _scan(self, track: Track, number: int, stamp_ns: int) -> Scan:
        model, errors, end_ns = self._model, self._errors, stamp_ns + self._sweep_ns
        start, step, n = model.start, model.step, model.beams
        rays = beams(track.knots(stamp_ns, end_ns), self._mount, start, step, model.beam_time, n)
        shapes = self._shapes
        exact = cast(rays, shapes.segments, shapes.discs(stamp_ns, end_ns), start, step)
        chance = self._stream.at(number)
        noise, lots = chance.standard_normal(n), chance.random(n)
        ranges = measured(exact, noise, lots, self._limits, errors.noise, errors.outliers)
        return Scan(self._name, start, step, tuple(ranges.tolist()), model.beam_time)
