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
from typing import Protocol, runtime_checkable

from hw.geometry import STILL, Pose2, Twist2
from hw.interfaces import Base, DriveMode
from hw.log import Log
from hw.reckoner import Reckoner
from hw.safety.chain import SafetyChain
from hw.safety.keeper import Hear, Keeper, Keeps, Pull, is_standing
from hw.safety.limits import SafetyLimits
from hw.safety.multiplexer import Multiplexer, Selected
from hw.safety.record import SafetyRecord
from hw.samples import ArmState, Joints, PoseSigma, Sample

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


@runtime_checkable
class Gated(Protocol):
    """Wheels with ramps of their own, which ask in each cycle what may go to the motors."""

    gate: GuardedBase | None


class KeptElsewhere(Keeps, Protocol):
    """The engine's side of a keeper in another process; it cycles there."""

    stops: Pull | None
    """Called, from any thread, with the reason when the wheels are stopped for good."""

    def pull(self, reason: str) -> None:
        """Stop the wheels for good."""
        ...


class GuardedBase:
    """See the module.

    While the arm is not folded, and until it has reported, only Escape drives, and Haptic with no
    more than `limits.overlap` to go (R46). While the stop line is pulled nobody drives (R48).

    `selected` is what counted in the last tick; `cycles` has the records of the chain.
    """

    def __init__(
        self,
        base: Base,
        limits: SafetyLimits,
        parked: Joints | None = None,
        pull: Pull | None = None,
    ) -> None:
        """Guard a base.

        Args:
            base: the wheels. If they have a `gate` it is set: they ask it in each cycle. If they
                have a `keeper` it guards them where they are, and here nobody cycles.
            limits: of the safety chain.
            parked: the joints of the folded arm, rad; None: there is no arm.
            pull: the stop line, pulled with the reason when a stop latches.
        """
        self.base = base
        self.selected = Selected(STILL, None, None)
        self.signals: tuple[str, ...] = (*base.signals, *TOLD)
        self._gated = isinstance(base, Gated)
        self._own: Keeper | None = None
        self._kept: Keeps
        self._elsewhere: KeptElsewhere | None = getattr(base, "keeper", None)
        if self._elsewhere is None:
            self._kept = self._own = Keeper(limits, measures=not self._gated)
        else:
            self._kept, self._elsewhere.stops = self._elsewhere, pull
        self._hears: dict[str, Hear] = {"stop.engaged": self._hear_stop_line}
        self._multiplexer = Multiplexer()
        self._parked, self._pull = parked, pull
        self._told: dict[str, object] = {}
        if parked is not None:
            self._hears["arm.joints"] = self._fold
            self._multiplexer.switch(ARM_LOCK, True, 0)
        if isinstance(base, Gated):
            base.gate = self

    def locate_by(self, reckoner: Reckoner) -> None:
        """The base does not know where it is: poses are those of a reckoner from now on."""
        self._kept.locate_by(reckoner)

    @property
    def keeper(self) -> Keeper:
        """Who keeps the wheels in this process.

        Raises:
            AttributeError: they are kept in another one.
        """
        if self._own is None:
            raise AttributeError("the wheels are kept in a process of their own")
        return self._own

    @property
    def cycled(self) -> bool:
        """Does somebody have to call `cycle`, or the gated wheels `admit`, in this process?"""
        return self._own is not None

    @property
    def chain(self) -> SafetyChain:
        """The safety chain in this process; see `keeper`."""
        return self.keeper.chain

    @property
    def limits(self) -> SafetyLimits:
        """What the chain goes by."""
        return self._kept.limits

    @property
    def cycles(self) -> Log[SafetyRecord]:
        """The newest records of the chain, for any number of readers."""
        return self._kept.cycles

    @property
    def reckons(self) -> bool:
        """Does it have to be told the estimates of localization, in every tick?"""
        return self._kept.reckons

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
        return tuple({**self._hears, **dict.fromkeys(self._kept.hears)})

    # what states call

    def drive(self, command: Twist2, source: str = "own", left: float = math.inf) -> None:
        """Go at this velocity (base frame) unless a source of higher priority drives.

        `left` is the way that remains to the goal, m.

        Raises:
            ValueError: a value is NaN or infinite.
            KeyError: there is no such source.
        """
        overlap = self.limits.overlap
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
        self._kept.grant(pose)

    # samples, and ticks

    @property
    def admitted(self) -> Twist2 | None:
        """What the chain last let pass, base frame; None: since the last tick, all of it."""
        return self._kept.admitted

    @property
    def refusal(self) -> str | None:
        """Why nobody drove in the last tick, or why the chain has let nothing pass; else None."""
        source, lock = self.selected[1:]
        if source is None:
            return None if lock is None else REFUSALS[lock]
        refused = self._kept.refused
        return self._kept.latched or refused[0] if refused else None

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
        self._kept.hear(sample, now_ns)
        take = self._hears.get(sample.name)
        if take is not None:
            take(now_ns, sample.stamp_ns, sample.value)

    def locate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Where localization takes the base to have been at an instant; None: it does not know."""
        self._kept.locate(stamp_ns, pose, sigma)

    def tick(self, now_ns: int) -> None:
        """All states were stepped: what they offer counts from now on, or goes on counting."""
        self.selected = selected = self._multiplexer.select(now_ns)
        self._kept.command(selected.twist, None if selected.source is None else now_ns)
        if not self._gated:
            return
        if selected.source is None:
            self.base.stop()
        else:
            self.base.drive(selected.twist)

    # what the owner of the wheels calls

    def cycle(self, now_ns: int) -> None:
        """Let wheels without a gate have their next velocity; call it at 100 Hz or more."""
        pose, twist = self.keeper.measured(now_ns)
        command = self.selected.twist
        if command == STILL and twist is not None and is_standing(twist):
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
        """How much of the next velocity may reach the motors: see `Keeper`."""
        admitted = self.keeper.admit(now_ns, command, pose, twist, self.mode)
        self._pull_if_latched()
        return admitted

    def rest(self, now_ns: int) -> None:
        """A cycle in which the base stands and is to stand."""
        self.keeper.rest(now_ns)
        self._pull_if_latched()

    def reset(self, now_ns: int) -> bool:
        """Take a latched stop away, by the operator's order; False while its cause holds."""
        return self._kept.reset(now_ns)

    def halt(self, reason: str) -> None:
        """The stop line was pulled: wheels that are kept elsewhere are stopped there at once."""
        if self._elsewhere is not None:
            self._elsewhere.pull(reason)

    def _pull_if_latched(self) -> None:
        if self.chain.latched is not None and self._pull is not None:
            self._pull(self.chain.latched)

    # what is heard

    def _hear_stop_line(self, now_ns: int, stamp_ns: int, reason: str | None) -> None:  # noqa: ARG002
        self._multiplexer.switch(STOP_LOCK, reason is not None, now_ns)

    def _fold(self, now_ns: int, stamp_ns: int, arm: ArmState) -> None:  # noqa: ARG002
        parked = self._parked or ()
        folded = arm.joints == parked or (
            len(arm.joints) == len(parked)
            and all(abs(a - b) <= FOLDED_RAD for a, b in zip(arm.joints, parked, strict=True))
        )
        self._multiplexer.switch(ARM_LOCK, not folded, now_ns)
