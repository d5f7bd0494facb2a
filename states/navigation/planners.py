"""Planners by the names that profiles and benchmarks use."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from hw import DriveMode
from states.navigation.exact import ExactPlanner
from states.navigation.local import LocalPlanner, ProfilePlanner, StraightPlanner
from states.navigation.planner_interfaces import GlobalPlanner, Limits, Tolerance

if TYPE_CHECKING:
    from states.environment import Environment
    from states.navigation.grid import GridPlanner
    from states.subsystems import SubsystemName


def _theta_star(*rings: Any, **values: Any) -> GridPlanner:
    from states.navigation.grid import ThetaStarPlanner

    return ThetaStarPlanner.in_room(*rings, **values)


def _navfn(*rings: Any, **values: Any) -> GridPlanner:
    from states.navigation.grid import NavfnPlanner

    return NavfnPlanner.in_room(*rings, **values)


def _teb(*given: Any, **values: Any) -> LocalPlanner:
    from states.navigation.local import TebPlanner

    return TebPlanner(*given, **values)


GLOBAL_PLANNERS: Mapping[str, Callable[..., ExactPlanner | GridPlanner]] = {
    "exact": ExactPlanner,
    "theta_star": _theta_star,
    "navfn": _navfn,
}
"""Factories for a known room: they take outer, obstacles and, by name, inflation_radius."""

LOCAL_PLANNERS: Mapping[str, Callable[..., LocalPlanner]] = {
    "profile": ProfilePlanner,
    "teb": _teb,
}
"""They take a global planner, limits, tolerance and mode; `teb` needs the `walls` as well."""


def driver_of(
    environment: Environment,
    name: SubsystemName,
    planner: GlobalPlanner,
    keeping: SubsystemName | None = None,
    mode: DriveMode = "omni",
    speed: float = math.inf,
) -> LocalPlanner:
    """A new local planner with a subsystem's values; one per drive.

    `keeping` names the subsystem whose distance from walls it keeps; None: its own. `speed` is a
    further limit, m/s.
    """
    subsystem, room = environment.navigation.named(name), environment.room
    limits, tolerance = _values(environment, name, speed)
    kept = environment.navigation.named(keeping or name).inflation
    more: dict[str, Any] = {}
    if subsystem.local_planner == "teb":
        walls = (room.outer, *room.obstacles, *environment.zones.keepout)
        more = {"walls": walls, "wall_distance": kept}
    make = LOCAL_PLANNERS[subsystem.local_planner]
    driver = make(planner, limits, tolerance, mode, latency=environment.latency, **more)
    driver.zones = environment.zones
    driver.reach = environment.robot.footprint.half_diagonal
    driver.spare = kept - driver.reach
    return driver


def straight_driver_of(
    environment: Environment, name: SubsystemName, planner: GlobalPlanner, speed: float = math.inf
) -> StraightPlanner:
    """A new planner of straight drives without turning, with a subsystem's values; one per drive.

    `planner` has the distances from walls to keep; `speed` is a further limit, m/s.
    """
    limits, tolerance = _values(environment, name, speed)
    robot = environment.robot
    return StraightPlanner(
        planner,
        limits,
        tolerance,
        footprint=robot.footprint,
        deceleration=robot.base.brake_deceleration,
        latency=environment.latency,
    )


def _values(
    environment: Environment, name: SubsystemName, speed: float
) -> tuple[Limits, Tolerance]:
    """Limits and tolerances of a subsystem's drives, no faster than `speed`, m/s."""
    subsystem, own = environment.navigation.named(name), environment.limits
    base = environment.robot.base
    limits = Limits(
        min(speed, subsystem.max_speed, own.base_speed, base.max_speed),
        own.base_acceleration,
        min(own.base_yaw_rate, base.max_yaw_rate),
        own.base_yaw_acceleration,
    )
    return limits, Tolerance(subsystem.tolerance, subsystem.yaw_tolerance)
