"""The risk of waiting places, against plain geometry with shapely."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from shapely.geometry import LineString, Point, Polygon

from behaviors.person.waiting import risks, way_risks
from behaviors.profile.profile import Profile
from behaviors.situation.present_situation import Situation
from hw.geometry import Pose2
from hw.samples import UserPose
from hw.scene.room import Room
from tests.repeats import examples

COLUMN = ((5.0, 2.0), (5.4, 2.0), (5.4, 3.1), (5.0, 3.1))
OUTER = ((0.0, 0.0), (9.0, 0.0), (9.0, 7.0), (0.0, 7.0))
ROOM = Room(outer=OUTER, columns=(COLUMN,))
LARGE = Room(outer=((-30.0, -30.0), (30.0, -30.0), (30.0, 30.0), (-30.0, 30.0)))
FLOOR = Polygon(OUTER, [COLUMN])
CLEAR = 0.77


def length_of(user: complex, angle: float) -> float:
    """How far a person can walk from here in this direction, m."""
    ray = LineString([(user.real, user.imag), _pair(user + cmath.rect(8.0, angle))])
    inside = ray.intersection(FLOOR)
    parts = getattr(inside, "geoms", [inside])
    first = min(parts, key=lambda part: part.distance(Point(user.real, user.imag)))
    return float(first.length)


def _pair(place: complex) -> tuple[float, float]:
    return place.real, place.imag


def time_aside(place: complex, onto: complex, reach: float, acceleration: float) -> float:
    """From standstill to `reach` away from a line of walk, on the side of `onto`, s."""
    if FLOOR.boundary.distance(Point(*_pair(onto))) < CLEAR or not FLOOR.contains(
        Point(*_pair(onto))
    ):
        return math.inf
    return math.sqrt(2.0 * abs(onto - place) / acceleration)


def expected(
    place: complex, user: complex, facing: float, contact: float, acceleration: float
) -> float:
    """The lack of time in each direction, weighed by the squared length of walk in it."""
    lacks, weights = [], []
    for step in range(36):
        angle = 2.0 * math.pi * step / 36
        way = length_of(user, angle)
        weights.append(way**2)
        seen = (place - user) * cmath.exp(-1j * angle)  # ahead, and to the left of the line
        if seen.real <= 0.0 or abs(seen.imag) >= contact:
            lacks.append(0.0)
            continue
        reach = seen.real - math.sqrt(contact**2 - seen.imag**2)
        if reach > way:
            lacks.append(0.0)
            continue
        turn = abs(cmath.phase(cmath.exp(1j * (angle - facing))))
        has = max(0.0, reach) / 1.3 + turn / 3.0
        across = cmath.rect(1.0, angle + 0.5 * math.pi)
        sides = [place + across * (side * contact - seen.imag) for side in (1.0, -1.0)]
        needs = min(time_aside(place, onto, contact, acceleration) for onto in sides)
        needs = min(3.0, 0.4 + needs)
        lack = max(0.0, needs + 0.3 - has)
        lacks.append(lack + 0.5 if lack > 0.3 else lack)
    return sum(map(float.__mul__, weights, lacks)) / sum(weights)


def risk_at(now: Situation, *places: complex) -> list[float]:
    found: list[float] = risks(now, np.array([_pair(place) for place in places])).tolist()
    return found


@pytest.mark.requirement(95, 103)
@given(
    x=st.floats(0.81, 8.13), y=st.floats(0.83, 6.17), facing=st.floats(-3.1, 3.1),
    places=st.lists(st.tuples(st.floats(0.9, 8.1), st.floats(0.9, 6.1)), min_size=1, max_size=4),
)  # fmt: skip
@settings(deadline=None, max_examples=examples(80))
def test_the_risk_is_lack_of_time_and_escapes_over_all_lines_of_walk(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    x: float,
    y: float,
    facing: float,
    places: list[tuple[float, float]],
) -> None:
    user = complex(x + 0.00137, y + 0.00071)  # no line of walk runs along a wall
    if not FLOOR.contains(Point(*_pair(user))):
        return
    stood = UserPose(Pose2(user.real, user.imag, facing), facing)
    now = situation_of(tuned, Pose2(4.0, 4.0), stood, room=ROOM)
    there = [complex(a + 0.00093, b + 0.00059) for a, b in places]

    found = risk_at(now, *there)

    rules, limits = now.settings.escape, now.environment.limits
    for place, risk in zip(there, found, strict=True):
        exact = expected(place, user, facing, rules.contact, limits.base_acceleration)
        assert risk == pytest.approx(exact, abs=1e-6)


def alone(tuned: Profile, situation_of: Callable[..., Situation], facing: float = 0.0) -> Situation:
    return situation_of(
        tuned, Pose2(5.0, 5.0), UserPose(Pose2(0.0, 0.0, facing), facing), room=LARGE
    )


@pytest.mark.requirement(103)
@given(bearing=st.floats(-3.1, 3.1), radius=st.floats(1.3, 6.0), farther=st.floats(0.1, 3.0))
@settings(deadline=None, max_examples=examples(100))
def test_on_open_floor_the_risk_never_grows_with_the_distance_nor_with_the_turn_to_there(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    bearing: float,
    radius: float,
    farther: float,
) -> None:
    """As many lines of walk or fewer meet a place that is farther off, and later.

    So they do one to which the user has to turn farther, if that holds for each of these lines.
    """
    now = alone(tuned, situation_of)
    step = 2.0 * math.pi / 36
    direction = step * round(bearing / step)

    near, far = risk_at(now, cmath.rect(radius, direction), cmath.rect(radius + farther, direction))
    assert far <= near + 1e-9
    behind = direction + (step if direction >= 0.0 else -step)
    to_the_edge = math.asin(min(1.0, now.settings.escape.contact / radius))
    if to_the_edge <= abs(direction) and abs(behind) + to_the_edge <= math.pi:
        [turned] = risk_at(now, cmath.rect(radius, behind))
        assert turned <= near + 1e-9


@pytest.mark.requirement(103)
def test_far_away_and_behind_a_wall_there_is_no_risk(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    assert risk_at(alone(tuned, situation_of), 20.0 + 0.0j) == [0.0]
    wall = ((2.5, -5.0), (2.6, -5.0), (2.6, 5.0), (2.5, 5.0))
    room = Room(outer=LARGE.outer, columns=(wall,))
    user = UserPose(Pose2(0.0, 0.0), 0.0)

    [open_floor] = risk_at(alone(tuned, situation_of), 4.0 + 0.0j)
    [walled] = risk_at(situation_of(tuned, Pose2(8.0, 8.0), user, room=room), 4.0 + 0.0j)

    assert open_floor > 0.0
    assert walled == 0.0


@pytest.mark.requirement(103)
def test_walls_beside_a_place_raise_its_risk_more_if_they_are_on_both_sides(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    """A user who looks along an alley; its walls begin beside the robot."""
    user, place = UserPose(Pose2(0.0, 0.0), 0.0), 3.0 + 0.3j
    left = ((2.0, 1.2), (4.0, 1.2), (4.0, 1.4), (2.0, 1.4))
    right = tuple((x, -y) for x, y in left)
    found = [
        risk_at(
            situation_of(
                tuned, Pose2(9.0, 9.0), user, room=Room(outer=LARGE.outer, columns=columns)
            ),
            place,
        )[0]
        for columns in ((), (left,), (left, right))
    ]

    assert found[0] < found[1] < found[2]


def test_every_place_is_weighed_by_itself(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    now, places = alone(tuned, situation_of), (2.0 + 0.1j, -2.0 + 1.0j, 0.5 - 3.0j)

    assert risk_at(now, *places) == [risk_at(now, place)[0] for place in places]


def on_the_way(start: complex, end: complex, user: complex, apart: float) -> list[complex]:
    """Points of the straight way, each pushed away from the user until `apart` from them."""
    points = [start + share * (end - start) for share in (0.15, 0.4, 0.65, 0.9)]
    return [
        point if abs(point - user) >= apart else user + cmath.rect(apart, cmath.phase(point - user))
        for point in points
    ]


@pytest.mark.requirement(95, 103)
@given(
    robot=st.builds(complex, st.floats(-6.0, 6.0), st.floats(-6.0, 6.0)),
    ends=st.lists(
        st.builds(complex, st.floats(-6.0, 6.0), st.floats(-6.0, 6.0)), min_size=1, max_size=3
    ),
    facing=st.floats(-3.1, 3.1), seconds=st.floats(0.0, 10.0),
)  # fmt: skip
@settings(deadline=None, max_examples=examples(60))
def test_a_drive_costs_the_mean_risk_on_it_times_the_chance_that_the_user_sets_off(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    robot: complex,
    ends: list[complex],
    facing: float,
    seconds: float,
) -> None:
    user, apart = 0.00137 + 0.00071j, 1.8
    stood = UserPose(Pose2(user.real, user.imag, facing), facing)
    now = situation_of(tuned, Pose2(robot.real, robot.imag), stood, room=LARGE)
    times = np.full(len(ends), seconds)

    found = way_risks(now, np.array([_pair(end) for end in ends]), apart, times).tolist()

    chance = 1.0 - math.exp(-0.1 * seconds)
    for end, risk in zip(ends, found, strict=True):
        points = risk_at(now, *on_the_way(robot, end, user, apart))
        assert risk == pytest.approx(chance * sum(points) / len(points), abs=1e-6)
