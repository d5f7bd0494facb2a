"""What a person does who is shown the robot: stops, steps back, takes a moment, goes round."""

import itertools
import math
from functools import partial

import pytest

from hw.geometry import Pose2
from hw.people.walking.manner import INSTANT
from hw.people.walking.pedestrian import ATTEMPTS, KEEP, MEMORY_NS, REST_NS
from hw.scene.room import Room
from tests.hw.people import walks
from tests.hw.people.walks import HALL

CORRIDOR = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 2.0), (0.0, 2.0)))
HZ = 30
FAR = Pose2(100.0, 100.0)


MOMENT_NS = round(INSTANT.pause_s[0] * 1e9)


someone = partial(walks.someone, manner=INSTANT)


def play(person, seconds, robot=FAR, shown=lambda t: False):
    """Place and speed, tick by tick."""
    rows = []
    for n in range(round(HZ * seconds) + 1):
        person.step(n * 10**9 // HZ, robot, shown(n / HZ))
        rows.append((person.body, person.speed))
    return rows


def nearest(rows, robot):
    return min(body.distance_to(robot) for body, _ in rows)


@pytest.mark.parametrize("distance", [0.9, 1.2])
def test_who_nearly_touches_the_robot_shown_steps_back_slowly(tmp_path, distance):
    robot = Pose2(2.0 + distance, 6.0)
    rows = play(someone(tmp_path, "  - stand: 60\n"), 5, robot, lambda t: t > 0.1)
    gone = [a.distance_to(b) * HZ for (a, _), (b, _) in itertools.pairwise(rows)]
    assert rows[-1][0].distance_to(robot) == pytest.approx(1.5, abs=0.02)
    assert max(gone) == pytest.approx(0.5)
    assert max(speed for _, speed in rows) == 0.5
    assert rows[-1][1] == 0.0
    assert rows[-1][0].yaw == 0.0


def test_who_has_room_enough_stays(tmp_path):
    rows = play(someone(tmp_path, "  - stand: 60\n"), 5, Pose2(3.3, 6.0), lambda t: t > 0.1)
    assert rows[-1][0] == rows[0][0]


def test_nobody_steps_back_while_they_still_stop(tmp_path):
    walk = "  - walk: {x: 9.0, y: 6.0, speed: 1.5}\n"
    rows = play(someone(tmp_path, walk), 3, Pose2(4.7, 6.0), lambda t: t > 1.0)
    xs = [body.x for body, _ in rows]
    turning = xs.index(max(xs))
    assert xs[:turning] == sorted(xs[:turning])
    assert max(xs) == pytest.approx(3.5 + 0.5 * 1.5 * 0.5, abs=0.06)
    assert xs[-1] < max(xs) - 0.2


@pytest.mark.parametrize("start", [(0.5, 6.0, 0.0), (0.6, 0.9, 2.0), (11.5, 0.8, 0.0)])
def test_back_to_the_wall_they_step_aside_and_into_no_wall(tmp_path, start):
    x, y, _ = start
    robot = Pose2(x + (0.9 if x < 6.0 else -0.9), y - 0.3)
    rows = play(someone(tmp_path, "  - stand: 60\n", start), 9, robot, lambda t: t > 0.1)
    assert rows[-1][0].distance_to(robot) > rows[0][0].distance_to(robot) + 0.1
    for body, _ in rows:
        assert HALL.clearance(body.x, body.y) >= 0.5 - 1e-9


def test_in_a_corner_with_the_robot_before_them_they_stay(tmp_path):
    start = (0.5, 0.5, 0.0)
    rows = play(someone(tmp_path, "  - stand: 60\n", start), 9, Pose2(1.2, 1.2), lambda t: t > 0.1)
    assert {(body.x, body.y, speed) for body, speed in rows} == {(0.5, 0.5, 0.0)}


def test_they_take_a_moment_after_the_robot_is_hidden(tmp_path):
    walk = "  - walk: {x: 9.0, y: 6.0, speed: 1.0}\n"
    rows = play(someone(tmp_path, walk), 12, Pose2(4.0, 9.0), lambda t: 1.0 < t <= 3.0)
    moving = [n / HZ for n, (_, speed) in enumerate(rows) if speed > 0.0]
    assert not [t for t in moving if 1.6 < t < 3.0 + MOMENT_NS * 1e-9]
    assert min(t for t in moving if t > 3.0) == pytest.approx(3.0 + MOMENT_NS * 1e-9, abs=0.1)


def test_shown_again_where_it_was_they_need_no_other_moment_but_make_more_room(tmp_path):
    robot = Pose2(3.5, 6.0)

    def shown(t):
        return t > 0.1 and (t % 3.0) < 0.7

    rows = play(someone(tmp_path, "  - walk: {x: 2.0, y: 10.0}\n"), 20, robot, shown)
    assert rows[round(3.5 * HZ)][0].x < 2.0
    assert rows[-1][0] == Pose2(2.0, 10.0, rows[-1][0].yaw)


@pytest.mark.parametrize("robot", [Pose2(5.0, 6.0), Pose2(5.0, 6.6), Pose2(7.0, 5.2)])
def test_nobody_walks_through_the_place_where_they_saw_the_robot(tmp_path, robot):
    walk = "  - walk: {x: 10.0, y: 6.0, speed: 1.5}\n"
    rows = play(someone(tmp_path, walk), 20, robot, lambda t: 0.8 < t < 2.0)
    stopped = rows[2 * HZ][0]
    assert rows[-1][0].x == pytest.approx(10.0)
    assert nearest(rows[2 * HZ :], robot) >= min(KEEP, stopped.distance_to(robot)) - 0.02


def test_without_a_way_round_they_wait_and_give_it_up(tmp_path):
    steps = "  - walk: {x: 10.0, y: 1.0, speed: 1.5}\n  - stand: 9\n"
    person = someone(tmp_path, steps, (2.0, 1.0, 0.0), CORRIDOR)
    robot, ended = Pose2(6.0, 1.0), 0
    for n in range(40 * HZ):
        person.step(n * 10**9 // HZ, robot, 0.8 < n / HZ < 2.0)
        assert person.body.distance_to(robot) > KEEP
        ended = ended or (n if person.finished else 0)
    waited = (MOMENT_NS + (ATTEMPTS - 1) * REST_NS) * 1e-9
    assert ended / HZ == pytest.approx(2.0 + waited + 0.25 + 9.0, abs=0.1)


def test_after_a_while_they_have_forgotten_where_the_robot_was(tmp_path):
    stand = (MOMENT_NS + MEMORY_NS) * 1e-9
    steps = f"  - stand: {stand}\n  - walk: {{x: 10.0, y: 6.0, speed: 1.5}}\n"
    rows = play(someone(tmp_path, steps), 40, Pose2(6.0, 6.0), lambda t: 0.5 < t < 2.0)
    assert nearest(rows, Pose2(6.0, 6.0)) < 0.1
    assert all(math.isclose(body.y, 6.0) for body, _ in rows)
