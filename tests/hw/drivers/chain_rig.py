"""A chain in a process of its own with the test as its engine, arm, VR side and observer."""

from __future__ import annotations

import select
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from hw.connection.connection import RunInfo
from hw.drivers.chain.chain_client import ChainBase, ChainBumper, ChainLink, ChainStopLine
from hw.drivers.observer import ObserverLink
from hw.geometry import Pose2, Twist2
from hw.ipc.datagrams import Intake, Outlet
from hw.model.robot import MotionLimits, load_robot
from hw.model.tracking import Tracking
from hw.safety.guarded import GuardedBase
from hw.safety.limits import SafetyLimits
from hw.samples import PoseSigma, UserPose
from tests.hw.drivers.rigs import OBSERVER_KEY, key_file, own_address
from tests.hw.drivers.wheels import SECRET

MS = 1_000_000
PATIENCE_S = 20.0
ROBOT = load_robot("rbkairos_ur10")
MOTION = MotionLimits(1.0, 2.0, base_speed=2.5, base_yaw_rate=1.5)
LIMITS = SafetyLimits.of(ROBOT, MOTION)
TRACKING = Tracking.of(ROBOT.sensing)
AHEAD = Twist2(0.3, 0.0, 0.0)
EVERY_MS = {"engine": 33, "arm": 20, "observer": 100, "vr": 100, "user": 11}
ARM_SILENT = "the link to the arm is silent"
HARDWARE = "tests.hw.drivers.wheels:Wheels"


def opening(now, watched=True, tell=lambda _: None):
    safety = replace(LIMITS, watched=watched)
    return RunInfo(now, ROBOT, MOTION, safety, TRACKING, tell=tell)


class Rig:
    """Speaks for everybody whose name is in `speaks`; `go` waits for what the wheels tell."""

    def __init__(self, host=None, port=7400, arm=False, observer=True, also=(), **hardware):
        self.begin, self.remarks = time.monotonic_ns(), []
        self.reports, orders = Intake(("wheels",)), Intake(("test",), secret=SECRET)
        orders.close()  # the wheels bind it
        self.host = host or own_address()
        self.chain = ChainLink(
            port,
            {
                "driver": HARDWARE,
                "tells": [self.reports.door("wheels"), *also],
                "hears": orders.address,
                **hardware,
            },
            self.run_time,
            opening(self.run_time, tell=self.remarks.append),
            host=self.host,
            arm=arm,
            observer={"timeout": 0.5, "key": key_file()} if observer else None,
        )
        self.outlets = {source: Outlet([self.chain.door(source)]) for source in ("arm", "vr")}
        self.observer = ObserverLink((self.host, port + 1), OBSERVER_KEY)
        self.faults = Outlet([orders.door("test")])
        self.speaks = set(EVERY_MS)
        self.command: Twist2 | None = AHEAD
        self.user = Pose2(40.0, 0.0)
        self.pulled: list[tuple[int, str]] = []
        self.cycles: list[tuple[int, int, Twist2, Twist2, bool]] = []
        self.closed = False
        self._due = dict.fromkeys(EVERY_MS, 0)
        self.last = dict(self._due)

    def run_time(self):
        return time.monotonic_ns() - self.begin

    def start(self):
        self.chain.wait()
        self.base = GuardedBase(ChainBase(self.chain, self.run_time), LIMITS, None, self._pulled)
        self.bumper = ChainBumper(self.chain)
        self.line = ChainStopLine(self.chain)
        return self

    def _pulled(self, reason):
        """As the stop line of a connection does."""
        self.pulled.append((time.monotonic_ns(), reason))
        self.base.chain.pull(reason)

    def speak(self):
        """Say what is due."""
        for who, every in EVERY_MS.items():
            now = time.monotonic_ns()
            if who in self.speaks and now >= self._due[who]:
                self._due[who], self.last[who] = now + every * MS, now
                getattr(self, f"_{who}")(now)

    def _engine(self, now):
        stamp = self.run_time()
        for sample in self.base.samples(stamp):
            if sample.name == "base.odometry":
                self.base.chain.locate(sample.stamp_ns, sample.value.pose, PoseSigma(0.01, 0.01))
        if self.command is not None:
            self.base.drive(self.command)
        else:
            self.base.stop()
        self.base.tick(stamp)

    def _arm(self, now):
        self.outlets["arm"].send("arm.link", now, None)

    def _observer(self, now):
        self.observer.here()

    def _vr(self, now):
        self.outlets["vr"].send("vr.link", now, "up")
        self.outlets["vr"].send("vr.haptic_request", now, None)

    def _user(self, now):
        self.outlets["vr"].send("user.pose", now, UserPose(self.user, 0.0))

    def meanwhile(self, call):
        """Go on while something takes its time; what it returns, or raises."""
        with ThreadPoolExecutor(1) as pool:
            asked = pool.submit(call)
            self.until(asked.done)
            return asked.result()

    def order(self, name, value):
        """Break the wheels; the time it was said."""
        now = time.monotonic_ns()
        self.faults.send(name, now, value)
        return now

    def until(self, reached):
        """Speak and listen until it is so."""
        end = time.monotonic() + PATIENCE_S
        while not reached():
            assert time.monotonic() < end, (self.chain.stopped, self.chain.remote.status)
            self.speak()
            select.select([self.reports, self.observer], [], [], 0.003)
            if "observer" in self.speaks:
                self.observer.receive()
            self.take()
        return self

    def take(self):
        for told in self.reports.poll():
            if told.name == "cycle":
                self.cycles.append((told.stamp_ns, *told.value))
            else:
                self.closed = True

    def driving(self):
        """Until it drives as told; on a busy machine this arm may have been silent, too."""

        def drives():
            if self.chain.stopped == ARM_SILENT:
                self.meanwhile(self.chain.reset)
            return (
                self.cycles and self.cycles[-1][2] == self.command and self.cycles[-1][4] is False
            )

        return self.until(drives)

    def standing(self):
        """Until the wheels stand."""
        return self.until(lambda: self.cycles and self.cycles[-1][3].speed == 0.0)

    def go(self, cycles):
        """So many cycles."""
        count = self.cycles[-1][1] + cycles
        return self.until(lambda: self.cycles[-1][1] >= count)

    def stopped_in(self, since_ns):
        """Which cycle after an instant was the first in which the wheels were stopped: 1, 2, …"""
        after = [cycle for cycle in self.cycles if cycle[0] > since_ns]
        return next(n for n, cycle in enumerate(after, 1) if cycle[4])

    def close(self):
        self.chain.close()
        for outlet in (*self.outlets.values(), self.observer, self.faults, self.reports):
            outlet.close()
