"""Past poses of a body, for sensors that look back when they are sampled.

Between two recorded instants it is assumed to move straight and to turn uniformly. The base records
each cycle of its loop (dt = 10 ms), so with an acceleration a the error is at most a dt^2 / 8: 0.04
mm at 3 m/s2.
"""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from numpy.typing import NDArray

from hw.geometry import Pose2, unwrap

TrackPose = tuple[float, float, float]
"""x, y in the map (m) and the yaw, not wrapped (rad)."""
KEPT = 512
"""Least number of instants kept: 5 s of motion."""


class Track:
    """Poses at rising times; the yaw is not wrapped, so that it can be interpolated."""

    def __init__(self, start: Pose2) -> None:
        self._times = [0]
        self._places: list[TrackPose] = [(start.x, start.y, start.yaw)]

    @property
    def known_ns(self) -> int:
        """The oldest known instant, ns."""
        return self._times[0]

    def note(self, now_ns: int, pose: Pose2) -> None:
        """Record the pose at now_ns; a second one of the same instant replaces the first."""
        times, places = self._times, self._places
        place = (pose.x, pose.y, unwrap(pose.yaw, places[-1][2]))
        if times[-1] == now_ns:
            places[-1] = place
            return
        if len(places) > 1 and place == places[-1] == places[-2]:
            times[-1] = now_ns  # still standing
            return
        times.append(now_ns)
        places.append(place)
        if len(times) >= 2 * KEPT:
            del times[:KEPT], places[:KEPT]

    def at(self, time_ns: int) -> TrackPose:
        """The pose at an instant, held constant beyond the known range."""
        times, places = self._times, self._places
        n = bisect_right(times, time_ns)
        if n == len(times):
            return places[-1]
        if n == 0:
            return places[0]
        share = (time_ns - times[n - 1]) / (times[n] - times[n - 1])
        (x, y, yaw), (x2, y2, yaw2) = places[n - 1], places[n]
        return x + share * (x2 - x), y + share * (y2 - y), yaw + share * (yaw2 - yaw)

    def knots(self, start_ns: int, end_ns: int) -> NDArray[np.float64]:
        """(n, 4): s after start_ns, x, y, yaw, from start to end; linear in between, n >= 2."""
        times = self._times
        low, high = bisect_right(times, start_ns), bisect_right(times, end_ns - 1)
        rows = [(0.0, *self.at(start_ns))]
        rows += [((times[n] - start_ns) * 1e-9, *self._places[n]) for n in range(low, high)]
        rows.append(((end_ns - start_ns) * 1e-9, *self.at(end_ns)))
        return np.array(rows)
