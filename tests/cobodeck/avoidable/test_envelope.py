"""The search for a way out: geometry, kinematics, and what can be computed by hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings, strategies as st

from cobodeck.avoidable import motion_search as search
from cobodeck.avoidable.envelope import (
    STANDING,
    Oncoming,
    asked,
    gap_beside_turning,
    least_distance,
    wall_behind,
)
from cobodeck.avoidable.motion_search import (
    STEP_S,
    BestMotion,
    Question,
    RobotLimits,
    RobotState,
    Walk,
    best_motion,
    clear_after,
    is_avoidable,
)
from cobodeck.avoidable.motions import ACCELERATE, BRAKE, CENTRES, GAP, ZONES, moved
from cobodeck.avoidable.recorded_escapes import edges
from cobodeck.avoidable.shapes import meets_walls, way_distance
from cobodeck.bench import envelope_bench as bench
from tests.repeats import examples

LIMITS = RobotLimits(1.0, 3.0, 2.5, 0.565, 0.455)
ROOM = ((0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0))
COLUMN = ((3.0, 2.2), (3.3, 2.2), (3.3, 2.8), (3.0, 2.8))
FLOOR = shapely.Polygon(ROOM, [COLUMN])

coordinate = st.floats(-3.0, 3.0).map(lambda value: round(value, 3))
angle = st.floats(-3.1, 3.1).map(lambda value: round(value, 3))
half = st.floats(0.2, 1.0).map(lambda value: round(value, 3))


def straight(x: float, y: float, vx: float, vy: float, view: float | None = None) -> Walk:
    """Someone who walks straight for 20 s."""
    looks = math.atan2(vy, vx) if view is None else view
    return Walk(np.array([0.0, 20.0]), np.array([(x, y, looks), (x + 20 * vx, y + 20 * vy, looks)]))


def box(pose: np.ndarray, a: float = 0.565, b: float = 0.455) -> shapely.Polygon:
    x, y, yaw = pose
    flat = shapely.affinity.rotate(shapely.box(-a, -b, a, b), yaw, (0, 0), use_radians=True)
    return shapely.affinity.translate(flat, x, y)


# geometry


@given(half, half, coordinate, coordinate, coordinate, coordinate)
@example(1.0, 0.5, -3.0, 1.5, 3.0, -1.5)  # through both diagonal corners' neighbourhood
@example(1.0, 0.5, 2.0, 2.0, 2.0, 2.0)  # no way at all
def test_the_distance_of_a_way_is_that_of_a_line(a, b, x0, y0, x1, y1) -> None:
    line = shapely.LineString([(x0, y0), (x1, y1)])

    found = way_distance(a, b, x0, y0, x1, y1)

    assert found == pytest.approx(shapely.distance(shapely.box(-a, -b, a, b), line), abs=1e-9)


@given(coordinate, coordinate, angle, st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_a_wall_is_met_exactly_if_the_swept_outline_meets_it(x, y, yaw, dx, dy) -> None:
    x, y = x + 3.0, y + 2.5
    before, after = box(np.array([x, y, yaw])), box(np.array([x + dx, y + dy, yaw]))
    swept = shapely.union(before, after).convex_hull
    rings = shapely.union_all([shapely.LinearRing(ROOM), shapely.LinearRing(COLUMN)])
    assume(not before.intersects(rings))
    assume(abs(shapely.distance(swept, rings)) > 1e-6 or swept.intersection(rings).length > 1e-6)

    c, s = math.cos(yaw), math.sin(yaw)
    poses = (x, y, c, s), (x + dx, y + dy, c, s)

    assert meets_walls(0.565, 0.455, *poses, edges((ROOM, COLUMN))) == swept.intersects(rings)


# what can be computed by hand


@pytest.mark.parametrize(("acceleration", "distance"), [(1.5, 2.32), (3.0, 1.945)])
def test_straight_away_is_best_on_an_open_floor(acceleration: float, distance: float) -> None:
    """Nearest once it is as fast as the person: clear + v delay + v^2 / 2a."""
    assert distance == pytest.approx(1.27 + 1.5 * 0.2 + 1.5**2 / (2 * acceleration), abs=1e-3)

    found = least_distance(Oncoming(acceleration=acceleration), CENTRES)

    assert found == pytest.approx(distance, abs=0.01)


@pytest.mark.parametrize(("reaction", "distance"), [(0.3, 2.395), (0.8, 3.145)])
def test_a_robot_that_stands_relies_on_the_sign_alone(reaction: float, distance: float) -> None:
    assert distance == pytest.approx(1.27 + 1.5 * (0.2 + reaction + 0.25))

    stays = Oncoming(acceleration=STANDING, reaction_s=reaction)

    assert least_distance(stays, CENTRES) == pytest.approx(distance, abs=0.01)


def test_the_worst_yaw_of_the_robot_counts() -> None:
    """A corner, turned by 45 degrees, reaches farthest of the yaws that are tried."""
    ahead, aside = (0.565 + 0.455) / math.sqrt(2.0), (0.565 - 0.455) / math.sqrt(2.0)
    at_touch = ahead + math.sqrt(0.5**2 - aside**2)

    found = least_distance(Oncoming(acceleration=3.0), GAP)

    assert found == pytest.approx(at_touch + 1.5 * 0.2 + 1.5**2 / 6.0, abs=0.015)


@pytest.mark.parametrize(("acceleration", "distance"), [(1.5, 3.55), (3.0, 3.175)])
def test_no_escape_is_needed_from_beyond_the_zone_ahead(acceleration, distance) -> None:
    assert least_distance(Oncoming(acceleration=acceleration), ZONES) == pytest.approx(
        distance, abs=0.01
    )


def test_who_walks_past_touches_nobody() -> None:
    past = Question(RobotState(0.0, 0.0, 0.0), LIMITS, straight(-3.0, 1.2, 1.5, 0.0))

    found = best_motion(past)

    assert found is not None
    assert found.free
    assert found.gap > 1.2 - 0.455 - 0.5  # the gap when it stays


def test_from_a_metre_and_a_bit_there_is_no_way_out() -> None:
    assert not is_avoidable(asked(Oncoming(), 1.3))
    assert is_avoidable(asked(Oncoming(), 2.6))
    assert not is_avoidable(asked(Oncoming(), 2.6), margin=0.3)


def test_behind_a_wall_it_takes_more_room() -> None:
    assert is_avoidable(asked(Oncoming(), 2.6))
    assert not is_avoidable(asked(Oncoming(wall=True), 2.6))


def test_who_turns_first_gives_time_only_if_the_turn_is_seen() -> None:
    right, about = math.pi / 2, math.pi
    walk = gap_beside_turning(right, seen="walk")

    assert gap_beside_turning(about, seen="walk") == pytest.approx(walk, abs=1e-6)
    assert gap_beside_turning(about) > gap_beside_turning(right) > walk + 0.5


def test_who_sees_the_sign_while_turning_does_not_set_off() -> None:
    """The turn takes 1.05 s; the sign is there at 0.2 s, and they have stopped 0.8 s later."""
    heeds = Oncoming(acceleration=STANDING, reaction_s=0.3)

    gap = gap_beside_turning(math.pi, approach=heeds)
    late = gap_beside_turning(math.pi, seen="walk", approach=heeds)

    ahead, aside = (0.565 + 0.455) / math.sqrt(2.0), (0.565 - 0.455) / math.sqrt(2.0)
    assert gap == pytest.approx(math.hypot(2.5 - ahead, aside) - 0.5, abs=1e-6)  # at a corner
    nearer = 2.5 - 1.5 * (0.2 + 0.3 + 0.25)
    assert late == pytest.approx(math.hypot(nearer - ahead, aside) - 0.5, abs=1e-3)


@given(st.floats(1.2, 4.0), st.floats(0.02, 0.5))
@settings(max_examples=examples(40))
def test_more_distance_is_never_worse(distance: float, more: float) -> None:
    nearer, farther = (best_motion(asked(Oncoming(), d, 0.4)) for d in (distance, distance + more))

    assert nearer is not None
    assert farther is not None
    assert farther.gap >= nearer.gap - 1e-9


def test_more_acceleration_and_less_delay_need_less_distance() -> None:
    found = [least_distance(Oncoming(1.5, a, 0.2, 0.3), CENTRES) for a in (0.5, 1.0, 2.0)]
    late = [least_distance(Oncoming(1.5, 2.0, delay, 0.3), CENTRES) for delay in (0.0, 0.2, 0.4)]

    assert found == sorted(found, reverse=True)
    assert found[0] > found[-1] + 0.1
    assert late == sorted(late)
    assert late[0] < late[-1] - 0.3


# properties of the motions


@given(coordinate, coordinate, angle, angle, st.floats(0.0, 2.0), angle)
@settings(max_examples=examples(40))
def test_turned_or_mirrored_a_case_has_the_same_result(x, y, yaw, heading, speed, turn) -> None:
    assume(math.hypot(x, y) > 1.3)
    vx, vy = speed * math.cos(heading), speed * math.sin(heading)
    c, s = math.cos(turn), math.sin(turn)
    case = RobotState(0.0, 0.0, yaw, 0.3, 0.2), straight(x, y, vx, vy)
    turned = (
        RobotState(0.0, 0.0, yaw + turn, 0.3 * c - 0.2 * s, 0.3 * s + 0.2 * c),
        straight(c * x - s * y, s * x + c * y, c * vx - s * vy, s * vx + c * vy),
    )
    mirrored = RobotState(0.0, 0.0, -yaw, 0.3, -0.2), straight(x, -y, vx, -vy)

    gaps = [
        found.gap
        for robot, walk in (case, turned, mirrored)
        if (found := best_motion(Question(robot, LIMITS, walk, horizon_s=1.5))) is not None
    ]

    assert gaps == pytest.approx([gaps[0]] * 3, abs=1e-6)


def speeds_of(found: BestMotion) -> np.ndarray:
    return np.diff(found.poses[:, :2], axis=0) / STEP_S


@given(
    st.floats(0.8, 5.2), st.floats(0.8, 4.2), angle, st.floats(-0.6, 0.6), st.floats(-0.6, 0.6),
    st.floats(0.6, 5.4), st.floats(0.6, 4.4), angle,
)  # fmt: skip
@settings(max_examples=examples(60))
def test_a_motion_keeps_to_the_floor_and_to_the_limits(x, y, yaw, vx, vy, px, py, heading) -> None:
    start = box(np.array([x, y, yaw]))
    assume(start.within(FLOOR.buffer(-0.01)))
    walk = straight(px, py, 1.2 * math.cos(heading), 1.2 * math.sin(heading))
    question = Question(
        RobotState(x, y, yaw, vx, vy, 0.4), LIMITS, walk, walls=edges((ROOM, COLUMN))
    )

    found = best_motion(question)

    if found is None:
        assert math.hypot(vx, vy) > 0.0  # standing would have been a motion
        return
    assert all(box(pose).within(FLOOR.buffer(1e-6)) for pose in found.poses)
    velocities = np.vstack([[vx, vy], speeds_of(found)])
    assert np.hypot(*velocities.T).max() <= LIMITS.speed + 1e-9
    changes = np.hypot(*np.diff(velocities, axis=0).T) / STEP_S
    assert changes.max() <= LIMITS.braking + 1e-6
    speeding = np.diff(np.hypot(*velocities.T)) / STEP_S
    assert speeding.max() <= LIMITS.acceleration + 1e-6
    left = np.hypot(*velocities[-1]) ** 2 / (2 * LIMITS.braking)
    ahead = shapely.LineString([found.poses[-1, :2], found.poses[-1, :2] + 1e-9])
    if left > 0.05:  # it can still stop before a wall
        unit = velocities[-1] / np.hypot(*velocities[-1])
        ahead = shapely.LineString([found.poses[-1, :2], found.poses[-1, :2] + 0.9 * left * unit])
    assert ahead.within(FLOOR)


@pytest.mark.parametrize(("start", "fastest"), [(0.0, 0.8), (0.3, 0.8), (1.2, 1.2)])
def test_no_motion_is_faster_than_allowed_or_than_at_its_start(start, fastest) -> None:
    slow = RobotLimits(1.0, 3.0, 0.8, 0.565, 0.455)
    robot = RobotState(0.0, 0.0, 0.0, 0.0, start)

    found = best_motion(Question(robot, slow, straight(-3.0, 0.1, 1.5, 0.0)))

    assert found is not None
    velocities = np.vstack([[0.0, start], speeds_of(found)])
    assert np.hypot(*velocities.T).max() == pytest.approx(fastest, abs=1e-6)
    assert np.hypot(*np.diff(velocities, axis=0).T).max() <= STEP_S * slow.braking + 1e-9


@given(st.floats(0.01, 2.4), st.floats(0.01, 2.4), st.integers(1, 16))
def test_uniform_acceleration_and_braking_are_exact(vx: float, vy: float, steps: int) -> None:
    task = search._task(asked(Oncoming(), 3.0), math.inf)
    push, brakes, _, h = task.limits
    speed = math.hypot(vx, vy)

    rest = 0.0, 0.0, vx, vy
    while rest[2:] != (0.0, 0.0):
        rest = moved(task, rest, (BRAKE, 0.0, 0.0))
    pushed = 0.0, 0.0, 0.1, 0.0
    for _ in range(steps):
        pushed = moved(task, pushed, (ACCELERATE, 0.6, -0.8))

    assert math.hypot(*rest[:2]) == pytest.approx(speed**2 / (2 * brakes), abs=1e-9)
    t = steps * h
    assert pushed == pytest.approx(
        (0.1 * t + 0.3 * push * t**2, -0.4 * push * t**2, 0.1 + 0.6 * push * t, -0.8 * push * t)
    )


def test_the_gap_told_is_that_of_the_path_told() -> None:
    question = asked(Oncoming(wall=True), 2.6, 0.4)
    found = best_motion(question)
    assert found is not None
    fine = np.arange(0.0, found.times[-1], 0.002)
    path = np.column_stack([np.interp(fine, found.times, column) for column in found.poses.T])
    person = question.walk.at(fine)

    gaps = [
        box(pose).distance(shapely.Point(place[:2])) - 0.5
        for pose, place in zip(path, person, strict=True)
    ]

    assert found.gap == pytest.approx(min(gaps), abs=2e-3)
    assert math.isclose(sum(span for _, span in found.phases) + 0.2, found.times[-1])


def test_out_of_the_zones_for_good_is_told() -> None:
    away = np.linspace(1.0, 4.0, 61)
    places = np.column_stack([away, 0.0 * away])
    ahead, beside = (np.tile((0.0, 0.0, view), (61, 1)) for view in (0.6, 0.7))

    assert clear_after(places, ahead) == pytest.approx(1.5)  # at 2.5 m
    assert clear_after(places, beside) == pytest.approx(0.5)  # at 1.5 m
    assert clear_after(places[::-1], beside) is None
    assert clear_after(places[40:], ahead[40:]) == 0.0


# against all motions, written out


HOLDS, TURNS = (0.2, 0.4), 4


def written_out(away: float, horizon: float) -> Iterator[tuple[tuple[str, float, float], ...]]:
    """All motions of up to three phases: kind, direction, duration."""
    kinds = [("coast", 0.0), ("brake", 0.0)]
    kinds += [("push", away + n * math.tau / TURNS) for n in range(TURNS)]
    for count in (1, 2, 3):
        for choice in itertools.product(kinds, repeat=count):
            if any(a == b for a, b in itertools.pairwise(choice)):
                continue
            for holds in itertools.product(HOLDS, repeat=count - 1):
                if sum(holds) < horizon:
                    spans = (*holds, horizon - sum(holds))
                    yield tuple((*kind, span) for kind, span in zip(choice, spans, strict=True))


def place_at(motion, time: float, start: complex, velocity: complex) -> complex:
    """Where a motion is after `time`, by formulas of uniform acceleration."""
    for kind, direction, span in motion:
        left = min(time, span)
        time -= left
        speed = abs(velocity)
        if kind == "push":
            push = LIMITS.acceleration * complex(math.cos(direction), math.sin(direction))
            start += velocity * left + 0.5 * push * left**2
            velocity += push * left
        elif kind == "coast" or speed == 0.0:
            start += velocity * left
        else:
            braking = min(left, speed / LIMITS.braking)
            start += velocity * braking * (1 - 0.5 * LIMITS.braking * braking / speed)
            velocity *= 1 - LIMITS.braking * braking / speed
        if time <= 0.0:
            break
    return start


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.few(2)
def test_no_motion_written_out_is_better(seed: int) -> None:
    rng = np.random.default_rng(seed)
    yaw, bearing = rng.uniform(-3.0, 3.0, 2)
    velocity = complex(*rng.uniform(-0.4, 0.4, 2))
    person = 1.7 * complex(math.cos(bearing), math.sin(bearing)) + complex(3.0, 1.2)
    walk = 1.3 * -(person - complex(3.0, 1.2)) / 1.7
    ring = ((1.4, 0.0), (5.0, 0.0), (5.0, 3.0), (1.4, 3.0))
    horizon = 1.2
    question = Question(
        RobotState(3.0, 1.2, yaw, velocity.real, velocity.imag),
        LIMITS,
        straight(person.real, person.imag, walk.real, walk.imag),
        horizon_s=horizon,
        walls=edges((ring,)),
        grid=search.SearchGrid(directions=TURNS, holds_s=HOLDS),
    )

    found = best_motion(question)

    times = np.arange(0.0, horizon + 1e-9, 0.01)
    room = shapely.Polygon(ring)
    motions = list(written_out(math.atan2(1.2 - person.imag, 3.0 - person.real), horizon))
    best = -math.inf
    outline = np.array([(0.565, 0.455), (-0.565, 0.455), (-0.565, -0.455), (0.565, -0.455)])
    turned = outline @ np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    people = shapely.points([(z.real, z.imag) for z in (person + walk * t for t in times)])
    for motion in motions:
        way = [place_at(motion, t, complex(3.0, 1.2), velocity) for t in times]
        boxes = shapely.polygons([turned + np.array([z.real, z.imag]) for z in way])
        end = (way[-1] - place_at(motion, horizon - 1e-4, complex(3.0, 1.2), velocity)) / 1e-4
        stop = way[-1] + end * abs(end) / (2 * LIMITS.braking)
        rest = shapely.Polygon(turned + np.array([stop.real, stop.imag]))
        if shapely.within(boxes, room).all() and rest.within(room):
            best = max(best, float(shapely.distance(boxes, people).min()) - 0.5)
    assert found is not None
    assert found.gap == pytest.approx(best, abs=0.01)
    assert found.tried == len(motions)


def test_the_search_is_exhaustive() -> None:
    found = best_motion(asked(Oncoming(), 2.5))

    assert found is not None
    assert found.tried >= 20_000


def test_the_wall_behind_closes_the_floor() -> None:
    wall = wall_behind()

    assert (wall[:, :2] == np.roll(wall[:, 2:], 1, axis=0)).all()
    assert wall[:, 0].min() == 1.5


# the benchmark


def test_the_rows_are_those_of_the_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "ACCELERATIONS", (1.5, 3.0))
    monkeypatch.setattr(bench, "REACTIONS_S", (0.3,))
    monkeypatch.setattr(bench, "SPEEDS", (0.5,))
    monkeypatch.setattr(bench, "DELAYS_S", (0.0,))
    monkeypatch.setattr(bench, "TURNS_DEG", (90,))
    monkeypatch.setattr(bench, "KNOBS", {"directions": (6,), "step": (0.2,), "durations": (1,)})
    monkeypatch.setattr(bench, "FINE", {"directions": 12, "step": 0.1, "durations": 2})

    rows = list(bench.rows(1))

    searches, others = (
        [row for row in rows if (row.name == "search") == is_search] for is_search in (True, False)
    )
    assert len(searches) >= 3
    errors = {(row.name, row.variant, row.value): row.error for row in others}
    assert len(errors) == len(others) == 3 * (2 + 1 + 1 + 2 + 1 + 1) + 4
    assert errors["walks on", "1.27 m apart", 0.5] == pytest.approx(1.27 + 0.1 + 0.125, abs=0.01)
    assert errors["walks on", "no Escape", 0.0] == pytest.approx(2.5 + 1.125, abs=0.01)
    assert errors["walks on", "1.27 m apart", 3.0] == pytest.approx(1.945, abs=0.01)
    assert errors["walks on", "no Escape", 1.5] == pytest.approx(3.55, abs=0.01)
    assert errors["sign, robot stands", "1.27 m apart", 0.3] == pytest.approx(2.395, abs=0.01)
    apart, touch = (errors["wall behind", aim, 1.0] for aim in ("1.27 m apart", "no touch"))
    assert apart > touch > errors["walks on", "no touch", 1.5]
