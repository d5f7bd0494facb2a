"""Every port of the safety chain's process against every message that could be sent to it.

What stands goes on standing, nothing ends, and the session goes on.
"""

import json
import random
import select
import socket
import threading
import time

import pytest

from hw.drivers.chain.chain_settings import SOURCES
from hw.drivers.feed import DatagramFeed
from hw.geometry import Pose2, Pose3, Twist2
from hw.ipc.datagrams import Door, Intake, Outlet, Seal, coded, key_of
from hw.ipc.plain import text
from hw.samples import PoseSigma, TrackerPose, UserPose
from tests.hw.drivers.chain.test_chain import stays_stopped
from tests.hw.drivers.chain_rig import AHEAD, Rig
from tests.hw.drivers.rigs import OBSERVER_KEY, PATIENCE_S

TAKEN = {
    "engine": {"command", "mode", "grant", "estimate"},
    "arm": {"arm.link"},
    "vr": {"vr.link", "vr.haptic_request", "user.pose", "rover.tracker"},
    "observer": {"observer.here", "pull"},
}
"""What the process takes, by source; the rest of each one's words is nobody's business."""
NAMES = sorted({"reset", "arm.joints", "chain.status", ""}.union(*TAKEN.values()))
VALUES = [
    0, 1, True, None, "", "up", "omni", (), (1, 2), 1e308, float("nan"), AHEAD,
    Twist2(float("nan"), 0.0, 0.0), Pose2(0.0, 0.0), Pose2(float("inf"), 0.0), Pose3(1.0, 0.0, 1.0),
    (Pose2(0.0, 0.0), PoseSigma(0.0, 0.0)), UserPose(Pose2(9.0, 9.0), 0.0),
    TrackerPose("base_front", Pose3(0.0, 0.0, 0.0)),
]  # fmt: skip
MALFORMED = [
    {"UserPose": [1, 2, 3, 4, 5]}, {"Pose2": []}, {"Pose2": ["x", "y", "z"]}, {"Scan": [[[]]]},
    {"Twist2": {"vx": 1}}, {"UserPose": [{"Pose2": [1, 2, None]}, 0.0, None, None, None]},
    [[[[{}]]]], {"Truth": list(range(14))}, {"no such": [1]},
]  # fmt: skip
RANDOM = 1_000


def forged():
    """Datagrams of who has no key: as they once were, and under keys that anybody can make."""
    for source in TAKEN:
        for name in NAMES:
            for value in (0, True, "up", json.loads(text(AHEAD)), MALFORMED[0]):
                told = [source, 1, name, time.monotonic_ns(), value]
                yield json.dumps(told).encode()
    for name in NAMES:
        for key in (b"", bytes(16), key_of(b"", "engine"), key_of(OBSERVER_KEY, "engine")):
            yield coded(Seal().body(name, time.monotonic_ns(), 0), key)


def noise(count, seed):
    chance = random.Random(seed)
    for _ in range(count):
        size = chance.choice((0, 1, 16, 31, 32, 48, 200, 2_000))
        yield chance.randbytes(chance.randrange(size + 1))
    yield from (bytes(65_000), b"[" * 65_000, coded(b"[" * 50_000, b""))


class Throwing:
    """A stranger who knows both ports, and in the end the keys, too."""

    def __init__(self, rig):
        self.rig = rig
        self.ports = [(rig.host, 7400), (rig.host, 7401)]
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def throw(self, datas):
        """Everything to both, while the others go on speaking."""
        for number, data in enumerate(datas):
            for port in self.ports:
                self._socket.sendto(data, port)
            if number % 10 == 0:
                self.rig.speak()
                self.rig.observer.receive()
                self.rig.take()
        self.rig.go(30)

    def close(self):
        self._socket.close()


@pytest.fixture(scope="module")
def rig():
    """One session for all: it goes on after each of them."""
    made = Rig().start()
    yield made
    made.close()


@pytest.fixture
def stranger(rig):
    made = Throwing(rig)
    yield made
    made.close()


def driving(rig):
    """It drives, reset if nobody has spoken since the test before."""
    rig.until(lambda: rig.chain.stopped is None or rig.meanwhile(rig.chain.reset))
    rig.driving()


def stopped_by_the_observer(rig):
    driving(rig)
    rig.observer.pull("the observer")
    rig.until(lambda: rig.chain.stopped == "the observer")
    rig.standing()


def goes_on(rig):
    """The operator resets it, and it drives."""
    assert rig.chain.stopped == "the observer"
    rig.until(lambda: not rig.observer.stopping and rig.meanwhile(rig.chain.reset))
    rig.driving()


@pytest.mark.requirement(48, 55, 149)
def test_what_the_observer_has_stopped_no_datagram_of_a_stranger_sets_in_motion(rig, stranger):
    stopped_by_the_observer(rig)
    stranger.throw([b'["engine",1,"reset",0,0]'] * 20)
    stays_stopped(rig)
    stranger.throw([*forged(), *noise(RANDOM, 1)])
    stays_stopped(rig)
    goes_on(rig)


@pytest.mark.slow
@pytest.mark.requirement(55, 149)
def test_nobody_else_is_the_observer(rig, stranger):
    driving(rig)
    rig.speaks.remove("observer")
    here = [*forged(), *(json.dumps(["observer", n, "observer.here", 0, True]).encode()
                         for n in range(200))]  # fmt: skip
    end = time.monotonic() + 0.7
    while time.monotonic() < end:
        stranger.throw(here[:50])
    rig.until(lambda: rig.chain.stopped == "the observer is silent")
    stranger.throw(here)
    assert not rig.meanwhile(rig.chain.reset)
    assert rig.chain.why == "the observer is silent"
    stays_stopped(rig)
    rig.speaks.add("observer")


@pytest.mark.slow
@pytest.mark.requirement(48, 149)
def test_what_has_been_recorded_moves_nothing():
    """A second chain at the same port is sent all that was sent to the first."""
    rig = Rig().start()
    stranger = Throwing(rig)
    recorder = Recorder(rig)
    stopped_by_the_observer(rig)
    stranger.throw(2 * recorder.datas())
    stays_stopped(rig)
    recorded = recorder.datas()
    recorder.close()
    rig.close()
    again = Rig(host=rig.host).start()
    stranger.rig = again
    try:
        again.speaks.remove("observer")
        again.until(lambda: again.cycles)
        stranger.throw(recorded)
        waits = ("the observer has not been heard",)
        again.until(lambda: again.chain.remote.status.refused == waits)
        assert all(cycle[3].speed == 0.0 for cycle in again.cycles)
    finally:
        again.close()
        stranger.close()


class Recorder:
    """Records what goes to a chain: all its senders send it here, too."""

    def __init__(self, rig):
        self._intake = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._intake.bind(("127.0.0.1", 0))
        self._intake.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self._intake.setblocking(False)
        here, self._kept = self._intake.getsockname(), []
        for outlet in (*rig.outlets.values(), rig.chain._outlet):
            outlet.doors = [Door(*here, outlet.doors[0].key), *outlet.doors]

    def datas(self):
        while select.select([self._intake], [], [], 0.0)[0]:
            self._kept.append(self._intake.recv(1 << 16))
        assert len(self._kept) > 100
        return list(self._kept)

    def close(self):
        self._intake.close()


@pytest.mark.requirement(48, 149)
def test_not_even_who_has_a_key_says_more_than_is_theirs(rig, stranger):
    """Each source with every name, and with values of every wrong type and size."""
    stopped_by_the_observer(rig)
    outlets = {name: Outlet([rig.chain.door(name)]) for name in SOURCES}
    keys = {name: bytes.fromhex(rig.chain.door(name).key) for name in SOURCES}
    for source, outlet in outlets.items():
        for name in NAMES:
            for value in VALUES:
                if name in TAKEN[source] and isinstance(value, str | UserPose | Twist2):
                    continue  # that may be meant so: it would only be another command
                outlet.send(name, time.monotonic_ns(), value)
            for content in MALFORMED:
                head = Seal().body("", 0)[:16]
                body = head + json.dumps([name, time.monotonic_ns(), content]).encode()
                stranger._socket.sendto(coded(body, keys[source]), (rig.host, 7400))
        rig.go(2)
    for outlet in outlets.values():
        outlet.close()
    rig.observer._send_sealed("reset", 1)
    rig.observer._send_sealed("command", True)
    stays_stopped(rig)
    goes_on(rig)


@pytest.mark.slow
@pytest.mark.requirement(48, 149)
def test_a_hundred_thousand_datagrams_of_chance_do_nothing(rig, stranger):
    driving(rig)
    for seed in range(20):
        stranger.throw(noise(5_000, seed))
        rig.driving()
    stopped_by_the_observer(rig)
    goes_on(rig)


def test_a_mistake_in_the_thread_of_a_feed_is_printed_and_the_next_datagram_is_taken(monkeypatch):
    taken, printed, done = [], [], threading.Event()
    monkeypatch.setattr(threading, "excepthook", lambda told: printed.append(told.exc_value))

    def take(datagram, _):
        taken.append(datagram.name)
        if datagram.name == "last":
            done.set()
        raise AttributeError(datagram.name)

    feed = DatagramFeed("vr", time.monotonic_ns, take)
    outlet = Outlet([feed.door])
    feed.start()
    for name in ("first", "last"):
        outlet.send(name, 0)
    assert done.wait(PATIENCE_S)
    feed.close()
    outlet.close()
    assert taken == ["first", "last"]
    assert list(map(str, printed)) == taken


def test_no_intake_is_reached_by_other_machines():
    for host in ("0.0.0.0", "", "192.168.0.10"):
        with pytest.raises(ValueError, match="other machines reach it"):
            Intake(("engine",), host)
