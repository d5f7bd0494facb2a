"""`math.hypot` gives the same bits in compiled and in plain functions."""

from __future__ import annotations

import math
import random

from hypothesis import example, given, strategies as st

from hw.jit import compiled, hypot

LENGTHS = st.floats(-1e3, 1e3) | st.floats()


@compiled
def compiled_hypot(x: float, y: float) -> float:
    return math.hypot(x, y)


@given(LENGTHS, LENGTHS)
@example(math.inf, math.nan)
@example(5e-324, 1e-320)
@example(1e308, 1e308)
def test_a_length_has_the_same_bits_compiled_and_plain(x: float, y: float) -> None:
    right = math.hypot(x, y)

    for found in (compiled_hypot(x, y), hypot(x, y)):
        assert found == right or (math.isnan(found) and math.isnan(right))


def test_lengths_that_need_the_correction_have_the_same_bits() -> None:
    chance = random.Random(2)
    places = [(chance.uniform(-9.0, 9.0), chance.uniform(-0.9, 0.9)) for _ in range(20_000)]

    assert [compiled_hypot(*place) for place in places] == [math.hypot(*place) for place in places]
