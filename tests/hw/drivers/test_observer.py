"""The observer's port: who has the key is heard, once, and as old as the chain's own clock says."""

import json
import random
import select
import socket
import time

import pytest

from hw.drivers.chain.chain_settings import OBSERVER_S
from hw.drivers.chain.watchdogs import Heartbeat
from hw.drivers.gates import OBSERVER_STOPS_NS
from hw.drivers.observer import ObserverLink, ObserverPort
from hw.ipc.datagrams import Seal, coded
from tests.hw.drivers.rigs import OBSERVER_KEY, PATIENCE_S, own_address

MS = 1_000_000
WITHIN_NS = 500 * MS


class Between:
    """A network that all of it can be recorded, held back and said again on."""

    def __init__(self, chain):
        self.chain = chain
        self.front, self.back = self._socket(), self._socket()
        self.address = self.front.getsockname()
        self.up, self.observer = [], None

    @staticmethod
    def _socket():
        found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        found.bind(("127.0.0.1", 0))
        found.settimeout(PATIENCE_S)
        return found

    def to_chain(self, times=1, pass_on=True):
        for _ in range(times):
            data, self.observer = self.front.recvfrom(1 << 16)
            self.up.append(data)
            if pass_on:
                self.say(data)

    def to_observer(self):
        data = self.back.recv(1 << 16)
        self.front.sendto(data, self.observer)
        return data

    def say(self, *datas):
        for data in datas:
            self.back.sendto(data, self.chain)

    def close(self):
        self.front.close()
        self.back.close()


class Scene:
    """The chain's port at an address, observers, and the network between them."""

    def __init__(self):
        self.address = own_address(), 7401
        self.port = ObserverPort(self.address, OBSERVER_KEY)
        self.net = Between(self.address)
        self.observers = [self.observer()]

    def observer(self, key=OBSERVER_KEY):
        return ObserverLink(self.net.address, key)

    def heard(self):
        """What has come to the chain's port."""
        select.select([self.port], [], [], 0.05)
        return self.port.poll()

    def asked(self, observer=None):
        """An observer has asked, and got an answer that they have not read yet."""
        (observer or self.observers[0]).here()
        self.net.to_chain()
        assert self.heard() == []
        return self.net.to_observer()

    def beat(self, observer=None):
        """A whole heartbeat; what the chain has heard."""
        observer = observer or self.observers[0]
        self.asked(observer)
        observer.receive()
        self.net.to_chain()
        return self.heard()

    def restart(self):
        self.port.close()
        self.port = ObserverPort(self.address, OBSERVER_KEY)

    def close(self):
        for one in (self.port, self.net, *self.observers):
            one.close()


@pytest.fixture
def scene():
    made = Scene()
    yield made
    made.close()


def test_a_heartbeat_is_stamped_by_the_chain(scene):
    before = time.monotonic_ns()
    scene.asked()
    answered = time.monotonic_ns()
    scene.observers[0].receive()
    scene.net.to_chain()
    (here,) = scene.heard()
    assert (here.source, here.name, here.value) == ("observer", "observer.here", True)
    assert before <= here.stamp_ns <= answered
    assert scene.observers[0].heard
    (following,) = scene.beat()
    assert following.stamp_ns > here.stamp_ns


def test_answers_may_take_longer_than_a_period(scene):
    (observer,) = scene.observers
    for _ in range(3):
        observer.here()
        scene.net.to_chain()
        assert scene.heard() == []
    stamps = []
    for _ in range(3):
        scene.net.to_observer()
        observer.receive()
        scene.net.to_chain()
        stamps += [told.stamp_ns for told in scene.heard()]
    assert len(set(stamps)) == 3
    assert stamps == sorted(stamps)
    assert observer.heard


def test_a_stop_is_sent_several_times_since_some_may_be_lost(scene):
    scene.beat()
    scene.observers[0].pull("the observer")
    scene.net.to_chain(times=3)
    assert {(told.name, told.value) for told in scene.heard()} == {("pull", "the observer")}


def test_a_stop_that_gets_lost_is_repeated_and_no_heartbeat_hides_it(scene, monkeypatch):
    """A gap in the network swallows all copies: then the stop is heard with the next answer."""
    now = [time.monotonic_ns()]
    monkeypatch.setattr(time, "monotonic_ns", lambda: now[0])
    scene.beat()
    scene.observers[0].pull("the observer")
    scene.net.to_chain(times=3, pass_on=False)
    waits_ns = round(OBSERVER_S * 1e9)
    for _ in range(waits_ns // (50 * MS) + 1):
        assert [(told.name, told.value) for told in scene.beat()] == [("pull", "the observer")]
        now[0] += 50 * MS
    assert scene.observers[0].stopping
    now[0] += OBSERVER_STOPS_NS
    assert [told.name for told in scene.beat()] == ["observer.here"]
    assert waits_ns + 100 * MS < OBSERVER_STOPS_NS


def test_whatever_was_recorded_is_believed_neither_now_nor_after_a_restart(scene):
    for _ in range(3):
        scene.beat()
    scene.observers[0].pull()
    scene.net.to_chain(times=3)
    scene.heard()
    recorded = list(scene.net.up)
    assert len(recorded) == 9
    for _ in range(2):
        scene.net.say(*recorded, *reversed(recorded))
        assert scene.heard() == []
        assert scene.port.strange == 12  # the others ask, and get an answer that is of no use
        scene.restart()


def test_what_is_held_back_is_as_old_as_it_is(scene):
    """Whoever can hold messages back may pass them on after the observer has gone: not for long."""
    beat, now = Heartbeat("the observer", WITHIN_NS), time.monotonic_ns()
    (here,) = scene.beat()
    beat.beat(here.stamp_ns, now)
    held = []
    for _ in range(5):  # the observer sends these, and leaves
        scene.asked()
        scene.observers[0].receive()
        scene.net.to_chain(pass_on=False)
        held.append(scene.net.up[-1])
    scene.net.say(*held)
    late = scene.heard()
    assert len(late) == 5
    asked_ns = late[-1].stamp_ns
    for told in late:
        beat.beat(told.stamp_ns, asked_ns + 2 * WITHIN_NS)
    assert beat.lost(asked_ns + WITHIN_NS) is None
    assert beat.lost(asked_ns + WITHIN_NS + 1) == "the observer is silent"


def test_the_same_answer_twice_is_one_heartbeat(scene):
    scene.net.front.sendto(scene.asked(), scene.net.observer)
    scene.observers[0].receive()
    scene.net.to_chain()
    assert len(scene.heard()) == 1
    assert not select.select([scene.net.front], [], [], 0.02)[0]


def test_an_old_answer_makes_nobody_believe_that_they_are_heard(scene):
    scene.observers[0].here()
    scene.net.to_chain()
    scene.heard()
    old = scene.net.to_observer()
    scene.observers[0].receive()
    scene.net.to_chain()
    newcomer = scene.observer()
    scene.observers.append(newcomer)
    newcomer.here()
    scene.net.to_chain(pass_on=False)
    scene.net.front.sendto(old, scene.net.observer)
    newcomer.receive()
    assert not newcomer.heard


@pytest.mark.parametrize("key", [bytes(32), OBSERVER_KEY[:-1] + b"x"])
def test_who_has_another_key_gets_no_answer(scene, key):
    stranger = scene.observer(key)
    scene.observers.append(stranger)
    stranger.here()
    scene.net.to_chain()
    assert scene.heard() == []
    assert scene.port.strange == 1
    assert not select.select([scene.net.back], [], [], 0.02)[0]


def test_two_observers_are_both_heard_and_both_stop_it(scene):
    scene.observers.append(scene.observer())
    for _ in range(3):
        for observer in scene.observers:
            assert len(scene.beat(observer)) == 1
    for observer in scene.observers:
        observer.pull("the observer")
        scene.net.to_chain(times=3)
        assert len(scene.heard()) == 3


def test_an_observer_that_goes_on_is_heard_by_the_chain_after_its_restart(scene):
    scene.beat()
    scene.restart()
    assert len(scene.beat()) == 1


FORGED = [
    json.dumps(["observer", 1, "observer.here", 0, True]).encode(),
    json.dumps(["engine", 1, "reset", 0, 0]).encode(),
    *(
        coded(Seal().body(name, 0, True), key)
        for name in ("observer.here", "pull", "reset", "command")
        for key in (OBSERVER_KEY, b"", bytes(16), b"guess")
    ),
    *(coded(bytes(size), OBSERVER_KEY[:16]) for size in (0, 16, 24, 40, 600, 60_000)),
    b"",
    bytes(65_000),
]


def test_no_forged_message_is_believed_or_answered(scene):
    chance = random.Random(3)
    for data in (*FORGED, *(chance.randbytes(chance.randrange(80)) for _ in range(100))):
        scene.net.say(data)
        assert scene.port.poll() == []
    assert scene.port.strange == len(FORGED) + 100
    assert not select.select([scene.net.back], [], [], 0.02)[0]
    assert len(scene.beat()) == 1
