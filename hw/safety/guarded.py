"""The part `base` of a run: a multiplexer of velocity sources behind a safety chain.

Any code that opens wheels wraps them in a `GuardedBase`, for every chart and profile. It has four
callers:

    base.drive(command, "chase"); base.release("chase")   # states, within a tick
    base.hear(sample, now_ns)                             # the inlet, for each sample of a part
    base.tick(now_ns)                                     # the loop, after all states
    base.cycle(now_ns)                                    # the owner of the wheels, at >= 100 Hz

The selected velocity is passed on in every tick with the tick's stamp, so that the chain notices
when ticks stop. Wheels with ramps of their own call back in each cycle, behind their ramps
(`gate`). Ticks, samples and cycles may come from different threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from hw.geometry import STILL, Pose2, Twist2
from hw.interfaces import Base, DriveMode
from hw.log import Log
from hw.motion import Reckoner
from hw.safety.chain import SafetyChain
from hw.safety.cycle_record import SafetyRecord
from hw.safety.keeper import Hear, Keeper, Keeps, Pull, is_standing
from hw.safety.limits import SafetyLimits
from hw.safety.multiplexer import Multiplexer, Selected
from hw.samples import ArmState, Joints, PoseSigma, Sample

STOP_LOCK, ARM_LOCK = "stop", "arm"
"""Locks: on while the stop line is pulled, and while the arm is not folded."""
REFUSALS = {STOP_LOCK: "the stop line is pulled", ARM_LOCK: "the arm is not folded"}
FOLDED_RAD = 0.02
"""The arm counts as folded if every joint is this close to its parked angle, rad."""
HEARD = frozenset((
    "vr.haptic_request", "stop.engaged", "user.pose", "arm.joints", "base.pose", "base.twist",
    "base.odometry", "rover.tracker",
))  # fmt: skip
"""Signals that a guard may use: the parts that give them are opened together with the base."""
REPORTED = ("base.mode", "base.refusal", "base.admitted")
"""Signals of the guard itself, sampled on change."""
CYCLE_NS = 10_000_000
"""Longest time between two cycles, ns."""


@runtime_checkable
class Gated(Protocol):
    """Wheels with ramps of their own, which ask in each cycle what may reach the motors."""

    gate: GuardedBase | None


class KeptElsewhere(Keeps, Protocol):
    """The engine's side of a keeper in another process, which runs the cycles there."""

    stops: Pull | None
    """Called with the reason, from any thread, when the wheels are stopped until a reset."""

    def pull(self, reason: str) -> None:
        """Stop the wheels until a reset."""
        ...


class GuardedBase:
    """See the module.

    While the arm is not folded, and until it has reported, only Escape may drive, and Haptic with
    at most `limits.overlap` left to its goal (R46). While the stop line is pulled nothing drives
    (R48).

    `selected` is the multiplexer's choice in the last tick; `cycles` has the records of the chain.
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
            base: the wheels. If they have a `gate`, it is set and called in each cycle. If they
                have a `keeper`, it guards them in another process and no cycles run here.
            limits: of the safety chain.
            parked: the joints of the folded arm, rad; None without an arm.
            pull: pulls the stop line with the reason of a latched stop.
        """
        self.base = base
        self.selected = Selected(STILL, None, None)
        self.signals: tuple[str, ...] = (*base.signals, *REPORTED)
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
        self._told: tuple[object, ...] | None = None
        if parked is not None:
            self._hears["arm.joints"] = self._fold
            self._multiplexer.switch(ARM_LOCK, True, 0)
        if isinstance(base, Gated):
            base.gate = self

    def locate_by(self, reckoner: Reckoner) -> None:
        """Take poses from a reckoner from now on: the base does not measure its own."""
        self._kept.locate_by(reckoner)

    @property
    def keeper(self) -> Keeper:
        """The keeper of the wheels in this process.

        Raises:
            AttributeError: the keeper is in another process.
        """
        if self._own is None:
            raise AttributeError("the keeper of the wheels is in a process of its own")
        return self._own

    @property
    def cycled(self) -> bool:
        """True if `cycle`, or `admit` of gated wheels, has to be called in this process."""
        return self._own is not None

    @property
    def chain(self) -> SafetyChain:
        """The safety chain in this process; see `keeper`."""
        return self.keeper.chain

    @property
    def limits(self) -> SafetyLimits:
        """The limits of the chain."""
        return self._kept.limits

    @property
    def cycles(self) -> Log[SafetyRecord]:
        """The newest records of the chain, for any number of readers."""
        return self._kept.cycles

    @property
    def reckons(self) -> bool:
        """True if `locate` has to be called with the localization's estimate in every tick."""
        return self._kept.reckons

    @property
    def mode(self) -> DriveMode:
        """How the wheels are driven; `omni` for wheels without modes."""
        mode: DriveMode = getattr(self.base, "mode", "omni")
        return mode

    @property
    def wake(self) -> Callable[[], None] | None:
        """Called by the driver of the wheels when a sample has arrived; None if unsupported."""
        return getattr(self.base, "wake", None)

    @wake.setter
    def wake(self, wake: Callable[[], None]) -> None:
        if hasattr(self.base, "wake"):
            self.base.wake = wake

    def close(self) -> None:
        """Close the driver of the wheels."""
        if hasattr(self.base, "close"):
            self.base.close()

    @property
    def hears(self) -> tuple[str, ...]:
        """The signals to call `hear` with; their parts are sampled even if no state reads them."""
        return tuple({**self._hears, **dict.fromkeys(self._kept.hears)})

    # what states call

    def drive(self, command: Twist2, source: str = "own", left: float = math.inf) -> None:
        """Offer this velocity (base frame); a source of higher priority overrides it.

        `left` is the remaining distance to the goal, m.

        Raises:
            ValueError: a value is NaN or infinite.
            KeyError: there is no such source.
        """
        overlap = self.limits.overlap
        docks = source == "haptic" and overlap > 0.0 and left <= overlap
        if source == "haptic" and not docks:
            self._multiplexer.release("docking")  # the remaining distance has grown again
        self._multiplexer.offer("docking" if docks else source, command)

    def release(self, source: str = "own") -> None:
        """Withdraw a source's offer, so that the others take over without waiting."""
        self._multiplexer.release(source)
        if source == "haptic":
            self._multiplexer.release("docking")

    def stop(self) -> None:
        """Withdraw all offers: called by the engine when the base changes hands, and to hold it."""
        self._multiplexer.release_all()

    def use(self, mode: DriveMode) -> None:
        """Change the drive mode; see `Base`."""
        self.base.use(mode)

    def grant(self, pose: Pose2 | None) -> None:
        """Serve the user's request from this base pose (map_from_base); None: it is not served.

        While the request lasts, the chain lets the base approach the user slowly down to the gap of
        that pose. The end of the request ends the grant.
        """
        self._kept.grant(pose)

    # samples, and ticks

    @property
    def admitted(self) -> Twist2 | None:
        """What the chain last admitted, base frame; None if nothing was cut since the last tick."""
        return self._kept.admitted

    @property
    def refusal(self) -> str | None:
        """Why no source drove in the last tick, or why the chain admitted nothing; else None."""
        source, lock = self.selected[1:]
        if source is None:
            return None if lock is None else REFUSALS[lock]
        refused = self._kept.refused
        return self._kept.latched or refused[0] if refused else None

    def samples(self, now_ns: int) -> list[Sample]:
        """The samples of the wheels, and those signals of the guard that have changed."""
        found = list(self.base.samples(now_ns))
        told, self._told = self._told, (self.mode, self.refusal, self.admitted)
        if told != self._told:
            for k, value in enumerate(self._told):
                if told is None or value != told[k]:
                    found.append(Sample(REPORTED[k], now_ns, value))
        return found

    def hear(self, sample: Sample, now_ns: int) -> None:
        """Take a sample that arrived now; signals not in `hears` are ignored."""
        self._kept.hear(sample, now_ns)
        take = self._hears.get(sample.name)
        if take is not None:
            take(now_ns, sample.stamp_ns, sample.value)

    def locate(self, stamp_ns: int, pose: Pose2 | None, sigma: PoseSigma | None) -> None:
        """Take the localization's estimate of the base at an instant; None: it has none."""
        self._kept.locate(stamp_ns, pose, sigma)

    def tick(self, now_ns: int) -> None:
        """Select a source, after all states were stepped, and pass its velocity on."""
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
        """Command wheels without a gate; call it at 100 Hz or more."""
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
        """The part of the next velocity that may reach the motors; see `Keeper`."""
        keeper = self.keeper
        admitted = keeper.admit(now_ns, command, pose, twist, self.mode)
        self._pull_if_latched(keeper)
        return admitted

    def rest(self, now_ns: int) -> None:
        """A cycle of a standing base without a command."""
        keeper = self.keeper
        keeper.rest(now_ns)
        self._pull_if_latched(keeper)

    def reset(self, now_ns: int) -> bool:
        """Release a latched stop on the operator's order; False while its cause persists."""
        return self._kept.reset(now_ns)

    def halt(self, reason: str) -> None:
        """Stop at once wheels with their keeper in another process: the stop line was pulled."""
        if self._elsewhere is not None:
            self._elsewhere.pull(reason)

    def _pull_if_latched(self, keeper: Keeper) -> None:
        latched = keeper.chain.latched
        if latched is not None and self._pull is not None:
            self._pull(latched)

    # samples heard

    def _hear_stop_line(self, now_ns: int, stamp_ns: int, reason: str | None) -> None:  # noqa: ARG002
        self._multiplexer.switch(STOP_LOCK, reason is not None, now_ns)

    def _fold(self, now_ns: int, stamp_ns: int, arm: ArmState) -> None:  # noqa: ARG002
        parked = self._parked or ()
        folded = arm.joints == parked or (
            len(arm.joints) == len(parked)
            and all(abs(a - b) <= FOLDED_RAD for a, b in zip(arm.joints, parked, strict=True))
        )
        self._multiplexer.switch(ARM_LOCK, not folded, now_ns)
