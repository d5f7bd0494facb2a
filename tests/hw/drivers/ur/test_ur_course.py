"""How an arm is led along its course: on it, no faster, and slowed down no harder than it can."""

import itertools
import math

import pytest
from hypothesis import given, strategies as st

from hw.drivers.ur.course import CourseRun, mode_of

CYCLE = 0.008
MOST = 16.0

joints = st.tuples(*[st.floats(-2.0, 2.0)] * 3)


def timed(corners, speed=2.0):
    """A course through corners, with a point each cycle and no joint faster than `speed`."""
    points, time = [(0.0, corners[0])], 0.0
    for a, b in itertools.pairwise(corners):
        way = max(abs(q - p) for p, q in zip(a, b, strict=True))
        count = max(1, math.ceil(way / speed / CYCLE))
        for k in range(1, count + 1):
            time += CYCLE
            here = tuple(p + k / count * (q - p) for p, q in zip(a, b, strict=True))
            points.append((time, here))
    return points


def off(points, joints):
    """How far joints are from the way through some points."""
    return min(_to_piece(a, b, joints) for (_, a), (_, b) in itertools.pairwise(points))


def _to_piece(a, b, joints):
    way = [q - p for p, q in zip(a, b, strict=True)]
    length = sum(w * w for w in way)
    share = sum(w * (j - p) for w, j, p in zip(way, joints, a, strict=True)) / (length or 1.0)
    share = min(1.0, max(0.0, share))
    return math.dist([p + share * w for p, w in zip(a, way, strict=True)], joints)


def test_left_alone_it_is_where_the_course_says_and_ends_at_its_last_point():
    points = timed([(0.0, 0.0, 0.0), (1.0, -0.5, 0.0)])
    run = CourseRun(points, MOST)
    for _, wanted in points[1:]:
        assert not run.over
        assert run.step(CYCLE, 1.0) == pytest.approx(wanted)
    assert run.step(CYCLE, 1.0) == points[-1][1]
    assert run.over


@given(
    st.lists(joints, min_size=2, max_size=4, unique=True),
    st.lists(st.floats(-0.5, 1.5), max_size=300),
    st.none() | st.integers(0, 300),
)
def test_whatever_it_is_slowed_down_by_it_stays_on_its_way_and_within_its_speed(
    corners, rates, stop
):
    points = timed(corners)
    run, before = CourseRun(points, MOST), points[0][1]
    for n, rate in enumerate(rates):
        if n == stop:
            run.stop()
        here = run.step(CYCLE, rate)
        assert off(points, here) < 1e-9
        assert max(abs(b - a) for a, b in zip(before, here, strict=True)) <= 2.0 * CYCLE + 1e-9
        before = here


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=200))
def test_along_a_straight_way_it_is_slowed_down_and_sped_up_no_harder_than_it_can_be(rates):
    run = CourseRun(timed([(0.0, 0.0, 0.0), (2.0, 1.0, 0.0)]), MOST)
    places = [run.step(CYCLE, rate)[0] for rate in rates]
    speeds = [(b - a) / CYCLE for a, b in itertools.pairwise([0.0, *places])]
    for a, b in itertools.pairwise([2.0, *speeds]):
        if not run.over:
            assert abs(b - a) <= MOST * CYCLE * (1.0 + 1e-6)


@pytest.mark.requirement(45)
@given(st.integers(0, 100))
def test_a_stop_stands_within_a_fifth_of_a_second(cycles):
    run = CourseRun(timed([(0.0, 0.0, 0.0), (2.0, 2.0, -2.0)], 3.14), MOST)
    for _ in range(cycles):
        run.step(CYCLE, 1.0)
    run.stop()
    for _ in range(25):
        run.step(CYCLE, 1.0)
    assert run.over
    assert run.step(CYCLE, 1.0) == run.joints


def test_at_half_the_speed_it_takes_twice_as_long():
    points = timed([(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)])
    run, cycles = CourseRun(points, MOST), 0
    while not run.over:
        run.step(CYCLE, 0.5)
        cycles += 1
    assert cycles == pytest.approx(2 * (len(points) - 1), abs=10)


@pytest.mark.parametrize(
    ("bits", "mode"),
    [
        ([0], "normal"),
        ([1], "reduced"),
        ([0, 1], "reduced"),
        ([3], "recovery"),
        ([2, 10], "protective_stop"),
        ([4, 10], "safeguard_stop"),
        ([0, 4], "safeguard_stop"),
        ([6, 7, 10], "emergency_stop"),
        ([5, 10], "emergency_stop"),
        ([2, 4, 7], "emergency_stop"),
        ([8], "fault"),
        ([9, 10], "fault"),
        ([10], "unknown"),
        ([0, 10], "unknown"),
        ([], "unknown"),
    ],
)
def test_safety_bits_are_read_as_the_gravest_of_them(bits, mode):
    assert mode_of(sum(1 << bit for bit in bits)) == mode
