"""The safety chain, last before the wheels: it gets a velocity and decides how much may be driven.

A chain is the rule (`hw.safety.rule`) with its inputs. The guarded base (`hw.safety.guarded`)
passes on samples as they arrive, and the velocity of each tick with the tick's stamp, so that the
chain notices when ticks stop. Whoever owns the wheels asks in each cycle what they may do:

    chain.hear(sample, now_ns)                     # signals of `hears`, as they arrive
    chain.command(twist, stamp_ns)                 # in each tick; stamp None: no source drives
    chain.admit(now_ns, next_velocity, pose, twist)

`LocalChain` runs in the process that owns the wheels. Real wheels have a process of their own with
a `LocalChain` in it; the engine then has its client, `hw.drivers.chain.remote_chain.RemoteChain`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from threading import Lock
from typing import Any, Protocol

import numpy as np

import hw.motion
import hw.safety
from hw.geometry import STILL, Pose2, Twist2
from hw.interfaces import DriveMode
from hw.jit import Structs, compile_examples
from hw.motion import RECKONING, Reckoner
from hw.safety.cycle_log import CycleLog
from hw.safety.limits import SafetyLimits
from hw.safety.rule import SafetyRule
from hw.samples import Odometry, PoseSigma, Sample, TrackerPose, UserPose

Hear = Callable[[int, int, Any], None]
"""Takes now and the stamp, both ns, and the value of a sample."""
Pull = Callable[[str], None]


class Chain(Protocol):
    """The safety chain as the guarded base sees it, wherever it runs."""

    stops: Pull | None
    """Called with the reason, from any thread, when the chain has stopped the base until a reset;
    it may be called again with the same reason."""

    @property
    def limits(self) -> SafetyLimits:
        """The limits of the chain."""
        ...

    @property
    def cycles(self) -> CycleLog:
        """The newest cycles, for any number of readers."""
        ...

    @property
    def latched(self) -> str | None:
        """The reason of a latched stop; None if there is none."""
        ...

    @property
    def refused(self) -> tuple[str, ...]:
        """Why no motion at all was possible in the last cycle; empty if some was."""
        ...

    @property
    def admitted(self) -> Twist2 | None:
        """What was last admitted, base frame; None if nothing was cut since the last tick."""
        ...

    @property
    def reckons(self) -> bool:
        """True if `locate` has to be called with the localization's estimate in every tick."""
        ...

    @property
    def hears(self) -> tuple[str, ...]:
        """The signals to call `hear` with."""
        ...

    def hear(self, sample: Sample, now_ns: int) -> None:
        """Take a sample that arrived now; signals not in `hears` are ignored."""
        ...

    def locate_by(self, reckoner: Reckoner) -> None:
        """Take poses from a reckoner from now on: the base does not measure its own."""
        ...

    def locate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Take the localization's estimate of the base at an instant; None: it has none."""
        ...

    def grant(self, pose: Pose2 | None) -> None:
        """Serve the user's request from this base pose (map_from_base); None: it is not served.

        While the request lasts, the chain lets the base approach the user slowly down to the gap of
        that pose. The end of the request ends the grant.
        """
        ...

    def command(self, twist: Twist2, stamp_ns: int | None) -> None:
        """Set the velocity commanded at stamp_ns; a stamp of None: no source drives."""
        ...

    def pull(self, reason: str) -> None:
        """The stop line was pulled: stop at once, without waiting for its sample."""
        ...

    def reset(self, now_ns: int) -> bool:
        """Release a latched stop on the operator's order; False while its cause persists."""
        ...


class LocalChain:
    """The chain in the process that owns the wheels; see `Chain`.

    Samples, ticks and cycles may come from different threads. `wanted` is the commanded velocity.

    Args:
        limits: of the rule.
        measures: True to take the base's pose and twist from samples; else `admit` gets them.
    """

    def __init__(self, limits: SafetyLimits, measures: bool = True) -> None:
        compile_examples((hw.motion, hw.safety))
        self.limits, self.rule = limits, SafetyRule(limits)
        self.cycles = self.rule.cycles
        self.stops: Pull | None = None
        self.wanted = STILL
        self._stamp_ns: int | None = None
        self._mutex = Lock()
        self._reckoner: Reckoner | None = None
        self._latched, self._slowed = self.rule.state["latched"], self.rule.state["slowed"]
        self._reckoning: Structs = np.zeros(1, RECKONING)
        self._measured: dict[str, tuple[int, Any]] = {}
        self._hears: dict[str, Hear] = {
            "vr.haptic_request": self._hear_request,
            "stop.engaged": self._hear_stop_line,
        }
        if limits.watched:
            self._hears["user.pose"] = self._hear_user
        if measures:
            for name in ("base.pose", "base.twist"):
                self._hears[name] = partial(self._measure, name)

    @property
    def latched(self) -> str | None:
        """The reason of a latched stop."""
        return self.rule.latched

    @property
    def refused(self) -> tuple[str, ...]:
        """Why no motion at all was possible in the last cycle."""
        return self.rule.refused

    @property
    def admitted(self) -> Twist2 | None:
        """What was last admitted, if anything was cut since the last command."""
        return self.rule.slowed_to if self._slowed[0] else None

    @property
    def reckons(self) -> bool:
        """True if it needs estimates."""
        return self._reckoner is not None

    @property
    def hears(self) -> tuple[str, ...]:
        """The signals to call `hear` with."""
        return tuple(self._hears)

    def locate_by(self, reckoner: Reckoner) -> None:
        """Take poses from a reckoner from now on."""
        self._reckoner, self._reckoning = reckoner, reckoner.state
        self.rule.state["reckons"] = True
        self._hears["base.odometry"] = self._hear_odometry
        self._hears["rover.tracker"] = self._hear_tracker

    def hear(self, sample: Sample, now_ns: int) -> None:
        """Take a sample that arrived now."""
        name, stamp_ns, value = sample
        if name in self._hears:
            with self._mutex:
                self._hears[name](now_ns, stamp_ns, value)

    def locate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Take the localization's estimate of the base."""
        if self._reckoner is not None:
            with self._mutex:
                self._reckoner.estimate(stamp_ns, pose, sigma)

    def grant(self, pose: Pose2 | None) -> None:
        """Serve the user's request from this base pose."""
        with self._mutex:
            self.rule.grant(pose)

    def command(self, twist: Twist2, stamp_ns: int | None) -> None:
        """Set the commanded velocity."""
        before, self.wanted, self._stamp_ns = self._stamp_ns, twist, stamp_ns
        if stamp_ns is not None or before is not None or self._slowed[0]:
            self.rule.begin(stamp_ns)

    def pull(self, reason: str) -> None:
        """Do nothing: the stop line is heard in this process."""

    def reset(self, now_ns: int) -> bool:
        """Release a latched stop."""
        with self._mutex:
            return self.rule.reset(now_ns)

    # in each cycle

    def measured(self, now_ns: int) -> tuple[Pose2 | None, Twist2 | None]:
        """The newest pose and velocity heard; None where it is too old."""
        pose, twist = self._recent("base.pose", now_ns), self._recent("base.twist", now_ns)
        if self._reckoner is not None:
            wheels = self._recent("base.odometry", now_ns)
            twist = None if wheels is None else wheels.twist
        return pose, twist

    def admit(
        self,
        now_ns: int,
        command: Twist2,
        pose: Pose2 | None,
        twist: Twist2 | None,
        mode: DriveMode = "omni",
    ) -> Twist2:
        """The part of the next velocity, ramps included, that may reach the motors.

        `pose` is map_from_base; with a reckoner its pose is used instead. See `SafetyRule`.
        """
        stamp, sigma = self._stamp_ns, 0.0
        with self._mutex:
            if self._reckoner is not None:
                located = self._reckoner.at(now_ns)
                pose, sigma = (None, 0.0) if located is None else located
            at = now_ns if stamp is None else stamp
            admitted = self.rule.admit(now_ns, command, at, pose, twist, sigma, mode == "omni")
        if self._latched[0]:
            self._tell()
        return admitted

    def leap(self, span_ns: int) -> None:
        """Pass over so long, ns; see `SafetyRule`."""
        with self._mutex:
            self.rule.leap(span_ns)

    def run(self, now_ns: int, move: Callable[..., Any], *arguments: Any) -> Any:
        """Run the cycles of simulated wheels from now on, each by `hw.safety.checks.cycle`.

        `move` gets these arguments, the rule's state, the rows of its log, the reckoner's state.
        """
        with self._mutex:
            if self._reckoner is not None:
                self._reckoner.prepare(now_ns)
            rule = self.rule
            found = move(*arguments, rule.state, rule.cycles.rows, self._reckoning)
        if self._latched[0]:
            self._tell()
        return found

    def rest(self, now_ns: int) -> None:
        """A cycle of a standing base without a command."""
        with self._mutex:
            self.rule.rest(now_ns)
        if self._latched[0]:
            self._tell()

    def _tell(self) -> None:
        latched = self.rule.latched
        if latched is not None and self.stops is not None:
            self.stops(latched)

    # samples heard

    def _hear_user(self, now_ns: int, stamp_ns: int, user: UserPose | None) -> None:
        if user is not None:
            self.rule.track_user(now_ns, stamp_ns, user.body.x, user.body.y)

    def _hear_request(self, now_ns: int, stamp_ns: int, deep: object) -> None:  # noqa: ARG002
        self.rule.request(deep is not None)

    def _hear_stop_line(self, now_ns: int, stamp_ns: int, reason: str | None) -> None:  # noqa: ARG002
        self.rule.stop_line = reason

    def _hear_odometry(self, now_ns: int, stamp_ns: int, wheels: Odometry) -> None:
        assert self._reckoner is not None
        self._reckoner.move(stamp_ns, wheels)
        self._measure("base.odometry", now_ns, stamp_ns, wheels)

    def _hear_tracker(self, now_ns: int, stamp_ns: int, seen: TrackerPose) -> None:  # noqa: ARG002
        assert self._reckoner is not None
        self._reckoner.track(stamp_ns, seen)

    def _measure(self, name: str, now_ns: int, stamp_ns: int, value: Any) -> None:  # noqa: ARG002
        self._measured[name] = stamp_ns, value

    def _recent(self, name: str, now_ns: int) -> Any:
        """The newest value; None if it is older than `limits.old`, or ahead of the clock."""
        limits = self.limits
        stamp, value = self._measured.get(name, (now_ns, None))
        return value if -limits.ahead <= (now_ns - stamp) / 1e9 <= limits.old else None
