"""Close drives and the gap to who walks: by hand, and of runs by shapely and by the chart."""

from __future__ import annotations

import copy
import itertools
import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, strategies as st

from cobodeck.evaluate.metrics import MOVING, Evaluator
from cobodeck.evaluate.proximity import BESIDE_M, CLOSE_M, DriveWatch, WalkingGap
from cobodeck.loop.loop import Loop
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from hw.geometry import Pose2
from hw.model.robot import load_robot
from hw.truth import Truth

OUTLINE = load_robot("rbkairos_ur10").footprint
LENGTH, WIDTH = OUTLINE.half_length, OUTLINE.half_width
PERSON_M = 0.5
SECOND = 10**9
TENTH = SECOND // 10


def passed(
    gaps: list[float], speed: float = 0.0, yaw: float = 0.0, still: float = 0.0
) -> dict[str, Any]:
    """A drive along the x axis: each tenth of a second this far before somebody at the origin."""
    watch = DriveWatch(OUTLINE, still)
    before = None
    for n, gap in enumerate(gaps):
        half = WIDTH if yaw else LENGTH
        base = Pose2(-gap - PERSON_M - half, 0.0, yaw)
        if n == 0:
            watch.begin(0, base)
        elif base != before:
            watch.watch(n * TENTH, Truth(body=Pose2(0.0, 0.0), speed=speed), base)
        before = base
    return watch.report()


def test_the_time_of_a_close_drive_and_that_beside_the_person() -> None:
    """Moves from 0.1 s to 0.6 s; nearer than 0.4 m at 0.3 to 0.5 s."""
    gaps = [1.0, 0.9, 0.5, 0.39, 0.3, 0.2, 0.45, 0.45, 0.45]

    for yaw in (0.0, math.pi / 2):
        found = passed(gaps, yaw=yaw)
        assert found == {"number": 1, "mean_s": 0.5, "below_0_4_m_s": pytest.approx(0.3)}


@pytest.mark.parametrize(
    ("gaps", "speed", "number"),
    [
        ([1.0, CLOSE_M + 0.01], 0.0, 0),
        ([1.0, CLOSE_M - 0.01], 0.0, 1),
        ([1.0, CLOSE_M - 0.01], MOVING + 0.01, 0),  # who walks is no drive's business
        ([0.1, 0.1, 0.1], 0.0, 0),  # to stand beside somebody is no drive
        ([1.0, 0.3, *[0.3] * 4, 0.2], 0.0, 1),  # a pause of half a second
        ([1.0, 0.3, *[0.3] * 5, 0.2], 0.0, 2),  # a longer one
    ],
)
def test_what_counts_as_a_close_drive(gaps: list[float], speed: float, number: int) -> None:
    assert passed(gaps, speed)["number"] == number


def test_each_request_begins_anew_and_what_is_not_known_is_null() -> None:
    watch, truth = DriveWatch(OUTLINE), Truth(body=Pose2(0.0, 0.0))
    for n in range(2):
        watch.begin(4 * n * TENTH, Pose2(-2.0, 0.0))
        watch.watch((4 * n + 1) * TENTH, truth, Pose2(-1.3, 0.0))

    assert watch.report()["number"] == 2
    assert passed([1.0, 0.9]) == {"number": 0, "mean_s": None, "below_0_4_m_s": None}
    assert set(DriveWatch().report().values()) == {None}


class Course:
    """An observer that keeps what the truth was at each tick."""

    def __init__(self, loop: Loop) -> None:
        self._plant, self.kept = loop.plant, list[tuple[int, Truth]]()

    def watch(self, now_ns: int) -> None:
        self.kept.append((now_ns, copy.copy(self._plant.truth)))  # type: ignore[arg-type]


def gap_of(base: Pose2, body: Pose2) -> float:
    box = shapely.affinity.rotate(
        shapely.box(-LENGTH, -WIDTH, LENGTH, WIDTH), base.yaw, (0, 0), use_radians=True
    )
    there = shapely.Point(body.x - base.x, body.y - base.y)
    return float(shapely.distance(box, there)) - PERSON_M


@pytest.fixture(scope="module")
def ran() -> tuple[Loop, Course, dict[str, Any]]:
    """A first request in a narrow place, served by a close drive."""
    loop = stage(open_setup(scene="lab_a"), Options("random", requests=1, seed=2))
    course = Course(loop)
    loop.observers = (*loop.observers, course)
    loop.go(40 * SECOND)
    evaluator = next(o for o in loop.observers if isinstance(o, Evaluator))
    evaluator.finish()
    return loop, course, evaluator.report()


def test_the_close_drive_of_a_run_is_that_of_its_chart(ran: Any) -> None:
    loop, course, found = ran
    trace = [line for line in loop.wired.run.trace if line.subject == "haptic/serve/drive_close"]
    times = {line.kind: line.time for line in trace}
    entered, ended = times["enter"] / 1e9, times["outcome"] / 1e9
    drives = found["close_drives"]

    assert drives["number"] == sum(line.kind == "enter" for line in trace) == 1
    assert drives["mean_s"] == pytest.approx(ended - entered, abs=0.25)  # it comes to rest later
    kept = [row for row in course.kept if entered <= row[0] / 1e9 <= ended + 0.3]
    beside = sum(
        (now - before) / 1e9
        for (before, was), (now, t) in itertools.pairwise(kept)
        if was.base != t.base and gap_of(t.base, t.body) < BESIDE_M
    )
    assert drives["below_0_4_m_s"] == pytest.approx(beside, abs=1e-6)


def test_the_least_gap_to_who_walks_is_that_of_the_course(ran: Any) -> None:
    _, course, found = ran
    walked = [
        gap_of(t.base.between(u.base, share), t.body.between(u.body, share))
        for (_, t), (_, u) in itertools.pairwise(course.kept)
        if u.speed > MOVING
        for share in (0.0, 0.5, 1.0)
    ]

    assert found["least_gap_walking_m"] == pytest.approx(min(walked), abs=2e-3)
    assert found["least_gap_walking_m"] >= found["min_gap_m"] - 1e-3


class Source:
    """Gives the truth that it is told."""

    truth: Truth | None = None


@given(
    st.lists(
        st.tuples(st.integers(-20, 20), st.integers(-20, 20), st.floats(-3.0, 3.0), st.booleans()),
        min_size=2,
        max_size=15,
    )
)
def test_only_gaps_to_who_walks_count_however_the_robot_comes_near(
    rows: list[tuple[int, int, float, bool]],
) -> None:
    """In steps of less than `proximity.STEP_M`, as the world makes them."""
    source = Source()
    evaluator = Evaluator(source, True, walking_gap=WalkingGap(OUTLINE))
    places, x, y, yaw = [], 2.0, 0.0, 0.0
    for n, (dx, dy, turn, walks) in enumerate(rows):
        x, y, yaw = x + 0.01 * dx, y + 0.01 * dy, yaw + 0.02 * turn
        places.append((Pose2(x, y, yaw), walks))
        speed = 1.0 if walks else 0.0
        source.truth = Truth(base=places[-1][0], body=Pose2(0.0, 0.0), speed=speed)
        evaluator.watch(n * TENTH)
    found = evaluator.report()["least_gap_walking_m"]

    body = Pose2(0.0, 0.0)
    gaps = [
        gap_of(a.between(b, share), body)
        for (a, _), (b, walks) in itertools.pairwise([places[0], *places])
        if walks
        for share in np.linspace(0.0, 1.0, 11)
    ]
    if not gaps:
        assert found is None
        return
    assert found == pytest.approx(min(gaps), abs=3e-3)
