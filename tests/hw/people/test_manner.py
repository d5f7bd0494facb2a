"""How attentive people take in the stop sign: late, and then they make room."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.geometry import Pose2
from hw.people.manner import ATTENTIVE, INSTANT
from hw.people.person import STOPPING_S
from hw.people.playback import Playback
from hw.people.recording import Recording
from hw.people.script import load_script
from hw.people.walker import Walker
from hw.room import Room
from tests.repeats import examples

HALL = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 12.0), (0.0, 12.0)))
CLOSET = Room(outer=((0.0, 0.0), (2.4, 0.0), (2.4, 2.4), (0.0, 2.4)))
HZ = 30
FAR = Pose2(100.0, 100.0)
SPEED = 0.8


def straight(seconds=12):
    stamps = tuple(i * 10**9 // 25 for i in range(25 * seconds))
    return Recording("w", stamps, tuple(1e-9 * SPEED * s for s in stamps), (5.0,) * len(stamps))


def someone(tmp_path, steps, start=(2.0, 6.0, 0.0), room=HALL, manner=ATTENTIVE, seed=0):
    path = tmp_path / "someone.yaml"
    x, y, yaw = start
    path.write_text(f"user: someone\nstart: {{x: {x}, y: {y}, yaw: {yaw}}}\nsteps:\n{steps}")
    return Walker(load_script(path), room, manner=manner, seed=seed)


def play(person, seconds, robot=FAR, shown=lambda t: False):
    """Place and speed, tick by tick."""
    rows = []
    for n in range(round(HZ * seconds) + 1):
        person.step(n * 10**9 // HZ, robot, shown(n / HZ))
        rows.append((person.body, person.speed, person.request))
    return rows


def first(rows, wanted):
    """The time of the first row that is as wanted, s."""
    return next(n for n, row in enumerate(rows) if wanted(row)) / HZ


@given(seed=st.integers(0, 10**6))
def test_a_reaction_is_that_of_the_seed_and_within_its_bounds(seed):
    assert 0.3 <= ATTENTIVE.reaction(seed) <= 0.8
    assert ATTENTIVE.reaction(seed) == ATTENTIVE.reaction(seed)
    assert INSTANT.reaction(seed) == 0.0


def test_reactions_spread_over_their_range():
    drawn = [ATTENTIVE.reaction(seed) for seed in range(200)]
    assert min(drawn) < 0.35
    assert max(drawn) > 0.75
    assert sum(drawn) / 200 == pytest.approx(0.55, abs=0.03)


@settings(max_examples=examples(40), deadline=None)
@given(
    seed=st.integers(0, 50),
    edges=st.lists(st.integers(1, 45), min_size=2, max_size=8),
)
def test_they_do_after_their_reaction_what_others_do_at_once(seed, edges):
    """Moving the sign by the reaction, to the next step, moves the whole run of speeds."""
    ends = [sum(edges[: i + 1]) for i in range(len(edges))]

    def sign(n):
        return sum(end <= n for end in ends) % 2 == 1

    late = Playback(straight(), seed=seed)
    ticks = math.ceil(late.reaction_s * HZ - 1e-6)
    at_once = Playback(straight(), manner=INSTANT)
    for n in range(300):
        for person, shown in ((late, sign(n)), (at_once, sign(n - ticks))):
            person.step(n * 10**9 // HZ, FAR, shown)
        assert late.body.x == pytest.approx(at_once.body.x, abs=SPEED * 1e-4)
        assert late.speed == pytest.approx(at_once.speed, abs=1e-3)


def test_a_sign_of_a_fifth_of_a_second_slows_them_late_and_for_as_long():
    person = Playback(straight(), seed=0)
    rows = play(person, 8, shown=lambda t: 2.0 <= t < 2.2)
    slow = [n / HZ for n, (_, speed, _) in enumerate(rows) if n / HZ > 1 and speed < SPEED - 1e-6]
    assert slow[0] == pytest.approx(2.0 + person.reaction_s, abs=0.05)
    assert slow[-1] == pytest.approx(2.0 + person.reaction_s + 2 * 0.2, abs=0.07)
    least = min(speed for _, speed, _ in rows[HZ:])
    assert least == pytest.approx(SPEED * (1.0 - 0.2 / STOPPING_S), abs=0.03)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("gap", [1.6, 2.0, 2.4])
def test_who_stands_before_the_shown_robot_leaves_after_a_while(tmp_path, gap, seed):
    robot = Pose2(2.0 + gap, 6.0)
    person = someone(tmp_path, "  - stand: 60\n", (2.0, 6.0, 1.0), seed=seed)
    rows = play(person, 12, robot, lambda t: t >= 1.0)
    off = first(rows, lambda row: row[0] != rows[0][0])
    assert 1.0 + 1.0 <= off - person.reaction_s <= 1.0 + 3.0 + 0.1
    speeds = {round(speed, 9) for _, speed, _ in rows if speed > 0.0}
    assert len(speeds) == 1
    assert 0.8 <= speeds.pop() <= 1.2
    assert 2.95 <= rows[-1][0].distance_to(robot) <= 3.15
    assert rows[-1][1] == 0.0
    gaps = [body.distance_to(robot) for body, *_ in rows]
    assert gaps == sorted(gaps)


def test_who_stands_farther_off_stays(tmp_path):
    rows = play(someone(tmp_path, "  - stand: 60\n"), 9, Pose2(4.6, 6.0), lambda t: t > 0.1)
    assert rows[-1][0] == rows[0][0]


@pytest.mark.parametrize("start", [(0.5, 6.0, 0.0), (0.6, 0.7, 2.0), (11.5, 0.8, 0.0)])
def test_with_a_wall_behind_they_leave_aside_and_into_no_wall(tmp_path, start):
    x, y, _ = start
    robot = Pose2(x + (1.6 if x < 6.0 else -1.6), y + 0.1)
    rows = play(someone(tmp_path, "  - stand: 60\n", start), 15, robot, lambda t: t > 0.1)
    assert 2.9 < rows[-1][0].distance_to(robot) < 3.2
    for body, *_ in rows:
        assert HALL.clearance(body.x, body.y) >= 0.5 - 1e-9


def test_without_room_they_stay(tmp_path):
    start = (0.5, 0.5, 0.0)
    person = someone(tmp_path, "  - stand: 60\n", start, CLOSET)
    rows = play(person, 12, Pose2(1.9, 1.9), lambda t: t > 0.1)
    assert {(body.x, body.y) for body, *_ in rows} == {(0.5, 0.5)}


def test_who_leaves_lets_go(tmp_path):
    person = someone(tmp_path, "  - request: {hold: 60}\n  - stand: 9\n")
    rows = play(person, 9, Pose2(4.0, 6.0), lambda t: t >= 1.0)
    assert rows[HZ][2] is not None
    let_go = first(rows[HZ:], lambda row: row[2] is None)
    assert let_go == pytest.approx(first(rows[HZ:], lambda row: row[0] != rows[0][0]), abs=0.05)


@pytest.mark.parametrize("seed", range(8))
def test_after_the_sign_they_take_a_moment_and_walk_on(tmp_path, seed):
    walk = "  - walk: {x: 9.0, y: 6.0, speed: 1.0}\n"
    person = someone(tmp_path, walk, seed=seed)
    rows = play(person, 16, Pose2(4.0, 10.0), lambda t: 1.0 < t <= 3.0)
    late = person.reaction_s
    moving = [n / HZ for n, (_, speed, _) in enumerate(rows) if speed > 0.0]
    still = max(t for t in moving if t < 3.0)
    onward = min(t for t in moving if t > 3.0)
    assert still == pytest.approx(1.0 + late + STOPPING_S, abs=0.08)
    assert 0.5 <= onward - 3.0 - late <= 3.0 + 0.1
    assert rows[-1][0].x == pytest.approx(9.0)
