"""How long drives came to nothing at one place, against times by hand."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

import pytest

from cobodeck.evaluate.stuck import PLACE_M, StuckWatch
from engine.run.chart_run import ChartRun
from hw.geometry import Pose2
from hw.model.robot import load_robot
from hw.scene.scene import load_scene
from hw.truth import Truth

FOLLOW, PARK = "chase/follow/drive/go", "haptic/serve/park"
START = (2.0, 2.0)


class Leaf(NamedTuple):
    path: str


@dataclass
class EndedDrives:
    """A run of which only the ends of drives are known."""

    raw: list[tuple[Any, ...]] = field(default_factory=list)
    gone: int = 0
    running: tuple[()] = ()
    inputs_of = None

    @property
    def trace(self) -> EndedDrives:
        return self

    @property
    def life(self) -> EndedDrives:
        return self


@dataclass
class Base:
    """A plant whose base is where it is put."""

    truth: Truth | None = None


Event = tuple[float, float, str, str]
"""Time, s; distance from the start, m; a node and how its drive ended, or nothing."""


def entries(*events: Event) -> list[tuple[float, float, int]]:
    """From when until when, s, drives came to nothing at one place, and how many."""
    plant, run = Base(), EndedDrives()
    watch = StuckWatch(
        cast(Any, plant),
        cast(ChartRun, run),
        load_scene("lab_a"),
        load_robot("rbkairos_ur10").footprint,
    )
    for at_s, off_m, node, outcome in events:
        plant.truth = Truth(base=Pose2(START[0] + off_m, START[1]))
        if node:
            run.raw.append(("end", round(at_s * 1e9), Leaf(node), outcome))
        watch.watch(round(at_s * 1e9))
    return [(one["at_s"], one["until_s"], one["count"]) for one in watch.found]


HOUR = [(float(s), 1.0, "", "") for s in range(10, 3600, 10)]


@pytest.mark.parametrize(
    ("events", "found"),
    [
        ([(1.0, 0.0, FOLLOW, "arrived")], []),
        ([(1.0, 0.0, FOLLOW, "stuck")], [(1.0, 1.0, 1)]),
        # two nodes and two outcomes in turn, at one place
        (
            [
                (60.0 * n, 0.0, (FOLLOW, PARK)[n % 2], ("stuck", "no_path")[n // 2 % 2])
                for n in range(11)
            ],
            [(0.0, 600.0, 11)],
        ),
        # an hour elsewhere between
        (
            [(1.0, 0.0, FOLLOW, "stuck"), *HOUR, (3600.0, 0.0, FOLLOW, "stuck")],
            [(1.0, 1.0, 1), (3600.0, 3600.0, 1)],
        ),
        # shaken, but still at the place where it began
        (
            [
                (1.0, 0.0, FOLLOW, "stuck"),
                (2.0, 0.9 * PLACE_M, "", ""),
                (3.0, 0.9 * PLACE_M, FOLLOW, "stuck"),
                (4.0, 1.1 * PLACE_M, FOLLOW, "stuck"),
            ],
            [(1.0, 3.0, 2), (4.0, 4.0, 1)],
        ),
    ],
)
def test_an_entry_lasts_while_drives_come_to_nothing_and_the_base_stays(
    events: list[Event], found: list[tuple[float, float, int]]
) -> None:
    assert entries(*events) == found
