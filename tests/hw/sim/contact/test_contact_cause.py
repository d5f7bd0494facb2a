"""Who closed in how fast when robot and person touched: worked out by hand, or by differences."""

import cmath
import math

import pytest
from hypothesis import assume, given, settings, strategies as st

from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.model.robot import load_robot
from hw.people.live import LivePerson
from hw.samples import USER_RADIUS, UserPose
from hw.sim.contact.contact import first_touch
from hw.sim.world import World

ROBOT = load_robot("rbkairos_ur10")
FOOTPRINT = ROBOT.footprint
LENGTH, WIDTH = 0.565, 0.455
TICK = 10**9 // 30


class Pushed:
    """A base that somebody pushes with an even velocity over the floor, whatever it meets."""

    signals = ("base.pose", "base.twist")
    mode = "omni"

    def __init__(self, velocity: Twist2) -> None:
        self.pose, self.twist, self.velocity = Pose2(0.0, 0.0), STILL, velocity
        self.distance_m = self.energy_j = 0.0
        self.braked, self.now = False, 0

    def advance(self, until_ns):
        t, v = until_ns * 1e-9, self.velocity
        self.pose = Pose2(v.vx * t, v.vy * t, v.wz * t)

    def drive(self, command):
        """It has no motor."""

    stop = use = block = drive

    def samples(self, now_ns):
        return []


def first_contact(velocity, start, walk=(0.0, 0.0)):
    """The first contact of a pushed robot and a person who walks evenly; m, m/s."""
    person = LivePerson(Pose2(*start))
    world = World(None, ROBOT, person, base=Pushed(velocity))
    for n in range(1, 300):
        t = n * TICK * 1e-9
        body = Pose2(start[0] + walk[0] * t, start[1] + walk[1] * t)
        person.push(n * TICK, UserPose(body, 0.0))
        world.advance(n * TICK)
        if world.collisions.contacts:
            return world.collisions.contacts[0]
    raise AssertionError("they do not meet")


def test_who_walks_into_a_standing_robot_has_caused_the_contact():
    contact = first_contact(STILL, (3.0, 0.2), walk=(-1.2, 0.0))

    assert (contact.part, contact.by, contact.granted) == ("base", "person", False)
    assert contact.at_ns * 1e-9 == pytest.approx((3.0 - LENGTH - USER_RADIUS) / 1.2, abs=1e-4)
    assert (contact.x, contact.y) == pytest.approx((LENGTH, 0.2), abs=1e-3)
    assert contact.robot_closing == 0.0
    assert contact.person_closing == pytest.approx(1.2)


def test_a_robot_pushed_into_a_standing_person_has_caused_the_contact():
    contact = first_contact(Twist2(0.3, 0.0), (1.5, -0.1))

    assert contact.by == "robot"
    way = 1.5 - LENGTH - USER_RADIUS
    assert contact.at_ns * 1e-9 == pytest.approx(way / 0.3, abs=1e-4)
    assert (contact.x, contact.y) == pytest.approx((LENGTH + way, -0.1), abs=1e-3)
    assert contact.robot_closing == pytest.approx(0.3, rel=0.01)
    assert contact.person_closing == 0.0


def test_at_a_corner_only_what_closes_the_gap_counts():
    """The person is 0.3 m beside the side, so that the normal is off the way by asin 0.6."""
    contact = first_contact(Twist2(0.3, 0.0), (2.0, WIDTH + 0.3))

    assert contact.robot_closing == pytest.approx(0.3 * 0.8, rel=0.01)
    assert contact.y == pytest.approx(WIDTH, abs=1e-3)


def test_a_turning_corner_is_as_fast_as_its_lever():
    """Only the corner, 0.725 m from the centre of the turn, reaches the person."""
    person = Pose2(math.hypot(LENGTH, WIDTH) + USER_RADIUS - 0.02, 0.0)
    contact = first_contact(Twist2(0.0, 0.0, 0.5), (person.x, person.y))

    assert math.hypot(contact.x, contact.y) == pytest.approx(math.hypot(LENGTH, WIDTH), abs=1e-3)
    nx, ny = (person.x - contact.x) / USER_RADIUS, (person.y - contact.y) / USER_RADIUS
    assert contact.robot_closing == pytest.approx(0.5 * (contact.x * ny - contact.y * nx), rel=0.01)
    assert contact.robot_closing > 0.05
    assert contact.by == "robot"


def test_a_robot_that_backs_away_from_who_catches_up_has_not_caused_the_contact():
    contact = first_contact(Twist2(-0.4, 0.0), (2.0, 0.0), walk=(-1.5, 0.0))

    assert contact.by == "person"
    assert contact.robot_closing == pytest.approx(-0.4, rel=0.01)
    assert contact.person_closing == pytest.approx(1.5, rel=0.01)


@pytest.mark.parametrize("asks", [True, False])
def test_a_contact_says_whether_a_touch_was_asked_for(asks):
    person = LivePerson(Pose2(1.2, 0.0))
    world = World(None, ROBOT, person)
    person.push(0, UserPose(Pose2(1.2, 0.0), 0.0))
    if asks:
        person.ask(Pose3(0.6, 0.0, 1.2))
    world.advance(0)
    person.push(TICK, UserPose(Pose2(1.0, 0.0), 0.0))
    world.advance(TICK)

    (contact,) = world.collisions.contacts
    assert contact.granted is asks


def test_a_leap_in_no_time_has_no_speeds():
    person = LivePerson(Pose2(3.0, 0.0))
    world = World(None, ROBOT, person)
    person.push(0, UserPose(Pose2(0.9, 0.0), 0.0))
    world.advance(0)

    (contact,) = world.collisions.contacts
    assert (contact.robot_closing, contact.person_closing, contact.at_ns) == (0.0, 0.0, 0)


# -- any motion, by differences of the gap -------------------------------------------------------


def gap_at(base: Pose2, body: Pose2) -> float:
    away = complex(body.x - base.x, body.y - base.y) * cmath.exp(-1j * base.yaw)
    return math.hypot(max(abs(away.real) - LENGTH, 0), max(abs(away.imag) - WIDTH, 0)) - USER_RADIUS


def beside(base: Pose2, side: float, gap: float) -> Pose2:
    """Who stands on this side of the base, so far from its outline; m."""
    near, far = 0.0, 3.0
    for _ in range(40):
        middle = 0.5 * (near + far)
        body = Pose2(base.x + middle * math.cos(side), base.y + middle * math.sin(side))
        near, far = (near, middle) if gap_at(base, body) > gap else (middle, far)
    return body


def along(a: Pose2, b: Pose2, share: float) -> Pose2:
    ways = (b.x - a.x, b.y - a.y, b.yaw - a.yaw)
    return Pose2(a.x + share * ways[0], a.y + share * ways[1], a.yaw + share * ways[2])


step = st.floats(-0.1, 0.1)


@settings(deadline=None, max_examples=200)
@given(
    st.floats(-math.pi, math.pi),
    st.floats(0.001, 0.02),
    st.floats(-math.pi, math.pi),
    st.tuples(step, step, st.floats(-0.15, 0.15)),
    st.tuples(step, step),
)
def test_closing_speeds_are_those_of_the_gap_with_the_other_one_held(
    yaw, away, side, moved, walked
):
    base = Pose2(1.0, -2.0, yaw)
    body = beside(base, side, away)
    robot = base, Pose2(1.0 + moved[0], -2.0 + moved[1], yaw + moved[2])
    person = body, Pose2(body.x + walked[0], body.y + walked[1])
    shares = [n / 500 for n in range(501)]
    touching = [s for s in shares if gap_at(along(*robot, s), along(*person, s)) <= 0.0]
    assume(touching)

    touch = first_touch(FOOTPRINT, robot, person, span_s=0.04)

    assert touch.share == pytest.approx(touching[0], abs=0.02)
    s, h = touch.share, 1e-5
    here, there = along(*robot, s), along(*person, s)
    by_robot = gap_at(along(*robot, s + h), there) - gap_at(along(*robot, s - h), there)
    by_person = gap_at(here, along(*person, s + h)) - gap_at(here, along(*person, s - h))
    assert touch.robot_closing == pytest.approx(-by_robot / (2 * h * 0.04), rel=0.01, abs=0.01)
    assert touch.person_closing == pytest.approx(-by_person / (2 * h * 0.04), rel=0.01, abs=0.01)
    assert math.hypot(touch.x - there.x, touch.y - there.y) == pytest.approx(USER_RADIUS, abs=1e-3)
