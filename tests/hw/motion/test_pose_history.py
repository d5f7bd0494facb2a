"""The one history of poses: between its stamps, beyond its ends, in any order, and bounded."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hw.geometry import Pose2
from hw.motion.pose_history import PoseHistory, along_arc, wrapped

STAMPS = st.lists(st.integers(-1000, 1000), min_size=1, max_size=30, unique=True)
ASKED = st.integers(-1200, 1200)


def straight(stamps, kept_ns=10**9):
    """x is the stamp itself, so that each interpolated pose tells when it was."""
    return PoseHistory(Pose2.between, kept_ns, [(n, Pose2(float(n), 0.0)) for n in stamps])


@given(STAMPS, ASKED)
def test_a_pose_is_where_numpy_interpolates_it_whatever_the_order_of_arrival(stamps, asked):
    values = {n: (n * 7919) % 101 for n in stamps}
    poses = PoseHistory(Pose2.between, poses=((n, Pose2(float(values[n]), 0.0)) for n in stamps))
    known = sorted(stamps)
    expected = float(np.interp(asked, known, [values[n] for n in known]))

    assert poses.held(asked).x == pytest.approx(expected)
    if known[0] <= asked <= known[-1]:
        assert poses.at(asked) == poses.held(asked)
    else:
        assert poses.at(asked) is None
    assert poses.newest == (known[-1], Pose2(float(values[known[-1]]), 0.0))
    assert poses.oldest_ns == known[0]


@given(STAMPS, st.integers(0, 500), ASKED)
def test_the_whole_span_is_kept_and_one_pose_before_it(stamps, kept, asked):
    known = sorted(stamps)
    poses = straight(known, kept)

    before = [n for n in known if n < known[-1] - kept]
    assert poses.oldest_ns == (before[-1] if before else known[0])
    if poses.oldest_ns <= asked <= known[-1]:
        assert poses.at(asked).x == pytest.approx(asked)
    else:
        assert poses.at(asked) is None


@given(STAMPS, ASKED, ASKED)
def test_inside_are_the_poses_after_one_stamp_and_before_another(stamps, start, end):
    inside = straight(stamps).inside(start, end)

    assert [n for n, _ in inside] == [n for n in sorted(stamps) if start < n < end]


def test_long_histories_take_no_more_room():
    poses = straight(range(100_000), kept_ns=50)

    assert len(poses._rows) < 1000
    assert poses.at(99_950) == Pose2(99_950.0, 0.0)


def test_one_of_the_same_stamp_is_replaced():
    poses = straight([0, 10, 20])
    poses.insert(20, Pose2(30.0, 0.0))
    poses.insert(10, Pose2(0.0, 0.0))

    assert poses.newest == (20, Pose2(30.0, 0.0))
    assert [poses.at(n).x for n in (5, 10, 15)] == [0.0, 0.0, 15.0]


def test_what_it_forgets_by_word_is_gone():
    poses = straight([0, 10])
    poses.clear()

    assert poses.newest is None
    assert poses.at(5) is None
    poses.insert(3, Pose2(3.0, 0.0))
    assert poses.oldest_ns == 3


def test_gaps_that_are_too_long_are_unknown_but_for_their_ends():
    poses = straight([0, 10, 40])

    assert poses.at(25, longest_ns=29) is None
    assert poses.at(25, longest_ns=30) == Pose2(25.0, 0.0)
    assert poses.at(40, longest_ns=1) == Pose2(40.0, 0.0)


def test_it_is_extended_along_the_last_poses_but_not_by_the_noise_of_close_ones():
    poses = PoseHistory(wrapped, poses=[(0, Pose2(0.0, 0.0)), (90, Pose2(80.0, 0.0, 3.0))])
    poses.insert(100, Pose2(100.0, 0.0, -3.0))

    assert poses.extended(45) == poses.at(45)
    assert poses.extended(-7) == Pose2(0.0, 0.0)
    assert poses.extended(110).x == pytest.approx(120.0)  # from the pose before
    assert poses.extended(110).yaw == pytest.approx(math.tau - 6.0 - 3.0)
    assert poses.extended(110, 50).x == pytest.approx(120.0)  # there is none in between
    assert poses.extended(110, 100).x == pytest.approx(110.0)  # from the first one
    assert straight([5]).extended(9) == Pose2(5.0, 0.0)


@given(*3 * [st.floats(-3.0, 3.0)], st.floats(0.0, 1.0))
def test_an_arc_is_driven_at_a_constant_velocity(x, y, yaw, share):
    """The first part of the way, and then the same velocity for the rest, lead to the end."""
    start, step = Pose2(1.0, -2.0, 0.5), Pose2(x, y, yaw)
    end = start @ step

    middle = along_arc(start, end, share)
    back = along_arc(end, start, 1.0 - share)

    assert middle.distance_to(back) < 1e-9
    assert along_arc(start, end, 1.0).distance_to(end) < 1e-9
    half = along_arc(start, end, 0.5)
    assert half.distance_to(start) == pytest.approx(half.distance_to(end), abs=1e-9)
