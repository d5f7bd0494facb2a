"""Goals that no robot can be at, and inflations that no wall can have: refused, never driven to."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from hw.geometry import Pose2, Twist2
from states.navigation.exact.visibility import ExactPlanner
from states.navigation.planner_interfaces import Limits, Tolerance
from states.navigation.planners import GLOBAL_PLANNERS, LOCAL_PLANNERS

OUTER = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
COLUMN = ((3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0))
NAN, INF = math.nan, math.inf
NOWHERE = [
    pytest.param((4.0, 4.0), id="in a column"),
    pytest.param((5.5, 4.0), id="in its inflation"),
    pytest.param((7.9, 4.0), id="at a wall"),
    pytest.param((20.0, 4.0), id="outside"),
    pytest.param((-3.0, -3.0), id="outside, negative"),
    pytest.param((1e300, 4.0), id="very far"),
    pytest.param((NAN, 4.0), id="nan"),
    pytest.param((4.0, INF), id="inf"),
]


@pytest.mark.requirement(34)
@pytest.mark.parametrize("name", GLOBAL_PLANNERS)
@pytest.mark.parametrize("goal", NOWHERE)
def test_no_way_leads_to_a_goal_where_the_robot_cannot_be(
    name: str, goal: tuple[float, float]
) -> None:
    planner = GLOBAL_PLANNERS[name](OUTER, (COLUMN,), inflation_radius=0.77)

    assert not planner.is_free(goal)
    assert planner.plan((1.5, 1.5), goal) is None


@pytest.mark.parametrize("name", GLOBAL_PLANNERS)
@pytest.mark.parametrize("place", [(NAN, 4.0), (4.0, INF), (-INF, 4.0)])
def test_no_way_leads_from_a_place_that_is_none(name: str, place: tuple[float, float]) -> None:
    planner = GLOBAL_PLANNERS[name](OUTER, (COLUMN,), inflation_radius=0.77)

    assert planner.plan(place, (1.5, 1.5)) is None
    assert planner.nearest_free(place) is None


@pytest.mark.requirement(120)
@pytest.mark.parametrize("name", GLOBAL_PLANNERS)
@pytest.mark.parametrize("inflation", [-1.0, -1e-9, NAN, INF])
def test_an_inflation_is_finite_and_not_negative(name: str, inflation: float) -> None:
    with pytest.raises(ValueError, match=r"inflation of .* 0 m or more|is not finite"):
        GLOBAL_PLANNERS[name](OUTER, (COLUMN,), inflation_radius=inflation)


def local(name: str) -> Any:
    make: Callable[..., Any] = LOCAL_PLANNERS[name]
    return make(ExactPlanner(OUTER, (COLUMN,), inflation_radius=0.77), Limits(), Tolerance())


@pytest.mark.parametrize("name", LOCAL_PLANNERS)
@pytest.mark.parametrize("goal", [Pose2(4.0, 4.0), Pose2(20.0, 1.0), Pose2(1e6, -1e6)])
def test_a_base_stands_for_a_goal_it_cannot_get_to(name: str, goal: Pose2) -> None:
    driver = local(name)
    driver.go_to(goal)

    command = driver.command(Pose2(1.5, 1.5), Twist2(0.0), None, 1.0 / 30.0)

    assert command == Twist2(0.0)
    assert driver.path is None


@pytest.mark.parametrize("name", LOCAL_PLANNERS)
@pytest.mark.parametrize("goal", [Pose2(NAN, 1.0), Pose2(1.0, INF), Pose2(1.0, 1.0, NAN)])
def test_a_goal_that_is_no_number_is_refused(name: str, goal: Pose2) -> None:
    driver = local(name)

    with pytest.raises(ValueError, match="a finite number is needed"):
        driver.go_to(goal)
