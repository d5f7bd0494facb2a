"""Where the base's own loop takes it to be: fixes of trackers and localization, and the wheels."""

import math

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.model.robot import load_robot
from hw.model.tracking import Tracking
from hw.motion.reckoner import KEPT_NS, SLIP, TRACKER_SIGMA, Reckoner
from hw.samples import OLD_NS, Odometry, PoseSigma, TrackerPose

MS = 1_000_000
SIGMA = PoseSigma(0.02, 0.01)
TURNED = Pose3.from_yaw(3.0, -1.0, 0.2, 0.7)
MOUNT = Pose3.from_yaw(0.3, 0.2, 0.5, math.pi)
TRACKING = Tracking(TURNED, {"a": MOUNT})
coordinates = st.floats(-5.0, 5.0)
places = st.builds(Pose2, coordinates, coordinates, st.floats(-3.0, 3.0))


def seen_at(pose, tracker="a"):
    """What a tracker shows while the base is at `pose`, by matrices of its own."""
    map_from_base = Pose3.from_yaw(pose.x, pose.y, 0.0, pose.yaw)
    return TrackerPose(tracker, TURNED.inverse() @ map_from_base @ MOUNT)


def stood(pose):
    """Wheels that are here and turn no more."""
    return Odometry(pose, STILL)


def near(a, b, within=1e-9):
    turned = math.remainder(a.yaw - b.yaw, 2 * math.pi)
    return a.distance_to(b) <= within and abs(turned) <= within


def test_without_a_fix_nobody_knows():
    reckoner = Reckoner(TRACKING)
    assert reckoner.at(0) is None
    reckoner.move(0, stood(Pose2(0.0, 0.0)))
    assert reckoner.at(0) is None


@settings(deadline=None)
@given(places, places, places)
def test_a_fix_is_moved_on_by_the_wheels(start, first, then):
    """The wheels count in any frame: what moves the base is their difference."""
    for fix in ("tracker", "estimate"):
        reckoner = Reckoner(TRACKING)
        reckoner.move(0, stood(first))
        if fix == "tracker":
            reckoner.track(0, seen_at(start))
        else:
            reckoner.estimate(0, start, SIGMA)
        reckoner.move(20 * MS, stood(then))
        expected = start @ (first.inverse() @ then)
        found = reckoner.at(20 * MS)
        assert near(found.pose, expected)
        way = first.distance_to(then)
        least = TRACKER_SIGMA if fix == "tracker" else SIGMA.position
        assert found.sigma == pytest.approx(least + SLIP * way)


def test_a_late_fix_counts_from_its_own_instant():
    """Straight ahead at 1 m/s; what was seen 30 ms ago is 3 cm further by now."""
    reckoner = Reckoner(TRACKING)
    for k in range(11):
        reckoner.move(k * 10 * MS, stood(Pose2(0.01 * k, 0.0)))
    reckoner.estimate(65 * MS, Pose2(5.0, 5.0), SIGMA)
    assert near(reckoner.at(100 * MS).pose, Pose2(5.035, 5.0))
    reckoner.estimate(-1, Pose2(9.0, 9.0), SIGMA)
    assert reckoner.at(100 * MS) is None  # from before anybody counted
    reckoner.estimate(70 * MS, None, None)
    assert reckoner.at(100 * MS) is None


def test_between_two_words_of_the_wheels_they_turn_on():
    """A quarter of a circle of 1 m radius within half a second, told every 50 ms."""
    reckoner, twist = Reckoner(TRACKING), Twist2(math.pi, 0.0, math.pi)

    def on_circle(ns):
        angle = math.pi * ns * 1e-9
        return Pose2(math.sin(angle), 1.0 - math.cos(angle), angle)

    reckoner.move(0, Odometry(Pose2(0.0, 0.0), twist))
    reckoner.estimate(0, Pose2(0.0, 0.0), SIGMA)
    for ns in range(0, 500 * MS, 10 * MS):
        if ns % (50 * MS) == 0:
            reckoner.move(ns, Odometry(on_circle(ns), twist))
        assert near(reckoner.at(ns).pose, on_circle(ns), within=2e-4)
    assert reckoner.at(0).sigma >= 0.02 + SLIP * 1.3


def test_of_silent_wheels_nothing_is_known():
    reckoner = Reckoner(TRACKING)
    reckoner.move(0, stood(Pose2(0.0, 0.0)))
    reckoner.estimate(0, Pose2(1.0, 0.0), SIGMA)
    assert reckoner.at(OLD_NS) is not None
    assert reckoner.at(OLD_NS + 1) is None


def test_a_tracker_goes_before_the_estimate_while_it_is_seen():
    reckoner = Reckoner(TRACKING)
    reckoner.move(0, stood(Pose2(0.0, 0.0)))
    reckoner.estimate(0, Pose2(1.0, 0.0), SIGMA)
    reckoner.track(0, seen_at(Pose2(1.3, 0.0)))
    reckoner.move(OLD_NS, stood(Pose2(0.0, 0.0)))
    by_tracker = reckoner.at(OLD_NS)
    assert near(by_tracker.pose, Pose2(1.3, 0.0))
    assert by_tracker.sigma == pytest.approx(0.3)  # they contradict each other
    assert near(reckoner.at(OLD_NS + 1).pose, Pose2(1.0, 0.0))


def test_the_newest_tracker_counts_and_a_strange_one_does_not():
    reckoner = Reckoner(TRACKING)
    reckoner.move(0, stood(Pose2(0.0, 0.0)))
    reckoner.move(50 * MS, stood(Pose2(0.0, 0.0)))
    reckoner.track(40 * MS, seen_at(Pose2(1.0, 0.0)))
    reckoner.track(30 * MS, seen_at(Pose2(2.0, 0.0)))
    reckoner.track(45 * MS, seen_at(Pose2(3.0, 0.0), "b"))
    assert near(reckoner.at(50 * MS).pose, Pose2(1.0, 0.0))


def test_memory_is_bounded():
    reckoner = Reckoner(TRACKING)
    for k in range(10_000):
        reckoner.move(k * 10 * MS, stood(Pose2(0.0, 0.0)))
    assert reckoner._wheels.oldest_ns >= 9_998 * 10 * MS - KEPT_NS


def test_a_robot_file_says_where_its_trackers_sit():
    sensing = load_robot("rbkairos_ur10").sensing
    tracking = Tracking.of(sensing)
    assert set(tracking.mounts) == set(sensing.trackers)
    for name, mount in tracking.mounts.items():
        base = Pose2(2.0, 1.0, 0.5)
        lifted = Pose3.from_yaw(base.x, base.y, 0.0, base.yaw)
        assert near(tracking.base_by(TrackerPose(name, lifted @ mount)), base)
    assert tracking.base_by(TrackerPose("nobody", Pose3(0.0, 0.0, 0.0))) is None


@settings(deadline=None)
@given(places, st.integers(0, 100 * MS), st.floats(-2.0, 2.0))
def test_before_its_newest_odometry_it_is_where_that_says(pose, early, speed):
    """A cycle may be asked for an instant that is already past: nothing is driven backwards."""
    reckoner = Reckoner(TRACKING)
    reckoner.move(1000 * MS, Odometry(pose, Twist2(speed, 0.3, -speed)))
    reckoner.estimate(1000 * MS, pose, SIGMA)

    assert near(reckoner.at(1000 * MS - early).pose, pose)


@pytest.mark.parametrize("fix", ["tracker", "estimate"])
def test_only_what_was_driven_since_a_fix_makes_it_unsure(fix):
    reckoner = Reckoner(TRACKING)
    for k in range(101):
        reckoner.move(k * 10 * MS, stood(Pose2(0.02 * k, 0.0)))
    if fix == "tracker":
        reckoner.track(990 * MS, seen_at(Pose2(1.0, 0.0)))
    else:
        reckoner.estimate(990 * MS, Pose2(1.0, 0.0), SIGMA)
    least = TRACKER_SIGMA if fix == "tracker" else SIGMA.position
    assert reckoner.at(1000 * MS).sigma == pytest.approx(least + SLIP * 0.02)
