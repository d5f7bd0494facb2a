"""The three navigation subsystems and the values that a profile gives each of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Literal, get_args

from engine.files import Angle, Length, Speed
from engine.files.declared import Range, above_0

SubsystemName = Literal["chase", "haptic", "escape"]
Localization = Literal["combined", "amcl"]
"""Scan matching with particles, filter and trackers combined; or AMCL alone, as in the paper."""
QUARTER = 4.0
"""All behaviours fit into a quarter of a circle of this radius around the user, m (R124)."""
SUBSYSTEMS: tuple[SubsystemName, ...] = get_args(SubsystemName)


@dataclass(frozen=True, slots=True)
class LocalizerEffort:
    """How much a localizer computes; None: its own values."""

    beams: Annotated[int, Range(3, 10_000)] | None = None
    """Most beams that are used of a scan; null: 180 in scan matching, 60 in AMCL."""
    particles: Annotated[int, Range(2, 100_000)] | None = None
    """How many AMCL keeps; null: 100 to 5000, as KLD sampling asks for."""


OWN_EFFORT = LocalizerEffort()


@dataclass(frozen=True, slots=True)
class CostmapValues:
    """Costmap parameters of a subsystem, with costmap_2d's names.

    Cells within the subsystem's `inflation` are blocked; costs beyond keep `navfn` off the walls.
    """

    resolution: Annotated[Length, Range(0.01, 0.25)]
    """Size of the cells."""
    inflation_radius: Annotated[Length, Range(0.0, 5.0)]
    """Costs reach this far from obstacles."""
    cost_scaling_factor: Annotated[float, Range(0.0, 100.0)]
    """How fast they fall off beyond the subsystem's `inflation`, 1/m."""
    width: Annotated[Length, Range(1.0, 100.0)]
    """Of the local window around the robot (R37)."""
    height: Annotated[Length, Range(1.0, 100.0)]
    """Of the local window around the robot (R37)."""


@dataclass(frozen=True, slots=True)
class Subsystem:
    """One of the three navigation subsystems, with values of its own (R35, R120, R129)."""

    planner: Literal["exact", "theta_star", "navfn"]
    """Finds paths: `exact` among the room's polygons, the others on a costmap."""
    local_planner: Literal["profile", "teb"]
    """Follows them."""
    max_speed: Annotated[Speed, above_0(5.0)]
    """Of the base."""
    inflation: Annotated[Length, above_0(5.0)]
    """The robot's centre keeps this from walls."""
    user_radius: Annotated[Length, above_0(5.0)]
    """While driving it keeps this from the user's centre."""
    tolerance: Annotated[Length, above_0(1.0)]
    """A goal this near is reached."""
    yaw_tolerance: Annotated[Angle, above_0(math.pi)]
    """A yaw this near is reached."""
    costmap: CostmapValues
    """The maps of the planners that need some."""


@dataclass(frozen=True, slots=True)
class Navigation:
    """The subsystems by name; Escape goes before Haptic before Chase (R71)."""

    chase: Subsystem
    """For Chase."""
    haptic: Subsystem
    """For Haptic."""
    escape: Subsystem
    """For Escape."""
    quarter: Annotated[Length, above_0(10.0)] = QUARTER
    """Radius of the quarter of a circle that a floor must have room for (R124); on a smaller one
    the behaviours are refused."""

    def capped(self, speed: float) -> Navigation:
        """A copy with no subsystem faster than this, m/s."""
        return self._each(lambda s: replace(s, max_speed=min(s.max_speed, speed)))

    def on_cells(self) -> Navigation:
        """A copy with `theta_star` in place of `exact`."""
        return self._each(lambda s: replace(s, planner="theta_star") if s.planner == "exact" else s)

    def _each(self, change: Callable[[Subsystem], Subsystem]) -> Navigation:
        chase, haptic, escape = map(change, (self.chase, self.haptic, self.escape))
        return replace(self, chase=chase, haptic=haptic, escape=escape)

    def named(self, name: SubsystemName) -> Subsystem:
        """The subsystem of this name."""
        found: Subsystem = getattr(self, name)
        return found
