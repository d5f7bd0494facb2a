"""The spatial table against areas computed by hand."""

import math

import pytest

from cobodeck.paper.rooms import rooms


@pytest.mark.requirement(121, 122, 123)
def test_the_areas_are_those_of_geometry():
    """Two ideal rooms shrink by 1 m all round; a column grows by 1 m, with round corners."""
    study, disc, square = rooms("study")
    column = 0.3 * 0.5 + 2.0 * (0.3 + 0.5) + math.pi
    side, radius = math.sqrt(115.0), math.sqrt(115.0 / math.pi)
    assert square["usable_m2"] == pytest.approx((side - 2.0) ** 2 - column, abs=0.01)
    assert disc["usable_m2"] == pytest.approx(math.pi * (radius - 1.0) ** 2 - column, abs=0.01)
    assert study["free_m2"] == pytest.approx(115.0, abs=0.05)
    assert study["usable_m2"] == pytest.approx(62.0, abs=0.05)
