"""No number that decides stands in the code of the behaviours: they are in profile and chart."""

import textwrap
from collections.abc import Mapping

import pytest

from tests.behaviors.deciding import deciding, numbers_of

EXCEPTIONS: Mapping[str, str] = {}
"""Physics, and tolerances of rounding: each with its source."""
LEFT = frozenset(
    (
        "chase.py:Approach.__init__:near",
        "chase.py:CELLS",
        "chase.py:TRIES",
        "chase.py:UserFar.__init__:beyond",
        "cornered.py:Cornered.__init__:moved",
        "cornered.py:GiveUp.__init__:after",
        "cornered.py:LOOK_S",
        "cornered.py:Leave.__init__:moved",
        "cornered.py:Leave.__init__:walking",
        "cornered.py:NEAR",
        "cornered.py:NEAR_S",
        "danger.py:BRAKED_S",
        "danger.py:CALM_S",
        "danger.py:CATCH_FROM",
        "danger.py:CATCH_S",
        "danger.py:LOOKAHEAD_S",
        "dodge.py:BEND",
        "dodge.py:BENDS",
        "dodge.py:CAUGHT_S",
        "dodge.py:DIRECTIONS",
        "dodge.py:DREAD",
        "dodge.py:EARLY_S",
        "dodge.py:HASTE",
        "dodge.py:HEADING",
        "dodge.py:LATE",
        "dodge.py:PACE",
        "dodge.py:RINGS",
        "dodge.py:SETS_OFF",
        "dodge.py:TOUCH",
        "dodge.py:TURNING_S",
        "escape_goal.py:KEEP_M",
        "escape_goal.py:KEEP_S",
        "haptic.py:SLICE",
        "inform.py:UserReady.__init__:cornered",
        "inform.py:UserReady.__init__:least",
        "inform.py:UserReady.__init__:moment",
        "make_room.py:MakeRoom.__init__:ahead",
        "make_room.py:MakeRoom.__init__:far",
        "make_room.py:MakeRoom.__init__:room",
        "make_room.py:MakeRoom.__init__:walking",
        "make_room.py:SETTLED_NS",
        "make_room.py:SLACK",
        "make_room.py:THINK_S",
        "make_room.py:TURNING",
        "make_room.py:UserCrowds.__init__:ahead",
        "make_room.py:UserCrowds.__init__:walking",
        "make_room.py:WATCHED",
        "prediction/aside.py:SETS_OFF_S",
        "prediction/aside.py:STEP_S",
        "prediction/costs.py:CORNERED",
        "prediction/costs.py:EFFORT",
        "prediction/costs.py:FAR",
        "prediction/costs.py:OPEN",
        "prediction/costs.py:lateness:0.1",
        "prediction/rollout.py:BREAK_OFF",
        "prediction/rollout.py:CLOSEST",
        "prediction/rollout.py:HORIZON_S",
        "prediction/rollout.py:SLACK",
        "prediction/rollout.py:STEP_S",
        "prediction/rollout.py:STOPPED_S",
        "prediction/rollout.py:WITH_USER",
        "prediction/waiting.py:DIRECTIONS",
        "prediction/waiting.py:ESCAPE_S",
        "prediction/waiting.py:LONGEST",
        "prediction/waiting.py:NOTICED_S",
        "prediction/waiting.py:ON_THE_WAY",
        "prediction/waiting.py:PACE",
        "prediction/waiting.py:SETS_OFF",
        "prediction/waiting.py:SPARE_S",
        "prediction/waiting.py:TRAPPED_S",
        "prediction/waiting.py:TURN_RATE",
        "refuge.py:DIRECTIONS",
        "refuge.py:FARTHEST",
        "refuge.py:RADII",
        "refuge.py:SLOWLY",
        "refuge.py:WORTH_S",
        "situation/chase_space.py:AT_A_TIME",
        "situation/present_situation.py:SPARE",
        "situation/present_situation.py:TURN_ROOM",
    )
)
"""Those that are still to go to the profile or to a chart."""


def test_no_number_that_decides_is_in_the_code():
    found = set(deciding())
    assert sorted(found - LEFT - set(EXCEPTIONS)) == []


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
        ("class A:\n    def run(self):\n        return [-3.5 for _ in range(7)]", ["A.run:3.5"]),
        ("def f(x):\n    return 0.5 * x[3] ** 2 / max(x[4], 1e-9)", []),
        ("def f(x):\n    return np.empty((len(x), 4)), x.reshape(-1, 3), 1e9 * x", []),
        ("@_f.example\ndef _of_f():\n    f(3.0)", []),
    ],
)
def test_which_numbers_count(code, numbers):
    assert list(numbers_of(textwrap.dedent(code))) == numbers
