"""Planners by the names that profiles and benchmarks use."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from states.navigation.exact import ExactPlanner
from states.navigation.grid import (
    GridPlanner,
    NavfnPlanner,
    ThetaStarPlanner,
    grid_planners,
    scanning,
)
from states.navigation.local import (
    LocalPlanner,
    ProfilePlanner,
    TebPlanner,
    profile_planner as profile,
    teb_planner,
)

GLOBAL_PLANNERS: Mapping[str, Callable[..., ExactPlanner | GridPlanner]] = {
    "exact": ExactPlanner,
    "theta_star": ThetaStarPlanner.in_room,
    "navfn": NavfnPlanner.in_room,
}
"""Factories for a known room: they take outer, obstacles and, by name, inflation_radius."""

LOCAL_PLANNERS: Mapping[str, Callable[..., LocalPlanner]] = {
    "profile": ProfilePlanner,
    "teb": TebPlanner,
}
"""They take a global planner, limits, tolerance and mode; `teb` needs the `walls` as well."""


def warm_up() -> None:
    """Compile all kernels, or load them from the cache, before the first tick."""
    profile.warm_up()
    teb_planner.warm_up()
    grid_planners.warm_up()
    scanning.warm_up()
