"""How a body slips against its wheels, in the complex plane."""

import cmath

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.sim.slip import FLOOR, slide

share, way, yaw = st.floats(0.0, 0.4), st.floats(-0.02, 0.02), st.floats(-3.1, 3.1)


@settings(deadline=None, max_examples=50)
@given(share, share, share, way, way, st.floats(-0.2, 0.2), yaw, yaw)
def test_shares_of_the_way_are_lost_along_the_body_whichever_way_it_has_turned(
    along, across, turning, dx, dy, turn, wheels, body
):
    """Of wheels and body both, the direction half way through the step counts."""
    floors = np.zeros(1, FLOOR)
    floors["along"], floors["across"], floors["turning"] = along, across, turning
    floors["patch"], floors["place"] = 0.3, (1.0, 2.0, body)
    steady = (0.0, 0.0, 0.0)

    slide(floors[0], wheels, steady, (dx, dy, turn, steady))

    told = complex(dx, dy) * cmath.exp(-1j * (wheels + 0.5 * turn))
    left = complex(told.real * (1.0 - along), told.imag * (1.0 - across))
    moved = left * cmath.exp(1j * (body + 0.5 * turn * (1.0 - turning)))
    x, y, after = floors["place"][0].tolist()
    assert (x - 1.0, y - 2.0) == pytest.approx((moved.real, moved.imag), abs=1e-12)
    turned = cmath.exp(1j * (body + turn * (1.0 - turning)))
    assert cmath.exp(1j * after) == pytest.approx(turned, abs=1e-12)
