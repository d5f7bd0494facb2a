"""The evaluator's figures, for courses of events that are worked out by hand."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cobodeck.evaluate.arm_contact import ArmOutline, ArmWatch
from cobodeck.evaluate.figures import spread
from cobodeck.evaluate.metrics import Evaluator
from cobodeck.evaluate.requests import RequestWatch
from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.truth import Contact, Truth

SECOND = 10**9
ORIGIN, FAR = Pose2(0.0, 0.0), Pose2(9.0, 0.0)


def forearm(joints):
    """One level capsule of 5 cm, as far ahead of base_link as the first joint says."""
    return np.array([[[0.0, 0.0, 1.0], [joints[0], 0.0, 1.0]]]), np.array([0.05])


class Course:
    """A plant that is told what to look like, one second after the other."""

    def __init__(self, part: str = "forearm") -> None:
        self.truth = Truth(
            base=FAR,
            joints=(0.0,) * 6,
            body=ORIGIN,
            distance_m=0.0,
            energy_j=0.0,
            wall_hits=0,
            min_gap=3.0,
            contacts=(),
        )
        self.prop = Pose3(100.0, 0.0, 0.0)
        footprint = load_robot("rbkairos_ur10").footprint
        arm = ArmWatch(ArmOutline(forearm, (part,), "panel", footprint))
        self.requests = RequestWatch(lambda base, joints: self.prop)
        self.seen = Evaluator(self, True, self.requests, arm)
        self.now = 0

    def be(self, **known: Any) -> None:
        self.truth = self.truth._replace(**known)

    def see(self, at: float, robot: Pose2, speed: float = 1.0, turn: float = 0.0) -> None:
        self.now = round(at * SECOND)
        self.be(base=robot, speed=speed, head_turn=turn, seen_ns=self.now)
        self.seen.watch(self.now)


@pytest.fixture
def course() -> Course:
    return Course()


@pytest.mark.requirement(104)
@pytest.mark.parametrize(
    ("distance", "bearing", "turn", "speed", "counted"),
    [
        (2.49, 0.0, 0.0, 0.21, 1),
        (2.51, 0.0, 0.0, 0.21, 0),
        (2.49, math.radians(35.9), 0.0, 0.21, 1),
        (2.49, math.radians(36.1), 0.0, 0.21, 0),
        (2.49, math.radians(-35.9), 0.0, 0.21, 1),
        (1.49, math.pi, 0.0, 0.21, 1),
        (1.51, math.pi, 0.0, 0.21, 0),
        (2.0, math.pi / 2, math.pi / 2, 0.21, 1),  # the head looks at the robot
        (2.0, 0.0, math.pi / 2, 0.21, 0),  # the head looks away
        (1.0, 0.0, 0.0, 0.19, 0),  # a user who stands is in no danger
    ],
)
def test_an_escape_situation_is_a_moving_user_with_the_robot_in_a_zone(
    course: Course, distance: float, bearing: float, turn: float, speed: float, counted: int
) -> None:
    robot = Pose2(distance * math.cos(bearing), distance * math.sin(bearing))

    course.see(0.1, robot, speed, turn)

    assert course.seen.situations == counted


def test_time_to_safety_runs_until_neither_zone_holds(course: Course) -> None:
    for at, x, speed in [(0, 5, 1), (1, 2.4, 1), (2, 2.4, 0), (3, 1.2, 1), (4, 2.6, 1), (5, 2, 1)]:
        course.see(at, Pose2(x, 0.0), speed)

    assert course.seen.situations == 2
    assert course.seen.time_to_safety_s == [3.0]


@pytest.mark.requirement(114)
def test_signs_are_counted_when_they_come_and_those_to_standing_people_apart(
    course: Course,
) -> None:
    shown = [(1, False, 1.0), (2, True, 1.0), (3, True, 0.0), (4, False, 0.0), (5, True, 0.0)]
    for at, informed, speed in [*shown, (6, True, 1.0), (7, False, 0.0), (8, True, 0.21)]:
        course.be(informed=informed)
        course.see(at, FAR, speed)

    figures = course.seen.report()
    assert (figures["signs"], figures["signs_to_standing"]) == (3, 1)


def test_without_a_virtual_world_there_are_no_signs(course: Course) -> None:
    course.see(1, FAR)

    figures = course.seen.report()
    assert (figures["signs"], figures["signs_to_standing"]) == (None, None)


@pytest.mark.requirement(44, 135)
@pytest.mark.parametrize(
    ("off", "yaw", "served"),
    [(0.019, 0.0, 1), (0.021, 0.0, 0), (0.0, 0.099, 1), (0.0, 0.101, 0)],
)
def test_served_is_the_prop_within_2_cm_and_a_tenth_rad(
    course: Course, off: float, yaw: float, served: int
) -> None:
    deep = Pose3.from_yaw(1.0, 0.0, 1.5, 0.0)
    course.see(1, Pose2(1.5, 0.0), 0.0)
    course.be(request=deep)
    course.see(2, Pose2(1.5, 0.0), 0.0)
    course.prop = Pose3.from_yaw(1.0 + off, 0.0, 1.5, yaw)
    course.see(5, Pose2(1.5, 0.0), 0.0)
    course.see(6, Pose2(1.5, 0.0), 0.0)

    figures = course.seen.report()
    assert (figures["requests"], figures["served"]) == (1, served)
    assert figures["response_s"]["mean"] == (3.0 if served else None)


def test_a_prop_that_comes_after_the_release_serves_nobody(course: Course) -> None:
    course.be(request=Pose3(1.0, 0.0, 1.5))
    course.see(1, Pose2(1.5, 0.0), 0.0)
    course.be(request=None)
    course.prop = Pose3(1.0, 0.0, 1.5)
    course.see(2, Pose2(1.5, 0.0), 0.0)
    course.see(3, Pose2(1.5, 0.0), 0.0)

    assert course.seen.report()["served"] == 0


@pytest.mark.requirement(44)
def test_the_error_of_a_served_request_is_that_of_the_prop_once_the_arm_stands(
    course: Course,
) -> None:
    course.be(request=Pose3(1.0, 0.0, 1.2))
    for at, off, turned, moving in [
        (1, 0.5, 0.0, False),
        (2, 0.015, 0.05, True),
        (3, 0.002, 0.01, True),
        (4, 0.006, 0.01, False),  # no more than a pause
        (4.05, 0.005, 0.01, True),
        (5, 0.009, 0.03, False),
        (5.1, 0.008, 0.02, False),
        (6, 0.001, 0.0, False),
        (7, 0.3, 0.0, True),
    ]:
        course.prop = Pose3.from_yaw(1.0 + off, 0.0, 1.2, turned)
        course.be(arm_moving=moving)
        course.see(at, Pose2(1.5, 0.01 * at), 0.0)

    figures = course.seen.report()

    assert figures["response_s"]["mean"] == 1.0
    assert figures["prop_error_m"]["max"] == pytest.approx(0.008)
    assert figures["prop_error_rad"]["max"] == pytest.approx(0.02)


def test_an_arm_that_does_not_come_to_stand_has_no_error(course: Course) -> None:
    course.prop = Pose3(1.0, 0.0, 1.2)
    for at, request in [(1, course.prop), (2, None), (3, Pose3(2.0, 0.0, 1.2))]:
        course.be(request=request, arm_moving=at < 2)
        course.see(at, Pose2(1.5, 0.0), 0.0)

    figures = course.seen.report()
    assert figures["served"] == 1
    assert figures["prop_error_m"]["mean"] is None


def test_a_request_is_served_once(course: Course) -> None:
    deep = Pose3(1.0, 0.0, 1.5)
    for begin in (1, 11):
        course.prop = deep
        course.be(request=Pose3(1.0, 0.0, 1.5))
        for second in range(5):
            course.see(begin + second, Pose2(1.5, 0.0), 0.0)
        course.be(request=None)
        course.see(begin + 6, Pose2(1.5, 0.0), 0.0)

    figures = course.seen.report()
    assert (figures["requests"], figures["served"]) == (2, 2)


def test_what_is_not_served_is_refused_with_its_times_also_at_the_end(course: Course) -> None:
    for begin, served in ((1, False), (5, True), (9, False)):
        course.prop = Pose3(1.0 if served else 50.0, 0.0, 1.5)
        course.be(request=Pose3(1.0, 0.0, 1.5))
        course.see(begin, Pose2(1.5, 0.0))
        course.see(begin + 2, Pose2(1.5, 0.01))
        if begin < 9:
            course.be(request=None)
            course.see(begin + 3, Pose2(1.5, 0.0))
    course.seen.finish()

    figures = course.seen.report()
    assert (figures["requests"], figures["served"], figures["refused"]) == (3, 1, 2)
    assert course.requests.unserved == [
        (1 * SECOND, 4 * SECOND, Pose3(1.0, 0.0, 1.5), Pose2(0.0, 0.0)),
        (9 * SECOND, 11 * SECOND, Pose3(1.0, 0.0, 1.5), Pose2(0.0, 0.0)),
    ]


@pytest.mark.requirement(91)
def test_the_share_beside_the_user_is_of_walking_time_only(course: Course) -> None:
    for at, x, speed in [(1, 2.9, 1), (2, 1.4, 1), (3, 4.1, 1), (4, 3.9, 1), (5, 3.5, 0)]:
        course.see(at, Pose2(x, 0.0), speed)

    figures = course.seen.report()
    assert figures["walking_s"] == 4.0
    assert figures["beside_share"] == 0.5
    assert figures["beside_share_3_4"] == 0.25


def test_silence_of_tracking_is_noticed_with_its_time(course: Course) -> None:
    course.see(0.1, Pose2(9.0, 0.0))
    course.seen.watch(SECOND)
    course.see(2.0, Pose2(9.0, 0.0))
    course.seen.watch(4 * SECOND)
    course.seen.finish()

    found = course.seen.report()["dropouts"]
    assert found == [{"from_s": 0.1, "to_s": 2.0}, {"from_s": 2.0, "to_s": 4.0}]


@pytest.mark.parametrize(("silent_s", "found"), [(0.15, 0), (0.16, 1)])
def test_tracking_is_lost_after_150_ms_of_silence(
    course: Course, silent_s: float, found: int
) -> None:
    course.see(0.1, Pose2(9.0, 0.0))
    course.see(0.1 + silent_s, Pose2(9.0, 0.0))
    course.seen.finish()

    assert len(course.seen.report()["dropouts"]) == found


def test_what_did_not_occur_is_null(course: Course) -> None:
    course.see(0.1, Pose2(9.0, 0.0), 0.0)

    figures = course.seen.report()

    assert figures["response_s"] == {"mean": None, "sd": None, "min": None, "max": None}
    assert figures["prop_error_m"] == {"mean": None, "max": None}
    assert figures["time_to_safety_s"] == {"mean": None, "min": None, "max": None}
    assert figures["beside_share"] is None
    assert figures["beside_share_3_4"] is None


def test_the_spread_is_that_of_a_sample() -> None:
    found = spread([1.0, 2.0, 4.0], ("mean", "sd", "min", "max"))

    assert found["mean"] == pytest.approx(7 / 3)
    assert found["sd"] == pytest.approx(math.sqrt(7 / 3))
    assert (found["min"], found["max"]) == (1.0, 4.0)
    assert spread([2.0], ("mean", "sd")) == {"mean": 2.0, "sd": None}


def hold_arm_out(course: Course, reach: float) -> None:
    course.be(joints=(reach, 0.0, 0.0, 0.0, 0.0, 0.0))


def contacts_of(course: Course) -> int:
    found: int = course.seen.report()["contacts"]
    return found


@pytest.mark.requirement(23)
@pytest.mark.parametrize(("x", "counted"), [(1.54, 1), (1.56, 0)])
def test_a_person_at_the_arm_is_a_contact(course: Course, x: float, counted: int) -> None:
    """Arm up to 1.0 m and 5 cm thick, person 0.5 m: they touch from 1.55 m on."""
    hold_arm_out(course, 1.0)

    for at in (0.0, 1.0, 2.0):
        course.see(at, Pose2(x, 0.0, math.pi))

    assert contacts_of(course) == counted


def test_between_two_looks_the_arm_touches_too(course: Course) -> None:
    hold_arm_out(course, 1.0)

    for at, y in ((0.0, -2.0), (1.0, 2.0)):  # past the person, sideways
        course.see(at, Pose2(1.2, y, math.pi))

    assert contacts_of(course) == 1


def test_what_the_arm_holds_may_meet_who_asked_until_it_has_come_away_once() -> None:
    course = Course("panel")
    hold_arm_out(course, 1.0)
    asked = Pose3(0.4, 0.0, 1.0)

    for at, x, request in [(0, 2.5, None), (1, 1.4, asked), (2, 1.4, None), (3, 2.5, None)]:
        course.be(request=request)
        course.see(at, Pose2(x, 0.0, math.pi))
    assert contacts_of(course) == 0

    course.see(4, Pose2(1.4, 0.0, math.pi))
    assert contacts_of(course) == 1


def test_a_link_that_touches_who_asked_is_a_contact_once(course: Course) -> None:
    hold_arm_out(course, 1.0)
    asked = Pose3(0.4, 0.0, 1.0)

    for at, x, request in [(0, 2.5, None), (1, 1.4, asked), (2, 1.4, None), (3, 2.5, None)]:
        course.be(request=request)
        course.see(at, Pose2(x, 0.0, math.pi))

    (contact,) = course.seen.report()["contact_list"]
    assert (contact["part"], contact["granted"]) == ("forearm", True)


def test_contacts_of_base_and_arm_are_told_in_the_order_of_their_times(course: Course) -> None:
    hold_arm_out(course, 1.0)
    for at in (1.0, 2.0):
        course.see(at, Pose2(1.4, 0.0, math.pi))
    course.be(contacts=(Contact(3 * SECOND // 2, 0.0, 0.0, "base", 0.1, 0.0, False),))
    course.see(3.0, Pose2(3.0, 0.0, math.pi))
    course.see(4.0, Pose2(1.4, 0.0, math.pi))

    listed = course.seen.report()["contact_list"]
    told = [(contact["at_s"], contact["part"]) for contact in listed]
    assert told == [(1.0, "forearm"), (1.5, "base"), (4.0, "forearm")]


def test_an_arm_inside_the_outline_touches_nobody(course: Course) -> None:
    hold_arm_out(course, 0.5)

    course.see(0.0, Pose2(1.0, 0.0, math.pi))

    assert contacts_of(course) == 0


def test_a_situation_that_is_open_at_the_end_is_told(course: Course) -> None:
    course.see(0.0, Pose2(1.0, 0.0))

    report = course.seen.report()

    assert (report["situations"], report["situations_open"]) == (1, 1)
    assert report["time_to_safety_s"]["mean"] is None


def test_a_run_without_a_world_has_the_same_figures() -> None:
    options = Options(duration_s=1.0)
    worlds = simulate(open_setup(), options), simulate(open_setup(), replace(options, tier=0))

    assert worlds[0].figures.keys() == worlds[1].figures.keys()
