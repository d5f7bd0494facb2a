"""The cycle of the safety chain in front of real wheels: receive, check, ramp, admit, drive.

It is the last stage before the actuators. Its input is one stamped command, which ages; all other
inputs it receives itself. Nothing here waits. Each cycle does, in this order:

1. poll the wheels; a touch of the foam or a fault stops them by the drives' own quick stop until
   the reset, and so does a lost link, a latch of the chain, or a pull of the stop line;
2. move the velocity towards the commanded one within the ramps (`hw.safety.ramps`);
3. let the safety chain limit it; what is cut is braked away;
4. command the wheels.

A stop lasts until the operator resets it: `reset` is tried for a while, because drives need some
cycles to be enabled again.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from hw.drivers.chain.chain_settings import ChainSettings
from hw.drivers.chain.watchdogs import Watchdogs
from hw.drivers.gates import MS
from hw.drivers.hardware import Hardware
from hw.finite import is_finite
from hw.geometry import STILL, Pose2, Pose3, Twist2
from hw.interfaces import DriveMode
from hw.ipc import Datagram, Outlet
from hw.motion import Reckoner
from hw.safety import (
    STANDSTILL,
    LocalChain,
    Ramps,
    Velocity,
    is_standing,
    require_rolling,
    twist_after,
)
from hw.samples import PoseSigma, Sample, TrackerPose, UserPose

RESET_NS = 400 * MS
"""Longest time for the drives to be ready after a reset, ns."""
LONGEST_S = 0.02
"""Longest time that ramps are applied for, however long a cycle took, s."""
LONGEST_TEXT = 200
"""Longest reason of a stop, characters."""
NOT_READY = "the wheels are not ready"
OWN_SIGNALS = {"user.pose": UserPose, "rover.tracker": TrackerPose}


class ChainCycle:
    """See the module; single-threaded. `stopped` is why the wheels are stopped, or None."""

    def __init__(self, settings: ChainSettings, hardware: Hardware, outlet: Outlet) -> None:
        observer = settings.observer
        self.hardware = hardware
        self.stopped: str | None = None
        self.mode: DriveMode = settings.model.modes[0]
        self.links = Watchdogs(settings.arm, None if observer is None else observer.timeout)
        self.chain = LocalChain(settings.safety, measures=False)
        self.chain.locate_by(Reckoner(settings.tracking))
        self._ramps, self._modes = Ramps(settings.model, settings.motion), settings.model.modes
        self._outlet = outlet
        self._mode_wanted = self.mode
        self._yaw, self._velocity = 0.0, STANDSTILL
        self._cycled_ns: int | None = None
        self._odometry_ns = -1
        self._resetting: tuple[int, int, bool] | None = None
        self._handlers: dict[tuple[str, str], Callable[[int, Datagram], None]] = {
            ("engine", "command"): self._hear_command,
            ("engine", "mode"): self._hear_mode,
            ("engine", "grant"): self._hear_grant,
            ("engine", "estimate"): self._hear_estimate,
            ("observer", "pull"): self._hear_pull,
            ("observer", "observer.here"): self._hear_observer,
            ("arm", "arm.link"): self._hear_arm,
            ("vr", "vr.link"): self._hear_vr,
            ("vr", "vr.haptic_request"): self._hear_request,
            ("vr", "user.pose"): self._hear_signal,
            ("vr", "rover.tracker"): self._hear_signal,
        }

    @property
    def stands(self) -> bool:
        """True if the wheels are commanded to stand and report standstill."""
        twist = None if self.hardware.odometry is None else self.hardware.odometry[1].twist
        return self._velocity == STANDSTILL and twist is not None and is_standing(twist)

    @property
    def awaited(self) -> str | None:
        """What is still missing before anything may move, other than a stop; None if nothing is."""
        return self.links.awaited() or (None if self.hardware.ready else NOT_READY)

    def receive(self, datagram: Datagram, now_ns: int) -> None:
        """Handle a datagram that has arrived; what its source may not say is ignored.

        A mistake in handling it stops the wheels.
        """
        handle = self._handlers.get((datagram.source, datagram.name))
        if handle is None:
            return
        try:
            handle(now_ns, datagram)
        except Exception as error:  # noqa: BLE001  whatever it is, the chain has to go on
            self.pull(f"{datagram.source} {datagram.name}: {type(error).__name__}: {error}")

    def order(self, now_ns: int, name: str, value: str | int) -> None:
        """Carry out an order of the engine, by the pipe of the process.

        It is `pull` with its reason, or `reset`, which is answered by `chain.reset` and its value.
        """
        if name == "pull":
            self.stop(now_ns, str(value))
        elif name == "reset":
            self._reset(now_ns, int(value))

    def stop(self, now_ns: int, reason: str) -> None:
        """Stop the wheels until the reset; this cancels a reset in progress."""
        self.pull(reason)
        if self._resetting is not None:
            self._refuse(now_ns, self._resetting[0], reason)

    def pull(self, reason: str) -> None:
        """Stop the wheels until the reset; the first reason is kept."""
        if self.stopped is None:
            self.stopped = reason
            self._stop_hardware()

    def _stop_hardware(self) -> None:
        with suppress(Exception):  # the cycles command standstill, too
            self.hardware.stop()

    def cycle(self, now_ns: int) -> None:
        """Run one cycle; an exception of the hardware stops the wheels."""
        try:
            self._cycle(now_ns)
        except Exception as error:  # noqa: BLE001  of a driver; the chain has to go on
            self.pull(f"wheels: {type(error).__name__}: {error}")

    def _cycle(self, now_ns: int) -> None:
        self.hardware.poll(now_ns)
        self._measure(now_ns)
        self._check_links(now_ns)
        if self._resetting is not None:
            self._go_on_resetting(now_ns, *self._resetting)
        self.chain.hear(Sample("stop.engaged", now_ns, self.stopped or self.awaited), now_ns)
        self.hardware.drive(self._next(now_ns), now_ns)
        if self.chain.latched is not None:
            self.pull(self.chain.latched)

    def _measure(self, now_ns: int) -> None:
        """Pass on what the hardware has measured, to the chain and to the engine."""
        for hit in self.hardware.hits():
            self._outlet.send("bumper.hit", now_ns, hit)
            self.pull("bumper")
        for remark in self.hardware.remarks():
            self._outlet.send("chain.remark", now_ns, remark)
        if self.hardware.odometry is None or self.hardware.odometry[0] <= self._odometry_ns:
            return
        self._odometry_ns, odometry = self.hardware.odometry
        if is_finite(odometry):
            self.chain.hear(Sample("base.odometry", self._odometry_ns, odometry), now_ns)
            self._outlet.send("base.odometry", self._odometry_ns, odometry)

    def _check_links(self, now_ns: int) -> None:
        """Stop on a lost link or a fault of the wheels."""
        reason = self.hardware.fault or self.links.lost(now_ns)
        if reason is not None:
            self.pull(reason)
        if not self.links.may_ask(now_ns):
            self.chain.hear(Sample("vr.haptic_request", now_ns, None), now_ns)

    def _next(self, now_ns: int) -> Twist2:
        """The next velocity of the wheels, base frame."""
        before, self._cycled_ns = self._cycled_ns, now_ns
        span = 0.0 if before is None else min(max(0.0, (now_ns - before) * 1e-9), LONGEST_S)
        target = self._ramps.limited(self.chain.wanted, self._mode_wanted)
        if self.stopped is not None:
            target, self._velocity = STILL, STANDSTILL
        _, twist = self.chain.measured(now_ns)
        if self._velocity == STANDSTILL:
            self.mode = self._mode_wanted
            if target == STILL and twist is not None and is_standing(twist):
                self.chain.rest(now_ns)
                return STILL
        elif self.mode != self._mode_wanted:
            target = STILL
        velocity, after = self._ramped(target, span, braked=False)
        admitted = self.chain.admit(now_ns, velocity, None, twist, self.mode)
        if admitted is not velocity:
            slower = self._ramps.limited(admitted, self.mode)
            velocity, after = self._ramped(slower, span, braked=True)
        self._yaw, self._velocity = after
        return velocity

    def _ramped(
        self, target: Twist2, span: float, braked: bool
    ) -> tuple[Twist2, tuple[float, Velocity]]:
        """The velocity after span s, with the yaw and the velocity over the floor then."""
        motion = self._ramps.toward(self._yaw, self._velocity, target, span, self.mode, braked)
        return twist_after(self._yaw, motion, self.mode), (self._yaw + motion[2], motion[3])

    # resets

    def _reset(self, now_ns: int, token: int) -> None:
        if self.stopped is None:
            self._outlet.send("chain.reset", now_ns, (token, None))
        elif self._resetting is None:
            self._resetting = token, now_ns + RESET_NS, False

    def _go_on_resetting(self, now_ns: int, token: int, until_ns: int, begun: bool) -> None:
        """Release the stop once the drives are ready, or report why it stays."""
        why = self.links.lost(now_ns)
        if why is None and not begun:
            why = self._begin_resetting(now_ns)
            self._resetting = token, until_ns, True
        elif why is None and self.hardware.fault is None and self.hardware.ready:
            self.stopped = self._resetting = None
            self._outlet.send("chain.reset", now_ns, (token, None))
            return
        if why is None and now_ns >= until_ns:
            why = self.hardware.fault or NOT_READY
        if why is not None:
            self._refuse(now_ns, token, why)

    def _begin_resetting(self, now_ns: int) -> str | None:
        """Why the reset cannot begin; None if the drives are being enabled."""
        if not self.stands or not self.chain.reset(now_ns):
            return self.chain.latched or "the base moves"
        if not self.hardware.acknowledge():
            return self.hardware.fault or NOT_READY
        return None

    def _refuse(self, now_ns: int, token: int, why: str) -> None:
        self._resetting = None
        self._stop_hardware()
        self._outlet.send("chain.reset", now_ns, (token, why))

    # datagrams received

    def _hear_command(self, now_ns: int, datagram: Datagram) -> None:  # noqa: ARG002
        if datagram.value is None:
            self.chain.command(STILL, None)
        elif isinstance(datagram.value, Twist2) and is_finite(datagram.value):
            if "omni" not in self._modes:
                require_rolling(datagram.value)
            self.chain.command(datagram.value, datagram.stamp_ns)

    def _hear_mode(self, now_ns: int, datagram: Datagram) -> None:  # noqa: ARG002
        if datagram.value in self._modes:
            self._mode_wanted = datagram.value

    def _hear_grant(self, now_ns: int, datagram: Datagram) -> None:  # noqa: ARG002
        value = datagram.value
        if value is None or (isinstance(value, Pose2) and is_finite(value)):
            self.chain.grant(value)

    def _hear_estimate(self, now_ns: int, datagram: Datagram) -> None:  # noqa: ARG002
        pose, sigma = _pair(datagram.value)
        known = (
            isinstance(pose, Pose2) and isinstance(sigma, PoseSigma) and is_finite(datagram.value)
        )
        self.chain.locate(datagram.stamp_ns, pose if known else None, sigma if known else None)

    def _hear_pull(self, now_ns: int, datagram: Datagram) -> None:
        self.stop(now_ns, str(datagram.value or datagram.source)[:LONGEST_TEXT])

    def _hear_observer(self, now_ns: int, datagram: Datagram) -> None:
        """The stamp is one of ours, which the observer has just been told."""
        self.links.observer.beat(datagram.stamp_ns, now_ns)

    def _hear_arm(self, now_ns: int, datagram: Datagram) -> None:
        fault = None if datagram.value is None else f"arm: {datagram.value}"
        self.links.arm.beat(datagram.stamp_ns, now_ns, fault)

    def _hear_vr(self, now_ns: int, datagram: Datagram) -> None:
        self.links.vr.beat(
            datagram.stamp_ns, now_ns, None if datagram.value == "up" else str(datagram.value)
        )

    def _hear_request(self, now_ns: int, datagram: Datagram) -> None:
        """An invalid DEEP counts as no request."""
        asked = isinstance(datagram.value, Pose3) and is_finite(datagram.value)
        self.links.request.beat(datagram.stamp_ns, now_ns)
        deep = datagram.value if asked and self.links.may_ask(now_ns) else None
        self.chain.hear(Sample("vr.haptic_request", now_ns, deep), now_ns)

    def _hear_signal(self, now_ns: int, datagram: Datagram) -> None:
        if isinstance(datagram.value, OWN_SIGNALS[datagram.name]) and is_finite(datagram.value):
            self.chain.hear(Sample(datagram.name, datagram.stamp_ns, datagram.value), now_ns)


def _pair(value: Any) -> tuple[Any, Any]:
    return value if isinstance(value, tuple) and len(value) == 2 else (None, None)
