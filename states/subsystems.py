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
class CostmapValues:
    """Costmap parameters of a subsystem, with costmap_2d's names.

    Cells within the subsystem's `inflation` are blocked; beyond it costs fall off with
    `cost_scaling_factor`, 1/m, up to `inflation_radius`, m, and keep `navfn` away from walls.
    `width` and `height` are those of the local window around the robot, m (R37).
    """

    resolution: Annotated[Length, Range(0.01, 0.25)]
    inflation_radius: Annotated[Length, Range(0.0, 5.0)]
    cost_scaling_factor: Annotated[float, Range(0.0, 100.0)]
    width: Annotated[Length, Range(1.0, 100.0)]
    height: Annotated[Length, Range(1.0, 100.0)]


@dataclass(frozen=True, slots=True)
class Subsystem:
    """One of the three navigation subsystems, with values of its own (R35, R120, R129).

    `planner` finds paths, `exact` among the room's polygons, the others on a costmap;
    `local_planner` follows them. The robot's centre keeps `inflation` from walls and, while
    driving, `user_radius` from the user's centre, m; a goal counts as reached within `tolerance`,
    m, and `yaw_tolerance`, rad.
    """

    planner: Literal["exact", "theta_star", "navfn"]
    local_planner: Literal["profile", "teb"]
    max_speed: Annotated[Speed, above_0(5.0)]
    inflation: Annotated[Length, above_0(5.0)]
    user_radius: Annotated[Length, above_0(5.0)]
    tolerance: Annotated[Length, above_0(1.0)]
    yaw_tolerance: Annotated[Angle, above_0(math.pi)]
    costmap: CostmapValues


@dataclass(frozen=True, slots=True)
class Navigation:
    """The subsystems by name; Escape goes before Haptic before Chase (R71).

    `quarter`: radius of the quarter of a circle that a floor must have room for, m (R124); on a
    smaller floor the behaviours are refused.
    """

    chase: Subsystem
    haptic: Subsystem
    escape: Subsystem
    quarter: Annotated[Length, above_0(10.0)] = QUARTER

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
