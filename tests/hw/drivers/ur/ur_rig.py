"""A UR arm behind its driver, on a fake controller: what tests of drivers and of runs share."""

import select
import threading
import time

from hw.drivers.ur.ur_arm import UrArm
from hw.fakes.peers import Cb3
from hw.ipc.datagrams import Intake
from hw.model.robot import load_robot
from hw.safety.stop_line import StopLatch
from tests.hw.drivers.rigs import PATIENCE_S, opening, own_address

ROBOT = load_robot("rbkairos_ur10")
PARKED = ROBOT.parked
OUT = tuple(angle + 0.5 for angle in PARKED[:2]) + PARKED[2:]
CYCLE_S = 0.008


def course(start, goal, seconds=0.3):
    """Points to a goal at even speed, one for each cycle of the controller."""
    count = round(seconds / CYCLE_S)
    shares = [k / count for k in range(count + 1)]
    return [
        (s * seconds, tuple(a + s * (b - a) for a, b in zip(start, goal, strict=True)))
        for s in shares
    ]


class Line(StopLatch):
    """A stop line that notes when it was pulled, ns of the monotonic clock."""

    pulled_ns = 0

    def pull(self, reason):
        if self.reason is None:
            self.pulled_ns = time.monotonic_ns()
        super().pull(reason)


class UrRig:
    """A fake controller, the arm on it, and a chain that hears both. `stack` closes all of it.

    `parts` are as a connection opens them. A fault pulls `line`, a latch.
    """

    def __init__(self, stack, unlock=0.0):
        self.host = own_address()
        self.truth, self.chain = Intake(("cb3",), self.host), Intake(("arm",), self.host)
        stack.callback(self.truth.close)
        stack.callback(self.chain.close)
        self.fake = Cb3(self.host, tells=self.truth, joints=PARKED, unlock=unlock)
        stack.callback(self.fake.close)
        self.fake.wait()
        self.arm = UrArm(self.host, opening(ROBOT), time.monotonic_ns, tells=self.chain)
        stack.callback(self.arm.close)
        self.arm.wait()
        self.parts = {"arm": self.arm}
        self.line = self.arm.line = Line(lambda: True)
        self.got = []
        self._woken = threading.Event()
        self.arm.wake = self._woken.set
        self.until(lambda: bool(self.got))

    @property
    def state(self):
        """The newest that the arm has said."""
        return self.got[-1].value

    def turn(self):
        """What the loop of a run does in each tick."""
        self.got += self.arm.samples(time.monotonic_ns())

    def until(self, wanted):
        """Turn until something is so."""
        limit = time.monotonic() + PATIENCE_S
        while not wanted():
            assert time.monotonic() < limit, (self.state, self.arm.fault, self.line.reason)
            self._woken.wait(0.02)
            self._woken.clear()
            self.turn()

    def cycles(self, count):
        """Where the joints truly are in the next cycles of the controller."""
        self.truth.poll(1_000_000)
        found = []
        while len(found) < count:
            assert select.select([self.truth], [], [], PATIENCE_S)[0]
            found += [told.value for told in self.truth.poll()]
            self.turn()
        return found

    def stands(self, count=20):
        """Does no joint move for some cycles, but for the last of its lag?"""
        way = self.cycles(count)
        return all(max(joint) - min(joint) < 5e-4 for joint in zip(*way, strict=True))

    def follow(self, goal, seconds=0.3):
        """Send the arm on a straight course from where it stands."""
        return self.arm.follow(course(self.state.joints, goal, seconds))

    def moving(self, goal=OUT, seconds=2.0):
        """Send the arm on its way, and wait until it is."""
        number = self.follow(goal, seconds)
        self.until(lambda: self.state.moving and self.state.course == number)
        self.cycles(10)
        return number

    def arrive(self, goal, seconds=0.3):
        """Send the arm somewhere, and wait until it stands there."""
        number = self.follow(goal, seconds)
        self.until(lambda: self.state.course == number and self.state.moving)
        self.until(lambda: not self.state.moving)
        away = max(abs(a - b) for a, b in zip(self.state.joints, goal, strict=True))
        assert (self.state.refused, away < 0.002) == (None, True)

    def faulty(self):
        """Has a fault been told?"""
        return self.line.reason is not None

    def recover(self):
        """What the operator does: acknowledge until the arm is there, then reset the line."""
        self.until(self.arm.acknowledge)
        self.line.reset()
