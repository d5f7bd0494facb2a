"""The Chase space cell by cell, by formulas of its own (R93-R100)."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator

import pytest

from behaviors.chase.waiting_place import chase_cell, free_cells
from behaviors.profile.profile import Profile
from behaviors.situation.chase_cells import Array, weighted_cells
from behaviors.situation.chase_ring import ChaseRing
from behaviors.situation.present_situation import Situation
from hw.geometry import Pose2
from hw.samples import UserPose
from hw.scene.room import Room

COLUMN = (6.0, 6.6, 6.3, 7.1)
"""x and y from, x and y to, m."""
SIDE = 9.0


def room() -> Room:
    x1, y1, x2, y2 = COLUMN
    column = ((x1, y1), (x2, y1), (x2, y2), (x1, y2))
    return Room(((0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE)), columns=(column,))


def cells() -> Iterator[complex]:
    """Centres (i + 1/2) 5 cm about the user, x ahead: 1.5 to 3 m, without 60 and 45 degrees."""
    for i in range(-60, 60):
        for j in range(-60, 60):
            place = complex((i + 0.5) * 0.05, (j + 0.5) * 0.05)
            bearing = math.degrees(abs(cmath.phase(place)))
            if 1.5 <= abs(place) <= 3.0 and 30.0 <= bearing <= 157.5:
                yield place


def clearance(place: complex) -> float:
    """To the walls of the square room and to its column, m."""
    x1, y1, x2, y2 = COLUMN
    x, y = place.real, place.imag
    to_column = math.hypot(max(x1 - x, 0.0, x - x2), max(y1 - y, 0.0, y - y2))
    return min(x, y, SIDE - x, SIDE - y, to_column)


def weighted(paper: Profile) -> Array:
    return weighted_cells(ChaseRing.of(paper.settings.chase), math.radians(90.0), 2.0)


@pytest.mark.requirement(93, 94, 97, 98, 100, 120)
@pytest.mark.parametrize(("x", "y", "yaw"), [(4.0, 5.0, 0.3), (7.0, 4.0, -2.0), (2.0, 2.0, 3.0)])
def test_the_free_cells_are_those_a_metre_from_walls_and_column(
    paper: Profile, situation_of: Callable[..., Situation], x: float, y: float, yaw: float
) -> None:
    user = UserPose(Pose2(x, y, yaw), yaw + 1.0)
    now = situation_of(paper, Pose2(1.5, 7.5), user, room=room())
    every = list(cells())
    assert len(every) == 5998
    placed = [complex(x, y) + place * cmath.exp(1j * yaw) for place in every]
    expected = {_key(place) for place in placed if clearance(place) >= 1.0}
    doubtful = {_key(place) for place in placed if abs(clearance(place) - 1.0) < 1e-6}

    found = {_key(complex(a, b)) for a, b, _ in free_cells(now, weighted(paper)).tolist()}

    assert found - doubtful == expected - doubtful
    assert 0 < len(found) < 5998


def _key(place: complex) -> tuple[int, int]:
    """Cells are 5 cm apart; a tenth of a millimetre tells them apart."""
    return round(place.real * 1e4), round(place.imag * 1e4)


@pytest.mark.requirement(95, 96)
def test_the_chosen_cell_has_the_largest_weight_of_all_that_can_be_reached(
    paper: Profile, situation_of: Callable[..., Situation]
) -> None:
    """At the side and 2 m away, where both terms of the paper's profile are highest."""
    user = UserPose(Pose2(4.0, 5.0, 0.3), 0.3)
    now = situation_of(paper, Pose2(1.5, 7.5), user, room=room())
    best = math.radians(90.0), 2.0

    found = chase_cell(now, ChaseRing.of(paper.settings.chase), *best)

    assert found is not None
    weights = {(a, b): weight for a, b, weight in free_cells(now, weighted(paper)).tolist()}
    chosen = min(weights, key=lambda place: math.dist(place, found))
    assert math.dist(chosen, found) < 1e-9
    assert weights[chosen] == max(weights.values())
    side = math.degrees(abs(cmath.phase(complex(*found) - (4.0 + 5.0j)) - 0.3))
    assert abs(side - 90.0) < 15.0
    assert math.dist(found, (4.0, 5.0)) == pytest.approx(2.0, abs=0.3)
    for _ in range(3):
        assert chase_cell(now, ChaseRing.of(paper.settings.chase), *best) == found
