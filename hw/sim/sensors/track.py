"""Past poses of a body, for sensors that look back when they are sampled.

Between two recorded instants it is assumed to move straight and to turn uniformly. The base records
each cycle of its loop (dt = 10 ms), so with an acceleration a the error is at most a dt^2 / 8: 0.04
mm at 3 m/s2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hw.geometry import Pose2, unwrap
from hw.motion import PoseHistory

TrackPose = tuple[float, float, float]
"""x, y in the map (m) and the yaw, not wrapped (rad)."""
KEPT_NS = 5_000_000_000
"""Longest look back, ns; sensors look back over a second and their delay at most."""


class Track(PoseHistory[TrackPose]):
    """Poses at rising times; the yaw is not wrapped, so that it can be interpolated."""

    __slots__ = ()

    def __init__(self, start: Pose2) -> None:
        super().__init__(_between, KEPT_NS, [(0, (start.x, start.y, start.yaw))])

    def note(self, now_ns: int, pose: Pose2) -> None:
        """Record the pose at now_ns; a second one of the same instant replaces the first."""
        rows = self._rows
        last_ns, last = rows[-1]
        place = (pose.x, pose.y, unwrap(pose.yaw, last[2]))
        if place == last and now_ns > last_ns and len(rows) > 1 and place == rows[-2][1]:
            self.newest = rows[-1] = now_ns, place  # still standing
        else:
            self.insert(now_ns, place)

    def knots(self, start_ns: int, end_ns: int) -> NDArray[np.float64]:
        """(n, 4): s after start_ns, x, y, yaw, from start to end; linear in between, n >= 2."""
        rows = [(0.0, *self.held(start_ns))]
        rows += [((at - start_ns) * 1e-9, *place) for at, place in self.inside(start_ns, end_ns)]
        rows.append(((end_ns - start_ns) * 1e-9, *self.held(end_ns)))
        return np.array(rows)


def _between(a: TrackPose, b: TrackPose, share: float) -> TrackPose:
    (x, y, yaw), (x2, y2, yaw2) = a, b
    return x + share * (x2 - x), y + share * (y2 - y), yaw + share * (yaw2 - yaw)
