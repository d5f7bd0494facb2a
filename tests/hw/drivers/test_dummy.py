"""A person out of a record, played to engine and safety chain as a VR link tells of one (R56)."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from hw.drivers.dummy import OF_PERSON, Dummy, DummyTrackers, DummyVr
from hw.geometry import Pose2, Pose3
from hw.ipc.datagrams import Datagram, Outlet
from hw.people.recorded.from_run_record import Asked, Past, Recalled, SeenPerson, Stood
from hw.people.walking.person import STOPPING_S
from hw.samples import Sample, TrackerPose, UserPose
from hw.scene.room import Room
from tests.hw.drivers.rigs import Chain

ROOM = Room(((0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0)))
PATIENCE_S = 10.0
MS = 1_000_000
DEEP = Pose3.from_yaw(4.0, 4.0, 1.3, 0.0)


def recalled(seconds: float = 2.0) -> Recalled:
    """Somebody who walks along x at 1 m/s, seen each 20 ms, and asks from 0.5 to 1.5 s."""
    ways = [Stood(n * 20 * MS, Pose2(2.0 + 0.02 * n, 4.0), 1.0) for n in range(int(50 * seconds))]
    seen = tuple(SeenPerson(at_ns, UserPose(body, 0.0)) for at_ns, body, _ in ways)
    asked = (Asked(0, None), Asked(500 * MS, DEEP), Asked(1500 * MS, None))
    return Recalled(Past("x.mcap", ways[-1].at_ns, tuple(ways), seen, asked), ROOM)


@pytest.fixture
def chain() -> Iterator[Chain]:
    found = Chain()
    yield found
    found.close()


@pytest.fixture
def dummy(chain: Chain) -> Iterator[Dummy]:
    found = Dummy(recalled(), lambda: 0, tells=chain)
    yield found
    found.close()


def values(told: list[Datagram], name: str) -> list[Any]:
    return [one.value for one in told if one.name == name]


def stepped(dummy: Dummy, seconds: float) -> None:
    for n in range(1, round(100 * seconds) + 1):
        dummy.step(n * 10 * MS)


@pytest.mark.requirement(56)
def test_engine_and_chain_are_told_the_same_with_the_same_stamps(
    dummy: Dummy, chain: Chain, monkeypatch: pytest.MonkeyPatch
) -> None:
    trackers, vr = DummyTrackers(dummy), DummyVr(dummy)
    now, began = [0], 7_000 * MS
    monkeypatch.setattr("hw.drivers.dummy.time.monotonic_ns", lambda: began + now[0])
    for n in range(1, 71):
        now[0] = n * 15 * MS  # they were seen each 20 ms
        dummy.step(now[0])

    seen = trackers.samples(now[0])
    told = chain.until(lambda told: len(values(told, "user.pose")) >= len(seen))
    monkeypatch.undo()

    poses = [one for one in told if one.name == "user.pose"]
    assert len(seen) == 53
    assert [sample.value for sample in seen] == [one.value for one in poses]
    assert [began + sample.stamp_ns for sample in seen] == [one.stamp_ns for one in poses]
    assert {sample.stamp_ns % (20 * MS) for sample in seen} == {0}
    asked = [s for s in vr.samples(now[0]) if s.name == "vr.haptic_request"]
    assert [sample.value for sample in asked] == [None, DEEP]
    assert asked[1].stamp_ns == 510 * MS
    assert {one.source for one in told} == {"vr"}
    numbers = [one.number for one in told]
    assert numbers == sorted(set(numbers))


def test_the_request_and_that_the_link_is_up_are_told_again_as_levels(
    dummy: Dummy, chain: Chain, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0]
    monkeypatch.setattr("hw.drivers.dummy.time.monotonic_ns", lambda: now[0])
    for n in range(1, 101):
        now[0] = n * 10 * MS
        dummy.step(now[0])
    monkeypatch.undo()

    told = chain.until(lambda told: len(values(told, "vr.link")) >= 10)
    assert values(told, "vr.link") == ["up"] * 10
    levels = values(told, "vr.haptic_request")
    assert levels.count(DEEP) >= 5
    assert levels[-1] == DEEP


def test_a_release_is_told_at_the_end_of_a_request(dummy: Dummy, chain: Chain) -> None:
    vr = DummyVr(dummy)
    stepped(dummy, 1.6)

    assert [s.stamp_ns for s in vr.samples(0) if s.name == "vr.release"] == [1500 * MS]
    assert values(chain.until(lambda told: values(told, "vr.release")), "vr.release") == [True]


def test_shown_the_robot_they_stand_still_and_say_so(dummy: Dummy) -> None:
    vr = DummyVr(dummy)
    vr.inform(True)
    stepped(dummy, dummy.person.reaction_s + STOPPING_S + 0.6)

    assert dummy.person.speed == 0.0
    assert "vr.restart" in {sample.name for sample in vr.samples(0)}


def test_before_the_run_begins_they_are_seen_to_stand_where_they_begin(
    dummy: Dummy, chain: Chain
) -> None:
    trackers = DummyTrackers(dummy)
    for _ in range(20):
        dummy.step(0)

    told = chain.until(lambda told: len(values(told, "user.pose")) >= 20)
    stamps = [one.stamp_ns for one in told if one.name == "user.pose"]
    assert stamps == sorted(set(stamps))
    assert set(values(told, "user.pose")) == {UserPose(Pose2(2.0, 4.0), 0.0)}
    assert trackers.samples(0) == [Sample("user.pose", 0, UserPose(Pose2(2.0, 4.0), 0.0))]


def test_of_what_a_vr_link_tells_the_chain_gets_all_but_the_person(
    chain: Chain,
) -> None:
    dummy = Dummy(recalled(), lambda: 0, tells=chain)
    dummy.wait()
    link = Outlet([dummy.door("vr")])
    tracker = TrackerPose("front", Pose3(1.0, 2.0, 0.3, 0.0, 0.0, 0.0, 1.0))
    for name in sorted(OF_PERSON):
        link.send(name, 1)
    link.send("rover.tracker", 4711, tracker)

    told = chain.until(lambda told: values(told, "rover.tracker"))
    dummy.close()
    link.close()

    assert [one.stamp_ns for one in told if one.name == "rover.tracker"] == [4711]
    assert all(one.stamp_ns != 1 for one in told)


def test_in_the_time_of_a_run_they_come_to_their_end_and_wake_who_waits() -> None:
    begin, woken = time.monotonic_ns(), threading.Event()
    dummy = Dummy(recalled(0.3), lambda: time.monotonic_ns() - begin)
    trackers = DummyTrackers(dummy)
    trackers.wake = woken.set
    dummy.wait()

    assert woken.wait(PATIENCE_S)
    end = time.monotonic() + PATIENCE_S
    while not dummy.finished:
        assert time.monotonic() < end
        woken.wait(0.01)
    dummy.close()

    assert dummy.person.body == Pose2(2.0 + 0.02 * 14, 4.0)
    stamps = [sample.stamp_ns for sample in trackers.samples(0)]
    assert stamps == sorted(set(stamps))
