"""Of several instants with the same truth the last one gives the same figures as all of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hypothesis import given, settings, strategies as st

from cobodeck.evaluate.arm_contact import ArmWatch
from cobodeck.evaluate.evaluators import arm_outline, prop_of
from cobodeck.evaluate.metrics import Evaluator
from cobodeck.evaluate.proximity import DriveWatch, WalkingGap
from cobodeck.evaluate.requests import RequestWatch
from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.truth import Truth

ROBOT = load_robot("rbkairos_ur10")
OUTLINE, PROP = arm_outline(ROBOT), prop_of(ROBOT)
REACHING = (0.3, -0.6, 0.9, -0.4, 1.2, 0.2)
TICK = 33_333_333
SERVED = PROP(Pose2(0.0, 0.0), REACHING)

Stretch = tuple[Truth, int]
"""A truth, and the number of instants at which it stays so."""


class Source:
    """Gives the truth that it is told."""

    truth: Truth | None = None


joints = st.sampled_from([REACHING, ROBOT.parked, (0.5, *REACHING[1:])])
PLACES = [(x, y) for x in (0.9, 1.1, 1.4, 2.2, 3.5) for y in (0.0, 0.6)]
bodies = st.sampled_from([Pose2(x, y) for x, y in PLACES])
truths = st.builds(
    Truth,
    base=st.sampled_from([Pose2(0.0, 0.0), Pose2(0.2, 0.0), Pose2(-2.0, 0.0, 0.4)]),
    joints=joints,
    arm_moving=st.booleans(),
    body=bodies,
    speed=st.sampled_from([0.0, 0.1, 0.7]),
    request=st.sampled_from([None, None, SERVED, Pose3(2.0, 0.0, 1.3)]),
    head_turn=st.sampled_from([0.0, 2.0]),
    informed=st.booleans(),
    min_gap=st.just(0.3),
    distance_m=st.sampled_from([None, 2.0]),
    contacts=st.just(()),
    others=st.just(()),
    seen_ns=st.none(),
    hits=st.none(),
    tracked_since_ns=st.none(),
)


def played(stretches: Sequence[Stretch], tracked: Sequence[bool], leaps: bool) -> Evaluator:
    """An evaluator that has seen each instant, or, of each stretch, the first one and the last."""
    source = Source()
    requests, outline = RequestWatch(PROP, base=DriveWatch(ROBOT.footprint)), ROBOT.footprint
    found = Evaluator(source, True, requests, ArmWatch(OUTLINE), walking_gap=WalkingGap(outline))
    n, seen, since = 0, None, None
    for (truth, count), tracks in zip(stretches, tracked, strict=True):
        for k in range(count):
            now = n * TICK
            if tracks:
                since = now if seen != now - TICK else since
                seen = now
            source.truth = truth._replace(seen_ns=seen, tracked_since_ns=since)
            if not leaps or k in (0, count - 1):
                found.watch(now)
            n += 1
    found.finish()
    return found


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(truths, st.integers(1, 40), st.booleans()), min_size=1, max_size=8))
def test_the_last_of_instants_alike_is_enough(rows: list[tuple[Truth, int, bool]]) -> None:
    stretches, tracked = [row[:2] for row in rows], [row[2] for row in rows]

    every, leaping = (played(stretches, tracked, leaps) for leaps in (False, True))

    assert leaping.report() == every.report()
    assert leaping.requests.unserved == every.requests.unserved


def test_a_drop_out_of_five_instants_is_one_and_a_leap_of_forty_is_none() -> None:
    still = Truth(base=Pose2(0.0, 0.0), joints=REACHING, body=Pose2(3.0, 0.0), contacts=())
    stretches = [(still, 40), (still, 5), (still, 40)]

    found = played(stretches, [True, False, True], leaps=True).report()["dropouts"]

    (gap,) = found
    assert (gap["from_s"], gap["to_s"]) == (39 * TICK / 1e9, 45 * TICK / 1e9)


def test_a_rotation_by_a_bit_is_motion_and_an_equal_pose_is_none() -> None:
    still = Truth(base=Pose2(0.0, 0.0, 0.1), body=Pose2(3.0, 0.0), joints=REACHING)
    again = still._replace(base=Pose2(0.0, 0.0, 0.1), body=Pose2(3.0, 0.0))
    moved = still._replace(base=Pose2(0.0, 0.0, math.nextafter(0.1, 1.0)))

    def hashed(*stretches: Stretch) -> str | None:
        return played(stretches, [False] * len(stretches), leaps=False).motion.sha256

    assert hashed((still, 3), (again, 2)) == hashed((still, 5)) != hashed((still, 4), (moved, 1))
    assert hashed((still, 5)) != hashed((still, 6))  # the last instant counts
