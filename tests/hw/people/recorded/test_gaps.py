"""Gaps of recorded walks, and where and how recordings are replayed around them."""

from __future__ import annotations

import math
import random
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from engine.files.finding import FileError
from hw.geometry import Pose2, wrap
from hw.people.recorded.recorded_walk import Playback
from hw.people.recorded.walk_file import Recording, read_recording
from hw.people.user import open_user, place_in_largest_disc
from hw.scene.scene import Scene, load_scene
from tests.hw.people.walks import shared
from tests.repeats import examples

LAB, STUDY = load_scene("lab_a"), load_scene("study")
FAR = Pose2(100.0, 100.0)
SPEED = 0.8

Rows = list[tuple[float, float, float]]


def walk(hz: float, seconds: float = 6.0) -> Rows:
    """Stamps, s, and positions, m, of a person who walks on a circle."""
    times = [n / hz for n in range(round(seconds * hz))]
    return [(t, 1.5 * math.cos(SPEED * t / 1.5), 1.5 * math.sin(SPEED * t / 1.5)) for t in times]


def read(folder: Path, rows: Rows) -> Recording:
    path = folder / "walk.csv"
    path.write_text("t,x,y\n" + "".join(f"{t:.6f},{x:.6f},{y:.6f}\n" for t, x, y in rows))
    return read_recording(path)


def moved(rows: Rows, since: int, far: float, until: int | None = None) -> Rows:
    """The rows from one on, up to another, moved by `far` m away from the centre of the circle."""
    x, y = rows[since][1] * far / 1.5, rows[since][2] * far / 1.5
    end = len(rows) if until is None else until
    moved = [(t, a + x, b + y) for t, a, b in rows[since:end]]
    return rows[:since] + moved + rows[end:]


@settings(max_examples=examples(60), deadline=None)
@given(
    hz=st.sampled_from([5.0, 25.0, 60.0, 120.0]),
    far=st.floats(1.8, 4.0),
    at=st.floats(1.0, 3.0),
)
def test_a_jump_is_a_gap_with_a_name_that_lasts_until_one_can_have_walked_there(
    tmp_path_factory: pytest.TempPathFactory, hz: float, far: float, at: float
) -> None:
    rows, row = walk(hz, 9.0), round(at * hz)
    found = read(tmp_path_factory.mktemp("walks"), moved(rows, row, far))

    (gap,) = found.gaps()
    assert gap.kind == "jump"
    assert gap.since_ns == pytest.approx(1e9 * rows[row - 1][0], abs=2e3)
    before, after = (found.stamps_ns.index(stamp) for stamp in gap[:2])
    assert after == before + 1
    crossed = math.dist(*((found.xs[n], found.ys[n]) for n in (before, after)))
    assert crossed <= 2.0 * (gap.until_ns - gap.since_ns) * 1e-9 + 1e-6
    assert (gap.until_ns - gap.since_ns) * 1e-9 <= (far + 0.1) / (2.0 - SPEED) + 2.0 / hz


@settings(max_examples=examples(40), deadline=None)
@given(hz=st.sampled_from([5.0, 25.0, 60.0]), seed=st.integers(0, 1000))
def test_noise_is_no_jump(tmp_path_factory: pytest.TempPathFactory, hz: float, seed: int) -> None:
    """A tenth of a metre either way, faster than anybody runs where rows are frequent."""
    chance = random.Random(seed)
    noisy = [
        (t, x + chance.uniform(-0.1, 0.1), y + chance.uniform(-0.1, 0.1)) for t, x, y in walk(hz)
    ]
    found = read(tmp_path_factory.mktemp("walks"), noisy)
    assert found.gaps() == ()
    assert len(found.xs) == len(noisy)


def test_a_place_far_off_for_an_instant_is_left_out(tmp_path: Path) -> None:
    rows = walk(25.0)
    found = read(tmp_path, moved(rows, 50, 3.0, 53))
    ((since, until, kind),) = found.gaps()
    assert (since, until, kind) == (49 * 40_000_000, 53 * 40_000_000, "jump")
    assert len(found.xs) == len(rows) - 3


def test_a_walk_ends_before_a_jump_that_there_is_no_time_to_cross(tmp_path: Path) -> None:
    rows = walk(25.0)
    found = read(tmp_path, moved(rows, len(rows) - 5, 3.0))
    assert found.gaps() == ()
    assert len(found.xs) == len(rows) - 5


def test_a_file_of_jumps_alone_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="jumps from the first row on; wrong unit"):
        read(tmp_path, [(0.0, 0.0, 0.0), (0.1, 50.0, 0.0), (0.2, 100.0, 0.0)])


@pytest.mark.parametrize("factor", [1.0, 2.5])
def test_jumps_keep_their_names_when_a_walk_is_placed_and_stretched(
    tmp_path: Path, factor: float
) -> None:
    found = read(tmp_path, moved(walk(25.0), 50, 3.0))
    changed = found.stretched(factor * max(found.size)).placed(1.0, 2.0, 0.5)
    ((since, _, kind),) = changed.gaps()
    assert kind == "jump"
    assert since == pytest.approx(factor * found.gaps()[0].since_ns, abs=2)


def test_across_a_jump_there_are_no_samples_and_the_true_person_walks_straight(
    tmp_path: Path,
) -> None:
    recording = read(tmp_path, moved(walk(60.0, 9.0), 120, 2.85))
    (gap,) = recording.gaps()
    person, before, fastest = Playback(recording, load_scene("hall").room), None, 0.0
    for n in range(1, 500):
        now = n * 10**9 // 60
        person.step(now, FAR, False)
        if gap.since_ns + 20_000_000 < now < gap.until_ns:
            assert person.measured is None
        if before is not None:
            fastest = max(fastest, 60.0 * person.body.distance_to(before))
        before = person.body
    assert 1.9 < fastest <= 2.0 + 1e-3


def test_a_jump_of_285_cm_in_16_ms_in_a_real_walk_is_named(tmp_path: Path) -> None:
    lines = shared("tum_room6.txt").read_text().splitlines()
    rows = [tuple(map(float, line.split()[:3])) for line in lines[1::2]]
    jumped = [(t, x + (2.85 if n >= 1000 else 0.0), y) for n, (t, x, y) in enumerate(rows)]
    kinds = [gap.kind for gap in read(tmp_path, jumped).gaps()]
    assert kinds[0] == "jump"
    assert set(kinds[1:]) == {"drop-out"}


@pytest.mark.parametrize(
    ("name", "person"),
    [
        ("tum_room3.txt", None),
        ("tum_room6.txt", None),
        ("sdu_uwb.csv", None),
        *(("juelich_people.csv", str(n)) for n in range(1, 13)),
    ],
)
def test_in_real_walks_nothing_is_taken_for_a_jump(name: str, person: str | None) -> None:
    assert {gap.kind for gap in read_recording(shared(name), person).gaps()} <= {"drop-out"}


# ---- where it is put


def begins(recording: Recording, scene: Scene) -> float:
    placed = place_in_largest_disc(recording, scene.room, scene.robot_start)
    return math.dist((placed.xs[0], placed.ys[0]), (scene.robot_start.x, scene.robot_start.y))


@settings(max_examples=examples(40), deadline=None)
@given(
    x=st.floats(0.3, 3.0),
    y=st.floats(-2.0, 2.0),
    back=st.floats(0.1, 2.0),
    scene=st.sampled_from([LAB, STUDY, load_scene("hall")]),
)
def test_by_default_nobody_begins_on_the_robot(
    x: float, y: float, back: float, scene: Scene
) -> None:
    stamps = (0, 4 * 10**9, 8 * 10**9)
    assert begins(Recording("w", stamps, (0.0, x, -back), (0.0, y, 0.0)), scene) >= 1.27


@pytest.mark.parametrize("size", [None, 3.0, 4.0, 6.0])
def test_real_walks_begin_off_the_robot_of_the_study(size: float | None) -> None:
    for name, person in (("tum_room3.txt", None), ("juelich_people.csv", "4")):
        recording = read_recording(shared(name), person)
        recording = recording if size is None else recording.stretched(size)
        assert begins(recording, STUDY) >= 1.27


# ---- headings


@settings(max_examples=examples(40), deadline=None)
@given(cut=st.integers(20, 140), seed=st.integers(0, 100))
def test_causal_headings_do_not_know_what_comes(cut: int, seed: int) -> None:
    chance = random.Random(seed)
    steps = [(0.04 * chance.uniform(0.2, 1), chance.uniform(-math.pi, math.pi)) for _ in range(150)]
    xs, ys = [0.0], [0.0]
    for length, yaw in steps:
        xs.append(xs[-1] + length)
        ys.append(ys[-1] + 0.3 * length * math.sin(yaw))
    stamps = tuple(n * 40_000_000 for n in range(151))
    whole = Recording("w", stamps, tuple(xs), tuple(ys))
    part = Recording("w", stamps[:cut], tuple(xs[:cut]), tuple(ys[:cut]))
    first = 13  # the heading of the first step is that from the beginning
    assert whole.motion(causal=True)[0][first:cut] == part.motion(causal=True)[0][first:]
    assert whole.motion(causal=True)[1] == whole.motion()[1]


def test_a_causal_heading_follows_a_turning_body_by_a_quarter_of_a_second() -> None:
    rows = walk(25.0)
    stamps = tuple(round(t * 1e9) for t, *_ in rows)
    recording = Recording("w", stamps, tuple(x for _, x, _ in rows), tuple(y for *_, y in rows))
    centred, causal = (recording.motion(causal=causal)[0] for causal in (False, True))
    lags = [wrap(a - b) for a, b in zip(centred[20:-20], causal[20:-20], strict=True)]
    assert lags == pytest.approx([0.25 * SPEED / 1.5] * len(lags), abs=0.02)


def test_causal_headings_are_chosen_for_recordings_only(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    path.write_text("t,x,y\n" + "".join(f"{t:.6f},{x},{y}\n" for t, x, y in walk(25.0)))
    yaws = []
    for heading in ("centred", "causal"):
        person = open_user(str(path), LAB, heading=heading)
        person.step(3 * 10**9, FAR, False)
        yaws.append(person.measured.value.body.yaw)
    assert wrap(yaws[0] - yaws[1]) == pytest.approx(0.25 * SPEED / 1.5, abs=0.02)
    with pytest.raises(FileError, match="only a recording has headings"):
        open_user("random", LAB, heading="causal")
