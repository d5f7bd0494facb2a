"""What clients of the VR link register and are told: a server in this thread, clients by TCP."""

import json
import select
import socket
import struct
from collections.abc import Iterator

import pytest

from hw.drivers import gates
from hw.drivers.clock_offsets import PeerClock
from hw.drivers.unity.bridge import NOBODY, Bridged, UnityBridge
from hw.drivers.unity.inbox import Checks
from hw.drivers.unity.protocol.services import DESCRIBE
from hw.drivers.unity.protocol.session import MOST_TEXTS, TEXTS_NS, Session
from hw.drivers.unity.protocol.topics import FLAG, POSE, TIME, Topics
from hw.drivers.unity.protocol.wire import KEEPALIVE
from hw.geometry import Pose2, Twist2
from hw.model.tracking import Tracking
from hw.samples import ClockState, RobotView
from tests.hw.vr_link_rig import order, pack

MS = 1_000_000
VIEW = RobotView(Pose2(1.0, 2.0, 0.5), Twist2(0.1, 0.0, 0.0), (0.0,) * 6, True, False)
ALL = ("head", "tailbone", "haptic_request", "release")


def pose(x: float, y: float, z: float, at_ns: int = 10**9) -> bytes:
    """A ROS 1 PoseStamped in the map."""
    head = struct.pack("<IIII", 1, at_ns // 10**9, at_ns % 10**9, 3) + b"map"
    return head + struct.pack("<7d", x, y, z, 0.0, 0.0, 0.0, 1.0)


class Rig:
    """A bridge, its sessions and their clients."""

    def __init__(self, build: str = "ros1") -> None:
        self.told: list[tuple[str, int, object]] = []
        topics = Topics.of({}, {"front": "vr/front"})
        bridged = Bridged(build, topics, Checks(Tracking()), tuple("abcdef"))
        self.bridge = UnityBridge(bridged, lambda *told: self.told.append(told))
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.clients: dict[socket.socket, Session] = {}
        self.now = 10**9

    def client(self) -> socket.socket:
        there = socket.socket()
        there.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        there.connect(self.listener.getsockname())
        here, (host, port) = self.listener.accept()
        session = Session(here, f"{host}:{port}", self.now, PeerClock())
        self.bridge.join(session)
        self.clients[there] = session
        there.settimeout(5.0)
        return there

    def say(self, client: socket.socket, *frames: bytes) -> None:
        """Have frames arrive and be answered."""
        session, wanted = self.clients[client], sum(map(len, frames))
        client.sendall(b"".join(frames))
        session._socket.settimeout(5.0)  # arrival is not at once, even on loopback
        taken = 0
        while taken < wanted:
            data = session._socket.recv(1 << 16)
            taken += len(data)
            for found in session._parser.feed(data):
                self.bridge.on_frame(session, found, self.now)
        session._socket.setblocking(False)
        session.flush()

    def heard(self, client: socket.socket) -> list[tuple[str, bytes]]:
        """All that a client has been sent until now."""
        session = self.clients[client]
        session.send_latest("end", pack("end", b""))
        data, found = b"", []
        while not found or found[-1][0] != "end":
            session.flush()
            data += client.recv(1 << 16)
            while len(data) >= 4:
                name_end = 4 + struct.unpack_from("<I", data)[0]
                if len(data) < name_end + 4:
                    break
                end = name_end + 4 + struct.unpack_from("<I", data, name_end)[0]
                if len(data) < end:
                    break
                found.append((data[4:name_end].decode(), data[name_end + 4 : end]))
                data = data[end:]
        return found[:-1]

    def commands(self, client: socket.socket, name: str) -> list[dict[str, object]]:
        return [json.loads(body) for known, body in self.heard(client) if known == f"__{name}"]

    def publishes(self, client: socket.socket, *roles: str) -> None:
        kinds = {"release": FLAG, "clock_answer": TIME}
        for role in roles:
            kind = kinds.get(role, POSE)
            self.say(client, order("publish", topic=f"vr/{role}", message_name=kind))

    def values(self, name: str) -> list[object]:
        return [value for known, _, value in self.told if known == name]


@pytest.fixture
def rig() -> Iterator[Rig]:
    made = Rig()
    yield made
    for client, session in made.clients.items():
        client.close()
        session.close()
    made.listener.close()


def test_the_handshake_comes_first_whatever_the_client_says(rig) -> None:
    client = rig.client()
    rig.say(client, KEEPALIVE, order("topic_list"))
    assert [name for name, _ in rig.heard(client)] == ["__handshake", "__topic_list"]


def test_the_topic_list_has_names_and_messages_of_all_topics(rig) -> None:
    client = rig.client()
    rig.say(client, order("topic_list"))
    [told] = rig.commands(client, "topic_list")
    known = dict(zip(told["topics"], told["types"], strict=True))
    assert known["vr/haptic_request"] == "geometry_msgs/PoseStamped"
    assert known["vr/front"] == "geometry_msgs/PoseStamped"
    assert known["robot/pose"] == "nav_msgs/Odometry"
    assert known["tf"] == "tf2_msgs/TFMessage"


@pytest.mark.requirement(19)
def test_who_subscribes_is_sent_what_is_shown_under_the_name_they_gave(rig) -> None:
    client, other = rig.client(), rig.client()
    rig.say(client, order("subscribe", topic="/tf", message_name="tf2_msgs/TFMessage"))
    rig.say(other, order("subscribe", topic="robot/visible", message_name="std_msgs/msg/Bool"))
    rig.bridge.show(10**9, VIEW)
    assert [name for name, _ in rig.heard(client)] == ["__handshake", "/tf"]
    assert ("robot/visible", b"\x01") in rig.heard(other)


def test_who_unsubscribes_is_sent_no_more_and_stays_connected(rig) -> None:
    client = rig.client()
    rig.say(client, order("subscribe", topic="/tf", message_name="tf2_msgs/TFMessage"))
    rig.say(client, order("remove_subscriber", topic="/tf"))
    rig.bridge.show(10**9, VIEW)
    rig.say(client, order("remove_subscriber", topic="never_there"), KEEPALIVE)
    assert [name for name, _ in rig.heard(client)] == ["__handshake"]
    assert rig.clients[client].broken is None


@pytest.mark.parametrize(
    ("command", "level", "told"),
    [
        (order("subscribe", topic="camera", message_name="a/B"), "warn", "camera is not sent here"),
        (order("subscribe", topic="tf", message_name="a/B"), "error", "is a tf2_msgs/TFMessage"),
        (order("publish", topic="cmd_vel", message_name="a/B"), "warn", "cmd_vel is not read here"),
        (order("publish", topic="vr/head", message_name="a/B"), "error", "no a/B"),
        (order("ros_service", topic="add", message_name="a/B"), "error", "no service add"),
        (order("fly", topic="x"), "warn", "__fly is not known"),
        (pack("vr/head", b""), "error", "no source of it"),
        (pack("nowhere", b"abc"), "error", "no source of it"),
    ],
)
def test_a_client_s_developer_is_told_what_is_wrong(rig, command, level, told) -> None:
    client = rig.client()
    rig.say(client, command)
    [said] = rig.commands(client, level)
    assert told in said["text"]
    assert rig.clients[client].broken is None


@pytest.mark.parametrize(
    "command",
    [
        pack("__publish", b"{"),
        pack("__publish", b"[]"),
        order("publish", message_name=POSE),
        order("publish", topic="x" * 600, message_name=POSE),
        order("publish", topic=7, message_name=POSE),
        order("request"),
        order("request", srv_id="7"),
    ],
)
def test_a_command_that_is_none_is_told_and_left_out(rig, command) -> None:
    client = rig.client()
    rig.say(client, command, order("topic_list"))
    names = [name for name, _ in rig.heard(client)]
    assert names == ["__handshake", "__error", "__topic_list"]
    assert rig.clients[client].broken is None


def test_texts_for_a_client_are_bounded_and_come_again_after_a_while(rig) -> None:
    client = rig.client()
    session = rig.clients[client]
    rig.say(client, *[order("fly", topic="x")] * 200)
    assert len(rig.commands(client, "warn")) == MOST_TEXTS
    session.heard_ns += TEXTS_NS
    rig.say(client, order("fly", topic="x"))
    assert len(rig.commands(client, "warn")) == 1


def test_registering_a_service_under_many_names_keeps_one(rig) -> None:
    client = rig.client()
    names = ["/" * n + DESCRIBE for n in range(300)]
    rig.say(client, *[order("ros_service", topic=name, message_name="x/Y") for name in names])
    assert rig.clients[client].services == {DESCRIBE}


@pytest.mark.requirement(15)
def test_requests_and_releases_are_told(rig) -> None:
    client = rig.client()
    rig.publishes(client, *ALL)
    rig.say(client, pack("vr/haptic_request", pose(1.0, 2.0, 1.5)))
    rig.say(client, pack("vr/release", b"\x01"))
    deep, end = rig.values("vr.haptic_request")
    assert (deep.x, deep.y, deep.z) == (1.0, 2.0, 1.5)
    assert end is None
    assert rig.values("vr.release") == [True]


@pytest.mark.requirement(15)
@pytest.mark.parametrize("body", [pose(float("nan"), 2.0, 1.5), pose(1.0, 2.0, 1.5)[:-1], b""])
def test_a_deep_that_cannot_be_read_ends_the_request_and_is_told(rig, body) -> None:
    client = rig.client()
    rig.publishes(client, *ALL)
    rig.say(client, pack("vr/haptic_request", pose(1.0, 2.0, 1.5)))
    rig.say(client, pack("vr/haptic_request", body))
    assert rig.values("vr.haptic_request")[-1] is None
    assert "vr/haptic_request" in rig.commands(client, "error")[0]["text"]
    rig.bridge.tick(rig.now)
    assert "vr/haptic_request" in str(rig.values("vr.fault")[-1])


def test_a_topic_has_one_source_and_the_second_is_refused_and_told(rig) -> None:
    first, second = rig.client(), rig.client()
    rig.publishes(first, "haptic_request")
    rig.publishes(second, "haptic_request", "release")
    [said] = rig.commands(second, "error")
    assert "comes from" in said["text"]
    rig.say(second, pack("vr/haptic_request", pose(5.0, 5.0, 1.5)))
    assert rig.values("vr.haptic_request") == []
    rig.bridge.tick(rig.now)
    assert rig.values("vr.fault") != [None]
    assert rig.values("vr.link") == ["up"]
    rig.say(second, pack("vr/release", b"\x01"))
    assert rig.values("vr.release") == [True]


def test_when_a_source_goes_its_request_ends_and_another_may_come(rig) -> None:
    first, second = rig.client(), rig.client()
    rig.publishes(first, "haptic_request")
    rig.say(first, pack("vr/haptic_request", pose(1.0, 2.0, 1.5)))
    rig.bridge.leave(rig.clients[first], rig.now)
    assert rig.values("vr.haptic_request")[-1] is None
    rig.bridge.tick(rig.now)
    assert rig.values("vr.link") == [NOBODY]
    rig.publishes(second, "haptic_request")
    rig.say(second, pack("vr/haptic_request", pose(3.0, 2.0, 1.5)))
    assert rig.values("vr.haptic_request")[-1].x == 3.0
    rig.say(second, order("remove_publisher", topic="/vr/haptic_request"))
    assert rig.values("vr.haptic_request")[-1] is None


def test_levels_are_told_again_every_hundred_milliseconds(rig) -> None:
    client = rig.client()
    rig.publishes(client, *ALL)
    rig.say(client, pack("vr/haptic_request", pose(1.0, 2.0, 1.5)))
    rig.told.clear()
    for n in range(101):
        rig.bridge.tick(rig.now + n * 10 * MS)
    assert rig.values("vr.link") == ["up"] * 11
    assert [deep.z for deep in rig.values("vr.haptic_request")] == [1.5] * 11


@pytest.mark.requirement(19)
def test_the_service_tells_all_topics(rig) -> None:
    client = rig.client()
    service = f"/{DESCRIBE}"
    rig.say(client, order("ros_service", topic=service, message_name="std_srvs/Trigger"))
    rig.say(client, order("request", srv_id=101), KEEPALIVE, pack(service, b""))
    (_, response), (name, body) = rig.heard(client)[-2:]
    assert json.loads(response) == {"srv_id": 101}
    assert name == service
    assert body[0] == 1
    told = json.loads(body[5:])
    assert told["reads"]["vr/release"] == "std_msgs/Bool"
    rig.say(client, order("remove_ros_service", topic=service))
    rig.say(client, order("request", srv_id=102), pack(service, b""))
    assert rig.heard(client)[-1][0] == "__error"


@pytest.mark.requirement(19)
def test_answers_that_nobody_has_asked_for_are_told_and_left_out(rig) -> None:
    client = rig.client()
    rig.say(client, order("unity_service", topic="mine", message_name="std_srvs/Trigger"))
    rig.say(client, order("response", srv_id=1001), pack("mine", b"\x01\0\0\0\0"))
    [said] = rig.commands(client, "warn")
    assert "1001" in said["text"]


def test_of_what_a_client_does_not_read_only_the_newest_waits(rig) -> None:
    client = rig.client()
    names = {"robot/pose": "nav_msgs/Odometry", "tf": "tf2_msgs/TFMessage"}
    for name, kind in names.items():
        rig.say(client, order("subscribe", topic=name, message_name=kind))
    session, held = rig.clients[client], 0
    for n in range(1_000):
        view = RobotView(Pose2(float(n), 0.0), Twist2(0.0), None, False, False)
        rig.bridge.show(n, view)
        session.flush()
        held = max(held, session.held)
    assert held < 4_000
    found = [body for name, body in rig.heard(client) if name == "robot/pose"]
    assert len(found) < 1_000
    x = struct.unpack_from("<d", found[-1], 12 + 4 + 4 + 4 + 9)[0]
    assert x == 999.0


def test_a_client_that_asks_and_never_reads_is_let_go(rig) -> None:
    client = rig.client()
    session = rig.clients[client]
    asked = 0
    while session.broken is None:
        rig.say(client, *[order("topic_list")] * 50)
        asked += 50
        assert asked < 100_000
    assert session.broken == "it does not read"


def test_a_client_of_ros_2_is_greeted_as_such(rig) -> None:
    other = Rig("ros2")
    client = other.client()
    try:
        handshake = other.commands(client, "handshake")[0]
        assert json.loads(handshake["metadata"]) == {"protocol": "ROS2"}
        body = json.dumps({"topic": "vr/release\0", "message_name": "std_msgs/Bool\0"}).encode()
        other.say(client, pack("__publish\0", body + b"\0"))
        other.say(client, pack("vr/release\0", b"\0\x01\0\0\x01"))
        assert other.values("vr.release") == [True]
    finally:
        other.clients[client].close()
        client.close()
        other.listener.close()


@pytest.mark.requirement(16)
def test_a_client_that_answers_has_its_clock_estimated(rig) -> None:
    client = rig.client()
    theirs = 1_000 * 10**9
    rig.publishes(client, "clock_answer")
    rig.say(client, order("subscribe", topic="vr/clock_ask", message_name=TIME))
    rig.bridge.tick(rig.now)
    [(_, asked)] = [found for found in rig.heard(client) if found[0] == "vr/clock_ask"]
    token = asked[12 + 4 + 8 :]
    rig.now += 2 * MS
    came = rig.now - MS + theirs
    stamp = struct.pack("<II", came // 10**9, came % 10**9)
    head = struct.pack("<I", 1) + stamp + bytes(4)
    rig.say(client, pack("vr/clock_answer", head + stamp + token))
    rig.bridge.tick(rig.now + 100 * MS)
    [state] = rig.values("vr.clock")
    assert state == ClockState(-1000.0, 0.001, 0.0, True)
    rig.say(client, pack("vr/clock_answer", head + stamp + b"\x01\0\0\0x"))
    assert "was not asked" in rig.commands(client, "error")[0]["text"]


def test_a_clock_is_asked_often_at_first_and_then_once_a_second(rig) -> None:
    client = rig.client()
    rig.say(client, order("subscribe", topic="vr/clock_ask", message_name=TIME))
    asked = []
    for n in range(1000):
        now = rig.now + n * 10 * MS
        before = len(rig.clients[client].asked)
        rig.bridge.tick(now)
        rig.clients[client].flush()
        if len(rig.clients[client].asked) > before:
            asked.append(n * 10)
    assert asked[:3] == [0, 100, 200]
    assert asked[-1] - asked[-2] == 1000


@pytest.mark.requirement(149)
def test_a_client_whose_data_has_queued_up_is_let_go(rig) -> None:
    client = rig.client()
    rig.publishes(client, *ALL)
    session = rig.clients[client]
    while not session.clock.known:
        rig.now += 50 * MS
        rig.say(client, pack("vr/head", pose(0.0, 0.0, 1.7, rig.now - MS)))
    for n in range(1, 40):
        rig.now += 20 * MS
        rig.say(client, pack("vr/head", pose(0.0, 0.0, 1.7 + n * 1e-3, rig.now - 400 * MS)))
        if session.broken:
            break
    assert "ms old" in str(session.broken)
    assert n * 20 * MS > gates.BACKLOGGED_NS


class Counted(socket.socket):
    """Notes what options are set, between receipts."""

    noted: tuple[str, ...] = ()

    def setsockopt(self, level: int, option: int, *value: object) -> None:
        self.noted += (f"{level}:{option}",)
        super().setsockopt(level, option, *value)

    def recv(self, *arguments: int) -> bytes:
        self.noted += ("recv",)
        return super().recv(*arguments)


@pytest.mark.skipif(not hasattr(socket, "TCP_QUICKACK"), reason="Linux alone has it")
def test_acknowledgements_are_not_delayed_after_any_receipt(rig) -> None:
    """The kernel forgets it, so it has to be said again each time."""
    there = socket.create_connection(rig.listener.getsockname())
    here, _ = rig.listener.accept()
    counted = Counted(fileno=here.detach())
    session = Session(counted, "somebody", rig.now, PeerClock())
    quick = f"{socket.IPPROTO_TCP}:{socket.TCP_QUICKACK}"
    try:
        assert counted.noted[-1] == quick
        for _ in range(3):
            there.sendall(KEEPALIVE)
            select.select([counted], [], [], 5.0)
            session.read(rig.now)
            assert counted.noted[-2:] == ("recv", quick)
    finally:
        there.close()
        session.close()
