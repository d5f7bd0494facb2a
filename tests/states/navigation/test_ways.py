"""Questions that planners answer in one call, compared with those about a single leg."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.scene import Disc
from states.navigation import GLOBAL_PLANNERS, GlobalPlanner

ROOM = ((0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0))
COLUMN = ((2.5, 2.0), (3.0, 2.0), (3.0, 2.5), (2.5, 2.5))
PLANNERS = {
    name: GLOBAL_PLANNERS[name](ROOM, (COLUMN,), inflation_radius=0.5)
    for name in ("exact", "theta_star")
}
coordinates = st.floats(0.2, 5.8)
places = st.tuples(coordinates, st.floats(0.2, 4.8))
users = st.none() | st.builds(Disc, coordinates, coordinates, st.floats(0.1, 1.3))
ways = st.lists(st.lists(places, min_size=5, max_size=5), min_size=1, max_size=5)


@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS.keys())
@given(start=places, ways=ways, user=users, spare=st.just(math.inf) | st.floats(-0.1, 0.3))
@settings(deadline=None, max_examples=200)
def test_the_first_way_is_that_whose_legs_are_all_allowed(
    planner: GlobalPlanner, start: Any, ways: Any, user: Disc | None, spare: float
) -> None:
    def is_allowed(there: Any, end: Any, *held: Any) -> bool:
        off_user = spare == math.inf or all(planner.allows(there, at, None, spare) for at in held)
        onward = planner.allows(there, end, user, 0.01)
        return planner.allows(start, there, user, 0.01) and onward and off_user

    expected = next((i for i, way in enumerate(ways) if is_allowed(*way)), len(ways))
    rows = np.array(ways).reshape(-1, 10)
    assert planner.first_allowed(start, rows, user, 0.01, spare) == expected


@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS.keys())
@given(start=places, ends=st.lists(places, min_size=1, max_size=4), user=users)
@settings(deadline=None, max_examples=200)
def test_each_end_is_allowed_if_all_legs_are(
    planner: GlobalPlanner, start: Any, ends: Any, user: Disc | None
) -> None:
    expected = all(planner.allows(start, end, user) for end in ends)
    assert planner.allows_each(start, np.array(ends), user) is expected
