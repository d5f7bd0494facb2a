"""The part `base` of a run: a multiplexer of velocity sources in front of a safety chain.

Any code that opens wheels wraps them in a `GuardedBase`, for every chart and profile. A command
goes from here to the chain (`hw.safety.chain`), and from there to the wheels. There are four
callers:

    base.drive(command, "chase"); base.release("chase")   # states, within a tick
    base.hear(sample, now_ns)                             # the inlet, for each sample of a part
    base.tick(now_ns)                                     # the loop, after all states
    base.cycle(now_ns)                                    # the owner of plain wheels, at >= 100 Hz

The selected velocity is passed on in every tick with the tick's stamp, so that the chain notices
when ticks stop. Who asks the chain what the wheels may do depends on the wheels:

| wheels | chain | asked by |
|---|---|---|
| plain: they have no `chain` | `LocalChain` | `cycle` |
| with ramps of their own; their `chain` is set here | `LocalChain` | the wheels, behind the ramps |
| in a process of their own; their `chain` is given | `RemoteChain` | that process, likewise |

Ticks, samples and cycles may come from different threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from hw.geometry import STILL, Pose2, Twist2
from hw.interfaces import Base, DriveMode
from hw.safety.chain import Chain, Hear, LocalChain, Pull
from hw.safety.limits import SafetyLimits
from hw.safety.multiplexer import Multiplexer, Selected
from hw.safety.ramps import require_rolling
from hw.safety.rule import is_standing
from hw.samples import ArmState, Joints, Sample

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


class GuardedBase:
    """See the module.

    While the arm is not folded, and until it has reported, only Escape may drive, and Haptic with
    at most `limits.overlap` left to its goal (R46). While the stop line is pulled nothing drives
    (R48).

    `selected` is the multiplexer's choice in the last tick, `chain` the safety chain. `cycled` is
    True for plain wheels: `cycle` has to be called.
    """

    def __init__(
        self,
        base: Base,
        limits: SafetyLimits,
        parked: Joints | None = None,
        pull: Pull | None = None,
        modes: tuple[DriveMode, ...] = ("omni",),
    ) -> None:
        """Guard a base.

        Args:
            base: the wheels; see the module for their attribute `chain`.
            limits: of the safety chain, unless the wheels have one.
            parked: the joints of the folded arm, rad; None without an arm.
            pull: pulls the stop line with the reason of a latched stop.
            modes: of the robot; wheels that do not say how they drive have the first.
        """
        self.base = base
        self.selected = Selected(STILL, None, None)
        self.signals: tuple[str, ...] = (*base.signals, *REPORTED)
        self.cycled = not hasattr(base, "chain")
        self._has_modes, self._modes = hasattr(base, "mode"), modes
        self._mode_wanted = self.mode
        self.chain = _chain_of(base, limits)
        self.chain.stops = pull
        self._drives_in_ticks = not self.cycled and isinstance(self.chain, LocalChain)
        self._hears: dict[str, Hear] = {"stop.engaged": self._hear_stop_line}
        self._multiplexer = Multiplexer()
        self._parked = parked
        self._joints: Joints | None = None
        self._reported: tuple[object, ...] | None = None
        if parked is not None:
            self._hears["arm.joints"] = self._hear_arm
            self._multiplexer.switch(ARM_LOCK, True, 0)

    @property
    def mode(self) -> DriveMode:
        """How the wheels are driven."""
        base: Any = self.base
        mode: DriveMode = base.mode if self._has_modes else self._modes[0]
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
        return tuple({**self._hears, **dict.fromkeys(self.chain.hears)})

    # what states call

    def drive(self, command: Twist2, source: str = "own", left: float = math.inf) -> None:
        """Offer this velocity (base frame); a source of higher priority overrides it.

        `left` is the remaining distance to the goal, m.

        Raises:
            ValueError: a value is NaN or infinite, or it goes sideways in the mode `differential`
                or on a robot without another one.
            KeyError: there is no such source.
        """
        if self._mode_wanted == "differential" or "omni" not in self._modes:
            require_rolling(command)
        overlap = self.chain.limits.overlap
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
        self._mode_wanted = mode

    def grant(self, pose: Pose2 | None) -> None:
        """Serve the user's request from this base pose (map_from_base); see `Chain`."""
        self.chain.grant(pose)

    # samples, and ticks

    @property
    def refusal(self) -> str | None:
        """Why no source drove in the last tick, or why the chain admitted nothing; else None."""
        source, lock = self.selected[1:]
        if source is None:
            return None if lock is None else REFUSALS[lock]
        refused = self.chain.refused
        return self.chain.latched or refused[0] if refused else None

    def samples(self, now_ns: int) -> list[Sample]:
        """The samples of the wheels, and those signals of the guard that have changed."""
        base: Any = self.base
        found, before = list(base.samples(now_ns)), self._reported
        mode = base.mode if self._has_modes else self._modes[0]
        self._reported = after = (mode, self.refusal, self.chain.admitted)
        if after != before:
            for k, value in enumerate(after):
                if before is None or value != before[k]:
                    found.append(Sample(REPORTED[k], now_ns, value))
        return found

    def hear(self, sample: Sample, now_ns: int) -> None:
        """Take a sample that arrived now; signals not in `hears` are ignored."""
        self.chain.hear(sample, now_ns)
        name, stamp_ns, value = sample
        if name in self._hears:
            self._hears[name](now_ns, stamp_ns, value)

    def tick(self, now_ns: int) -> None:
        """Select a source, after all states were stepped, and pass its velocity on."""
        self.selected = selected = self._multiplexer.select(now_ns)
        self.chain.command(selected.twist, None if selected.source is None else now_ns)
        if not self._drives_in_ticks:
            return
        if selected.source is None:
            self.base.stop()
        else:
            self.base.drive(selected.twist)

    def leap(self, span_ns: int) -> None:
        """Pass over so long, ns, in which the base stands and all samples are repeated."""
        assert isinstance(self.chain, LocalChain)
        self.chain.leap(span_ns)

    @property
    def still(self) -> bool:
        """True while no source drives, and all that has changed has been reported."""
        if self.selected.source is not None:
            return False
        return self._reported in (None, (self.mode, self.refusal, self.chain.admitted))

    # what the owner of plain wheels calls

    def cycle(self, now_ns: int) -> None:
        """Command plain wheels; call it at 100 Hz or more if `cycled`."""
        chain = self.chain
        assert isinstance(chain, LocalChain)
        pose, twist = chain.measured(now_ns)
        command = self.selected.twist
        if command == STILL and twist is not None and is_standing(twist):
            chain.rest(now_ns)
            self.base.stop()
            return
        admitted = chain.admit(now_ns, command, pose, twist, self.mode)
        if admitted == STILL:
            self.base.stop()
        else:
            self.base.drive(admitted)

    # samples heard

    def _hear_stop_line(self, now_ns: int, stamp_ns: int, reason: str | None) -> None:  # noqa: ARG002
        self._multiplexer.switch(STOP_LOCK, reason is not None, now_ns)

    def _hear_arm(self, now_ns: int, stamp_ns: int, arm: ArmState) -> None:  # noqa: ARG002
        joints, parked = arm.joints, self._parked or ()
        if joints is self._joints:
            return  # the lock has no time-out
        self._joints = joints
        folded = joints == parked or (
            len(joints) == len(parked)
            and all(abs(a - b) <= FOLDED_RAD for a, b in zip(joints, parked, strict=True))
        )
        self._multiplexer.switch(ARM_LOCK, not folded, now_ns)


def _chain_of(base: Any, limits: SafetyLimits) -> Chain:
    """The chain of these wheels; see the module."""
    if not hasattr(base, "chain"):
        return LocalChain(limits)
    given: Chain | None = base.chain
    if given is not None and not isinstance(given, LocalChain):
        return given
    base.chain = chain = LocalChain(limits, measures=False)
    return chain
