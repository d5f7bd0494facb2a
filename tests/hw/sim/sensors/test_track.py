"""Past poses of a body, as sensors look back at them."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, wrap
from hw.sim.sensors.track import KEPT_NS, Track, knots

MS = 1_000_000


@given(
    start=st.floats(-3.1, 3.1), rate=st.floats(-3.0, 3.0), asked=st.floats(0.0, 1.0),
    count=st.integers(1, 500),
)  # fmt: skip
@settings(deadline=None, max_examples=60)
def test_a_body_that_turns_on_and_on_is_seen_turning_evenly(
    start: float, rate: float, asked: float, count: int
) -> None:
    track = Track(Pose2(0.0, 0.0, start))
    for n in range(1, count + 1):
        track.note(10 * n * MS, Pose2(0.01 * n, 0.0, wrap(start + rate * 0.01 * n)))

    at_s = 0.01 * count * asked
    x, _, yaw = track.held(round(at_s * 1e9))
    assert x == pytest.approx(at_s, abs=1e-8)
    assert yaw == pytest.approx(start + rate * at_s, abs=1e-6)
    turns = [b - a for a, b in pairwise(knots(track.past, 0, 10 * count * MS)[:, 3].tolist())]
    assert max(map(abs, turns)) <= abs(rate) * 0.01 + 1e-9


def test_it_forgets_what_is_long_ago_and_holds_on_beyond_its_ends() -> None:
    track = Track(Pose2(0.0, 0.0))
    for n in range(1, 2000):
        track.note(10 * n * MS, Pose2(n * 1e-3, 0.0, math.pi))

    rows, first, _ = track.past
    assert rows[first, 0] == 19_990 * MS - KEPT_NS - 10 * MS
    assert track.held(0)[0] == pytest.approx(rows[first, 0] * 1e-10)
    assert track.held(10**12)[0] == pytest.approx(1.999)


def test_who_stands_takes_no_room_and_the_last_of_an_instant_counts() -> None:
    track = Track(Pose2(0.0, 0.0))
    for n in range(1, 9):
        track.note(n * MS, Pose2(1.0, 0.0))
    track.note(9 * MS, Pose2(2.0, 0.0))
    track.note(9 * MS, Pose2(3.0, 0.0))

    assert track.held(8 * MS)[0] == 1.0
    assert track.held(9 * MS)[0] == 3.0
    assert len(knots(track.past, 0, 9 * MS)) <= 5


@given(
    steps=st.lists(
        st.tuples(st.integers(0, 3), st.integers(-1, 1), st.sampled_from([0.0, 3.0, -3.0])),
        min_size=1, max_size=3000,
    ),
    asked=st.lists(st.integers(-5, 9000), min_size=1, max_size=20),
)  # fmt: skip
@settings(deadline=None, max_examples=30)
def test_a_pose_is_on_the_line_between_the_two_around_it(
    steps: list[tuple[int, int, float]], asked: list[int]
) -> None:
    """Against a list of all poses that were noted, where the last of an instant counts."""
    track, now, x, every = Track(Pose2(0.0, 0.0)), 0, 0.0, {0: (0.0, 0.0)}
    for later, ahead, yaw in steps:
        now, x = now + later, x + ahead
        track.note(now, Pose2(x, 0.0, yaw))
        last = every[max(every)][1]
        every[now] = x, last + wrap(yaw - last)
    stamps = sorted(every)
    for stamp in asked:
        before = max((at for at in stamps if at <= stamp), default=stamps[0])
        after = min((at for at in stamps if at >= stamp), default=stamps[-1])
        share = 0.0 if before == after else (stamp - before) / (after - before)
        expected = [a + share * (b - a) for a, b in zip(every[before], every[after], strict=True)]
        found_x, _, found_yaw = track.held(stamp)
        assert (found_x, found_yaw) == pytest.approx(expected, abs=1e-9)
