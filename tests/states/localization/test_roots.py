"""Where rounding takes what is under a root, or in an arc function, past its bound."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, Pose3
from states.localization.calibration.tracker_calibration import _upright
from states.localization.filter.fusion import sigma_of
from states.localization.matching.pose_matcher import CERTAIN, SAME_M, SAME_RAD, leaps
from states.localization.matching.scan_tracker import Match

RESTS = (-1e-18, -0.0, 0.0, 1e-12)


@pytest.mark.parametrize("rest", RESTS)
def test_a_variance_that_is_nearly_nothing_is_nothing(rest: float) -> None:
    covariance = np.diag([rest, rest, rest])

    sigma = sigma_of(covariance)

    assert 0.0 <= sigma.position <= 1e-6
    assert 0.0 <= sigma.yaw <= 1e-6
    for way, leapt in ((0.9, False), (1.1, True)):
        for found in (Pose2(way * SAME_M, 0.0, 0.0), Pose2(0.0, 0.0, way * SAME_RAD)):
            match = Match(found, np.eye(3), CERTAIN - 0.01, 100, 0.0, 3)
            assert leaps(match, Pose2(0.0, 0.0), covariance) is leapt


@given(a=st.floats(-math.pi, math.pi), b=st.floats(-math.pi, math.pi))
@settings(deadline=None)
def test_upside_down_is_half_a_turn_from_upright(a: float, b: float) -> None:
    over = Pose3(0.0, 0.0, 0.0, math.cos(a), math.sin(a), 0.0, 0.0)

    assert _upright(over @ Pose3.from_yaw(0.0, 0.0, 0.0, b)) == pytest.approx(math.pi, abs=1e-6)
    assert _upright(Pose3.from_yaw(0.0, 0.0, 0.0, b)) == 0.0
