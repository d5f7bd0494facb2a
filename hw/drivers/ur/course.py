"""The execution of a trajectory: its progress, its rate, and its end.

Time along the trajectory runs at a rate from 0 to 1, which changes no faster than the arm can
brake. A stop, a controller at reduced speed and an engine that is late for a moment all slow the
arm down along its path, and nothing makes it leave the path.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from hw.samples import ArmMode, Joints, TimedJoints

SLOWEST = 1e-6
"""Least joint speed assumed on a piece, rad/s."""
_BITS: tuple[tuple[ArmMode, int], ...] = (
    ("fault", 1 << 8 | 1 << 9),
    ("emergency_stop", 1 << 5 | 1 << 6 | 1 << 7),
    ("safeguard_stop", 1 << 4),
    ("protective_stop", 1 << 2),
    ("unknown", 1 << 10),
    ("recovery", 1 << 3),
    ("reduced", 1 << 1),
    ("normal", 1 << 0),
)


def mode_of(bits: int) -> ArmMode:
    """The mode of RTDE's `safety_status_bits`; of several stops the gravest."""
    return next((mode for mode, mask in _BITS if bits & mask), "unknown")


class CourseRun:
    """Set-points along a trajectory; stepped once per package of the controller.

    `deceleration` is the greatest of any joint, rad/s2.
    """

    def __init__(self, points: Sequence[TimedJoints], deceleration: float) -> None:
        self._times = [time for time, _ in points]
        self._points = [joints for _, joints in points]
        self._deceleration = deceleration
        self._share = 0.0
        self._rate = 1.0
        self._broken = False

    @property
    def over(self) -> bool:
        """True once the last point is reached, or a stop is complete."""
        return self._share >= self._times[-1] or (self._broken and self._rate == 0.0)

    @property
    def rate(self) -> float:
        """Share of its planned speed at which it runs."""
        return self._rate

    def stop(self) -> None:
        """Brake, without resuming."""
        self._broken = True

    def step(self, span: float, rate: float) -> Joints:
        """The joints span s later, with time along the trajectory tending to this rate.

        The joints move at rate times their speed v on the piece, so the rate may change by
        deceleration / max |v| per second.
        """
        wanted = 0.0 if self._broken else min(1.0, max(0.0, rate))
        most = span * self._deceleration / self._fastest()
        before = self._rate
        self._rate += min(most, max(-most, wanted - before))
        self._share = min(self._times[-1], self._share + 0.5 * (before + self._rate) * span)
        return self.joints

    @property
    def joints(self) -> Joints:
        """The present set-point, rad."""
        if self._share >= self._times[-1]:
            return self._points[-1]
        k = self._piece()
        begin, end = self._times[k : k + 2]
        part = (self._share - begin) / (end - begin)
        pairs = zip(self._points[k], self._points[k + 1], strict=True)
        return tuple(a + part * (b - a) for a, b in pairs)

    def _piece(self) -> int:
        return min(bisect_right(self._times, self._share), len(self._times) - 1) - 1

    def _fastest(self) -> float:
        """Speed of the fastest joint on this piece at a rate of 1, rad/s."""
        if len(self._times) == 1:
            return SLOWEST
        k = self._piece()
        pairs = zip(self._points[k], self._points[k + 1], strict=True)
        way = max(abs(b - a) for a, b in pairs)
        return max(SLOWEST, way / (self._times[k + 1] - self._times[k]))
