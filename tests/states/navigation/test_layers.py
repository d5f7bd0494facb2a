"""Each subsystem's costmaps and planner: from the room, a scanned map, laser scans (R34-R38)."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from behaviors.profile import load_profile
from hw.geometry import Pose2
from hw.robot import load_robot
from hw.room import Disc, Room
from hw.samples import Scan
from states.navigation.distance import LETHAL
from states.navigation.layers import map_of
from states.navigation.local_planner import GlobalPlanner
from states.site import Site, SubsystemName

HALL = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0)))
WALLS = (((5.8, 0.0), (6.2, 0.0), (6.2, 4.0), (5.8, 4.0)),)
DIVIDED = Room(outer=HALL.outer, walls=WALLS)
NAMES: tuple[SubsystemName, ...] = ("chase", "haptic", "escape")
PLANNERS = ("exact", "theta_star", "navfn")
ON_CELLS = PLANNERS[1:]
BEAMS = 720


def site_of(planner: str, room: Room = DIVIDED, **changes: Any) -> Site:
    """A site all of whose subsystems plan so."""
    profile = load_profile("tuned")
    navigation = profile.navigation
    for name in NAMES:
        subsystem = replace(navigation.named(name), planner=planner, **changes)
        navigation = replace(navigation, **{name: subsystem})
    return replace(profile, navigation=navigation).site(room, load_robot("rbkairos_ur10"))


def scan_of(post: tuple[float, float], radius: float, sensor: Pose2) -> Scan:
    """What a scanner with 20 m of range sees of a round post in the open."""
    ranges = []
    for i in range(BEAMS):
        angle = sensor.yaw - math.pi + 2.0 * math.pi * i / BEAMS
        dx, dy = post[0] - sensor.x, post[1] - sensor.y
        along = dx * math.cos(angle) + dy * math.sin(angle)
        aside = abs(dx * math.sin(angle) - dy * math.cos(angle))
        hit = along > 0.0 and aside < radius
        ranges.append(along - math.sqrt(radius**2 - aside**2) if hit else math.inf)
    return Scan("laser", -math.pi, 2.0 * math.pi / BEAMS, tuple(ranges))


def least_distance(path: Any, place: tuple[float, float]) -> float:
    assert path is not None
    points = np.array(path.points)
    steps = np.linspace(0.0, 1.0, 200)[:, None]
    along = [a + steps * (b - a) for a, b in itertools.pairwise(points)]
    return float(np.hypot(*(np.concatenate(along) - place).T).min())


@pytest.mark.requirement(34, 35, 38)
@pytest.mark.parametrize("name", PLANNERS)
def test_every_choice_answers_all_that_a_tick_asks(name: str) -> None:
    planner: GlobalPlanner = site_of(name).planner("chase")
    here, there, user = (2.0, 2.0), (10.0, 2.0), Disc(6.0, 6.0, 1.2)

    way = planner.plan(here, there)
    assert way is not None
    exact = site_of("exact").planner("chase").plan(here, there)
    assert exact is not None
    assert exact.length - 0.05 <= way.length <= 1.08 * exact.length
    assert planner.plan(here, there, user) is None  # they stand in the only gap
    assert planner.plan(here, (6.0, 2.0)) is None
    assert [planner.is_free(place) for place in (here, (6.0, 2.0), (0.5, 4.0))] == [True, 0, 0]
    assert planner.are_free(np.array([here, (6.0, 2.0), (0.5, 4.0)])).tolist() == [True, 0, 0]
    assert planner.clearance((3.0, 3.0)) == pytest.approx(2.8, abs=0.05)
    out = planner.nearest_free((0.6, 4.0))
    assert out == pytest.approx((1.0, 4.0), abs=0.08)
    assert planner.allows((2.0, 2.0), (4.0, 3.0))
    assert not planner.allows((2.0, 2.0), (5.5, 2.0))
    assert planner.allows((0.6, 4.0), (1.5, 4.0))


@pytest.mark.requirement(35, 120)
@pytest.mark.parametrize("planner", ON_CELLS)
def test_every_subsystem_plans_on_its_own_costmap_with_its_own_inflation(planner: str) -> None:
    site = site_of(planner)
    maps = [site.layers(name) for name in NAMES]

    assert len({id(layers.planner) for layers in maps}) == 3
    assert [layers.whole.inflation.inscribed_radius for layers in maps] == [1.0, 1.0, 0.77]
    near = (0.9, 4.0)
    assert [site.planner(name).is_free(near) for name in NAMES] == [False, False, True]


@pytest.mark.requirement(34)
def test_costs_beyond_the_inflation_keep_navfn_off_the_walls() -> None:
    values = load_profile("tuned").navigation.chase.costmap
    wide = replace(values, inflation_radius=1.8, cost_scaling_factor=2.0)
    plain, soft = (site_of("navfn", costmap=c).planner("chase") for c in (values, wide))
    ways = [planner.plan((2.0, 1.2), (10.0, 1.2)) for planner in (plain, soft)]

    tops = [least_distance(way, (6.0, 4.0)) for way in ways]
    assert tops[0] == pytest.approx(1.0, abs=0.1)
    assert tops[1] > 1.15


@pytest.mark.requirement(34, 36)
@pytest.mark.parametrize("planner", ON_CELLS)
def test_a_scanned_map_takes_the_place_of_the_room(planner: str) -> None:
    drawn = map_of(HALL, 0.05)
    values = drawn.values.copy()
    values[120:140, 120:140] = 100  # a box of 1 m that nobody drew, about (5.7, 5.7)
    values.setflags(write=False)
    site = replace(site_of(planner, HALL), map=replace(drawn, values=values))

    way = site.planner("chase").plan((2.0, 5.7), (10.0, 5.7))

    assert way is not None
    assert least_distance(way, (6.2, 6.2)) > 1.3
    assert site_of(planner, HALL).planner("chase").is_free((6.2, 6.2))


@pytest.mark.requirement(37, 38, 51)
@pytest.mark.parametrize("planner", ON_CELLS)
def test_a_scan_blocks_the_way_of_the_subsystem_that_saw_it_and_of_no_other(planner: str) -> None:
    site, post, robot = site_of(planner, HALL), (6.0, 4.0), Pose2(4.0, 4.0, 0.3)
    chase, haptic = site.layers("chase"), site.layers("haptic")

    chase.see(robot, scan_of(post, 0.2, robot), 10**9)

    assert chase.whole.cost(*post) < LETHAL
    assert chase.local.cost(5.81, 4.0) == LETHAL
    ways = [layers.planner.plan((4.0, 4.0), (10.0, 4.0)) for layers in (chase, haptic)]
    assert least_distance(ways[0], (5.8, 4.0)) > 0.95
    assert least_distance(ways[1], (5.8, 4.0)) < 0.05


@pytest.mark.requirement(37)
def test_the_window_rolls_with_the_robot_and_what_left_is_free_again() -> None:
    layers, post = site_of("theta_star", HALL).layers("chase"), (6.0, 4.0)
    for n, x in enumerate((4.0, 4.5)):
        robot = Pose2(x, 4.0, 0.0)
        layers.see(robot, scan_of(post, 0.2, robot), n * 10**8)
        middle = (layers.local.grid.x + 2.5, layers.local.grid.y + 2.5)
        assert middle == pytest.approx((x, 4.0), abs=0.026)
    assert not layers.planner.is_free(post)

    robot = Pose2(4.5, 4.0, 0.0)
    layers.see(robot, scan_of((50.0, 50.0), 0.2, robot), 3 * 10**8)

    assert layers.planner.is_free(post)


@pytest.mark.requirement(51)
def test_the_user_is_not_marked() -> None:
    layers, post, robot = site_of("theta_star", HALL).layers("chase"), (6.0, 4.0), Pose2(4.0, 4.0)

    layers.see(robot, scan_of(post, 0.2, robot), 0, ignore=Disc(*post, 0.5))

    assert layers.planner.is_free(post)


def test_a_planner_without_costmap_says_so() -> None:
    with pytest.raises(ValueError, match="'exact' plans without a costmap"):
        site_of("exact").layers("escape")
