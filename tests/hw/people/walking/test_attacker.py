"""People who try to be touched by the robot."""

import itertools
import math

import pytest

from hw.geometry import Pose2, wrap
from hw.people.user import open_user
from hw.people.walking.attacker import TOUCHES, Attacker
from hw.people.walking.manner import ATTACKERS
from hw.scene.scene import load_scene
from tests.hw.people.walks import HALL

HZ = 30
ROBOT = Pose2(8.0, 8.0)
BY_NAME = {manner.name: manner for manner in ATTACKERS}


def attacker(kind, seed=0):
    return Attacker(HALL, Pose2(2.0, 2.0), seed, manner=BY_NAME[kind])


def play(person, seconds, robot=lambda t: ROBOT, shown=lambda t: False):
    """Place, speed and request, tick by tick."""
    rows = []
    for n in range(HZ * seconds):
        person.step(n * 10**9 // HZ, robot(n / HZ), shown(n / HZ))
        rows.append((person.body, person.speed, person.request))
    return rows


@pytest.mark.parametrize("kind", ["cutter", "circler", "shadow", "backer", "grabber"])
def test_they_touch_a_robot_that_stands(kind):
    rows = play(attacker(kind), 120)
    assert min(body.distance_to(ROBOT) for body, *_ in rows) <= TOUCHES + 1e-6


@pytest.mark.parametrize("kind", BY_NAME)
def test_they_ignore_the_sign(kind):
    assert play(attacker(kind), 60) == play(attacker(kind), 60, shown=lambda t: t % 3.0 > 1.0)


@pytest.mark.parametrize("kind", BY_NAME)
def test_they_walk_at_most_as_iso_13855_has_it_and_stay_off_the_walls(kind):
    scene = load_scene("lab_b")
    centre = scene.robot_start
    person = open_user(f"random:{kind}", scene, seed=3)

    def driven(t):
        return Pose2(centre.x + 0.5 * math.sin(0.5 * t), centre.y, 0.0)

    rows = play(person, 90, driven)
    steps = [math.dist((a.x, a.y), (b.x, b.y)) for (a, *_), (b, *_) in itertools.pairwise(rows)]
    assert max(steps) <= 1.6 / HZ + 1e-9
    assert max(speed for _, speed, _ in rows) > 0.7
    for body, *_ in rows[::5]:
        assert scene.room.clearance(body.x, body.y) >= 0.5 - 1e-9


def test_a_cutter_aims_ahead_of_a_robot_that_drives():
    def robot(t):
        return Pose2(2.0 + 0.4 * t, 10.0)

    rows = play(attacker("cutter"), 5, robot)
    moving = [(robot(n / HZ), body) for n, (body, speed, _) in enumerate(rows) if speed > 0.0]
    assert moving
    assert all(body.bearing_to(place) > 0.0 for place, body in moving[1:])


def test_a_backer_looks_away_from_where_they_go():
    rows = play(attacker("backer"), 5)
    moving = [body for body, speed, _ in rows if speed > 0.0]
    assert moving
    assert all(
        abs(wrap(body.yaw + math.pi - math.atan2(8 - body.y, 8 - body.x))) < 1e-6 for body in moving
    )


def test_a_circler_goes_all_around():
    rows = play(attacker("circler", seed=1), 60)
    near = {
        round(ROBOT.bearing_to(body) * 4 / math.pi)
        for body, *_ in rows
        if body.distance_to(ROBOT) < 2.1
    }
    assert len(near) >= 6


def test_a_shadow_stays_behind_before_they_dart():
    def robot(t):
        return Pose2(2.0 + 0.3 * t, 4.0)

    rows = play(attacker("shadow"), 3, robot)
    moving = [(robot(n / HZ), body) for n, (body, speed, _) in enumerate(rows) if speed > 0.0]
    assert moving
    assert all(body.x < place.x for place, body in moving[HZ:])


def test_a_lurker_waits_for_the_robot_and_darts():
    person = attacker("lurker")
    waits = play(person, 12, lambda t: Pose2(11.0, 11.0))
    place, speed, _ = waits[-1]
    assert speed == 0.0
    near = Pose2(place.x + math.copysign(2.0, 6.0 - place.x), place.y)
    for n in range(12 * HZ, 14 * HZ):
        person.step(n * 10**9 // HZ, near, False)
    assert person.body.distance_to(near) < 1.5


def test_a_grabber_goes_for_the_robot_while_they_ask():
    rows = play(attacker("grabber", seed=2), 120)
    touched = [n for n, (body, *_) in enumerate(rows) if body.distance_to(ROBOT) <= TOUCHES + 1e-6]
    assert any(rows[n][2] is not None for n in touched)


def test_they_ask_for_touches_and_come_to_an_end():
    person = open_user("random:cutter", load_scene("lab_a"), 2, seed=1)
    rows = play(person, 240)
    assert person.finished
    assert len({request for *_, request in rows if request}) == 2
