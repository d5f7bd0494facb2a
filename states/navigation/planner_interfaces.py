"""What planners share: the interface of global ones, limits and tolerances of local ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from hw import Pose2, Twist2
from hw.scene import Disc, Point
from states.navigation.exact import Array, Path

DriveStatus = Literal["driving", "arrived", "blocked"]


class GlobalPlanner(Protocol):
    """Finds paths for the robot's centre; see `visibility.ExactPlanner`."""

    boxes: tuple[Sequence[Point], ...]
    """Those of its obstacles that come from scans, as polygons, m."""

    def plan(
        self, start: Point, goal: Point, user: Disc | None = None, side: int = 0
    ) -> Path | None:
        """The path, on one side of the user if `side` is +1 (ccw) or -1; None if there is none."""
        ...

    def is_free(self, place: Point, user: Disc | None = None) -> bool:
        """True if the robot's centre may be here."""
        ...

    def are_free(self, places: Array) -> NDArray[np.bool_]:
        """`is_free` of each of the places (n, 2), m, without the user: (n,)."""
        ...

    def clearance(self, place: Point) -> float:
        """Distance to the nearest wall, not inflated, m."""
        ...

    def nearest_free(self, place: Point, user: Disc | None = None) -> Point | None:
        """The nearest free place that `allows` lets the robot go straight to, or None."""
        ...

    def allows(
        self, start: Point, end: Point, user: Disc | None = None, slack: float = 0.0
    ) -> bool:
        """True if the straight line keeps every required distance, or the start's own if less.

        `slack` is subtracted from the required distances to walls, m.
        """
        ...

    def first_allowed(
        self, start: Point, ways: Array, user: Disc | None, slack: float, spare: float
    ) -> int:
        """Index of the first of some ways to stop that is allowed; their number if none is.

        A way is a row of (n, 10): on to the place x, y, and then to another, both with `slack`;
        and, unless `spare` is infinite, from the first place to each of three more, with `spare`
        and without the user.
        """
        ...

    def allows_each(self, start: Point, ends: Array, user: Disc | None = None) -> bool:
        """`allows` from the start to each of some places (n, 2)."""
        ...

    def allows_line(self, line: Array, user: Disc | None = None) -> bool:
        """`allows` from each point of a line (n, 3), x and y first, to the next."""
        ...


class Driver(Protocol):
    """Turns goals into velocities, one per control cycle; see `local.LocalPlanner`."""

    planner: GlobalPlanner
    status: DriveStatus

    @property
    def left(self) -> float:
        """Length of the way to the goal, m; infinite without one."""
        ...

    def go_to(self, goal: Pose2) -> None:
        """Set the goal, map_from_base; the present one is replaced without stopping."""
        ...

    def release(self) -> None:
        """Forget the goal: something else drives the base from now on."""
        ...

    def command(  # noqa: PLR0913 - most are optional
        self,
        pose: Pose2,
        twist: Twist2,
        user: Disc | None,
        dt: float,
        user_velocity: Point = (0.0, 0.0),
        *,
        sigma: float = 0.0,
        admitted: Twist2 | None = None,
        share: float = 1.0,
    ) -> Twist2:
        """The velocity (base frame) to send for the coming period of dt seconds."""
        ...


@dataclass(frozen=True, slots=True)
class Limits:
    """Largest speeds and accelerations, as norms: m/s, m/s2; rad/s, rad/s2 (R50)."""

    speed: float = 1.5
    acceleration: float = 1.0
    turn_rate: float = 1.0
    turn_acceleration: float = 1.0


@dataclass(frozen=True, slots=True)
class Tolerance:
    """When a drive has arrived: within `position`, m, and `yaw`, rad, and slower than `speed`."""

    position: float = 0.05
    yaw: float = 0.1
    speed: float = 0.1
