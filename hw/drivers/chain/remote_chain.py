"""The client of the safety chain in the process beside the wheels: commands out, status back."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from hw.geometry import Pose2, Twist2
from hw.interfaces import DriveMode
from hw.ipc import Datagram, Outlet
from hw.motion import Reckoner
from hw.safety import ChainStatus, CycleLog, SafetyLimits, SafetyRecord
from hw.samples import PoseSigma, Sample


class RemoteChain:
    """A chain as the guarded base sees it (`hw.safety.chain.Chain`).

    The process receives the chain's inputs itself; `hears` makes the engine sample them too, so
    that they are in the record of the run. `lost` counts records that did not arrive.
    """

    reckons = True
    hears = ("vr.haptic_request", "user.pose", "rover.tracker", "base.odometry", "base.twist")

    def __init__(
        self,
        limits: SafetyLimits,
        mode: DriveMode,
        outlet: Outlet,
        now: Callable[[], int],
        reset: Callable[[], bool],
        pull: Callable[[str], None],
    ) -> None:
        self.limits = limits
        self.cycles = CycleLog()
        self.status = ChainStatus(None, (), None, mode, 0, 0, 0, 0.0)
        self.mode_wanted = mode
        self.stops: Callable[[str], None] | None = None
        self.lost = 0
        self.longest_ms = 0.0
        self._outlet, self._now = outlet, now
        self._reset, self._pull = reset, pull
        self._granted: Pose2 | None = None
        self._located_ns: int | None = None

    @property
    def latched(self) -> str | None:
        """The reason of a latched stop."""
        return self.status.latched

    @property
    def refused(self) -> tuple[str, ...]:
        """Why no motion at all was possible in the last reported cycle."""
        return self.status.refused

    @property
    def admitted(self) -> Twist2 | None:
        """What was last admitted; None if nothing was cut since the last tick."""
        return self.status.admitted

    def locate_by(self, reckoner: Reckoner) -> None:
        """Nothing to do: the process has its own reckoner."""

    def hear(self, sample: Sample, now_ns: int) -> None:  # noqa: ARG002
        """Note the end of a request, which ends its grant; the chain receives it itself."""
        if sample.name == "vr.haptic_request" and sample.value is None:
            self._granted = None

    def grant(self, pose: Pose2 | None) -> None:
        """Serve the request from this base pose."""
        self._granted = pose
        self._outlet.send("grant", time.monotonic_ns(), pose)

    def locate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Send the localization's estimate, once for each stamp."""
        if pose is None or sigma is None:
            self._located_ns = None
            self._outlet.send("estimate", time.monotonic_ns(), None)
        elif stamp_ns != self._located_ns:
            self._located_ns = stamp_ns
            self._outlet.send("estimate", self._monotonic(stamp_ns), (pose, sigma))

    def command(self, twist: Twist2, stamp_ns: int | None) -> None:
        """Send the commanded velocity; mode and grant are repeated with it."""
        now = time.monotonic_ns()
        self._outlet.send("mode", now, self.mode_wanted)
        if self._granted is not None:
            self._outlet.send("grant", now, self._granted)
        if stamp_ns is None:
            self._outlet.send("command", now, None)
        else:
            self._outlet.send("command", self._monotonic(stamp_ns), twist)

    def reset(self, now_ns: int) -> bool:  # noqa: ARG002
        """Ask the chain to release its stop."""
        return self._reset()

    def pull(self, reason: str) -> None:
        """Stop the wheels until a reset."""
        self._pull(reason)

    def receive(self, datagram: Datagram, stamp_ns: int) -> None:
        """Keep records or a status of the chain; `stamp_ns` is the datagram's in the run's time.

        Records sent before the first datagram arrived here do not count as lost.
        """
        if isinstance(datagram.value, ChainStatus):
            self.lost = datagram.value.records - self.cycles.written
            self.longest_ms = max(self.longest_ms, datagram.value.longest_ms)
            self.status = datagram.value
        elif datagram.name == "chain.cycles":
            for record in _records(datagram.value):
                ago = datagram.stamp_ns - record.stamp_ns
                self.cycles.append(record._replace(stamp_ns=stamp_ns - ago))

    def _monotonic(self, stamp_ns: int) -> int:
        """A time of the run by the clock that all processes share, ns."""
        return time.monotonic_ns() - (self._now() - stamp_ns)


def _records(value: Any) -> list[SafetyRecord]:
    found = value if isinstance(value, tuple) else ()
    return [record for record in found if isinstance(record, SafetyRecord)]
