"""The transform buffer against scipy's rotations and slerp, and tf2's rules one by one."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation, Slerp

from hw.geometry import Pose3
from states.localization.frames.transforms import NoTransform, TransformBuffer

MS = 1_000_000


def matrix(pose: Pose3) -> np.ndarray:
    whole = np.eye(4)
    whole[:3, :3] = Rotation.from_quat([pose.qx, pose.qy, pose.qz, pose.qw]).as_matrix()
    whole[:3, 3] = pose.x, pose.y, pose.z
    return whole


def random_pose(chance: random.Random) -> Pose3:
    q = np.array([chance.gauss(0, 1) for _ in range(4)])
    q /= np.linalg.norm(q)
    return Pose3(*(chance.uniform(-5, 5) for _ in range(3)), *map(float, q))


def interpolated(t0: int, a: Pose3, t1: int, b: Pose3, t: int) -> np.ndarray:
    turns = Rotation.from_quat([[p.qx, p.qy, p.qz, p.qw] for p in (a, b)])
    share = (t - t0) / (t1 - t0)
    whole = np.eye(4)
    whole[:3, :3] = Slerp([0.0, 1.0], turns)([share]).as_matrix()[0]
    for i, name in enumerate("xyz"):
        whole[i, 3] = (1 - share) * getattr(a, name) + share * getattr(b, name)
    return whole


def reason(found: Pose3 | NoTransform) -> str:
    assert isinstance(found, NoTransform)
    return found.reason


@settings(max_examples=60)
@given(st.integers(0, 2**32), st.floats(0.0, 1.0))
def test_a_tree_is_what_scipy_makes_of_it(seed: int, share: float) -> None:
    """Two branches of moving and fixed edges, asked between their stamps, both ways round."""
    chance = random.Random(seed)
    buffer = TransformBuffer()
    at = round(share * 10 * MS)
    truth = {"map": np.eye(4)}
    for parent, child, moving in (
        ("map", "odom", True),
        ("odom", "base", True),
        ("base", "scanner", False),
        ("map", "vive", False),
        ("vive", "tracker", True),
    ):
        a, b = random_pose(chance), random_pose(chance)
        if moving:
            buffer.set_transform(parent, child, 0, a)
            buffer.set_transform(parent, child, 10 * MS, b)
            truth[child] = truth[parent] @ interpolated(0, a, 10 * MS, b, at)
        else:
            buffer.fix(parent, child, a)
            truth[child] = truth[parent] @ matrix(a)

    for target in truth:
        for source in truth:
            found = buffer.lookup(target, source, at)
            assert isinstance(found, Pose3)
            expected = np.linalg.inv(truth[target]) @ truth[source]
            np.testing.assert_allclose(matrix(found), expected, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-5, 2e-5, 1e-3, 1.0, math.pi - 1e-6])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_orientations_go_the_short_way_at_a_steady_rate(angle: float, sign: float) -> None:
    half = 0.5 * angle
    q = (0.0, sign * math.sin(half), 0.0, sign * math.cos(half))
    buffer = TransformBuffer()
    buffer.set_transform("a", "b", 0, Pose3(0, 0, 0))
    buffer.set_transform("a", "b", 1000, Pose3(0, 0, 0, *q))
    for t in (0, 1, 250, 500, 999, 1000):
        found = buffer.lookup("a", "b", t)
        assert isinstance(found, Pose3)
        expected = Pose3(0, 0, 0, 0, math.sin(half * t / 1000), 0, math.cos(half * t / 1000))
        assert found.angle_to(expected) <= 1e-14


def test_a_stamp_that_was_told_gives_the_told_value_bit_for_bit() -> None:
    chance = random.Random(3)
    told = [random_pose(chance) for _ in range(50)]
    buffer = TransformBuffer()
    for n, pose in enumerate(told):
        buffer.set_transform("a", "b", n, pose)
    assert [buffer.lookup("a", "b", n) for n in range(50)] == told


def test_the_order_of_arrival_does_not_count() -> None:
    chance = random.Random(4)
    told = [(n * MS, random_pose(chance)) for n in range(40)]
    one, other = TransformBuffer(), TransformBuffer()
    for stamp, pose in told:
        one.set_transform("a", "b", stamp, pose)
    for stamp, pose in chance.sample(told, len(told)):
        assert other.set_transform("a", "b", stamp, pose)
    for t in range(0, 39 * MS, 333_333):
        assert one.lookup("a", "b", t) == other.lookup("a", "b", t)


def test_nothing_is_extrapolated_and_each_case_has_its_name() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("a", "b", 100, Pose3(0, 0, 0))
    assert reason(buffer.lookup("a", "b", 99)) == "one_value"
    assert reason(buffer.lookup("a", "b", 101)) == "one_value"
    buffer.set_transform("a", "b", 200, Pose3(1, 0, 0))
    assert reason(buffer.lookup("a", "b", 99)) == "past"
    assert reason(buffer.lookup("b", "a", 201)) == "future"
    assert "b is known from 100 to 200 ns" in str(buffer.lookup("b", "a", 201))
    assert isinstance(buffer.lookup("a", "b", 100), Pose3)
    assert isinstance(buffer.lookup("a", "b", 200), Pose3)


def test_edges_above_the_common_frame_need_not_be_known() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("map", "base", 0, Pose3(9, 9, 9))
    buffer.fix("base", "left", Pose3(0, 1, 0))
    buffer.fix("base", "right", Pose3(0, -1, 0))
    assert buffer.lookup("left", "right", 5) == Pose3(0, -2, 0)


def test_without_a_time_the_newest_common_one_is_taken() -> None:
    buffer = TransformBuffer()
    for stamp in range(0, 1000, 10):
        buffer.set_transform("map", "odom", stamp, Pose3(float(stamp), 0, 0))
    for stamp in range(0, 951, 50):
        buffer.set_transform("odom", "base", stamp, Pose3(0, float(stamp), 0))
    buffer.fix("base", "tool", Pose3(0, 0, 1))
    assert buffer.newest_common("map", "tool") == 950
    assert buffer.lookup("map", "tool") == Pose3(950, 950, 1)
    assert buffer.newest_common("base", "tool") == 0
    assert buffer.lookup("base", "tool") == Pose3(0, 0, 1)


def test_an_edge_forgets_what_is_older_than_its_cache() -> None:
    buffer = TransformBuffer(cache=1e-6)
    for stamp in range(0, 5000, 10):
        assert buffer.set_transform("a", "b", stamp, Pose3(float(stamp), 0, 0))
        oldest = max(stamp - 1000, 0)
        assert isinstance(buffer.lookup("a", "b", oldest), Pose3)
        if oldest:
            assert reason(buffer.lookup("a", "b", oldest - 1)) == "past"
    assert not buffer.set_transform("a", "b", 3989, Pose3(0, 0, 0))
    assert buffer.set_transform("a", "b", 3995, Pose3(7, 0, 0))
    assert buffer.lookup("a", "b", 3995) == Pose3(7, 0, 0)


def test_a_static_edge_holds_at_all_times_and_the_last_word_counts() -> None:
    buffer = TransformBuffer()
    buffer.fix("a", "b", Pose3(1, 0, 0))
    assert buffer.lookup("a", "b", -(10**18)) == buffer.lookup("a", "b", 10**18) == Pose3(1, 0, 0)
    buffer.fix("a", "b", Pose3(2, 0, 0))
    assert buffer.lookup("a", "b", 5) == Pose3(2, 0, 0)
    buffer.set_transform("a", "b", 5, Pose3(3, 0, 0))
    assert buffer.lookup("a", "b", 5) == Pose3(3, 0, 0)
    assert reason(buffer.lookup("a", "b", 6)) == "one_value"
    buffer.fix("a", "b", Pose3(4, 0, 0))
    assert buffer.lookup("a", "b", 6) == Pose3(4, 0, 0)


def test_a_second_value_for_a_stamp_takes_the_place_of_the_first() -> None:
    buffer = TransformBuffer()
    for x in (1.0, 2.0):
        for stamp in (-7, 3):
            assert buffer.set_transform("a", "b", stamp, Pose3(x, 0, 0))
    assert buffer.lookup("a", "b", -2) == Pose3(2, 0, 0)


def test_a_frame_may_change_its_parent() -> None:
    """The prop is taken from the table at 100 ns; until 200 ns the older value holds."""
    buffer = TransformBuffer()
    buffer.fix("map", "table", Pose3(10, 0, 0))
    buffer.fix("map", "hand", Pose3(20, 0, 0))
    buffer.set_transform("table", "prop", 0, Pose3(0, 1, 0))
    buffer.set_transform("table", "prop", 100, Pose3(0, 2, 0))
    buffer.set_transform("hand", "prop", 200, Pose3(0, 3, 0))
    buffer.set_transform("hand", "prop", 300, Pose3(0, 4, 0))
    assert buffer.lookup("map", "prop", 50) == Pose3(10, 1.5, 0)
    assert buffer.lookup("map", "prop", 150) == Pose3(10, 2, 0)
    assert buffer.lookup("map", "prop", 200) == Pose3(20, 3, 0)
    assert buffer.lookup("map", "prop", 250) == Pose3(20, 3.5, 0)
    assert buffer.lookup("map", "prop") == Pose3(20, 4, 0)


def test_a_parent_change_is_forgotten_with_the_values() -> None:
    buffer = TransformBuffer(cache=1e-6)
    buffer.set_transform("left", "b", 0, Pose3(1, 0, 0))
    for stamp in range(10, 20000, 10):
        buffer.set_transform("right", "b", stamp, Pose3(2, 0, 0))
    assert buffer.lookup("right", "b", 19_995 - 10) == Pose3(2, 0, 0)
    assert reason(buffer.lookup("left", "b", 19_985)) == "unconnected"


def test_frames_that_are_not_connected_are_both_named() -> None:
    buffer = TransformBuffer()
    buffer.fix("map", "base", Pose3(0, 0, 0))
    buffer.fix("vive", "tracker", Pose3(0, 0, 0))
    found = buffer.lookup("base", "tracker", 0)
    assert reason(found) == "unconnected"
    assert "base" in str(found)
    assert "tracker" in str(found)
    assert reason(buffer.lookup("base", "tracker")) == "unconnected"
    assert reason(buffer.lookup("base", "nobody", 0)) == "unknown"
    assert reason(buffer.lookup("nobody", "nobody", 0)) == "unknown"
    assert reason(buffer.lookup("nobody", "nobody")) == "unknown"
    assert buffer.lookup("vive", "vive", 0) == Pose3(0, 0, 0)


def test_a_loop_ends_the_search() -> None:
    buffer = TransformBuffer()
    buffer.fix("map", "base", Pose3(0, 0, 0))
    for parent, child in (("a", "b"), ("b", "c"), ("c", "a")):
        buffer.set_transform(parent, child, 0, Pose3(0, 0, 0))
    assert reason(buffer.lookup("map", "a", 0)) == "loop"
    assert reason(buffer.lookup("a", "base")) == "loop"


@pytest.mark.parametrize(
    ("pose", "what"),
    [
        (Pose3(math.nan, 0, 0), "not finite"),
        (Pose3(0, math.inf, -math.inf), "not finite"),
        (Pose3(0, 0, 0, 0, 0, 0, math.nan), "not finite"),
        (Pose3(0, 0, 0, 0, 0, 0, 0), "length 0"),
        (Pose3(0, 0, 0, 0, 0, 0.5, 1), "length 1.12"),
    ],
)
def test_what_is_no_pose_is_refused(pose: Pose3, what: str) -> None:
    buffer = TransformBuffer()
    with pytest.raises(ValueError, match=what):
        buffer.set_transform("a", "b", 0, pose)
    with pytest.raises(ValueError, match=what):
        buffer.fix("a", "b", pose)
    assert reason(buffer.lookup("a", "b")) == "unknown"


def test_a_frame_is_not_its_own_parent() -> None:
    with pytest.raises(ValueError, match="its own parent"):
        TransformBuffer().set_transform("a", "a", 0, Pose3(0, 0, 0))


def test_quaternions_that_are_nearly_units_are_made_units() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("a", "b", 0, Pose3(0, 0, 0, 0, 0, 0, 1.009))
    assert buffer.lookup("a", "b", 0) == Pose3(0, 0, 0)


def test_a_million_metres_away_nothing_changes_but_the_place() -> None:
    chance = random.Random(8)
    near, far = TransformBuffer(), TransformBuffer()
    for stamp in (0, 1000):
        pose = random_pose(chance)
        near.set_transform("map", "base", stamp, pose)
        far.set_transform("map", "base", stamp, Pose3(1e6, -1e6, 0) @ pose)
    here, there = near.lookup("map", "base", 321), far.lookup("map", "base", 321)
    assert isinstance(here, Pose3)
    assert isinstance(there, Pose3)
    assert (Pose3(1e6, -1e6, 0) @ here).distance_to(there) < 1e-9
    assert here.angle_to(there) < 1e-12


def test_a_long_cache_does_not_slow_a_lookup() -> None:
    """Counted, not timed: halving a hundred times longer list takes seven comparisons more."""

    class Counted(int):
        asked = 0

        def __lt__(self, other: int) -> bool:
            Counted.asked += 1
            return int(self) < int(other)

        def __gt__(self, other: int) -> bool:
            Counted.asked += 1
            return int(self) > int(other)

    def comparisons(length: int) -> int:
        buffer = TransformBuffer(cache=1e9)
        for n in range(length):
            buffer.set_transform("a", "b", Counted(10 * n), Pose3(0, 0, 0))
        Counted.asked = 0
        assert isinstance(buffer.lookup("a", "b", 5 * length + 5), Pose3)
        return Counted.asked

    assert comparisons(30_000) <= comparisons(300) + 2 * 8
