"""Run time of single steps of localization: filters, and transforms looked up in a cache."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from cobodeck.bench.harness import BenchRow, Work, timed, times
from hw import Pose3
from states.localization.filter import (
    AXES,
    POSE,
    FilterConfig,
    Measurement,
    MeasurementSource,
    PlanarFilter,
    ProcessNoise,
    SpatialFilter,
    planar_config,
)
from states.localization.frames import TransformBuffer

NAME = "localization"
CACHES_S = (10.0, 100.0, 1000.0)
PERIOD_NS = 20_000_000
NO_ERROR = "has no error"


def step_rows(rounds: int) -> Iterator[BenchRow]:
    """One prediction with one correction, and one transform look-up over five edges."""
    planar = PlanarFilter(
        planar_config(
            MeasurementSource("wheels", ("vx", "vy", "wz"), gate=None),
            MeasurementSource("scan", POSE),
        )
    )
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    none, some = (0.0,) * len(AXES), (1e-3,) * len(AXES)
    noise = ProcessNoise(some, none, none)
    spatial = SpatialFilter(
        FilterConfig((MeasurementSource("pose", axes),), noise, (1.0,) * len(AXES))
    )
    points = [
        (_step("filter planar"), Work(times(_filtering(planar, "scan", 3)))),
        (_step("filter 15 states"), Work(times(_filtering(spatial, "pose", 6)))),
    ]
    for cache_s in CACHES_S:
        row = replace(_step("lookup 5 edges"), knob="cache", value=cache_s)
        points.append((row, Work(times(_looking(cache_s)))))
    yield from timed(points, rounds)


def _step(name: str) -> BenchRow:
    return BenchRow(NAME, name, "cobodeck", reference=NO_ERROR)


def _filtering(filter_: Any, source: str, axes: int) -> Callable[[], object]:
    stamp = 0
    values, variances = (0.0,) * axes, (1e-4,) * axes

    def step() -> object:
        nonlocal stamp
        stamp += PERIOD_NS
        return filter_.correct(Measurement(stamp, source, values, variances))

    return step


def _looking(cache_s: float) -> Callable[[], object]:
    buffer = TransformBuffer(cache_s)
    for k in range(round(100 * cache_s)):
        moved = Pose3.from_yaw(0.01 * k, 0.0, 0.0, 0.001 * k)
        for parent, child in (("map", "odom"), ("odom", "base"), ("base", "arm")):
            buffer.set_transform(parent, child, k * 10_000_000, moved)
    buffer.fix("arm", "flange", Pose3(0.0, 0.0, 1.0))
    buffer.fix("flange", "tool", Pose3(0.1, 0.0, 0.0))
    at = round(0.5 * cache_s * 1e9) + 5_000_000
    return lambda: buffer.lookup("map", "tool", at)
