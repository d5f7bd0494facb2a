"""CAN wheels and their fake nodes in one process, in a time that the test lets pass.

Nothing runs by itself but the nodes while the driver opens and closes, which it does in real time.
"""

import contextlib
import itertools
import threading
import time

from hw.drivers.can.can_base import CanBase
from hw.fakes.can.can_wire import open_wire
from hw.fakes.can.nodes import Nodes
from hw.geometry import STILL
from hw.model.robot import load_robot

CYCLE_NS = 10_000_000
STEPS = 5
WHEELS = {"nodes": [1, 2, 3, 4], "signs": [1, -1, 1, -1], "gear": 12.52, "increments": 4096}
MODEL = load_robot("rbkairos_ur10").base
_numbers = itertools.count()


class Wheels(CanBase):
    """Opens quickly."""

    listens_ns = 10_000_000


class Rig:
    """`cycle` is one of the chain's; between two of them the nodes take five steps."""

    def __init__(
        self,
        bumper=True,
        by_hand_ns=None,
        prepare=lambda nodes: None,
        wheels=WHEELS,
        traits=None,
    ):
        self.bus = {"interface": "virtual", "channel": f"rig {next(_numbers)}"}
        self.wire = open_wire(self.bus)
        self.nodes = Nodes(self.wire, by_hand_ns=by_hand_ns, traits=traits)
        prepare(self.nodes)
        self._ahead_ns = 0
        try:
            with self._alive():
                self.base = Wheels(MODEL, self.bus, wheels, bumper, self._clock)
        except OSError:
            self.wire.close()
            raise
        self.now_ns = self._clock()

    def cycle(self, velocity=STILL, count=1):
        for _ in range(count):
            self.base.poll(self.now_ns)
            self.base.drive(velocity, self.now_ns)
            self.pass_time(CYCLE_NS)

    def pass_time(self, span_ns):
        """The nodes live on, and nobody drives them."""
        for _ in range(round(span_ns * STEPS / CYCLE_NS)):
            self.nodes.on_frames(self.wire.poll(), self.now_ns)
            self.now_ns += CYCLE_NS // STEPS
            self.nodes.step(self.now_ns)

    def cycles_until(self, wanted, velocity=STILL, most=300):
        """How many cycles it takes."""
        for count in range(1, most + 1):
            self.cycle(velocity)
            if wanted():
                return count
        raise AssertionError(f"not within {most} cycles; fault: {self.base.fault}")

    def ready(self):
        """Enabled, and the board has shown to be well."""
        self.cycles_until(lambda: self.enabled() and self.base.fault is None)
        self.cycle(count=10)
        return self

    def enabled(self):
        return self.states() == {"enabled"}

    def states(self):
        return {drive.state for drive in self.nodes.drives.values()}

    def stands(self):
        return all(velocity == 0.0 for velocity in self.nodes.velocities())

    def acknowledge(self):
        """Again and again, as an operator does; True once it is done."""
        for _ in range(30):
            if self.base.acknowledge():
                self.cycles_until(lambda: self.base.fault is None)
                return True
            self.cycle(count=10)
        return False

    def close(self):
        self._ahead_ns = self.now_ns - time.monotonic_ns()
        with self._alive():
            self.base.close()
        self.wire.close()

    def _clock(self):
        return time.monotonic_ns() + self._ahead_ns

    @contextlib.contextmanager
    def _alive(self):
        over = threading.Event()

        def live():
            while not over.wait(0.0005):
                now = self._clock()
                self.nodes.on_frames(self.wire.poll(), now)
                self.nodes.step(now)

        living = threading.Thread(target=live)
        living.start()
        try:
            yield
        finally:
            over.set()
            living.join()


@contextlib.contextmanager
def rig(**settings):
    made = Rig(**settings)
    try:
        yield made
    finally:
        made.close()
