"""The world of the fakes in a process of its own: peers move it, the truth comes to one alone."""

from __future__ import annotations

import itertools
import select
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from hw.connection.connection import HostedScene, RunInfo
from hw.fakes.world_peer import WorldPeer
from hw.geometry import Pose2
from hw.ipc.datagrams import Intake, Outlet
from hw.model.robot import MotionLimits, load_robot
from hw.model.sensor_errors import SensorErrors
from hw.model.tracking import Tracking
from hw.safety.limits import SafetyLimits
from hw.scene.scene import load_scene
from tests.hw.drivers.rigs import own_address

ROBOT, MOTION = load_robot("rbkairos_ur10"), MotionLimits()
SCENE = load_scene("lab_a")
PATIENCE_S = 20.0
BEGAN = time.monotonic_ns()
USER = """
user: quick
about: asks at once, lets go at once
steps:
  - stand: 0.3
  - request: {hold: 0.3}
  - stand: 0.3
"""


def now():
    return time.monotonic_ns() - BEGAN


def opening(play):
    safety = SafetyLimits.of(ROBOT, MOTION)
    return RunInfo(now, ROBOT, MOTION, safety, Tracking.of(ROBOT.sensing), play)


def play(folder: Path) -> HostedScene:
    user = folder / "quick.yaml"
    user.write_text(USER)
    return HostedScene(SCENE, str(user), SensorErrors())


def running(play: HostedScene) -> Iterator[WorldPeer]:
    found = WorldPeer(7500, opening(play), own_address(), now=now)
    try:
        found.wait()
        yield found
    finally:
        found.close()


@pytest.fixture
def world(tmp_path: Path) -> Iterator[WorldPeer]:
    """One of the test's own."""
    yield from running(play(tmp_path))


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WorldPeer]:
    """One of all tests that neither wait for its person nor end it."""
    yield from running(play(tmp_path_factory.mktemp("world")))


class Peer:
    """Something that subscribes, and remembers what it hears."""

    def __init__(self, source, world):
        self.intake, self.out, self.heard = Intake(("world",)), Outlet([world.door(source)]), []

    def until(self, there):
        """Ask and listen until it is so."""
        end = time.monotonic() + PATIENCE_S
        while not there():
            assert time.monotonic() < end, {told.name for told in self.heard}
            self.out.send("subscribe", time.monotonic_ns(), tuple(self.intake.door("world")))
            select.select([self.intake], [], [], 0.1)
            self.heard += self.intake.poll()

    def names(self):
        return {told.name for told in self.heard}

    def close(self):
        self.intake.close()
        self.out.close()


@pytest.fixture
def peer():
    peers = []

    def make(source, world):
        peers.append(Peer(source, world))
        return peers[-1]

    yield make
    for one in peers:
        one.close()


def advance(world, until):
    end = time.monotonic() + PATIENCE_S
    while not until():
        assert time.monotonic() < end
        world.advance()
        select.select([], [], [], 0.005)


def test_the_truth_is_known_before_the_run_and_stays_between_two_looks(shared):
    assert shared.truth.base == SCENE.robot_start
    assert shared.truth.joints == ROBOT.parked
    held = shared.truth
    advance(shared, lambda: shared.truth is not held)
    assert not shared.failures


def test_peers_hear_what_is_theirs_and_nobody_else_the_truth(shared, peer):
    client, scanners = peer("vr_client", shared), peer("scanners", shared)
    client.until(lambda: {"user.pose", "rover.tracker", "vr.haptic_request"} <= client.names())
    scanners.until(lambda: {told.value.sensor for told in scanners.heard}
                   >= set(ROBOT.sensing.lidars))  # fmt: skip
    assert {told.source for told in client.heard + scanners.heard} == {"world"}
    assert scanners.names() == {"base.scan"}
    stranger = peer("somebody", shared)
    client.heard.clear()
    stranger.out.send("subscribe", 0, tuple(stranger.intake.door("world")))
    client.until(lambda: len(client.heard) > 50)
    assert stranger.intake.poll() == []
    assert "truth" not in client.names()


def test_scans_and_poses_are_stamped_when_they_were_measured(shared, peer):
    client = peer("vr_client", shared)
    client.until(lambda: len([told for told in client.heard if told.name == "user.pose"]) > 20)
    stamps = [told.stamp_ns for told in client.heard if told.name == "user.pose"]
    assert stamps == sorted(set(stamps))
    assert {b - a for a, b in itertools.pairwise(stamps)} == {10_000_000}
    assert max(stamps) < time.monotonic_ns()


def test_a_damaged_datagram_harms_nobody(shared, peer):
    drives, held = peer("drives", shared), shared.truth
    for value in ((1.0,), None, (1e400, 0.0, 0.0, 0.0), "fast"):
        drives.out.send("wheels", 0, value)
    drives.out.send("subscribe", 0, 7)
    drives.out.send("subscribe", 0, ("nowhere at all", 7))
    drives.out.send("music", 0, 1)
    advance(shared, lambda: shared.truth is not held)
    assert shared.truth.base == SCENE.robot_start


def test_the_body_goes_where_drives_say(shared, peer):
    drives = peer("drives", shared)
    start = shared.truth.base

    def turned():
        drives.out.send("wheels", time.monotonic_ns(), (4.0, 4.0, 4.0, 4.0))
        return shared.truth.base.distance_to(start) > 0.1

    advance(shared, turned)
    gone = shared.truth.base
    assert Pose2(start.x, start.y, start.yaw).bearing_to(gone) == pytest.approx(0.0, abs=0.05)
    advance(shared, lambda: shared.truth.distance_m > 0.1)


@pytest.mark.slow
def test_the_person_begins_with_the_run_and_the_end_is_told(world, peer):
    client = peer("vr_client", world)
    client.until(lambda: len(client.heard) > 100)
    assert not any(told.value for told in client.heard if told.name == "vr.haptic_request")
    began = now()
    seen = []

    def over():
        client.until(lambda: True)
        seen.append(world.truth.request)
        return world.finished

    advance(world, over)
    assert any(seen)
    client.until(lambda: "vr.release" in client.names())
    assert world.truth.seen_ns >= began
    assert world.truth_ns <= now()


@pytest.mark.slow
def test_a_world_that_has_died_is_told_once(world):
    held = world.truth
    advance(world, lambda: world.truth is not held)
    world.child.kill()
    advance(world, lambda: world.failures)
    world.advance()
    assert [str(error) for error in world.failures] == [
        "the world of the fakes has ended (killed by signal 9, SIGKILL)"
    ]


def test_a_world_without_a_room_and_one_whose_user_is_unknown_are_refused():
    host = own_address()
    with pytest.raises(ValueError, match="--scene"):
        WorldPeer(7500, opening(None), host, now=now)
    strange = WorldPeer(
        7500, opening(HostedScene(SCENE, "nobody_at_all", SensorErrors())), host, now=now
    )
    try:
        with pytest.raises(OSError, match="nobody_at_all"):
            strange.wait()
    finally:
        strange.close()


def test_an_address_is_taken_once(shared):
    host = shared.address[0]
    another = WorldPeer(7500, opening(HostedScene(SCENE, None, SensorErrors())), host, now=now)
    try:
        with pytest.raises(OSError, match="in use"):
            another.wait()
    finally:
        another.close()
