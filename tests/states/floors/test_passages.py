"""Passages of twice the radius are open to every planner, narrower ones closed (R119).

On cells the way runs through centres, which may lie half a cell off the middle of a passage: so
much nearer to walls counts as free, and passages narrower by less than a cell may be open too.
"""

from __future__ import annotations

import pytest

from hw.scene.room import Room
from states.subsystems import SUBSYSTEMS
from tests.states.navigation.grid.test_layers import PLANNERS, environment_of

CELL = 0.05
START, GOAL = (2.0, 5.0), (10.0, 5.0)


def hall_with_gap(width: float, low: float = 4.0) -> Room:
    """A wall across the hall, with a gap from y = `low` on."""
    outer = ((0.0, 0.0), (12.0, 0.0), (12.0, 10.0), (0.0, 10.0))
    south = ((5.9, -1.0), (6.1, -1.0), (6.1, low), (5.9, low))
    north = ((5.9, low + width), (6.1, low + width), (6.1, 11.0), (5.9, 11.0))
    return Room(outer, walls=(south, north))


@pytest.mark.requirement(119)
@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("radius", [0.5, 0.75, 0.77, 1.0])
@pytest.mark.parametrize("low", [4.0, 4.013, 4.025, 4.04])
def test_a_passage_of_twice_the_radius_is_open_to_all(
    planner: str, radius: float, low: float
) -> None:
    environment = environment_of(planner, hall_with_gap(2.0 * radius, low), inflation=radius)
    for name in SUBSYSTEMS:
        assert environment.static_planners[name].plan(START, GOAL) is not None


@pytest.mark.requirement(119)
@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("radius", [0.5, 0.75, 0.77, 1.0])
@pytest.mark.parametrize("low", [4.0, 4.013, 4.025, 4.04])
def test_narrower_ones_are_closed_to_all(planner: str, radius: float, low: float) -> None:
    less = 1e-4 if planner == "exact" else CELL
    environment = environment_of(
        planner, hall_with_gap(2.0 * radius - less - 1e-6, low), inflation=radius
    )
    assert environment.static_planners["chase"].plan(START, GOAL) is None
