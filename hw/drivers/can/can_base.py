"""Wheels and bumper on a CAN bus, as hardware of the chain's process (`hw.drivers.hardware`).

    hardware:
      driver: CanBase
      bus: {interface: socketcan, channel: can0, bitrate: 500000}
      wheels: {nodes: [1, 2, 3, 4], signs: [1, -1, 1, -1], gear: 12.52, increments: 4096}
                                  # see `hw.drivers.can.wheel_setting`
      bumper: true                # its board is on the bus

In each cycle `poll` takes the frames received; `drive` sends a target to each drive and one SYNC,
on which all four take their targets and answer with their velocities. Single-threaded, no waiting.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from canopen import Network

from hw.drivers.can.bus import CanBus
from hw.drivers.can.can_bumper import CanBumper
from hw.drivers.can.ds402 import Ds402Drive
from hw.drivers.can.mecanum import Mecanum, Reckoning, filled
from hw.drivers.can.wheel_setting import DriveNodes
from hw.drivers.gates import VELOCITY_NS
from hw.geometry import STILL, Twist2
from hw.model import BaseModel
from hw.safety import require_rolling
from hw.samples import BumperHit, Odometry

NAMES = ("front left", "front right", "rear left", "rear right")
SYNC, ORDER = 0x80, 0x00
OPENING_NS = 3_000_000_000
"""Time limit for configuring the drives, ns."""
ENABLING_NS = 2_000_000_000
"""Time limit for enabling the drives, ns."""
BEAT_NS = 15_000_000
"""Age of our last heartbeat at which the next is sent, ns: every second cycle of 10 ms."""
STRANGE_NS = 1_000_000_000
"""Silence after which another master counts as gone, ns."""
SLIPPING, SLIPPING_NS = 0.15, 500_000_000
"""A residual of the four rates above this, m/s, for this long, ns, is a fault: a wheel slips, is
blocked, or is measured wrongly.

The time is longer than the drives' ramps can cause a residual after a step of the command.
"""
STANDING_NS = 1_000_000_000
"""Time for the wheels to stop when closing, ns."""


class CanBase:
    """Four drives and a bumper; see `Hardware`.

    Args:
        model: of the base.
        bus: of python-can: `interface`, `channel`, `bitrate`.
        wheels: mounting and scaling of the drives: `nodes`, `signs`, `gear`, `unit`, `increments`,
            `silence`, `without` (`hw.drivers.can.wheel_setting`).
        bumper: whether its board is on the bus.
        clock: ns.

    Raises:
        OSError: the bus does not open, another master is on it, or a drive does not answer.
        ValueError: an invalid entry.
    """

    listens_ns = 100_000_000
    """Time to listen for another master before sending, ns."""

    def __init__(
        self,
        model: BaseModel,
        bus: Mapping[str, Any],
        wheels: Mapping[str, Any],
        bumper: bool = False,
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """`clock` is for opening and closing only; otherwise time is passed in by the calls."""
        self.odometry: tuple[int, Odometry] | None = None
        self.fault: str | None = None
        self._remarks: list[str] = []
        self._wheels, self._mecanum = DriveNodes.of(wheels), Mecanum.of(model)
        brakes = self._mecanum.brakes(model.brake_deceleration)
        for wrong in self._wheels.faults_at(model.wheel_radius, self._mecanum.max_rate, brakes):
            raise ValueError(f"wheels: {wrong}")
        self._reckoning = Reckoning(self._mecanum, 1.0 / self._wheels.scale)
        self._bus = CanBus(bus)
        setting = self._wheels.setting(brakes)
        self._drives = tuple(
            Ds402Drive(node, name, setting, self._bus.send)
            for node, name in zip(self._wheels.nodes, NAMES, strict=True)
        )
        self._bumper = CanBumper(self._bus.send) if bumper else None
        self._begun = False
        self._starting_ns: int | None = None
        self._stranger_ns: int | None = None
        self._clock, self._now_ns = clock, clock()
        self._beat_ns = self._sync_ns = self._moved_ns = self._rolled_ns = 0
        self._net = Network()  # its threads are not used: frames are handed on by `_receive`
        self._subscribe()
        try:
            self._open()
        except OSError:
            self._bus.close()
            raise

    @property
    def ready(self) -> bool:
        """True if all drives are enabled without a fault; see `Hardware`."""
        return self.fault is None and all(drive.enabled for drive in self._drives)

    def poll(self, now_ns: int) -> None:
        """Take frames, check ages, compute odometry; see `Hardware`."""
        if not self._begun:
            self._begun = True
            self._start(now_ns)
        self._receive(now_ns)
        for drive in self._drives:
            drive.poll(now_ns)
        if self._bumper is not None:
            self._bumper.poll(now_ns)
        self._reckon()
        self._judge()

    def hits(self) -> list[BumperHit]:
        """Touches of the foam since the last call."""
        return [] if self._bumper is None else self._bumper.hits()

    def remarks(self) -> list[str]:
        """What drives lack, and error frames of the bus, since the last call."""
        found, self._remarks = self._remarks, []
        return found

    def drive(self, velocity: Twist2, now_ns: int) -> None:
        """Send targets, SYNC and heartbeat; the targets are 0 during a fault."""
        if not self._mecanum.sideways:
            require_rolling(velocity)
        rates = self._mecanum.rates(velocity if self.ready else STILL)
        for drive, target in zip(self._drives, self._wheels.counts(rates), strict=True):
            drive.send_command(drive.control(), target)
        self._bus.send(SYNC, b"")
        self._sync_ns = now_ns
        if now_ns - self._beat_ns >= BEAT_NS:
            self._beat_ns = now_ns
            self._bus.send(0x700 + self._wheels.master, b"\x05")

    def stop(self) -> None:
        """Quick stop of all drives with the next `drive`, until `acknowledge`; it is a fault."""
        self.fault = self.fault or "the drives are stopped"
        self._starting_ns = None
        for drive in self._drives:
            drive.hold()

    def acknowledge(self) -> bool:
        """Begin to clear the fault and to enable the drives; `poll` completes both."""
        now_ns = self._now_ns
        if self._bus.fault is not None or self._is_strange():
            return False
        if not all(drive.alive(now_ns) for drive in self._drives):
            return False
        if self._bumper is not None and not self._bumper.acknowledge():
            return False
        self._start(now_ns)
        return True

    def close(self) -> None:
        """Stop, switch the drives off, and close the bus."""
        self.stop()
        end_ns = self._clock() + STANDING_NS
        while self._clock() < end_ns and not self._stand():
            self.drive(STILL, self._clock())
            self._bus.readable(0.005)
            self._receive(self._clock())
        for drive in self._drives:
            drive.switch_off()
        self._bus.send(SYNC, b"")
        self._bus.close()

    # --- frames

    def _subscribe(self) -> None:
        on: dict[int, Callable[[bytes, int], None]] = {
            SYNC: self._hear_stranger,
            ORDER: self._hear_stranger,
            0x700 + self._wheels.master: self._hear_stranger,
        }
        for drive in self._drives:
            on[0x700 + drive.node] = drive.on_heartbeat
            on[0x180 + drive.node] = drive.on_told
            on[0x80 + drive.node] = drive.on_emergency
            on[0x580 + drive.node] = drive.on_answer
        if self._bumper is not None:
            on[self._bumper.frame] = self._bumper.on_frame
        for identifier, handle in on.items():
            self._net.subscribe(identifier, self._handler(handle))

    def _handler(
        self, handle: Callable[[bytes, int], None]
    ) -> Callable[[int, bytearray, float], None]:
        return lambda _id, data, _stamp: handle(bytes(data), self._now_ns)

    def _receive(self, now_ns: int) -> None:
        self._now_ns = now_ns
        for frame in self._bus.poll(now_ns):
            self._net.notify(frame.id, bytearray(frame.data), 1e-9 * now_ns)
        if self._bus.warning is not None:
            self._remarks.append(self._bus.warning)

    def _hear_stranger(self, _data: bytes, now_ns: int) -> None:
        self._stranger_ns = now_ns

    def _is_strange(self) -> bool:
        heard = self._stranger_ns
        return heard is not None and self._now_ns - heard < STRANGE_NS

    # --- opening, starting, standing

    def _open(self) -> None:
        """Listen, then configure the drives."""
        end_ns = self._now_ns + self.listens_ns
        while self._now_ns < end_ns:
            self._bus.readable(0.005)
            self._receive(self._clock())
        if self._is_strange():
            raise OSError(
                f"{self._bus.name}: another master drives there; a bus has one, so end that first"
            )
        for drive in self._drives:
            drive.start(self._now_ns)
        end_ns = self._now_ns + OPENING_NS
        while waiting := [drive for drive in self._drives if not drive.configured]:
            self._bus.readable(0.002)
            self._receive(self._clock())
            for drive in waiting:
                drive.poll(self._now_ns)
            faults = [drive.fault for drive in waiting if drive.fault is not None]
            if faults or self._now_ns > end_ns or self._bus.fault is not None:
                why = "; ".join(faults) or "the drives are too slow"
                raise OSError(self._bus.fault or f"{self._bus.name}: {why}")
        self._remarks += self._lacking()

    def _lacking(self) -> list[str]:
        """What drives lack, each with those that do."""
        found: dict[str, list[str]] = {}
        for drive in self._drives:
            for told in drive.lacking:
                found.setdefault(told, []).append(drive.name)
        return [f"{', '.join(names)}: {told}" for told, names in found.items()]

    def _start(self, now_ns: int) -> None:
        self._starting_ns = self._rolled_ns = now_ns
        for drive in self._drives:
            drive.start(now_ns)

    def _stand(self) -> bool:
        """True if all wheels that still report stand."""
        least = 0.01 * self._wheels.scale
        return all(
            abs(drive.velocity) < least or not drive.alive(self._now_ns) for drive in self._drives
        )

    # --- odometry and faults

    def _reckon(self) -> None:
        """Update odometry, once all drives that still report have answered the last SYNC."""
        telling = [drive for drive in self._drives if drive.tells(self._now_ns)]
        if not telling or not all(drive.fresh for drive in telling):
            return
        rates = filled(
            [
                self._wheels.rate(n, drive.velocity) if drive.fresh else None
                for n, drive in enumerate(self._drives)
            ]
        )
        for drive in telling:
            drive.fresh = False
        if rates is None:
            return
        span_ns, self._moved_ns = self._sync_ns - self._moved_ns, self._sync_ns
        span = 1e-9 * span_ns if span_ns <= VELOCITY_NS else 0.0  # after a silence: start over
        self.odometry = (self._sync_ns, self._reckoning.move(rates, span))
        free = all(drive.enabled for drive in self._drives)
        if not free or abs(self._mecanum.slip(rates)) <= SLIPPING:
            self._rolled_ns = self._sync_ns

    def _judge(self) -> None:
        """Stop on any fault; clear an acknowledged fault once the drives are enabled."""
        found = next(self._wrong(), None)
        if found is not None:
            if self.fault is None or self._starting_ns is not None:
                self.fault = found
            self.stop()
        elif self._starting_ns is not None and self._ready():
            self._starting_ns, self.fault = None, None

    def _ready(self) -> bool:
        bumper = self._bumper
        return all(drive.enabled for drive in self._drives) and (not bumper or not bumper.fault)

    def _wrong(self) -> Iterator[str]:
        if self._bus.fault is not None:
            yield self._bus.fault
        if self._is_strange():
            yield f"{self._bus.name}: another master drives there"
        yield from (drive.fault for drive in self._drives if drive.fault is not None)
        bumper = self._bumper
        if bumper is not None and bumper.fault is not None and not bumper.forgetting:
            yield bumper.fault
        if self._sync_ns - self._rolled_ns > SLIPPING_NS:
            yield "the wheels disagree: one slips, is blocked, or is measured wrongly"
        if self._starting_ns is not None and self._now_ns - self._starting_ns > ENABLING_NS:
            late = [drive.name for drive in self._drives if not drive.enabled]
            yield f"{', '.join(late) or 'bumper'}: not ready in {1e-9 * ENABLING_NS:g} s"
