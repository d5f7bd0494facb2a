"""Places outside the user's zones, against geometry of its own."""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from behaviors.chase.refuge import KEEPS, is_outside, refuge, way_out
from behaviors.person.waiting import risks, way_risks
from behaviors.profile.profile import Profile
from behaviors.situation.present_situation import Situation
from hw.geometry import Pose2
from hw.samples import UserPose
from hw.scene.room import Room
from tests.repeats import examples

SMALL = Room(outer=((0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0)))
CORRIDOR = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 2.2), (0.0, 2.2)))
WALL = 0.77
DIRECTIONS, RADII = 24, (1.9, 2.9, 3.4, 4.2, 5.2)
FARTHEST, SLOWLY, WORTH_S = 8.0, 0.8, 0.5


def zone_left(robot: complex, body: complex, view: float) -> bool:
    """Farther than 1.7 m, and than 2.7 m within 36 degrees of the view."""
    seen = (robot - body) * cmath.exp(-1j * view)
    in_view = abs(cmath.phase(seen)) <= math.pi / 5
    return abs(seen) >= 1.7 and (not in_view or abs(seen) >= 2.7)


def from_segment(place: complex, start: complex, end: complex) -> float:
    along = end - start
    share = ((place - start) * along.conjugate()).real / max(1e-12, abs(along) ** 2)
    return abs(place - start - min(1.0, max(0.0, share)) * along)


ROBOT = st.builds(complex, st.floats(0.9, 5.1), st.floats(0.9, 4.1))
USER = st.builds(complex, st.floats(0.5, 5.5), st.floats(0.5, 4.5))


@pytest.mark.requirement(112)
@given(robot=ROBOT, user=USER, view=st.floats(-3.1, 3.1), turn=st.floats(-3.1, 3.1))
@settings(deadline=None, max_examples=examples(200))
def test_outside_is_beyond_both_zones_and_their_hysteresis(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    robot: complex,
    user: complex,
    view: float,
    turn: float,
) -> None:
    now = situation_of(
        tuned, Pose2(robot.real, robot.imag), UserPose(Pose2(user.real, user.imag, turn), view)
    )

    assert is_outside(now) is zone_left(robot, user, view)


@pytest.mark.requirement(52, 108, 112, 120)
@given(robot=ROBOT, user=USER, view=st.floats(-3.1, 3.1))
@settings(deadline=None, max_examples=examples(120))
def test_a_way_out_ends_outside_both_zones_away_from_walls_and_keeps_off_the_user(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    robot: complex,
    user: complex,
    view: float,
) -> None:
    assume(abs(robot - user) > 0.8)
    looking = UserPose(Pose2(user.real, user.imag, view), view)
    now = situation_of(tuned, Pose2(robot.real, robot.imag), looking, room=SMALL)

    found = way_out(now)

    if found is None:
        return
    place = complex(*found)
    assert zone_left(place, user, view)
    assert min(place.real, place.imag, 6.0 - place.real, 5.0 - place.imag) >= WALL - 1e-6
    path = now.planners["escape"].plan(
        (robot.real, robot.imag), found, now.user_disc("haptic", found)
    )
    assert path is not None
    points = [complex(*point) for point in path.points]
    least = min(tuned.navigation.haptic.user_radius, abs(robot - user), abs(place - user))
    for start, end in itertools.pairwise(points):
        assert from_segment(user, start, end) >= least - 1e-6
    length = sum(abs(end - start) for start, end in itertools.pairwise(points))
    assert length <= FARTHEST + 1e-9


@pytest.mark.requirement(112)
@pytest.mark.parametrize(
    ("user", "view", "blocked"),
    [(2.6, math.pi, True), (2.6, 0.0, True), (3.7, math.pi, False), (10.0, math.pi, False)],
)
def test_at_the_end_of_a_corridor_somebody_before_the_robot_leaves_no_way_out(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    user: float,
    view: float,
    blocked: bool,
) -> None:
    """Nobody can be passed in it; 0.33 m remain behind the robot."""
    looking = UserPose(Pose2(user, 1.1, view), view)
    now = situation_of(tuned, Pose2(1.1, 1.1), looking, room=CORRIDOR)

    assert (way_out(now) is None) is blocked


@pytest.mark.requirement(112)
def test_on_open_floor_there_is_always_a_way_out_and_never_past_a_nearer_one(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    """Straight back is 0.5 m to go; nothing nearer is outside."""
    for view in (0.0, 1.0, 2.5, math.pi):
        looking = UserPose(Pose2(10.0, 10.0, view), view)
        now = situation_of(tuned, Pose2(11.4, 10.0), looking)

        found = way_out(now)

        assert found is not None
        back = complex(12.9, 10.0) if zone_left(12.9 + 10j, 10 + 10j, view) else complex(13.4, 10.0)
        assert math.dist(found, (11.4, 10.0)) <= abs(back - (11.4 + 10.0j)) + 1e-9


WIDE = Room(outer=((0.0, 0.0), (9.0, 0.0), (9.0, 7.0), (0.0, 7.0)))


@pytest.mark.requirement(101)
@given(
    robot=st.builds(complex, st.floats(0.9, 8.1), st.floats(0.9, 6.1)),
    user=st.builds(complex, st.floats(0.9, 8.1), st.floats(0.9, 6.1)),
    view=st.floats(-3.1, 3.1),
    radius=st.sampled_from(RADII), step=st.integers(0, DIRECTIONS - 1),
)  # fmt: skip
@settings(deadline=None, max_examples=examples(80))
def test_no_place_outside_the_zones_costs_less_than_the_refuge(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    robot: complex,
    user: complex,
    view: float,
    radius: float,
    step: int,
) -> None:
    """Any other candidate costs as much, or is in a zone, or cannot be driven to."""
    assume(abs(robot - user) > 0.8)
    looking = UserPose(Pose2(user.real, user.imag, view), view)
    now = situation_of(tuned, Pose2(robot.real, robot.imag), looking, room=WIDE)
    planner = now.planners["escape"]

    def cost(place: complex, length: float) -> float:
        there, seconds = np.array([(place.real, place.imag)]), abs(place - robot) / SLOWLY
        apart = now.environment.navigation.named(KEEPS).user_radius
        [risk] = (risks(now, there) + way_risks(now, there, apart, np.array([seconds]))).tolist()
        return float(now.settings.chase.risk * risk + length / SLOWLY)

    def way(place: complex) -> float:
        """Length of the way to a place outside the zones; infinite without one."""
        there = (place.real, place.imag)
        if not zone_left(place, user, view) or not planner.is_free(there):
            return math.inf
        path = planner.plan((robot.real, robot.imag), there, now.user_disc("haptic", there))
        return math.inf if path is None or path.length > FARTHEST else path.length

    def is_cornered() -> bool:
        """True if no Escape pose is free."""
        escape, away = now.settings.escape, cmath.phase(robot - user)
        places = [
            robot + cmath.rect(distance, away + angle)
            for distance, angle in itertools.product(escape.distances, escape.angles)
        ]
        return not any(planner.is_free((place.real, place.imag)) for place in places)

    other = user + cmath.rect(radius, step * math.tau / DIRECTIONS)
    found = refuge(now)

    stays = zone_left(robot, user, view) and not is_cornered()
    stay = cost(robot, 0.0) - WORTH_S if stays else math.inf
    best = stay if found is None else cost(complex(*found), way(complex(*found)))
    assert found is None or best < stay
    assert cost(other, way(other)) >= best - 1e-9


@pytest.mark.requirement(101, 117)
@pytest.mark.parametrize("off", [0.85, 1.5])
def test_a_robot_leaves_a_corner_without_an_escape_pose_while_the_user_is_away(
    tuned: Profile, situation_of: Callable[..., Situation], off: float
) -> None:
    """Else whoever walks up finds it cornered, is shown it, and walks up again."""
    away = UserPose(Pose2(3.0 + off, 3.0 + off, 0.5), 0.5)

    found = refuge(situation_of(tuned, Pose2(off, off), away, room=WIDE))

    assert (found is not None) is (off < 1.0)
