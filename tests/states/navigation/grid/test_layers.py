"""Each subsystem's costmaps and planner: from the room or a scanned map (R34-R36)."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from behaviors.profile.profile import load_profile
from hw.model.robot import load_robot
from hw.scene.room import Disc, Room
from states.environment.environment import Environment
from states.navigation.grid.layers import map_of
from states.navigation.planner_interfaces import GlobalPlanner
from states.subsystems import SUBSYSTEMS

HALL = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0)))
WALLS = (((5.8, 0.0), (6.2, 0.0), (6.2, 4.0), (5.8, 4.0)),)
DIVIDED = Room(outer=HALL.outer, walls=WALLS)
PLANNERS = ("exact", "theta_star", "navfn")
ON_CELLS = PLANNERS[1:]


def environment_of(planner: str, room: Room = DIVIDED, **changes: Any) -> Environment:
    """A site all of whose subsystems plan so."""
    profile = load_profile("tuned")
    navigation = profile.navigation
    for name in SUBSYSTEMS:
        subsystem = replace(navigation.named(name), planner=planner, **changes)
        navigation = replace(navigation, **{name: subsystem})
    return replace(profile, navigation=navigation).environment(room, load_robot("rbkairos_ur10"))


def least_distance(path: Any, place: tuple[float, float]) -> float:
    assert path is not None
    points = np.array(path.points)
    steps = np.linspace(0.0, 1.0, 200)[:, None]
    along = [a + steps * (b - a) for a, b in itertools.pairwise(points)]
    return float(np.hypot(*(np.concatenate(along) - place).T).min())


@pytest.mark.requirement(34, 35, 38)
@pytest.mark.parametrize("name", PLANNERS)
def test_every_choice_answers_all_that_a_tick_asks(name: str) -> None:
    planner: GlobalPlanner = environment_of(name).static_planners["chase"]
    here, there, user = (2.0, 2.0), (10.0, 2.0), Disc(6.0, 6.0, 1.2)

    way = planner.plan(here, there)
    assert way is not None
    exact = environment_of("exact").static_planners["chase"].plan(here, there)
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
    environment = environment_of(planner)
    maps = environment.static_costmaps

    assert (
        len({id(found) for found in (*maps.values(), *environment.static_planners.values())}) == 6
    )
    radii = [maps[name].whole.inflation.inscribed_radius for name in SUBSYSTEMS]
    assert radii == pytest.approx([1.0, 1.0, 0.77], abs=1e-5)
    near = (0.9, 4.0)
    assert [environment.static_planners[name].is_free(near) for name in SUBSYSTEMS] == [
        False,
        False,
        True,
    ]


@pytest.mark.requirement(34)
def test_costs_beyond_the_inflation_keep_navfn_off_the_walls() -> None:
    values = load_profile("tuned").navigation.chase.costmap
    wide = replace(values, inflation_radius=1.8, cost_scaling_factor=2.0)
    plain, soft = (
        environment_of("navfn", costmap=c).static_planners["chase"] for c in (values, wide)
    )
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
    environment = replace(environment_of(planner, HALL), map=replace(drawn, values=values))

    way = environment.static_planners["chase"].plan((2.0, 5.7), (10.0, 5.7))

    assert way is not None
    assert least_distance(way, (6.2, 6.2)) > 1.3
    assert environment_of(planner, HALL).static_planners["chase"].is_free((6.2, 6.2))
