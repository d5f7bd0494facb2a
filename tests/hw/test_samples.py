"""What no part can have measured is told apart from what it can."""

import math

import pytest

from hw.geometry import Pose2, Pose3, Twist2
from hw.samples import ArmState, BumperHit, UserPose, is_finite

JOINTS = (0.0,) * 5
BAD = (math.nan, math.inf, -math.inf)


@pytest.mark.parametrize(
    "value",
    [
        UserPose(Pose2(1.0, -2.0, 3.0), -3.0),
        Pose2(1e6, -1e6, 0.0),
        Twist2(0.0, 0.0, -9.0),
        Pose3(1.0, 2.0, 3.0),
        ArmState((*JOINTS, 1.0), (*JOINTS, -1.0)),
        BumperHit(0.5),
        None,
        True,
        "pressed",
    ],
)
def test_numbers_and_what_holds_no_numbers_pass(value):
    assert is_finite(value)


@pytest.mark.parametrize("bad", BAD)
def test_one_bad_number_is_enough(bad):
    for place in range(3):
        numbers = [bad if n == place else 1.0 for n in range(3)]
        assert not is_finite(Pose2(*numbers))
        assert not is_finite(Twist2(*numbers))
        assert not is_finite(Pose3(*numbers))
        assert not is_finite(UserPose(Pose2(*numbers), 0.0))
    assert not is_finite(UserPose(Pose2(1.0, 1.0), bad))
    assert not is_finite(ArmState((*JOINTS, bad), (*JOINTS, 0.0)))
    assert not is_finite(ArmState((*JOINTS, 0.0), (bad, *JOINTS)))


def test_infinities_that_cancel_are_noticed():
    assert not is_finite(Pose2(math.inf, -math.inf))
