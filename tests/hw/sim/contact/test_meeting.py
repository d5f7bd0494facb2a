"""Chairs and people that no map shows: the robot runs into them, and scanners see them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from hw.geometry import STILL, Pose2, Twist2
from hw.scene.objects import Thing
from tests.hw.sim.driven import HALL, PERFECT, ROBOT, Driven, ticks

OUT = ROBOT.footprint.half_length
START = HALL.robot_start


def with_things(*things: Thing):
    return replace(HALL, robot_start=Pose2(7.0, 7.0, 0.0), objects=things)


def ahead(now: int) -> Twist2:
    return Twist2(0.8, 0.0, 0.0)


def driven(*things: Thing, command=ahead, seconds: float = 6.0, asked=()) -> Driven:
    run = Driven(
        PERFECT, scene=with_things(*things), command=command, asked=[*asked, "bumper"],
        instants=ticks(seconds),
    )  # fmt: skip
    assert run.world.collisions.wall_hits == 0
    return run


@pytest.mark.requirement(4, 5)
def test_a_robot_runs_into_a_chair_once_and_stands() -> None:
    run = driven(Thing("chair", (9.0, 7.1)), seconds=2.6)
    truth = run.world.truth
    assert (truth.object_hits, truth.wall_hits, truth.contacts) == (1, 0, ())
    assert truth.base.x == pytest.approx(9.0 - 0.25 - OUT, abs=0.03)
    assert run.world.parts["stop_line"].reason == "bumper: object"
    assert len(run.got["bumper.hit"]) == 1


def test_a_chair_that_appears_is_hit_only_then() -> None:
    late = driven(Thing("chair", (8.0, 7.0), appears=4.0), seconds=5.0)
    gone = driven(Thing("chair", (9.0, 7.0), leaves=1.0), seconds=5.0)
    free = driven(seconds=5.0)
    assert late.world.collisions.object_hits == gone.world.collisions.object_hits == 0
    assert late.world.base.pose == gone.world.base.pose == free.world.base.pose


def test_a_robot_gets_away_from_a_chair_that_was_put_against_it() -> None:
    away = driven(Thing("chair", (7.7, 7.0)), command=lambda _: Twist2(-0.5, 0.0, 0.0), seconds=2.0)
    assert away.world.collisions.object_hits == 0
    assert away.world.base.pose.x < 6.5
    assert driven(Thing("chair", (7.7, 7.0)), seconds=1.0).world.collisions.object_hits == 1


def test_people_are_touched_by_name_and_a_touch_counts_once() -> None:
    run = driven(Thing("chair", (2.0, 2.0)), Thing("person", (9.0, 7.0)))
    (contact,) = run.world.collisions.contacts
    assert (contact.who, contact.part, contact.by, contact.granted) == (
        "person_2", "base", "robot", False,
    )  # fmt: skip
    assert contact.x == pytest.approx(8.5, abs=0.02)
    assert contact.robot_closing == pytest.approx(0.8, abs=0.05)
    assert run.world.collisions.object_hits == 0
    assert run.world.parts["stop_line"].reason == "bumper: person"
    # what counts as the least distance is that of the user
    assert run.world.collisions.min_gap > 3.0


def test_somebody_who_walks_into_a_standing_robot_has_done_it() -> None:
    walker = Thing("person", (12.0, 7.0), walks=((9.0, 7.0), (2.0, 7.0)), speed=1.2)
    run = driven(walker, command=lambda _: STILL, seconds=8.0)
    (contact,) = run.world.collisions.contacts
    assert (contact.who, contact.by) == ("person_1", "person")
    assert contact.person_closing == pytest.approx(1.2, abs=1e-6)
    assert contact.at_ns == pytest.approx((12.0 - 7.0 - OUT - 0.5) / 1.2 * 1e9, abs=1e6)
    # once they are gone the operator lets the robot go on
    assert run.world.parts["stop_line"].reason is None
    ((who, other),) = run.world.truth.others
    assert who == "person_1"
    assert (other.x, other.y) == pytest.approx((12.0 - 8.0 * 1.2, 7.0), abs=0.05)


def test_a_robot_is_pushed_off_somebody_who_stays() -> None:
    run = driven(Thing("person", (9.0, 7.0)), seconds=14.0, command=lambda now: (
        ahead(now) if now < 3_000_000_000 else STILL
    ))  # fmt: skip
    assert len(run.world.collisions.contacts) == 1
    assert run.world.parts["stop_line"].reason is None
    assert 9.0 - 0.5 - OUT - run.world.base.pose.x > 0.0


@pytest.mark.requirement(51)
def test_scanners_see_what_appears_and_where_somebody_walks() -> None:
    chair = Thing("chair", (9.0, 7.0), appears=1.0)
    walker = Thing("person", (7.0, 9.0), walks=((9.0, 10.0),), speed=0.5, again=True)
    run = driven(chair, walker, command=lambda _: STILL, seconds=2.0, asked=["lidar"])
    seen = {"chair": 0, "person": 0}
    for stamp, scan in run.values("base.scan"):
        sensor = run.world.base.pose @ ROBOT.sensing.mount(scan.sensor)
        for n, r in enumerate(scan.ranges):
            angle = scan.start + n * scan.step
            x, y = sensor.transform(r * math.cos(angle), r * math.sin(angle))
            place = walker.place(stamp + round(n * scan.beam_time * 1e9))
            if abs(math.dist((x, y), (9.0, 7.0)) - 0.25) < 1e-3:
                seen["chair"] += 1
                assert stamp > 0.93e9
            elif abs(math.dist((x, y), place) - 0.5) < 2e-3:
                seen["person"] += 1
            else:
                assert min(x, y, 14.0 - x, 14.0 - y) < 1e-3 or math.dist((x, y), (13.4, 0.6)) < 0.51
    assert seen["chair"] > 50
    assert seen["person"] > 100
