"""How people take in the stop sign, how they make room, and what kinds of people there are."""

import itertools
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings, strategies as st

from engine.files.finding import FileError
from hw.geometry import Pose2, wrap
from hw.people.recorded.recorded_walk import Playback
from hw.people.recorded.walk_file import Recording
from hw.people.user import open_user, with_manner
from hw.people.walking.manner import (
    ATTENTIVE,
    CURIOUS,
    DEAF,
    HASTY,
    INSTANT,
    MANNERS,
    PURSUER,
    at_speed,
)
from hw.people.walking.person import STOPPING_S
from hw.people.walking.wanderer import Wanderer
from hw.scene.room import Room
from hw.scene.scene import load_scene
from tests.hw.people.walks import HALL, someone
from tests.repeats import examples

CLOSET = Room(outer=((0.0, 0.0), (2.4, 0.0), (2.4, 2.4), (0.0, 2.4)))
HZ = 30
FAR = Pose2(100.0, 100.0)
SPEED = 0.8


def straight(seconds=12):
    stamps = tuple(i * 10**9 // 25 for i in range(25 * seconds))
    return Recording("w", stamps, tuple(1e-9 * SPEED * s for s in stamps), (5.0,) * len(stamps))


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

    late = Playback(straight(), HALL, manner=HASTY, seed=seed)
    ticks = math.ceil(late.reaction_s * HZ - 1e-6)
    at_once = Playback(straight(), HALL, manner=replace(INSTANT, pause_s=(0.0, 0.0)))
    for n in range(300):
        for person, shown in ((late, sign(n)), (at_once, sign(n - ticks))):
            person.step(n * 10**9 // HZ, FAR, shown)
        assert late.body.x == pytest.approx(at_once.body.x, abs=SPEED * 1e-4)
        assert late.speed == pytest.approx(at_once.speed, abs=1e-3)


def test_a_sign_of_a_fifth_of_a_second_slows_them_late_and_for_as_long():
    person = Playback(straight(), HALL, manner=HASTY, seed=0)
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


# ---- kinds


LAB = load_scene("lab_a")


def follow(person, seconds, robot, shown=lambda t: False):
    """As `play`, with a robot that moves: `robot` gives its place at t, s."""
    rows = []
    for n in range(round(HZ * seconds) + 1):
        person.step(n * 10**9 // HZ, robot(n / HZ), shown(n / HZ))
        rows.append((person.body, person.speed, person.request))
    return rows


@pytest.mark.parametrize("source", ["study", "random"])
def test_deaf_people_never_slow_down(source):
    runs = [
        play(open_user(f"{source}:deaf", LAB, seed=3), 60, Pose2(5.0, 5.0), shown)
        for shown in (lambda t: True, lambda t: False)
    ]
    assert runs[0] == runs[1]
    assert DEAF.reaction(3) is None


@pytest.mark.parametrize("source", ["random", "study", "demo"])
def test_hasty_people_walk_off_the_moment_they_let_go(source):
    rows = play(open_user(f"{source}:hasty", LAB, 4, seed=1), 250)
    edges = [n for n, (a, b) in enumerate(itertools.pairwise(rows), 1) if a[2] and not b[2]]
    assert len(edges) >= 2
    for n in edges[:-1]:
        walks = next(m for m in range(n, len(rows)) if rows[m][1] > 0.0)
        turn = wrap(rows[walks][0].yaw - rows[n - 1][0].yaw)
        assert (walks - n) / HZ == pytest.approx(abs(turn) / 3.0, abs=0.08)


def test_others_wait_after_they_have_let_go():
    rows = play(open_user("random", LAB, 4, seed=1), 250)
    edges = [n for n, (a, b) in enumerate(itertools.pairwise(rows), 1) if a[2] and not b[2]]
    assert all(speed == 0.0 for n in edges for _, speed, _ in rows[n : n + 5 * HZ])


def test_hasty_people_go_on_at_once_after_the_sign(tmp_path):
    walk = "  - walk: {x: 9.0, y: 6.0, speed: 1.0}\n"
    person = someone(tmp_path, walk, manner=HASTY)
    rows = play(person, 16, Pose2(4.0, 10.0), lambda t: 1.0 < t <= 3.0)
    onward = min(n / HZ for n, (_, speed, _) in enumerate(rows) if speed > 0.0 and n > 3 * HZ)
    assert onward == pytest.approx(3.0 + person.reaction_s, abs=0.1)


def pursuer(seed=0):
    return Wanderer(HALL, Pose2(2.0, 2.0), seed, manner=PURSUER)


@pytest.mark.parametrize("seed", range(4))
def test_a_pursuer_walks_into_a_robot_that_stays_where_it_is(seed):
    rows = play(pursuer(seed), 90, Pose2(8.0, 8.0))
    assert min(body.distance_to(Pose2(8.0, 8.0)) for body, *_ in rows) < 0.65


def test_a_pursuer_follows_a_robot_that_drives_away():
    def robot(t):
        return Pose2(6.0 + 3.5 * math.cos(0.2 * t), 6.0 + 3.5 * math.sin(0.2 * t))

    rows = follow(pursuer(1), 120, robot)
    moving = [(n, body) for n, (body, speed, _) in enumerate(rows) if speed > 0.0]
    aimed = sum(abs(body.bearing_to(robot(n / HZ))) < 0.05 for n, body in moving)
    assert aimed > 0.8 * len(moving)
    assert all(0.5 <= speed <= 1.5 for _, speed, _ in rows if speed > 0.0)
    assert any(request for *_, request in rows)


def test_a_pursuer_stops_at_the_sign_and_then_goes_on():
    robot, shown = Pose2(11.0, 11.0), lambda t: 2.0 <= t < 6.0
    person = pursuer()
    rows = play(person, 30, robot, shown)
    stopped = 2.0 + person.reaction_s + STOPPING_S
    still = rows[round(HZ * (stopped + 0.05)) : round(HZ * 6.3)]
    assert len({body for body, *_ in still}) == 1
    assert rows[HZ][1] > 0.0
    assert rows[-1][0].distance_to(robot) < still[0][0].distance_to(robot) - 1.0


def test_a_pursuer_is_not_held_up_by_a_wall():
    scene = load_scene("lab_b")
    person, robot = open_user("random:pursuer", scene, seed=2), scene.robot_start
    rows = play(person, 400, robot)
    for body, *_ in rows[::5]:
        assert scene.room.clearance(body.x, body.y) >= 0.5 - 1e-9
    places = {(round(body.x / 2), round(body.y / 2)) for body, *_ in rows}
    assert len(places) >= 4


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.few(1)
def test_curious_people_turn_often_and_look_at_things_and_at_the_robot(seed):
    robot = Pose2(6.0, 4.0)
    curious = play_head(open_user("random:curious", LAB, seed=seed), 600, robot)
    others = play_head(open_user("random", LAB, seed=seed), 600, robot)
    assert turned(curious) > 2.0 * turned(others)
    near = [body.distance_to(robot) for body, _, speed in curious if speed == 0.0]
    assert min(near) < 2.6
    heads = [head for _, head, _ in curious]
    assert max(map(abs, heads)) <= 1.2 + 1e-9
    assert max(heads) > 1.0
    assert max(abs(b - a) for a, b in itertools.pairwise(heads)) <= 3.01 / HZ
    walls = [LAB.room.clearance(body.x, body.y) for body, _, speed in curious if speed == 0.0]
    assert min(walls) < 0.8


def play_head(person, seconds, robot):
    rows = []
    for n in range(HZ * seconds):
        person.step(n * 10**9 // HZ, robot, False)
        seen = person.measured.value
        rows.append((person.body, wrap(seen.head_yaw - seen.body.yaw), person.speed))
    return rows


def turned(rows):
    """How far the body has turned in all, rad."""
    return sum(abs(wrap(b.yaw - a.yaw)) for (a, *_), (b, *_) in itertools.pairwise(rows))


def test_curious_people_ask_for_touches_and_come_to_an_end():
    rows = play(open_user("random:curious", LAB, 3, seed=1), 400)
    asked = {request for *_, request in rows if request}
    assert len(asked) == 3
    assert open_user("random:curious", LAB, 3, seed=1).manner is CURIOUS


@pytest.mark.parametrize("kind", MANNERS)
@pytest.mark.parametrize("seed", [0, 7])
def test_the_same_seed_gives_the_same_person_beside_the_same_robot(kind, seed):
    runs = [
        play(open_user(f"random:{kind}", LAB, seed=seed), 60, Pose2(6.0, 4.0), lambda t: t % 9 > 6)
        for _ in range(2)
    ]
    other = play(open_user(f"random:{kind}", LAB, seed=seed + 1), 60, Pose2(6.0, 4.0))
    assert runs[0] == runs[1]
    assert runs[0] != other


@pytest.mark.parametrize(
    ("source", "bare", "manner"),
    [
        ("random", "random", ATTENTIVE),
        ("random:hasty", "random", HASTY),
        ("demo:instant", "demo", INSTANT),
        ("a/walk.csv#3@1,2,0:deaf", "a/walk.csv#3@1,2,0", DEAF),
        ("a:b/walk.csv", "a:b/walk.csv", ATTENTIVE),
        ("live", "live", None),
        ("random at 2 m/s", "random", at_speed(ATTENTIVE, 2.0)),
        ("random:deaf at 50 cm/s", "random", at_speed(DEAF, 0.5)),
        ("walk at home.csv", "walk at home.csv", ATTENTIVE),
    ],
)
def test_a_source_names_a_manner(source, bare, manner):
    assert with_manner(source) == (bare, manner)


@pytest.mark.parametrize("speed", [0.4, 2.5])
def test_a_random_person_walks_at_the_chosen_speed_where_they_would_walk_anyway(speed):
    walk = play(open_user(f"random at {speed} m/s", LAB, seed=3), 150)
    own = play(open_user("random", LAB, seed=3), 150)
    steps = [math.dist((a.x, a.y), (b.x, b.y)) for (a, *_), (b, *_) in itertools.pairwise(walk)]

    assert max(steps) == pytest.approx(speed / HZ, rel=1e-6)
    goal, other = (next(deep for *_, deep in rows if deep is not None) for rows in (walk, own))
    assert (goal.x, goal.y) == pytest.approx((other.x, other.y), abs=1e-6)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("random:hastie", "'hastie' is no kind of person; did you mean 'hasty'"),
        ("random:", "'' is no kind of person"),
        ("demo:pursuer", "write random:pursuer"),
        ("demo:persuer", "'persuer' is no kind of person; allowed: attentive, deaf, hasty"),
        ("demo at 1 m/s", "only random people walk at a chosen speed"),
        ("random at 9 m/s", "'9 m/s' is no speed from 0.1 to 5 m/s"),
        ("random at x m/s", "'x m/s' is no speed from 0.1 to 5 m/s"),
        ("live:deaf", "a live person has their own manner"),
    ],
)
def test_a_wrong_kind_is_an_error_that_says_what_is_right(source, message):
    with pytest.raises(FileError, match=message):
        open_user(source, LAB)
