"""Where the base stands, by its newest poses: the mean, which is less noisy than each of them."""

from __future__ import annotations

import math
from collections import deque

from hw import Pose2, PoseSigma, total, wrap

WINDOW_NS = 500_000_000
"""Age of the oldest pose that counts, ns."""
LEFT = 0.001
"""Least offset of the base that matters at the DEEP, m or rad."""
SURE = 2.0
"""Standard errors of a mean beyond which an offset is not noise."""


class Standing:
    """The poses of a base that stands, or comes to rest."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, Pose2]] = deque()

    def add_base_pose(self, now_ns: int, pose: Pose2) -> None:
        """Take the pose of this tick, map_from_base."""
        self._seen.append((now_ns, pose))
        while now_ns - self._seen[0][0] > WINDOW_NS:
            self._seen.popleft()

    def pose(self, otherwise: Pose2) -> Pose2:
        """The mean of the newest poses; `otherwise` before the first."""
        if not self._seen:
            return otherwise
        first, n = self._seen[0][1], len(self._seen)
        x = total([pose.x for _, pose in self._seen]) / n
        y = total([pose.y for _, pose in self._seen]) / n
        turn = total([wrap(pose.yaw - first.yaw) for _, pose in self._seen]) / n
        return Pose2(x, y, wrap(first.yaw + turn))

    def has_left(self, planned: Pose2, sigma: PoseSigma | None) -> bool:
        """True if the base stands off `planned` by more than its poses are uncertain."""
        mean = self.pose(planned)
        steps = [pose.distance_to(mean) / math.sqrt(2.0) for _, pose in self._seen]
        turns = [wrap(pose.yaw - mean.yaw) for _, pose in self._seen]
        known = (0.0, 0.0) if sigma is None else (sigma.position, sigma.yaw)
        return mean.distance_to(planned) > _noise(steps, known[0]) or abs(
            wrap(mean.yaw - planned.yaw)
        ) > _noise(turns, known[1])


def _noise(errors: list[float], sigma: float) -> float:
    """The offset of a mean, m or rad, that may be noise: of the errors of its values, one per axis.

    What their scatter s explains of sigma is independent from value to value, and adds s / sqrt(n)
    to the mean. The rest, sqrt(sigma^2 - s^2), lasts longer than the window.
    """
    n = len(errors)
    square = total([error * error for error in errors]) / n if n else 0.0
    lasting = math.sqrt(max(0.0, sigma * sigma - square))
    return max(LEFT, lasting, SURE * math.sqrt(square / max(1, n)))
