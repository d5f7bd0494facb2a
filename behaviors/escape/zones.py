"""The two zones of the user in which the paper's robot must not be while they move (R104)."""

from __future__ import annotations

import math
from typing import Protocol

from hw import Pose2, UserPose, wrap


class EscapeZones(Protocol):
    """One zone around the user, and a wider one where they look.

    Radii `ahead` and `around`, m; `half_view`: how far they see to either side, rad.
    """

    @property
    def ahead(self) -> float: ...
    @property
    def half_view(self) -> float: ...
    @property
    def around(self) -> float: ...


def in_zone(zones: EscapeZones, user: UserPose, base: Pose2, margin: float = 0.0) -> bool:
    """True if the robot's centre is in one of the zones, grown by `margin`, m.

    Poses are in the map. What the user sees is told by their head.
    """
    dx, dy = base.x - user.body.x, base.y - user.body.y
    distance = math.hypot(dx, dy)
    if distance >= max(zones.ahead, zones.around) + margin:
        return False
    bearing = wrap(math.atan2(dy, dx) - user.head_yaw)
    reach = zones.ahead if abs(bearing) <= zones.half_view else zones.around
    return distance < reach + margin
