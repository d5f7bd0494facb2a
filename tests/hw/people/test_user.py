import itertools
import math
from pathlib import Path

import pytest

from engine.files.finding import FileError
from hw.geometry import Pose2, Pose3
from hw.people.live import LivePerson
from hw.people.recorded.recorded_walk import Playback
from hw.people.recorded.walk_file import Recording
from hw.people.user import open_user, parse_source, place_in_largest_disc
from hw.people.walking.manner import ATTENTIVE, INSTANT
from hw.people.walking.person import Touch
from hw.people.walking.script import load_script, script_names
from hw.people.walking.walker import Walker
from hw.samples import USER_RADIUS, UserPose
from hw.scene.scene import load_scene
from tests.hw.conftest import tick
from tests.hw.people.walks import WALKING

LAB = load_scene("lab_a")
FAR = Pose2(100.0, 100.0)


def play(person, ticks, robot=FAR, informed=lambda n: False):
    """Everything about a person, tick by tick."""
    rows = []
    for n in range(ticks + 1):
        person.step(tick(n), robot, informed(n))
        rows.append((tick(n), person.body, person.speed, person.request, person.measured))
    return rows


def straight(seconds=10, hz=25, gap=()):
    stamps = [
        i * 10**9 // hz for i in range(seconds * hz + 1) if not gap or not gap[0] < i / hz < gap[1]
    ]
    return Recording(
        "w", tuple(stamps), tuple(1.0 + 0.5e-9 * s for s in stamps), (5.0,) * len(stamps)
    )


def walker(
    tmp_path, steps, start="{x: 2.0, y: 2.0, yaw: 0.0}", extra="", requests=None, manner=ATTENTIVE
):
    path = tmp_path / "someone.yaml"
    path.write_text(f"user: someone\nstart: {start}\n{extra}steps:\n{steps}")
    return Walker(load_script(path), LAB.room, requests=requests, manner=manner)


# ---- recordings


@pytest.mark.requirement(24)
def test_a_replayed_person_is_where_the_recording_says():
    for now, body, speed, _, _ in play(Playback(straight(), LAB.room), 290):
        assert body.x == pytest.approx(1.0 + 0.5 * now * 1e-9, abs=1e-9)
        assert (body.y, body.yaw) == (5.0, 0.0)
        assert speed == pytest.approx(0.5, abs=1e-6)


def test_tracking_gives_every_row_at_most_once_with_its_own_stamp():
    samples = [row[4] for row in play(Playback(straight(), LAB.room), 320) if row[4] is not None]
    stamps = [sample.stamp_ns for sample in samples]
    assert stamps == [i * 10**9 // 25 for i in range(251)]
    assert samples[10].value.body.x == pytest.approx(1.0 + 0.5 * 0.4)


def test_a_gap_ends_as_recorded_even_if_the_person_stands_still_in_it():
    person = Playback(straight(gap=(4.0, 6.0)), LAB.room)
    seen = []
    for n in range(30 * 9):
        person.step(tick(n), FAR, 4.5 <= n / 30 < 8.0)
        seen.append(person.measured is not None)
    assert not any(seen[int(4.1 * 30) : int(5.9 * 30)])
    assert all(seen[int(6.1 * 30) :])


def test_in_a_gap_there_are_no_samples_and_the_true_person_walks_on():
    rows = play(Playback(straight(gap=(4.0, 6.0)), LAB.room), 290)
    for now, body, _, _, sample in rows:
        if 4.05e9 < now < 5.95e9:
            assert sample is None
        assert body.x == pytest.approx(1.0 + 0.5 * now * 1e-9, abs=1e-9)


def test_a_person_shown_the_robot_stops_within_half_a_second_and_goes_on_after_a_pause():
    person = Playback(straight(), LAB.room, manner=INSTANT)
    rows = play(person, 240, informed=lambda n: 30 <= n < 90)
    stopped = rows[46][1]
    assert all(body == stopped and speed == 0.0 for _, body, speed, _, _ in rows[46:180])
    assert all(sample is not None for *_, sample in rows[46:180])
    assert rows[240][1].x > stopped.x + 0.5
    steps = [b[1].x - a[1].x for a, b in itertools.pairwise(rows)]
    assert max(steps) <= 0.5 / 30 + 1e-9


def test_after_the_last_row_the_person_stands_and_tracking_is_silent():
    person = Playback(straight(seconds=2), LAB.room)
    rows = play(person, 90)
    assert person.finished
    assert rows[-1][1].x == pytest.approx(2.0)
    assert rows[-1][2] == 0.0
    assert rows[-1][4] is None


@pytest.mark.requirement(56, 131)
def test_a_replayed_person_can_stop_on_the_way_to_ask_for_touches():
    touch = Touch(10**9, 2 * 10**9, 10**9)
    rows = play(Playback(straight(), LAB.room, requests=2, touch=touch), 560)
    asked = [n for n, row in enumerate(rows) if row[3] is not None]
    assert [b - a for a, b in itertools.pairwise(asked) if b - a > 1] == [161]
    assert len(asked) == 2 * 60
    assert all(rows[n][2] == 0.0 and rows[n][4] is not None for n in asked[:50])
    assert rows[-1][1].x == pytest.approx(6.0, abs=1e-9)


def test_stamps_of_samples_always_rise_whatever_interrupts_the_walk():
    person = Playback(straight(gap=(4.0, 6.0)), LAB.room, requests=3)
    stamps = [r[4].stamp_ns for r in play(person, 4700, informed=lambda n: n % 100 < 20) if r[4]]
    assert all(b > a for a, b in itertools.pairwise(stamps))


# ---- where a recording is put


@pytest.mark.parametrize(
    ("text", "path", "person", "place"),
    [
        ("a/walk.txt", "a/walk.txt", None, None),
        ("walk.csv#12", "walk.csv", "12", None),
        ("walk.csv#12@1,-2,3.5", "walk.csv", "12", (1.0, -2.0, 3.5)),
        ("walk.txt@1,2,0", "walk.txt", None, (1.0, 2.0, 0.0)),
    ],
)
def test_a_source_names_file_person_and_place(text, path, person, place):
    source = parse_source(text)
    assert (source.path, source.person, source.place) == (Path(path), person, place)


@pytest.mark.parametrize("text", ["w.txt@1,2", "w.txt@1,2,x", "w.txt@", "w.txt@1,2,nan", "w.csv#"])
def test_a_source_that_cannot_be_read_says_what_is_needed(text):
    with pytest.raises(FileError, match=r"@x,y,yaw|an id must follow"):
        parse_source(text)


@pytest.mark.parametrize("length", [6.4, 8.2])
def test_by_default_the_first_yaw_that_keeps_the_whole_person_on_the_floor_is_taken(length):
    import shapely

    long = Recording("w", (0, 10**9), (0.0, length), (0.0, 0.0))
    placed = place_in_largest_disc(long, LAB.room, FAR)
    disc = LAB.room.largest_free_disc
    assert placed.middle == pytest.approx((disc.x, disc.y))

    def clear(k):
        dx, dy = (0.5 * length * f(k * math.pi / 8) for f in (math.cos, math.sin))
        line = shapely.LineString([(disc.x - dx, disc.y - dy), (disc.x + dx, disc.y + dy)])
        return LAB.room.free_space.contains(line.buffer(USER_RADIUS))

    first = next(k for k in range(16) if clear(k))
    assert first > 0
    yaw = math.atan2(placed.ys[1] - placed.ys[0], placed.xs[1] - placed.xs[0])
    assert yaw == pytest.approx(first * math.pi / 8)


def test_a_walk_that_fits_nowhere_is_an_error_that_says_so():
    long = Recording("w", (0, 10**9), (0.0, 20.0), (0.0, 0.0))
    with pytest.raises(FileError, match=r"20.00 m x 0.00 m does not fit .*@x,y,yaw"):
        place_in_largest_disc(long, LAB.room, FAR)


def test_a_place_in_a_wall_is_an_error_that_says_where(tmp_path):
    path = tmp_path / "walk.csv"
    path.write_text("t,x,y\n0,0,0\n1,1,0\n2,2,0\n")
    assert open_user(f"{path}@3,5,0", LAB).body.x == pytest.approx(2.0)
    with pytest.raises(FileError, match=r"would be at \(6.75, 5.15\) after 1.00 s"):
        open_user(f"{path}@6.75,5.15,0", LAB)


@pytest.mark.requirement(24)
@pytest.mark.parametrize("source", ["tum_room3.txt", "tum_room6.txt", "juelich_people.csv#5"])
def test_real_walks_fit_into_the_lab(source):
    if not (WALKING / source.partition("#")[0]).is_file():
        pytest.skip(f"no {WALKING / source}")
    person = open_user(str(WALKING / source), LAB)
    for _, body, *_ in play(person, 600)[::10]:
        assert LAB.room.clearance(body.x, body.y) >= USER_RADIUS - 1e-9


# ---- scripts


def test_the_shipped_scripts_load_and_start_in_their_scenes():
    assert script_names() == ("brief", "cornering", "demo", "stroller", "study", "visitor")
    for name in ("lab_a", "lab_b", "hall", "study"):
        scene = load_scene(name)
        assert not open_user(scene.user, scene).finished


@pytest.mark.requirement(130, 131, 132)
def test_the_study_script_stands_asks_and_waits_to_the_tick():
    person = open_user("study", load_scene("study"), requests=7)
    rows = play(person, 30 * 420)
    assert person.finished
    edges = [
        (n, row[1], row[3] is not None)
        for n, (before, row) in enumerate(itertools.pairwise(rows), start=1)
        if (before[3] is None) != (row[3] is None)
    ]
    starts, ends = edges[0::2], edges[1::2]
    assert len(starts) == len(ends) == 7
    for (begin, body, _), (end, _, _) in zip(starts, ends, strict=True):
        assert abs(end - begin - 30 * 30) <= 1
        assert all(rows[n][2] == 0.0 for n in range(begin - 10 * 30 + 1, end + 5 * 30 - 1))
        deep = rows[begin][3]
        assert math.dist((deep.x, deep.y), (body.x, body.y)) == pytest.approx(0.85)
        assert body.bearing_to(deep.flat()) == pytest.approx(0.0, abs=1e-9)
        assert deep.z == 1.5
    assert max(row[2] for row in rows) == 1.5


def test_the_study_poses_are_those_of_the_study():
    import json

    path = WALKING.parent / "floorplans/study.json"
    if not path.is_file():
        pytest.skip(f"no {path}")
    poses = [(u["x"], u["y"], u["heading"]) for u in json.loads(path.read_text())["users"]]
    walks = [step for step in load_script("study").steps if type(step).__name__ == "WalkStep"]
    assert [(w.x, w.y, w.yaw) for w in walks] == poses


def test_a_walk_turns_first_goes_straight_and_turns_at_its_end(tmp_path):
    person = walker(tmp_path, "  - walk: {x: 2.0, y: 4.0, yaw: 3.0, speed: 1.0}\n")
    rows = play(person, 120)
    moving = [row for row in rows if row[2] > 0.0]
    assert all(row[1].yaw == pytest.approx(math.pi / 2) and row[2] == 1.0 for row in moving)
    assert len(moving) == pytest.approx(60, abs=1)
    assert rows[-1][1] == Pose2(2.0, 4.0, 3.0)
    expected_ns = (math.pi / 2 / 3.0 + 2.0 + (3.0 - math.pi / 2) / 3.0) * 1e9
    first_finished = next(row[0] for row in rows if row[1] == rows[-1][1])
    assert 0 <= first_finished - expected_ns <= tick(1) + 1


def test_no_time_is_lost_between_steps_that_end_within_a_tick(tmp_path):
    steps = "  - walk: {x: 2.7, y: 2.0}\n  - stand: 0.11\n" + "  - walk: {x: 2.0, y: 2.0}\n"
    person = walker(tmp_path, steps * 1, extra="repeat: true\nspeed: 1.0\n")
    period = 2 * (0.7 + math.pi / 3.0) + 0.11
    rows = play(person, 1200)
    for n in range(100, 1200, 97):
        whole = (rows[n][0] * 1e-9 + math.pi / 3.0) % period
        if math.pi / 3.0 < whole < math.pi / 3.0 + 0.7:
            assert rows[n][1].x == pytest.approx(2.0 + whole - math.pi / 3.0, abs=1e-6)


def test_an_approach_follows_the_robot_and_stops_at_the_distance(tmp_path):
    person = walker(
        tmp_path, "  - approach: {target: robot, stop_at: 1.0, for: 20}\n  - stand: 9\n"
    )
    rows = play(person, 200, robot=Pose2(5.0, 5.0))
    assert rows[-1][1].distance_to(Pose2(5.0, 5.0)) == pytest.approx(1.0)
    assert rows[10][1].bearing_to(Pose2(5.0, 5.0)) == pytest.approx(0.0, abs=1e-9)


def test_an_approach_ends_when_the_robot_is_shown(tmp_path):
    steps = "  - approach: {target: robot, for: 60}\n  - stand: 60\n"
    person = walker(tmp_path, steps, manner=INSTANT)
    rows = play(person, 300, robot=Pose2(5.5, 9.0), informed=lambda n: 30 <= n < 60)
    assert rows[29][2] > rows[35][2] > rows[40][2] > 0.0
    assert all(row[2] == 0.0 for row in rows[45:])


def test_an_approach_goes_into_no_wall(tmp_path):
    person = walker(tmp_path, "  - approach: {target: robot, for: 60}\n")
    for row in play(person, 600, robot=Pose2(11.0, 1.0)):
        assert LAB.room.clearance(row[1].x, row[1].y) >= USER_RADIUS


def test_the_head_can_look_aside_and_tracking_can_be_lost(tmp_path):
    steps = "  - look: 0.5\n  - stand: 1\n  - lose_tracking: 1\n  - stand: 3\n"
    rows = play(walker(tmp_path, steps), 119)
    assert rows[5][4].value.head_yaw == pytest.approx(0.5)
    assert rows[5][4].value.body.yaw == 0.0
    lost = [now for now, *_, sample in rows if sample is None]
    assert (lost[0], lost[-1]) == (tick(30), tick(59))


def test_requests_bound_the_script_and_the_stand_after_the_last_is_kept(tmp_path):
    steps = "  - stand: 1\n  - request: {hold: 1}\n  - stand: 2\n  - walk: {x: 4.0, y: 2.0}\n"
    person = walker(tmp_path, steps, extra="repeat: true\n", requests=2)
    rows = play(person, 600)
    assert sum(a[3] is None and b[3] is not None for a, b in itertools.pairwise(rows)) == 2
    last = max(row[0] for row in rows if row[3] is not None)
    assert person.finished
    end = next(row[0] for row in rows if row[0] > last and row[1] == rows[-1][1])
    assert end <= last + 2.1e9


def test_a_round_without_time_does_not_hang(tmp_path):
    person = walker(tmp_path, "  - look: 0.5\n  - look: 0.1\n", extra="repeat: true\n")
    assert len(play(person, 10)) == 11
    person = walker(tmp_path, "  - stand: 0\n", extra="repeat: true\n", requests=3)
    assert len(play(person, 10)) == 11


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        (
            "  - walk: {x: 9.0, y: 1.0}\n",
            "4:5: the path from (2, 2) to (9, 1) leaves the",
        ),
        ("  - wolk: {x: 9.0, y: 1.0}\n", "4:5: steps[0].wolk: no such step; did you mean 'walk'?"),
        ("  - walk: {x: 3.0}\n", "the key 'y' is missing"),
        ("  - stand: -1\n", "steps[0].stand: -1 is out of range"),
        ("  - stand: .inf\n", "'.inf' is not a duration"),
        ("  - request: {hold: 0}\n", "0.1 to"),
        ("  - approach: {target: wall, for: 3}\n", "'wall' is not known; allowed: robot"),
        ("  - {stand: 1, turn: 2}\n", "a step has one key"),
        ("  []\n", "steps: is an empty list"),
    ],
)
def test_a_wrong_script_is_named_with_file_line_and_key(tmp_path, steps, message):
    with pytest.raises(FileError) as caught:
        walker(tmp_path, steps)
    assert any(part in str(caught.value) for part in message.split("|"))


def test_spans_speeds_and_angles_of_a_script_may_carry_units(tmp_path):
    steps = "  - stand: 2 min\n  - walk: {x: 300 cm, y: 2 m, speed: 3.6 km/h}\n  - turn: 90 deg\n"
    path = tmp_path / "someone.yaml"
    path.write_text(f"user: someone\nspeed: 120 cm/s\nsteps:\n{steps}")
    stand, walk, turn = load_script(path).steps
    assert stand.span_ns == 120 * 10**9
    assert (walk.x, walk.y, walk.speed) == (3.0, 2.0, 1.0)
    assert turn.yaw == math.pi / 2


def test_all_wrong_steps_of_a_script_are_told_at_once(tmp_path):
    steps = "  - stand: 2 m\n  - walk: {x: 3}\n  - look: 90\n  - turn: 0\n"
    with pytest.raises(FileError) as caught:
        walker(tmp_path, steps)
    assert [f.place.line for f in caught.value.findings] == [4, 5, 6]


def test_every_walk_that_leaves_the_floor_is_told(tmp_path):
    steps = "  - walk: {x: 9, y: 1}\n  - walk: {x: 2, y: 2}\n  - stand: 1\n"
    with pytest.raises(FileError) as caught:
        walker(tmp_path, steps)
    assert [f.place.line for f in caught.value.findings] == [4, 5]


def test_an_unknown_user_is_answered_with_a_suggestion():
    with pytest.raises(FileError, match="did you mean 'study'"):
        open_user("studi", LAB)


# ---- live


@pytest.mark.requirement(24)
def test_a_live_person_is_where_they_were_pushed_to():
    person = LivePerson(Pose2(1.0, 1.0))
    person.step(0, FAR, False)
    assert (person.body, person.measured, person.speed) == (Pose2(1.0, 1.0), None, 0.0)
    person.push(10_000_000, UserPose(Pose2(2.0, 2.0), 0.1))
    person.push(20_000_000, UserPose(Pose2(2.01, 2.0), 0.1))
    person.step(tick(1), FAR, False)
    assert person.measured.stamp_ns == 20_000_000
    assert person.body.x == 2.01
    assert person.speed == pytest.approx(1.0)
    person.step(tick(2), FAR, False)
    assert person.measured is None
    person.step(tick(30), FAR, False)
    assert person.speed == 0.0


@pytest.mark.requirement(15)
def test_a_live_request_is_a_level_and_nonsense_is_refused():
    person = LivePerson(Pose2(1.0, 1.0))
    deep = Pose3.from_yaw(2.0, 1.0, 1.5, 0.0)
    person.ask(deep)
    person.step(0, FAR, False)
    person.step(tick(1), FAR, False)
    assert person.request == deep
    person.let_go()
    person.step(tick(2), FAR, False)
    assert person.request is None
    with pytest.raises(ValueError, match="z is nan"):
        person.ask(Pose3(0.0, 0.0, math.nan))
    with pytest.raises(ValueError, match="x is nan"):
        person.push(5, UserPose(Pose2(math.nan, 0.0), 0.0))
    person.push(5, UserPose(Pose2(0.0, 0.0), 0.0))
    with pytest.raises(ValueError, match="is not after"):
        person.push(5, UserPose(Pose2(0.0, 0.0), 0.0))


def test_a_live_person_ends_when_told():
    person = open_user("live", LAB)
    person.end()
    person.step(0, FAR, False)
    assert person.finished
    assert person.body == LAB.user_start


# ---- what does not change


def test_a_person_who_stands_is_the_same_pose_again_and_again(tmp_path):
    rows = play(walker(tmp_path, "  - stand: 1\n  - walk: {x: 3.0, y: 2.0}\n"), 40)
    seen = [measured.value for *_, measured in rows]
    assert all(value is seen[0] for value in seen[:30])
    assert len({id(value) for value in seen[31:40]}) == 9


def test_a_recorded_person_who_stands_is_so_too():
    rows = play(Playback(straight(), LAB.room, requests=1, touch=Touch(10**9, 10**9, 10**9)), 250)
    seen = [measured.value for *_, measured in rows if measured is not None]
    assert all(later is pose for pose, later in itertools.pairwise(seen) if later == pose)
    assert sum(later is pose for pose, later in itertools.pairwise(seen)) > 80


def test_a_live_person_pushed_twice_to_one_place_is_the_same_pose():
    person = LivePerson(Pose2(0.0, 0.0))
    poses = []
    for n, x in enumerate((1.0, 1.0, 2.0)):
        person.push(tick(n), UserPose(Pose2(x, 0.0), 0.0))
        person.step(tick(n), FAR, False)
        poses.append(person.measured.value)
    assert poses[0] is poses[1]
    assert poses[2].body.x == 2.0


# ---- recordings and the shown robot


def stopped_before(robot, seed, *, requests=0, shown=(3.0, 25.0), ticks=1200):
    person = Playback(straight(), LAB.room, requests, Touch(10**9, 60 * 10**9, 10**9), seed=seed)
    return play(person, ticks, robot, informed=lambda n: shown[0] <= n / 30 < shown[1])


@pytest.mark.parametrize("seed", range(4))
def test_a_replayed_person_leaves_the_robot_they_stand_in_and_walks_back_to_go_on(seed):
    robot = Pose2(3.2, 5.2)
    rows = stopped_before(robot, seed)
    left = rows[int(24.9 * 30)][1]
    assert left.distance_to(robot) == pytest.approx(3.0, abs=0.1)
    set_off = next(n for n, row in enumerate(rows) if n > 150 and row[2] > 0.0)
    stood = rows[set_off - 1][1]
    gaps = [row[1].distance_to(robot) for row in rows[set_off : 25 * 30]]
    assert gaps == sorted(gaps)
    back = [n for n, row in enumerate(rows) if n > 25 * 30 and row[1].distance_to(stood) < 1e-6]
    assert back
    assert all(abs(row[1].y - 5.0) < 1e-9 for row in rows[back[-1] :])
    assert rows[-1][1].x == pytest.approx(6.0, abs=1e-6)
    steps = [b[1].distance_to(a[1]) for a, b in itertools.pairwise(rows)]
    assert max(steps) <= 1.2 / 30 + 1e-9
    stamps = [row[4].stamp_ns for row in rows if row[4]]
    assert all(a < b < a + 3 * 10**8 for a, b in itertools.pairwise(stamps))


def test_a_replayed_person_who_leaves_lets_go():
    rows = stopped_before(Pose2(4.6, 5.0), 1, requests=1, shown=(10.0, 30.0))
    assert rows[299][3] is not None
    assert rows[899][3] is None


def test_a_replayed_person_far_from_the_shown_robot_stays():
    rows = stopped_before(Pose2(6.0, 5.0), 0)
    assert rows[200][1] == rows[740][1]
