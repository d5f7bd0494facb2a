"""The VR link as a whole: its server in a process of its own, and VR applications over TCP."""

from __future__ import annotations

import json
import math
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress

import pytest

from hw.drivers import gates
from hw.drivers.unity.unity_link import Unity, UnityVr, ahead_ns, drained
from hw.fakes.unity.unity_client import Client
from hw.fakes.unity.vr_application import FRAME_NS
from hw.geometry import Pose2, Twist2
from hw.ipc.datagrams import Intake
from hw.samples import ArmState, Sample, TrackerPose
from tests.hw.drivers.rigs import own_address
from tests.hw.drivers.unity.unity_rig import DEEP, MAP_FROM_VIVE, Rig, Standing, an_opening
from tests.repeats import TIMES


@pytest.fixture
def rig() -> Iterator[Rig]:
    made = Rig()
    yield made
    made.close()


@pytest.mark.requirement(7, 13, 14, 15, 16)
@pytest.mark.parametrize("answers", [True, False])
@pytest.mark.few(1)
def test_a_user_is_tracked_asks_and_lets_go_by_a_clock_of_their_own(rig, answers) -> None:
    offset_s = 1000.5
    app = rig.application(offset_ns=int(offset_s * 1e9), answers=answers)
    assert rig.until(lambda: rig.newest("user.pose") and rig.newest("vr.clock"))
    rig.person.request = DEEP
    assert rig.until(lambda: rig.newest("vr.haptic_request") is not None)

    person, deep = rig.newest("user.pose"), rig.newest("vr.haptic_request")
    assert person.body.distance_to(Pose2(5.5, 5.0)) < 0.001
    assert person.head.z == pytest.approx(1.65, abs=0.001)
    assert person.left_hand is not None
    assert deep.distance_to(app.asks) < 1e-6
    assert rig.until(lambda: rig.newest("vr.clock").round_trips is answers)
    clock = rig.newest("vr.clock")
    assert abs(clock.offset + offset_s) <= clock.error + 0.02  # one way: what the way takes
    stamps = [sample.stamp_ns for sample in rig.samples if sample.name == "user.pose"]
    assert stamps == sorted(stamps)
    assert rig.newest("vr.fault") is None
    rig.person.request = None
    assert rig.until(lambda: rig.values("vr.release") and not rig.newest("vr.haptic_request"))
    assert rig.wakes > 0


@pytest.mark.requirement(18, 114)
def test_what_the_robot_shows_arrives_and_the_user_restarts(rig) -> None:
    app = rig.application()
    joints = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)

    def tick() -> None:
        now = rig.now()
        rig.vr.hear(Sample("base.pose", now, Pose2(1.0, 2.0, 0.5)), now)
        rig.vr.hear(Sample("base.twist", now, Twist2(0.2, 0.1, 0.3)), now)
        rig.vr.hear(Sample("arm.joints", now, ArmState(joints, (0.0,) * 6)), now)
        rig.vr.show(now)

    assert rig.until(lambda: app.robot and app.joints and len(app.changes) == 2, tick)
    assert app.changes == ["robot/visible off", "robot/stop_sign off"]
    shown = app._robot_in_map()
    assert shown is not None
    assert shown.distance_to(Pose2(1.0, 2.0)) < 0.001
    assert shown.yaw == pytest.approx(0.5, abs=0.001)
    assert app.robot is not None
    assert app.robot.velocity == (0.2, 0.1, 0.3)
    assert app.joints == joints
    rig.vr.inform(True)
    assert rig.until(lambda: rig.values("vr.restart"), tick)
    assert {"robot/visible on", "robot/stop_sign on"} <= set(app.changes)
    rig.vr.inform(False)
    assert rig.until(lambda: app.changes[-2:] == ["robot/visible off", "robot/stop_sign off"], tick)


@pytest.mark.requirement(114)
def test_the_pose_shown_is_right_within_five_centimetres_at_a_hundred_milliseconds(rig) -> None:
    """The base speeds up, turns and brakes; its pose is 80 ms old when it is shown."""
    app = rig.application()
    period, late = 1.0 / 30.0, 0.08

    def truth(t: float) -> tuple[Pose2, Twist2]:
        pose, step = Pose2(1.0, 1.0, 0.3), 0.001
        speed = 0.0
        for n in range(round(t / step)):
            at = n * step
            speed = min(1.0, speed + 1.0 * step) if at < 1.5 else max(0.0, speed - 1.0 * step)
            pose = pose @ Pose2(speed * step, 0.0, 0.4 * step)
        return pose, Twist2(speed, 0.0, 0.4)

    worst, seen = 0.0, 0
    registered = "__topic_list"  # is answered after all that was registered before
    assert rig.until(lambda: registered in [name for name, _ in app.client.told])
    for tick in range(3, 75, 6):
        at = tick * period
        now = rig.now()
        measured = Sample("base.pose", now - int(late * 1e9), truth(at - late)[0])
        rig.vr.hear(measured, now)
        rig.vr.hear(Sample("base.twist", now, truth(at)[1]), now)
        rig.vr.show(now)
        app.robot = None
        assert rig.until(lambda: app.robot)
        shown, velocity = app._robot_in_map(), app.robot.velocity
        turn = 0.5 * velocity[2] * 0.1
        moved = shown @ Pose2(0.0, 0.0, turn) @ Pose2(velocity[0] * 0.1, velocity[1] * 0.1)
        worst = max(worst, moved.distance_to(truth(at + 0.1)[0]))
        seen += 1
    assert seen == 12
    assert worst <= 0.05


def test_a_pose_is_moved_on_to_the_instant_at_which_it_is_shown(rig) -> None:
    shown = []
    rig.link.show = lambda stamp, view: shown.append((stamp, view))
    rig.vr.hear(Sample("base.pose", 10**9, Pose2(1.0, 2.0, 0.0)), 0)
    rig.vr.show(10**9 + 50_000_000)
    rig.vr.hear(Sample("base.twist", 10**9, Twist2(1.0, 0.0, 0.0)), 0)
    rig.vr.show(10**9 + 50_000_000)
    rig.vr.show(10**9 + 900_000_000)
    poses = [view.pose.x for _, view in shown]
    assert poses == [1.0, pytest.approx(1.05), 1.0]
    stamps = [stamp for stamp, _ in shown]
    wanted = rig.begun_ns + 10**9 + 50_000_000
    assert all(abs(stamp - wanted) < 900_000_000 for stamp in stamps[:2])


@pytest.mark.requirement(8, 12)
def test_each_tracker_on_the_rover_is_told_by_itself_in_its_own_frame(rig) -> None:
    app = rig.application(trackers=("front_tracker", "rear_tracker"))
    mounts = rig.opening.tracking.mounts
    there = MAP_FROM_VIVE.inverse()

    def track() -> None:
        now = time.monotonic_ns()
        for name, mount in mounts.items():
            app._newest[f"vr/{name}"] = (there @ mount, now)

    assert rig.until(lambda: len(rig.values("rover.tracker")) > 10, track)
    seen = {value.tracker: value for value in rig.values("rover.tracker")}
    assert set(seen) == set(mounts)
    for name, tracker in seen.items():
        assert isinstance(tracker, TrackerPose)
        base = rig.opening.tracking.base_by(tracker)
        assert base is not None
        assert base.distance_to(Pose2(0.0, 0.0)) < 0.001, name


def test_a_vr_application_that_is_gone_asks_for_nothing_and_may_come_back(rig) -> None:
    app = rig.application()
    rig.person.request = DEEP
    assert rig.until(lambda: rig.newest("vr.haptic_request") is not None)
    app.fault = "gone"
    assert rig.until(lambda: rig.newest("vr.haptic_request") is None)
    count = len(rig.values("user.pose"))
    app.fault = "none"
    assert rig.until(lambda: len(rig.values("user.pose")) > count)
    assert app.client.connections == 2
    app.fault = "lost"  # and the robot hears nothing of it
    frames = iter(range(20))
    assert rig.until(lambda: next(frames, None) is None)
    count = len(rig.values("user.pose"))
    app.fault = "none"
    assert rig.until(lambda: len(rig.values("user.pose")) > count)
    assert app.client.connections == 3
    assert rig.until(lambda: rig.newest("vr.haptic_request") is not None)


def test_who_may_not_connect_is_told_why_before_the_link_is_closed() -> None:
    """What they have sent meanwhile is read, so that no reset overtakes the word."""
    rig = Rig(peer="10.0.0.9")
    try:
        with socket.create_connection(rig.link.address, timeout=5.0) as link:
            link.sendall(bytes(8) * 100)
            received = b""
            while data := link.recv(1 << 16):
                received += data
                link.sendall(bytes(8))
        assert received.index(b"__handshake") < received.index(b"__error")
        assert b"is not the `peer` of this link: 10.0.0.9/32" in received
        assert rig.until(lambda: "is not the `peer`" in str(rig.newest("vr.fault")))
        assert rig.remarks == []
    finally:
        rig.close()


@pytest.mark.slow
def test_a_link_that_anybody_may_connect_to_says_so_at_its_start() -> None:
    rig = Rig(host="0.0.0.0")
    rig.close()
    [told] = rig.remarks
    assert "no password and no `peer`" in told


def test_a_server_that_dies_ends_the_request_and_nothing_else(rig) -> None:
    rig.application()
    rig.person.request = DEEP
    assert rig.until(lambda: rig.newest("vr.haptic_request") is not None)
    os.kill(rig.link.pid, signal.SIGKILL)
    assert rig.until(lambda: rig.newest("vr.haptic_request") is None)


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("frozen", "tracking is lost"),
        pytest.param("future", "their clock", marks=pytest.mark.slow),
        pytest.param("back", "their clock", marks=pytest.mark.slow),
        ("jump", "has jumped"),
    ],
)
@pytest.mark.requirement(149)
def test_poses_that_cannot_be_are_not_told_and_the_fault_is(rig, fault, told) -> None:
    app = rig.application()
    assert rig.until(lambda: len(rig.values("user.pose")) > 5)
    app.fault = fault
    assert rig.until(lambda: told in str(rig.newest("vr.fault")))
    count = len(rig.values("user.pose"))
    frames = iter(range(20))
    assert rig.until(lambda: next(frames, None) is None)
    assert len(rig.values("user.pose")) == count or fault == "back"
    app.fault = "none"
    assert rig.until(lambda: len(rig.values("user.pose")) > count + 5)


@pytest.mark.requirement(15)
def test_a_touch_at_nan_is_no_request(rig) -> None:
    app = rig.application()
    app.fault, rig.person.request = "nan", DEEP
    assert rig.until(lambda: "x is nan" in str(rig.newest("vr.fault")))
    assert set(rig.values("vr.haptic_request")) == {None}


def test_late_poses_are_told_with_their_age(rig) -> None:
    app = rig.application()
    assert rig.until(lambda: len(rig.values("user.pose")) > 5 and rig.values("vr.clock"))
    app.fault = "late"
    assert rig.until(lambda: rig.newest("vr.clock").age > 0.19)
    newest = [sample for sample in rig.samples if sample.name == "user.pose"][-1]
    assert rig.now() - newest.stamp_ns > 190_000_000


def test_two_applications_are_not_both_believed(rig) -> None:
    first = rig.application()
    assert rig.until(lambda: len(rig.values("user.pose")) > 5)
    second = rig.application(Standing(Pose2(2.0, 3.0)))
    assert rig.until(lambda: "second source" in str(rig.newest("vr.fault")))
    assert rig.until(lambda: any(name == "__error" for name, _ in second.client.told))
    assert {round(person.body.x, 1) for person in rig.values("user.pose")} == {5.5}
    first.fault = "gone"
    assert rig.until(lambda: not first.client.connected)
    second.fault = "drop"  # it has to register anew
    count = len(rig.values("user.pose"))
    assert rig.until(lambda: len(rig.values("user.pose")) > count)


def test_a_safety_chain_is_told_the_same(rig) -> None:
    with_chain = Intake(("vr",))
    other = Rig(tells=with_chain)
    try:
        other.application()
        other.person.request = DEEP
        assert other.until(lambda: other.newest("vr.haptic_request") and other.newest("user.pose"))
        names = {told.name for told in with_chain.poll() if told.source == "vr"}
        assert {"user.pose", "vr.haptic_request", "vr.link"} <= names
    finally:
        other.close()
        with_chain.close()


def noise(chance: random.Random, size: int) -> bytes:
    """Bytes that look a little like frames, or not at all."""
    names = (b"__publish", b"__subscribe", b"__request", b"vr/haptic_request", b"", b"\xff\xfe")
    data = b""
    while len(data) < size:
        name, body = chance.choice(names), chance.randbytes(chance.randrange(60))
        if chance.random() < 0.3:
            body = json.dumps({"topic": "vr/head", "srv_id": chance.randrange(9)}).encode()
        made = struct.pack("<I", len(name)) + name + struct.pack("<I", len(body)) + body
        data += made[: chance.randrange(len(made) + 1)] if chance.random() < 0.2 else made
        data += chance.randbytes(chance.randrange(9)) if chance.random() < 0.2 else b""
    return data


def harass(rig: Rig, total: int) -> None:
    """Send noise over many links beside an application that works, and leave others idle."""
    chance, sent, links = random.Random(3), 0, 0
    idle = [socket.create_connection(rig.link.address, timeout=5.0) for _ in range(64)]
    app = rig.application(offset_ns=10**12)
    assert rig.until(lambda: len(rig.values("user.pose")) > 5)
    before = resident_kb(rig.link.pid)
    app.client.send("vr/head", [bytes(1_500_000)])
    assert rig.until(lambda: "1500000 bytes" in str(app.client.told))
    while sent < total:
        with suppress(OSError), socket.create_connection(rig.link.address, timeout=5.0) as link:
            data = noise(chance, chance.randrange(1, 20_000))
            sent, links = sent + len(data), links + 1
            link.sendall(data)
            app.step(time.monotonic_ns())
    count = len(rig.values("user.pose"))
    assert rig.until(lambda: len(rig.values("user.pose")) > count + 20)
    assert app.client.connections == 1
    assert links > total // 20_000
    assert resident_kb(rig.link.pid) - before < 20_000
    for link in idle:
        link.close()


def resident_kb(pid: int) -> int:
    """Memory of a process."""
    with open(f"/proc/{pid}/status") as status:  # noqa: PTH123
        [line] = [line for line in status if line.startswith("VmRSS")]
    return int(line.split()[1])


def test_noise_harms_nobody_but_who_makes_it(rig) -> None:
    harass(rig, 100_000)


@pytest.mark.slow
def test_a_million_bytes_of_noise_harm_nobody_but_who_makes_it(rig) -> None:
    harass(rig, 1_000_000)


@pytest.mark.slow
def test_a_client_that_says_nothing_is_let_go_and_one_that_stays_alive_is_not(rig) -> None:
    alive = Client(*rig.link.address, {}, {})
    silent = socket.create_connection(rig.link.address)
    silent.settimeout(gates.CLIENT_SILENT_NS * 2e-9)
    received = b""
    try:
        while data := silent.recv(1 << 16):
            received += data
            alive.poll()
        assert received.count(bytes(8)) >= 4  # signs of life of the server
        alive.poll()
        assert alive.connected
    finally:
        silent.close()
        alive.close()


def test_a_port_that_is_taken_is_said_so() -> None:
    with socket.create_server((own_address(), 0)) as taken:
        host, port = taken.getsockname()
        link = Unity(port, time.monotonic_ns, an_opening(time.monotonic_ns), host=host)
        with pytest.raises(OSError, match="in use"):
            link.wait()
        link.close()


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        ({"topics": {"hat": "x"}}, "'hat' is none of head"),
        ({"topics": {"head": {"topic": ""}}}, "head: needs a name"),
        ({"topics": {"head": {"topic": "x", "typ": "y"}}}, "head: needs a name"),
        ({"topics": {"head": "vr/tailbone"}}, "named twice"),
        ({"topics": {"head": {"type": "Pose"}}}, "'Pose' is no message"),
        ({"stamps": "never"}, "'never' is neither"),
        ({"predicted": "60 ms"}, "0 to 0.05 s"),
        ({"peer": "the headset"}, "'the headset' is no address"),
    ],
)
def test_mistakes_in_a_connection_are_named(arguments, fault) -> None:
    with pytest.raises(ValueError, match=fault):
        Unity(0, time.monotonic_ns, an_opening(time.monotonic_ns), **arguments)


@pytest.mark.parametrize("arguments", [{"build": "ros3"}, {"topics": {"head": {"type": "a/B"}}}])
def test_what_only_the_process_can_know_is_told_when_it_starts(arguments) -> None:
    now = time.monotonic_ns
    link = Unity(0, now, an_opening(now), host=own_address(), **arguments)
    with pytest.raises(OSError, match=r"ros3|a/B"):
        link.wait()
    link.close()


def test_predicted_poses_may_be_further_ahead() -> None:
    assert ahead_ns(0.0) == gates.AHEAD_NS
    assert ahead_ns("50 ms") == gates.PREDICTED_NS


def test_the_engine_loads_neither_ros_nor_numpy_for_it() -> None:
    code = (
        "import sys, hw.drivers.unity.unity_link; print({'rosbags', 'numpy'} & sys.modules.keys())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_the_part_vr_says_what_it_gives() -> None:
    assert {"vr.haptic_request", "vr.release", "vr.restart"} <= set(UnityVr.signals)


def test_what_came_before_the_run_began_is_left_out() -> None:
    queue = deque([Sample("vr.release", -1, True), Sample("user.pose", 5, None)])
    assert drained(queue, 3) == [Sample("user.pose", 3, None)]
    assert not queue


GATE_FRAMES = math.ceil(gates.FROZEN_NS / FRAME_NS)


@pytest.mark.slow
@pytest.mark.requirement(149)
@pytest.mark.parametrize(
    ("fault", "poses", "requests"),
    [
        ("frozen", GATE_FRAMES + 2, None),
        ("jump", 0, None),
        ("future", 0, None),
        ("silent", 0, None),
        ("gone", 0, 1),
        ("drop", None, 1),
    ],
)
def test_twenty_times_a_fault_is_noticed_within_its_gate_and_two_frames(
    rig, fault, poses, requests
) -> None:
    """Counted in what is still told after the application has begun to fail, over TCP."""
    app = rig.application()
    for _ in range(TIMES):
        count = len(rig.values("user.pose"))
        assert rig.until(lambda before=count: len(rig.values("user.pose")) > before + 5)
        rig.person.request = DEEP
        assert rig.until(lambda: rig.newest("vr.haptic_request") is not None)
        assert settled(rig)
        rig.samples.clear()
        app.fault, frames = fault, iter(range(30))
        assert rig.until(lambda left=frames: next(left, None) is None)
        if poses is not None:
            assert len(rig.values("user.pose")) <= poses
        if requests is not None:
            assert rig.values("vr.haptic_request")[:1] == [None]
        app.fault = "none"
        assert rig.until(lambda client=app.client: client.connected)  # else it is told to nobody
        rig.person.request = None
        assert rig.until(lambda: rig.values("vr.release"))


def settled(rig: Rig) -> bool:
    """Let everything that is on the way arrive, with the application standing still."""
    applications, rig.applications = rig.applications, []
    quiet = iter(range(5))
    try:
        return rig.until(lambda: next(quiet, None) is None)
    finally:
        rig.applications = applications
