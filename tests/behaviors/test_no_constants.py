"""No number that decides stands in the code of the behaviours: they are in profile and chart."""

import textwrap
from collections.abc import Mapping

import pytest

from tests.behaviors.deciding import deciding, left_to_code, numbers_of

EXCEPTIONS: Mapping[str, str] = {
    "chase/waiting_place.py:LEAST_WEIGHT": "rounding: keeps a division by a weight of 0 finite",
}
"""Physics, and tolerances of rounding: each with its source."""


def test_no_number_that_decides_is_in_the_code():
    found = set(deciding())
    assert sorted(found - set(EXCEPTIONS)) == []


def test_no_chart_leaves_a_number_to_the_code():
    assert sorted(left_to_code()) == []


def test_exceptions_exist_and_say_why():
    found = set(deciding())
    assert sorted(set(EXCEPTIONS) - found) == []
    assert all(len(reason) > 10 for reason in EXCEPTIONS.values())


@pytest.mark.parametrize(
    ("code", "numbers"),
    [
        ("NEAR, NEAR_S = 1.9, 1.0", ["NEAR", "NEAR_S"]),
        ("RINGS: tuple[float, ...] = (0.6, 1.2)", ["RINGS"]),
        ("DUE = EARLIER + 0.3", ["DUE"]),
        ("NAMES = ('a', 'b')\nON = True", []),
        ("def f(x, near=0.4, ahead=0.0): return x", ["f:near"]),
        ("def f(x, /, *, near=2): return x", ["f:near"]),
        ("def f(x):\n    return x > 0.7", ["f:0.7"]),
        ("class A(Monitor):\n    def __init__(self, near=3.0): self.near = near", []),
        ("class A:\n    def run(self):\n        return [-3.5 for _ in range(7)]", ["A.run:3.5"]),
        ("def f(x):\n    return 0.5 * x[3] ** 2 / max(x[4], 1e-9)", []),
        ("def f(x):\n    return np.empty((len(x), 4)), x.reshape(-1, 3), 1e9 * x", []),
        ("@_f.example\ndef _of_f():\n    f(3.0)", []),
    ],
)
def test_which_numbers_count(code, numbers):
    assert list(numbers_of(textwrap.dedent(code))) == numbers
