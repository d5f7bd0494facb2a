"""All frames of a run hang together, at every time that is remembered."""

import math

import pytest

from engine.state import Stamped
from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.model.tracking import Tracking
from hw.samples import UserPose
from states.localization.frames.frames import FramesEstimator

ROBOT = load_robot("rbkairos_ur10")
VIVE = Pose3.from_yaw(1.0, 2.0, 0.0, 0.5)
TRACKING = Tracking(VIVE, Tracking.of(ROBOT.sensing).mounts)
MS = 1_000_000
HAND = Pose3.from_yaw(2.3, 1.0, 1.2, 0.0)


def frames(**user):
    made = FramesEstimator(ROBOT, TRACKING)
    for k in range(11):
        made.update("base.pose", Stamped(Pose2(0.1 * k, 0.0, 0.02 * k), 10 * k * MS))
    made.update("user.pose", Stamped(UserPose(Pose2(2.0, 1.0, math.pi), 0.0, **user), 50 * MS))
    return made


def test_a_frame_is_looked_up_where_it_was_then():
    found = frames().value().lookup("map", "base", 45 * MS)
    assert (found.x, found.y, found.yaw) == pytest.approx((0.45, 0.0, 0.09))
    assert not isinstance(frames().value().lookup("map", "base", 200 * MS), Pose3)


@pytest.mark.requirement(20, 84)
@pytest.mark.parametrize("frame", ["front_laser", "rear_tracker", "arm", "vive"])
def test_every_frame_is_seen_from_every_other(frame):
    buffer = frames(left_hand=HAND).value()
    seen, from_hand = buffer.lookup(frame, "user_left_hand", 50 * MS), HAND.inverse()
    whole = buffer.lookup("map", frame, 50 * MS) @ seen @ from_hand
    assert (whole.x, whole.y, whole.z) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_the_deep_of_the_tracking_comes_into_the_map_and_onto_the_rover():
    buffer = frames().value()
    deep = Pose3.from_yaw(0.5, 0.3, 1.1, 0.2)
    in_map = buffer.lookup("map", "vive", 50 * MS) @ deep
    assert in_map == VIVE @ deep
    base = Pose3.from_yaw(0.5, 0.0, 0.0, 0.1)
    on_rover = buffer.lookup("base", "vive", 50 * MS) @ deep
    expected = base.inverse() @ in_map
    assert (on_rover.x, on_rover.y, on_rover.z) == pytest.approx((expected.x, expected.y, 1.1))


def test_it_is_as_old_as_its_newest_pose():
    made = FramesEstimator(ROBOT, TRACKING)
    assert made.stamp() is None
    assert frames().stamp() == 100 * MS
