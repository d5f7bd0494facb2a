"""Many places are free as each of them is."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, strategies as st

from states.navigation.exact.clearance import are_free, is_free

OUTER = ((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (4.0, 7.0), (0.0, 6.0))
PILLARS = (((2.0, 2.0), (3.0, 2.0), (2.5, 3.0)), ((5.0, 4.0), (6.0, 4.0), (6.0, 5.0), (5.0, 5.0)))


def room(radius: float) -> tuple[np.ndarray, np.ndarray]:
    rings = (OUTER, *PILLARS)
    discs = [(x, y, radius) for ring in rings for x, y in ring]
    sides = [
        (*a, *b, radius, float(number))
        for number, ring in enumerate(rings)
        for a, b in zip(ring, (*ring[1:], ring[0]), strict=True)
    ]
    return np.array(discs), np.array(sides)


COORDINATE = st.floats(-1.0, 9.0) | st.sampled_from((0.0, 2.0, 4.0, 5.0, 8.0, math.nan, math.inf))


@given(st.lists(st.tuples(COORDINATE, COORDINATE), max_size=40), st.floats(0.0, 1.2))
def test_many_places_are_free_as_each_is(places: list[tuple[float, float]], radius: float) -> None:
    discs, sides = room(radius)
    rows = np.array(places).reshape(-1, 2)

    assert are_free(rows, discs, sides).tolist() == [is_free(x, y, discs, sides) for x, y in places]
