"""The base of a run: several offer velocities, one of them drives, and a chain guards the wheels.

Whoever opens wheels makes a `GuardedBase` around them, whatever chart and profile run. It is the
part `base` of the run, and has three sides:

    base.drive(command, "chase"); base.release("chase")   # states, in a tick
    base.hear(sample, now_ns)                             # whoever takes samples from the parts
    base.tick(now_ns)                                     # whoever ticks, after all states
    base.cycle(now_ns)                                    # whoever owns the wheels, at >= 100 Hz

The velocity that counts is passed on in every tick with the tick's stamp, so that the chain notices
when ticks stop. Wheels with ramps of their own ask in each cycle, behind their ramps (`gate`).
Ticks, samples and cycles may come from different threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from threading import Lock
from typing import Any, Protocol, runtime_checkable

from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.interfaces import Base, DriveMode
from hw.multiplexer import Multiplexer, Selected
from hw.reckoner import Reckoner
from hw.safety import STANDING, SafetyChain
from hw.safety_limits import SafetyLimits
from hw.samples import ArmState, Joints, Odometry, PoseSigma, Sample, TrackerPose, UserPose

STOP_LOCK, ARM_LOCK = "stop", "arm"
"""The locks that are on while the stop line is pulled, and while the arm is not folded."""
REFUSALS = {STOP_LOCK: "the stop line is pulled", ARM_LOCK: "the arm is not folded"}
FOLDED_RAD = 0.02
"""The arm is folded if every joint is that near to where it is when parked."""
HEARD = frozenset((
    "vr.haptic_request", "stop.engaged", "user.pose", "arm.joints", "base.pose", "base.twist",
    "base.odometry", "rover.tracker",
))  # fmt: skip
"""All that a guard may go by: who gives it is opened with the base."""
TOLD = ("base.mode", "base.refusal", "base.admitted")
"""What a guard tells of itself, whenever it changes."""
CYCLE_NS = 10_000_000
"""Longest time between two cycles."""
Hear = Callable[[int, int, Any], None]
"""Takes now and the stamp, ns, and the value of a sample."""


@runtime_checkable
class Gated(Protocol):
    """Wheels with ramps of their own, which ask in each cycle what may go to the motors."""

    gate: GuardedBase | None


class GuardedBase:
    """See the module.

    While the arm is not folded, and until it has reported, only Escape drives, and Haptic with no
    more than `limits.overlap` to go (R46). While the stop line is pulled nobody drives (R48).

    `selected` is what counted in the last tick; `chain.cycles` has the records.
    """

    def __init__(
        self,
        base: Base,
        limits: SafetyLimits,
        parked: Joints | None = None,
        pull: Callable[[str], None] | None = None,
    ) -> None:
        """Guard a base.

        Args:
            base: the wheels. If they have a `gate` it is set: they ask it in each cycle.
            limits: of the safety chain.
            parked: the joints of the folded arm, rad; None: there is no arm.
            pull: the stop line, pulled with the reason when a stop latches.
        """
        self.base = base
        self.chain = SafetyChain(limits)
        self.selected = Selected(STILL, None, None)
        self.signals: tuple[str, ...] = (*base.signals, *TOLD)
        self._hears: dict[str, Hear] = {
            "vr.haptic_request": self._ask,
            "stop.engaged": self._hear_stop_line,
        }
        self._multiplexer = Multiplexer()
        self._parked, self._pull = parked, pull
        self._stamp_ns: int | None = None
        self._told: dict[str, object] = {}
        self._admitted: Twist2 | None = None
        self._measured: dict[str, tuple[int, Any]] = {}
        self._mutex = Lock()
        self._reckoner: Reckoner | None = None
        if limits.watched:
            self._hears["user.pose"] = self._see
        if parked is not None:
            self._hears["arm.joints"] = self._fold
            self._multiplexer.switch(ARM_LOCK, True, 0)
        self._gated = isinstance(base, Gated)
        if isinstance(base, Gated):
            base.gate = self
        else:
            self._hears["base.pose"] = partial(self._measure, "base.pose")
            self._hears["base.twist"] = partial(self._measure, "base.twist")

    def locate_by(self, reckoner: Reckoner) -> None:
        """The base does not know where it is: poses are those of a reckoner from now on."""
        self._reckoner = reckoner
        self._hears["base.odometry"] = self._move
        self._hears["rover.tracker"] = self._track

    @property
    def reckons(self) -> bool:
        """Does it have to be told the estimates of localization, in every tick?"""
        return self._reckoner is not None

    @property
    def mode(self) -> DriveMode:
        """How the wheels are driven; wheels that know of no modes go in all directions."""
        mode: DriveMode = getattr(self.base, "mode", "omni")
        return mode

    @property
    def wake(self) -> Callable[[], None] | None:
        """What the driver of the wheels calls when a sample has come; None: it does not."""
        return getattr(self.base, "wake", None)

    @wake.setter
    def wake(self, wake: Callable[[], None]) -> None:
        if hasattr(self.base, "wake"):
            self.base.wake = wake

    def close(self) -> None:
        """Let go of the wheels."""
        if hasattr(self.base, "close"):
            self.base.close()

    @property
    def hears(self) -> tuple[str, ...]:
        """The signals to call `hear` with; whoever measures them has to be sampled."""
        return tuple(self._hears)

    # what states call

    def drive(self, command: Twist2, source: str = "own", left: float = math.inf) -> None:
        """Go at this velocity (base frame) unless a source of higher priority drives.

        `left` is the way that remains to the goal, m.

        Raises:
            ValueError: a value is NaN or infinite.
            KeyError: there is no such source.
        """
        overlap = self.chain.limits.overlap
        docks = source == "haptic" and overlap > 0.0 and left <= overlap
        if source == "haptic" and not docks:
            self._multiplexer.release("docking")  # it had less to go a moment ago
        self._multiplexer.offer("docking" if docks else source, command)

    def release(self, source: str = "own") -> None:
        """A source is done; the others need not wait."""
        self._multiplexer.release(source)
        if source == "haptic":
            self._multiplexer.release("docking")

    def stop(self) -> None:
        """All sources are done: called by the engine between two users of the base, and to hold."""
        self._multiplexer.release_all()

    def use(self, mode: DriveMode) -> None:
        """Change the way of driving; see `Base`."""
        self.base.use(mode)

    def grant(self, pose: Pose2 | None) -> None:
        """The request of the user is served from this pose, map_from_base; None: it is not.

        The chain lets the base come slowly as near to the user as that pose is, while they ask for
        it. The end of the request ends the grant.
        """
        with self._mutex:
            self.chain.grant(pose)

    # samples, and ticks

    @property
    def admitted(self) -> Twist2 | None:
        """What the chain last let pass, base frame; None: since the last tick, all of it."""
        return self._admitted

    @property
    def refusal(self) -> str | None:
        """Why nobody drove in the last tick, or why the chain has let nothing pass; else None."""
        source, lock = self.selected[1:]
        if source is None:
            return None if lock is None else REFUSALS[lock]
        refused = self.chain.refused
        return self.chain.latched or refused[0] if refused else None

    def samples(self, now_ns: int) -> list[Sample]:
        """Those of the wheels, and what has changed of `TOLD`."""
        found = list(self.base.samples(now_ns))
        for name, value in zip(TOLD, (self.mode, self.refusal, self.admitted), strict=True):
            if name not in self._told or value != self._told[name]:
                self._told[name] = value
                found.append(Sample(name, now_ns, value))
        return found

    def hear(self, sample: Sample, now_ns: int) -> None:
        """A sample has arrived now; anything else is ignored."""
        take = self._hears.get(sample.name)
        if take is not None:
            with self._mutex:
                take(now_ns, sample.stamp_ns, sample.value)

    def locate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Where localization takes the base to have been at an instant; None: it does not know."""
        if self._reckoner is not None:
            with self._mutex:
                self._reckoner.estimate(stamp_ns, pose, sigma)

    def tick(self, now_ns: int) -> None:
        """All states were stepped: what they offer counts from now on, or goes on counting."""
        self.selected = selected = self._multiplexer.select(now_ns)
        self._stamp_ns = None if selected.source is None else now_ns
        self._admitted = None
        if not self._gated:
            return
        if selected.source is None:
            self.base.stop()
        else:
            self.base.drive(selected.twist)

    # what the owner of the wheels calls

    def cycle(self, now_ns: int) -> None:
        """Let wheels without a gate have their next velocity; call it at 100 Hz or more."""
        pose, twist = self._recent("base.pose", now_ns), self._recent("base.twist", now_ns)
        if self._reckoner is not None:
            wheels = self._recent("base.odometry", now_ns)
            twist = None if wheels is None else wheels.twist
        command = self.selected.twist
        if command == STILL and twist is not None and _is_standing(twist):
            self.rest(now_ns)
            self.base.stop()
            return
        admitted = self.admit(now_ns, command, pose, twist)
        if admitted == STILL:
            self.base.stop()
        else:
            self.base.drive(admitted)

    def admit(
        self, now_ns: int, command: Twist2, pose: Pose2 | None, twist: Twist2 | None
    ) -> Twist2:
        """How much of the next velocity, ramps included, may reach the motors: `SafetyChain`.

        `pose` is map_from_base; that of a base that is located by a reckoner is the reckoner's.
        """
        chain, stamp, sigma = self.chain, self._stamp_ns, 0.0
        with self._mutex:
            if self._reckoner is not None:
                located = self._reckoner.at(now_ns)
                pose, sigma = (None, 0.0) if located is None else located
            chain.holonomic = self.mode == "omni"
            if stamp is None:
                stamp = now_ns  # a stop does not get old
            record = chain.admit(now_ns, command, stamp, pose, twist, sigma)
            if self._admitted is not None or record.admitted != command:
                self._admitted = record.admitted
        self._pull_if_latched()
        return record.admitted

    def rest(self, now_ns: int) -> None:
        """A cycle in which the base stands and is to stand."""
        with self._mutex:
            self.chain.rest(now_ns)
        self._pull_if_latched()

    def reset(self, now_ns: int) -> bool:
        """Take a latched stop away, by the operator's order; False while its cause holds."""
        with self._mutex:
            return self.chain.reset(now_ns)

    def _pull_if_latched(self) -> None:
        if self.chain.latched is not None and self._pull is not None:
            self._pull(self.chain.latched)

    # what is heard

    def _see(self, now_ns: int, stamp_ns: int, user: UserPose | None) -> None:
        if user is not None:
            self.chain.see(now_ns, stamp_ns, user.body.x, user.body.y)

    def _ask(self, now_ns: int, stamp_ns: int, deep: Pose3 | None) -> None:  # noqa: ARG002
        self.chain.request(deep is not None)

    def _hear_stop_line(self, now_ns: int, stamp_ns: int, reason: str | None) -> None:  # noqa: ARG002
        self.chain.stop_line = reason
        self._multiplexer.switch(STOP_LOCK, reason is not None, now_ns)

    def _fold(self, now_ns: int, stamp_ns: int, arm: ArmState) -> None:  # noqa: ARG002
        parked = self._parked or ()
        folded = arm.joints == parked or (
            len(arm.joints) == len(parked)
            and all(abs(a - b) <= FOLDED_RAD for a, b in zip(arm.joints, parked, strict=True))
        )
        self._multiplexer.switch(ARM_LOCK, not folded, now_ns)

    def _move(self, now_ns: int, stamp_ns: int, wheels: Odometry) -> None:
        assert self._reckoner is not None
        self._reckoner.move(stamp_ns, wheels)
        self._measure("base.odometry", now_ns, stamp_ns, wheels)

    def _track(self, now_ns: int, stamp_ns: int, seen: TrackerPose) -> None:  # noqa: ARG002
        assert self._reckoner is not None
        self._reckoner.track(stamp_ns, seen)

    def _measure(self, name: str, now_ns: int, stamp_ns: int, value: Any) -> None:  # noqa: ARG002
        self._measured[name] = stamp_ns, value

    def _recent(self, name: str, now_ns: int) -> Any:
        """The newest value; None if it is older than poses may be, or ahead of the clock."""
        limits = self.chain.limits
        stamp, value = self._measured.get(name, (now_ns, None))
        return value if -limits.ahead <= (now_ns - stamp) / 1e9 <= limits.old else None


def _is_standing(twist: Twist2) -> bool:
    return max(twist.speed, abs(twist.wz)) <= STANDING
