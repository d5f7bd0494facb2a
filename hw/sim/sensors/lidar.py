"""Laser scanners: exact rays from the base's pose at the time of each beam."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hw.model import LidarErrors, LidarModel
from hw.samples import Sample, Scan
from hw.sim.sensors.rays import nothing_kept, scan
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
        self._name, self._beams, self._shapes = name, model.beams, shapes
        self._mount = np.array([model.mount.x, model.mount.y, model.mount.yaw])
        limits = np.array([model.min_range, model.max_range])
        self._limits = limits, errors.noise, errors.outliers
        self._turns = model.start, model.step, model.beam_time
        self._kept = nothing_kept(model.beams)

    def samples(self, track: Track, now_ns: int) -> list[Sample]:
        if now_ns < self._rhythm.next_ns:
            return []
        due = self._rhythm.due(now_ns)
        return [Sample("base.scan", stamp, self._scan(track, n, stamp)) for n, stamp in due]

    def _scan(self, track: Track, number: int, stamp_ns: int) -> Scan:
        end_ns, n, (start, step, spacing) = stamp_ns + self._sweep_ns, self._beams, self._turns
        bodies = self._shapes.segments, self._shapes.discs(stamp_ns, end_ns)
        chance = self._stream.at(number)
        ranges, span = chance.standard_normal(n), (stamp_ns, end_ns)
        chances = ranges, chance.random(n)
        scan(track.past, span, self._mount, self._turns, bodies, chances, self._limits, self._kept)
        return Scan.of_array(self._name, start, step, ranges, spacing)
