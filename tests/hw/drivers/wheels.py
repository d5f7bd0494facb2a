"""Wheels for tests of the chain: they brake by themselves, and fail on demand by datagram."""

from __future__ import annotations

import math

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.ipc.datagrams import Door, Intake, Outlet
from hw.samples import BumperHit, Odometry

SECRET = b"of the orders to the wheels"
READY_AFTER = 5
"""Drives that were stopped are ready again so many polls after an acknowledgement."""


class Wheels:
    """As `hw.drivers.hardware.Hardware`; it does in each cycle what it is told.

    It tells `tells`, doors, what happens in each cycle, as `cycle`: its number, the velocity it
    was told, that which it has, and whether it was stopped. With `hears` it takes datagrams there:
    `fault` (text or None), `hit` (bearing), `remarked` (texts); `mute`, `runs_on`, `held` and
    `raises` (bool).
    """

    def __init__(self, model, tells=(), hears=None, refuse=""):
        if refuse:
            raise RuntimeError(refuse)
        self.odometry = None
        self.fault = None
        self.cause = None
        self.stopped = False
        self.mute = self.runs_on = self.held = self.raises = False
        self.told = STILL
        self.closed = False
        self.cycles = 0
        self._brakes = model.brake_deceleration
        self._pose, self._twist, self._now = Pose2(0.0, 0.0), STILL, None
        self._hits, self.remarked, self._left = [], [], 0
        self._outlet = Outlet(Door(*door) for door in tells) if tells else None
        self._intake = Intake(("test",), *hears, SECRET) if hears else None

    @property
    def ready(self):
        return not self.stopped and self.fault is None

    def poll(self, now_ns):
        self.cycles += 1
        for told in self._intake.poll() if self._intake else ():
            self.order(told.name, told.value)
        if self.cause is not None:
            self.fault = self.cause
        elif self._left:
            self._left -= 1
            if not self._left:
                self.fault, self.stopped = None, False
        self._move(now_ns)

    def order(self, name, value):
        if name == "fault":
            self.cause = value
        elif name == "hit":
            self._hits.append(BumperHit(value))
        else:
            setattr(self, name, value)

    def hits(self):
        hits, self._hits = self._hits, []
        return hits

    def remarks(self):
        remarks, self.remarked = self.remarked, []
        return remarks

    def drive(self, velocity, now_ns):
        if self.raises:
            raise OSError("bus off")
        self.told = velocity
        if not self.stopped and not self.runs_on:
            self._twist = velocity
        if self._outlet is not None:
            self._outlet.send("cycle", now_ns, (self.cycles, velocity, self._twist, self.stopped))

    def stop(self):
        self.stopped, self._left = True, 0

    def acknowledge(self):
        if self.held or self.cause is not None:
            return False
        self._left = READY_AFTER
        return True

    def close(self):
        self.closed = True
        if self._outlet is not None:
            self._outlet.send("closed", 0, self._twist)
            self._outlet.close()
        if self._intake is not None:
            self._intake.close()

    def _move(self, now_ns):
        span = 0.0 if self._now is None else (now_ns - self._now) * 1e-9
        self._now = now_ns
        if self.stopped and not self.runs_on:
            self._twist = _braked(self._twist, self._brakes * span)
        way = self._twist.rotated(0.5 * self._twist.wz * span)
        turned = wrap(self._twist.wz * span)
        self._pose = self._pose @ Pose2(way.vx * span, way.vy * span, turned)
        if not self.mute:
            self.odometry = now_ns, Odometry(self._pose, self._twist)


def _braked(twist, by):
    speed = math.hypot(twist.vx, twist.vy, twist.wz)
    share = max(0.0, speed - by) / speed if speed else 0.0
    return Twist2(share * twist.vx, share * twist.vy, share * twist.wz)
