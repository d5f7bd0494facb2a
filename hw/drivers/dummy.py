"""A dummy: a person replayed from a record to engine and safety chain (R56).

links:
  chain: {…}
  dummy: {driver: Dummy, person: PERSON, tells: chain}
parts:
  trackers: {driver: DummyTrackers, link: dummy}
  vr: {driver: DummyVr, link: dummy}

This is not written by hand: `run --user RECORD.mcap` puts it in place of the VR link's person. The
VR link's messages to the chain then pass through the dummy, which drops those that concern a
person.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from hw.geometry import Pose2
from hw.ipc import Door, Hearer, Intake, Outlet
from hw.people.walking import Person
from hw.samples import Sample
from hw.sim.sensors import SimVr

Now = Callable[[], int]
SOURCE = "vr"
"""The source under which engine and chain know the VR link."""
OF_PERSON = frozenset(
    ("user.pose", "vr.haptic_request", "vr.release", "vr.restart", "vr.link", "vr.show")
)
"""Messages that come from the dummy alone."""
STEP_S = 0.01
"""Period of the person's steps, s."""
LEVEL_NS = 100_000_000
"""Period at which levels are repeated, ns: the request, and that the link is up."""
KEPT = 4096
"""Longest queue of samples for the engine."""
FAR = Pose2(1e3, 1e3)
"""The pose of the robot as given to the person: a replayed person ignores the robot."""


class Dummy:
    """Steps a person in real time, in a thread of its own; the parts below take its samples.

    Before the run begins the person stands at their start. `tells` is the safety chain,
    if there is one.
    """

    def __init__(self, person: Person, now: Now, tells: Hearer | None = None) -> None:
        self.person, self.vr = person, SimVr(person)
        self.finished = False
        self._now = now
        self._outlet = Outlet(() if tells is None else (tells.door(SOURCE),))
        self._intake = Intake((SOURCE,))
        self._queues: dict[str, deque[Sample]] = {}
        self._wakes: dict[str, Callable[[], None]] = {}
        self._seen: Sample | None = None
        self._told_ns = -LEVEL_NS
        self._over = threading.Event()
        self._mutex = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="dummy", daemon=True)

    def door(self, source: str) -> Door:
        """Where a VR link sends its messages for the chain; see `Hearer`."""
        return self._intake.door(source)

    def wait(self) -> None:
        """Start the thread."""
        self._thread.start()

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        """Show the robot to the person, with or without the stop sign, or hide it."""
        with self._mutex:
            self.vr.inform(show, sign, least)

    def queue(self, name: str, wake: Callable[[], None]) -> deque[Sample]:
        """The samples of a name from now on; `wake` is called when one has come."""
        self._wakes[name] = wake
        return self._queues.setdefault(name, deque(maxlen=KEPT))

    def close(self) -> None:
        """End the thread."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join()
        self._intake.close()
        self._outlet.close()

    def step(self, now_ns: int) -> None:
        """Advance to an instant of the run, and send what is new."""
        with self._mutex:
            self.person.step(now_ns, FAR, self.vr.shown)
            self.vr.step(now_ns)
            told = list(self.vr.samples(now_ns))
        seen = self.person.measured
        if seen is not None:
            self._seen = seen
            told.append(seen)
        elif now_ns <= 0 and self._seen is not None:  # before the run they stand, tracked
            told.append(self._seen)
        lag = time.monotonic_ns() - now_ns
        for name, stamp, value in told:
            self._outlet.send(name, lag + stamp, value)
        self._tell_levels(lag + now_ns)
        for sample in told:
            self._hand_on(sample)
        self.finished = self.person.finished

    def _tell_levels(self, at_ns: int) -> None:
        if at_ns - self._told_ns < LEVEL_NS:
            return
        self._told_ns = at_ns
        self._outlet.send("vr.link", at_ns, "up")
        self._outlet.send("vr.haptic_request", at_ns, self.person.request)

    def _hand_on(self, sample: Sample) -> None:
        queue = self._queues.get(sample.name)
        if queue is not None and (not queue or sample != queue[-1]):
            queue.append(sample)
            self._wakes[sample.name]()

    def _pass_on(self) -> None:
        """Pass on messages of a VR link that concern no person, such as trackers on the robot."""
        for told in self._intake.poll():
            if told.name not in OF_PERSON:
                self._outlet.send(told.name, told.stamp_ns, told.value)

    def _run(self) -> None:
        while not self._over.wait(STEP_S):
            self.step(self._now())
            self._pass_on()


class _Part:
    """Gives some of a dummy's samples."""

    signals: tuple[str, ...] = ()

    def __init__(self, link: Dummy) -> None:
        self.wake: Callable[[], None] = _nobody
        self._link = link
        self._queues = [link.queue(name, lambda: self.wake()) for name in self.signals]

    def samples(self, now_ns: int) -> list[Sample]:  # noqa: ARG002
        """Samples since the last call, by stamp."""
        found = [queue.popleft() for queue in self._queues for _ in range(len(queue))]
        return sorted(found, key=lambda sample: sample.stamp_ns)


class DummyTrackers(_Part):
    """Tracking of the dummy; see `Trackers`."""

    signals = ("user.pose",)


class DummyVr(_Part):
    """The virtual world of the dummy; see `Vr`."""

    signals = ("vr.haptic_request", "vr.release", "vr.restart")

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        """Let the person stop, or go on; see `Vr`."""
        self._link.inform(show, sign, least)


def _nobody() -> None:
    """No loop was started yet."""
