"""The Chase space at one instant: the places around the user where the robot may wait (R93)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from behaviors.profile import Settings
from hw import Pose2, UserPose

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from behaviors.situation.chase_cells import Array
    from states.navigation import GlobalPlanner

AT_A_TIME = 256
"""Number of cells that are tested for being free in one call."""
ChaseCell = tuple[float, float, float]
CellSource = Callable[[], "Array"]


@dataclass(frozen=True)
class ChaseSpace:
    """The Chase space at one instant; `centre` is the user's position with the yaw of `view`.

    `cells` gives all cells, (n, 3), in the user's frame; `are_free` tests (n, 2) places in the map.
    """

    centre: Pose2
    cells: CellSource = field(repr=False)
    are_free: Callable[[Array], NDArray[np.bool_]] = field(repr=False)

    def free(self) -> Iterator[ChaseCell]:
        """x, y in the map, m, and weight of the free cells, best first (R100)."""
        from behaviors.situation.chase_cells import placed

        cells = self.cells()
        for first in range(0, len(cells), AT_A_TIME):
            some = placed(cells[first : first + AT_A_TIME], self.centre)
            yield from some[self.are_free(some[:, :2].copy())].tolist()

    def all_free(self) -> Array:
        """What `free` yields, as one array, (n, 3)."""
        from behaviors.situation.chase_cells import placed

        cells = placed(self.cells(), self.centre)
        return cells[self.are_free(cells[:, :2].copy())]


def space(
    settings: Settings, cells: CellSource, planner: GlobalPlanner, user: UserPose
) -> ChaseSpace:
    """The Chase space for the current user pose; it moves and turns with the user (R93)."""
    yaw = user.head_yaw if settings.chase.view == "head" else user.body.yaw
    centre = Pose2(user.body.x, user.body.y, yaw)
    return ChaseSpace(centre, cells, planner.are_free)
