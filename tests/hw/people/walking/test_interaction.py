"""Requests that arise from where a person stands and looks."""

import math

import pytest

from hw.geometry import Pose2
from hw.people.live import LivePerson
from hw.people.walking.interaction import Interaction, Surface
from hw.samples import UserPose

FAR = Pose2(100.0, 100.0)
WALL = Surface((0.0, 5.0), (10.0, 5.0))
NORTH = math.pi / 2


def request(*places, surface=WALL, seconds=1.0, requests=None):
    """What is asked for after standing at each of these poses (x, y, yaw of the view)."""
    live = LivePerson(Pose2(*places[0]))
    person = Interaction(live, [surface], requests)
    now, seen = 0, []
    for x, y, yaw in places:
        for _ in range(round(seconds * 30)):
            now += 33_333_333
            live.push(now, UserPose(Pose2(x, y, 0.0), yaw))
            person.step(now, FAR, False)
        seen.append(person.request)
    return seen


@pytest.mark.requirement(74)
@pytest.mark.parametrize(
    ("x", "y", "turn", "asks"),
    [
        (5.0, 3.55, 0.0, True),
        (5.0, 3.45, 0.0, False),  # too far
        (5.0, 4.0, math.pi, False),  # back to it
        (5.0, 4.0, math.radians(44), True),
        (5.0, 4.0, math.radians(46), False),  # looks past it
        (10.5, 4.2, 0.0, False),  # beside its end
        (5.0, 6.0, math.pi, True),  # from behind
    ],
)
def test_a_touch_is_asked_for_near_a_surface_and_facing_it(x, y, turn, asks):
    assert (request((x, y, NORTH + turn))[0] is not None) is asks


@pytest.mark.requirement(74)
def test_the_deep_is_where_the_view_meets_the_surface_at_touching_height():
    deep = request((5.0, 4.0, NORTH - math.radians(30)))[0]
    assert (deep.x, deep.y, deep.z) == pytest.approx((5.0 + math.tan(math.radians(30)), 5.0, 1.5))
    assert deep.yaw == pytest.approx(math.radians(60))
    low = Surface((0.0, 5.0), (10.0, 5.0), 0.0, 0.9)
    assert request((5.0, 4.0, NORTH), surface=low)[0].z == 0.9


@pytest.mark.requirement(74)
@pytest.mark.parametrize(
    ("then", "kept"),
    [
        ((5.0, 3.3, NORTH), True),  # out of reach for asking, not for keeping
        ((5.0, 3.1, NORTH), False),
        ((5.0, 4.7, NORTH + math.radians(50)), True),
        ((5.0, 4.7, NORTH + math.radians(65)), False),
        ((5.5, 4.0, NORTH), False),  # reaches for another spot
    ],
)
def test_it_is_kept_until_the_person_goes_turns_or_looks_elsewhere(then, kept):
    first, second = request((5.0, 4.0, NORTH), then)
    assert first is not None
    assert (second is first) is kept


def test_a_glance_asks_for_nothing():
    assert request((5.0, 4.0, NORTH), seconds=0.2) == [None]


def test_with_so_many_requests_no_more_are_asked_for():
    away = (5.0, 2.0, -NORTH)
    seen = request((5.0, 4.0, NORTH), away, (5.0, 4.0, NORTH), requests=1)
    assert seen[0] is not None
    assert seen[1:] == [None, None]
