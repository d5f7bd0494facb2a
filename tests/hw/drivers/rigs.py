"""What tests of drivers share: an address of their own, an opening, and waiting for what comes."""

import random
import select
import threading
import time
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from hw.connection.connection import RunInfo
from hw.ipc.datagrams import Intake
from hw.model.robot import MotionLimits, load_robot
from hw.model.tracking import Tracking
from hw.safety.limits import SafetyLimits, Stopping

PATIENCE_S = 20.0
OBSERVER_KEY = bytes(range(32))


@cache
def key_file():
    """The file with the `OBSERVER_KEY`; it goes with the process."""
    file = Path(_FOLDER.name, "observer.key")
    file.touch(0o600)
    file.write_text(OBSERVER_KEY.hex())
    return str(file)


_FOLDER = TemporaryDirectory()


def own_address():
    """An address of this machine that no other test takes."""
    chance = random.SystemRandom()
    return f"127.{chance.randrange(1, 64)}.{chance.randrange(256)}.{chance.randrange(1, 255)}"


def opening(body=None, now=time.monotonic_ns):
    body = body or load_robot("rbkairos_ur10")
    base = body.base
    stopping = Stopping(base.brake_deceleration, base.reaction_time, 0.35)
    safety = SafetyLimits(body.footprint, stopping, base.max_speed, base.max_yaw_rate)
    return RunInfo(now, body, MotionLimits(), safety, Tracking.of(body.sensing))


class Chain:
    """Where the safety chain listens: all that it is `told`."""

    def __init__(self):
        self.intake = Intake(("arm", "vr"))
        self.door = self.intake.door
        self.told = []

    def until(self, reached):
        """All that was told, once that is `reached`."""
        limit = time.monotonic() + PATIENCE_S
        while not reached(self.told):
            assert time.monotonic() < limit, self.told
            select.select([self.intake], [], [], 0.1)
            self.told += self.intake.poll()
        return self.told

    def close(self):
        self.intake.close()


class Listener:
    """Collects the samples of a part, which wakes it."""

    def __init__(self, part):
        self.part, self.got = part, []
        self._woken = threading.Event()
        part.wake = self._woken.set

    def until(self, wanted, nudge=lambda: None):
        """Collect until `wanted()`; `nudge` is called again and again in between."""
        limit = time.monotonic() + PATIENCE_S
        while True:
            self.got += self.part.samples(time.monotonic_ns())
            if wanted():
                return
            assert time.monotonic() < limit, f"it did not come within {PATIENCE_S} s"
            nudge()
            self._woken.wait(0.05)
            self._woken.clear()
