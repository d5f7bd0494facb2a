"""Each request of a run: its arm time and its part of the way, against oracles on raw poses."""

from __future__ import annotations

import copy
import itertools
import math
from typing import Any

import pytest
from hypothesis import given, strategies as st

from cobodeck.evaluate.evaluators import STILL
from cobodeck.evaluate.metrics import Evaluator
from cobodeck.evaluate.proximity import DriveWatch
from cobodeck.evaluate.requests import RequestWatch
from cobodeck.loop.loop import Loop
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from hw.geometry import Pose2, Pose3
from hw.truth import Truth

SECOND = 10**9
DEEP = Pose3(1.0, 0.0, 1.5)
ELSEWHERE, ARMED = Pose3(9.0, 0.0, 1.5), (0.0,) * 6


def watched(
    steps: list[tuple[float, Pose2, bool, bool]], still: float = 0.0
) -> list[dict[str, Any]]:
    """The requests after instants: time, s; base; whether a request, and the prop, is there."""
    there = False
    watch = RequestWatch(
        lambda base, joints: DEEP if there else ELSEWHERE, base=DriveWatch(still=still)
    )
    way, before = 0.0, steps[0][1]
    for at_s, base, asks, there in steps:  # noqa: B007  `there` is read by the arm
        way += base.distance_to(before)
        before = base
        truth = Truth(
            base=base,
            joints=tuple(ARMED),
            request=DEEP if asks else None,
            body=Pose2(at_s, 0.0),
            distance_m=way,
        )
        watch.watch(round(at_s * SECOND), truth)
    watch.end(round(steps[-1][0] * SECOND), truth)
    found: list[dict[str, Any]] = watch.report(way)["request_list"]
    return found


@pytest.mark.requirement(142)
@pytest.mark.parametrize(
    ("xs", "arm_s"),
    [
        ((2.0, 1.5, 1.2, 1.2, 1.2), 2.0),  # seen to move last at 3 s, served at 5 s
        ((1.2, 1.2, 1.2, 1.2, 1.2), 4.0),  # it stands already: from the request on
        ((2.0, 1.5, 1.4, 1.3, 1.2), 0.0),  # the prop is there while the base still moves
        ((1.2, 1.2, 1.2, 1.3, 1.3), 1.0),  # the last motion counts
    ],
)
def test_the_arm_s_part_begins_where_the_base_has_come_to_stand(
    xs: tuple[float, ...], arm_s: float
) -> None:
    steps = [(n + 1.0, Pose2(x, 0.0), True, n == 4) for n, x in enumerate(xs)]

    (found,) = watched([*steps, (7.0, Pose2(xs[-1] + 0.5, 0.0), True, True)])

    assert found["arm_s"] == arm_s
    assert found["response_s"] == 4.0
    assert (found["deep"], found["user"]) == ([1.0, 0.0, 1.5], [1.0, 0.0, 0.0])


def test_a_rotation_is_motion_and_noise_of_a_measured_pose_is_none() -> None:
    turning = [(1.0, Pose2(1.2, 0.0), True, False), (3.0, Pose2(1.2, 0.0, 0.02), True, False)]
    noisy = [(4.0, Pose2(1.2, 0.9 * STILL, 0.02 - 0.9 * STILL), True, False)]
    served = [(6.0, Pose2(1.2, 0.0, 0.02), True, True)]

    assert watched([*turning, *noisy, *served], STILL)[0]["arm_s"] == 3.0
    assert watched([*turning, *noisy, *served])[0]["arm_s"] == 0.0
    assert watched([*turning, *served])[0]["arm_s"] == 3.0


def test_what_was_not_served_has_no_arm_time() -> None:
    (found,) = watched([(1.0, Pose2(1.2, 0.0), True, False), (2.0, Pose2(1.2, 0.0), True, False)])

    assert (found["served"], found["response_s"], found["arm_s"]) == (False, None, None)


steps_of = st.lists(
    st.tuples(st.integers(-4, 4), st.integers(1, 5), st.booleans(), st.booleans()),
    min_size=1,
    max_size=20,
)


@given(steps_of)
def test_the_ways_of_the_requests_add_up_to_that_of_the_run(
    rows: list[tuple[int, int, bool, bool]],
) -> None:
    """Cells of a quarter of a metre; each step is an instant."""
    x, at_s, steps = 0, 0.0, []
    for dx, wait, asks, there in rows:
        x, at_s = x + dx, at_s + wait
        steps.append((at_s, Pose2(1.0 + 0.25 * x, 0.0), asks, there))

    found = watched(steps)

    gone = [0.25 * abs(row[0]) for row in rows]
    asks = [row[2] for row in rows]
    ends = [n for n in range(1, len(rows)) if asks[n - 1] and not asks[n]]
    begun = [n for n in range(len(rows)) if asks[n] and not (n and asks[n - 1])]
    assert [one["asked_s"] for one in found] == [steps[n][0] for n in begun]
    gone[0] = 0.0  # the run begins at the first instant
    cuts = [0, *(n + 1 for n in ends)][: len(begun)]
    parts = [sum(gone[a:b]) for a, b in itertools.pairwise([*cuts, len(rows)])] if begun else []
    assert [one["travelled_m"] for one in found] == pytest.approx(parts)


class Course:
    """An observer that keeps what the truth was at each tick."""

    def __init__(self, loop: Loop) -> None:
        self._plant, self.kept = loop.plant, list[tuple[float, Truth]]()

    def watch(self, now_ns: int) -> None:
        self.kept.append((now_ns / 1e9, copy.copy(self._plant.truth)))  # type: ignore[arg-type]


def test_the_requests_of_a_run_are_those_of_its_course() -> None:
    loop = stage(open_setup(scene="study"), Options(requests=2, seed=5))
    course = Course(loop)
    loop.observers = (*loop.observers, course)
    loop.go(100 * SECOND)
    evaluator = next(o for o in loop.observers if isinstance(o, Evaluator))
    evaluator.finish()
    found = evaluator.report()

    rows = course.kept
    starts = [n for n in range(1, len(rows)) if rows[n][1].request and not rows[n - 1][1].request]
    assert len(found["request_list"]) == len(starts) == 2
    for told, n in zip(found["request_list"], starts, strict=True):
        asked_s, truth = rows[n]
        deep = truth.request
        assert deep is not None
        assert (told["asked_s"], told["deep"]) == (asked_s, [deep.x, deep.y, deep.z])
        served_s = asked_s + told["response_s"]
        bases = [(at, t.base) for at, t in rows if asked_s <= at <= served_s + 1e-9]
        moved = [at for (_, a), (at, b) in itertools.pairwise(bases) if a != b]
        assert told["arm_s"] == pytest.approx(served_s - max(moved))
        arm = [t.arm_moving for at, t in rows if max(moved) < at <= served_s]
        assert sum(arm) / len(arm) > 0.9  # it is the arm that moves then
        assert told["user"][:2] == [truth.body.x, truth.body.y]  # type: ignore[union-attr]
    ways = [told["travelled_m"] for told in found["request_list"]]
    assert math.fsum(ways) == pytest.approx(found["distance_m"])
    assert min(ways) > 1.0
