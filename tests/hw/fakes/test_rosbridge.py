"""The fake RB-KAIROS behind rosbridge, asked by a plain websocket client that shares nothing."""

import json
import math
import time
from contextlib import ExitStack

import pytest
from websockets.sync.client import connect

from hw.fakes.kairos.kairos_peer import Kairos
from hw.fakes.kairos.kairos_robot import KairosWheels
from hw.ipc.datagrams import Intake
from tests.hw.drivers.rigs import PATIENCE_S, opening, own_address

ODOM = "/robot/robotnik_base_control/odom"
DRIVE = "/robot/robotnik_base_control/cmd_vel"
STOP = "/robot/robotnik_base_hw/emergency_stop"
SCAN = "/robot/front_laser/scan"


class Client:
    """Frames as rosbridge's protocol has them, written by hand."""

    def __init__(self, host):
        self.open = ExitStack()
        address = f"ws://{host}:9090"
        connection = connect(address, compression=None, open_timeout=PATIENCE_S)
        self.socket = self.open.enter_context(connection)

    def say(self, **frame):
        self.socket.send(json.dumps(frame))

    def hear(self, topic=None):
        while True:
            frame = json.loads(self.socket.recv(PATIENCE_S))
            if topic is None or frame.get("topic") == topic:
                return frame

    def drive(self, vx, vy=0.0, wz=0.0):
        twist = {"linear": {"x": vx, "y": vy, "z": 0}, "angular": {"x": 0, "y": 0, "z": wz}}
        self.say(op="publish", topic=DRIVE, msg=twist)


@pytest.fixture
def rig():
    with _Rig() as found:
        yield found


class _Rig:
    def __init__(self, **given):
        self.host, self.world = own_address(), Intake(("drives", "scanners"))
        if given.pop("world", False):
            given["tells"] = self.world
        self.fake = Kairos(self.host, opening(), **given)
        self.fake.wait()
        self.client = Client(self.host)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.client.open.close()
        self.fake.close()
        self.world.close()


def test_odometry_as_ros_1_has_it(rig):
    rig.client.say(op="subscribe", topic=ODOM, type="nav_msgs/Odometry", queue_length=1)
    first, second = rig.client.hear(), rig.client.hear()
    assert set(first) == {"op", "topic", "msg"}
    assert first["op"] == "publish"
    message = first["msg"]
    assert set(message) == {"header", "child_frame_id", "pose", "twist"}
    assert set(message["header"]) == {"seq", "stamp", "frame_id"}
    assert set(message["header"]["stamp"]) == {"secs", "nsecs"}
    assert len(message["pose"]["covariance"]) == 36
    turned = message["pose"]["pose"]["orientation"]
    assert math.hypot(*turned.values()) == pytest.approx(1.0)
    assert second["msg"]["header"]["seq"] > message["header"]["seq"]


def test_odometry_as_ros_2_has_it():
    with _Rig(ros=2) as rig:
        rig.client.say(op="subscribe", topic=ODOM, type="nav_msgs/msg/Odometry")
        header = rig.client.hear()["msg"]["header"]
    assert set(header) == {"stamp", "frame_id"}
    assert set(header["stamp"]) == {"sec", "nanosec"}


def test_a_latched_topic_tells_a_newcomer(rig):
    rig.client.say(op="subscribe", topic=STOP)
    assert rig.client.hear()["msg"] == {"data": False}
    rig.fake.fault("stop")
    assert rig.client.hear()["msg"] == {"data": True}


@pytest.mark.parametrize("wrong", [{"type": "std_msgs/Odometry"}, {"topic": "/robot/odometry"}])
def test_a_subscription_that_fails_is_silent_unless_warnings_are_wanted(rig, wrong):
    rig.client.say(**({"op": "subscribe", "topic": ODOM, "type": "nav_msgs/Odometry"} | wrong))
    rig.client.say(op="subscribe", topic=SCAN)
    assert rig.client.hear()["topic"] == SCAN  # nothing of odometry, which comes far more often
    rig.client.say(op="unsubscribe", topic=SCAN)
    rig.client.say(op="set_level", level="warning")
    rig.client.say(**({"op": "subscribe", "topic": ODOM, "type": "nav_msgs/Odometry"} | wrong))
    frame = rig.client.hear()
    while frame["op"] == "publish":
        assert frame["topic"] == SCAN
        frame = rig.client.hear()
    assert frame["op"] == "status"


def test_what_json_has_not_is_null(rig):
    rig.client.say(op="subscribe", topic=SCAN, type="sensor_msgs/LaserScan")
    ranges = rig.client.hear()["msg"]["ranges"]
    assert len(ranges) == 541
    assert ranges[1] is None
    rig.fake.fault("nan")
    while any(r is not None for r in ranges):
        ranges = rig.client.hear()["msg"]["ranges"]
    rig.client.say(op="unsubscribe", topic=SCAN)
    rig.client.say(op="subscribe", topic=ODOM)
    assert rig.client.hear(ODOM)["msg"]["pose"]["pose"]["position"]["x"] is None


def test_services_fail_and_nonsense_does_no_harm(rig):
    rig.client.socket.send("{")
    rig.client.socket.send(b"\xff\xfe")
    rig.client.say(op="fly")
    rig.client.say(topic="x")
    rig.client.say(op="publish", topic=DRIVE, msg={"linear": {"x": None}})
    rig.client.say(op="call_service", service="/rosapi/get_time", id="7")
    answer = rig.client.hear()
    assert (answer["op"], answer["id"], answer["result"]) == ("service_response", "7", False)


def test_it_tells_a_world_its_wheels():
    with _Rig(world=True) as rig:
        heard = {}
        until = time.monotonic() + PATIENCE_S
        while "wheels" not in heard or max(heard["wheels"].value) < 0.5:
            rig.client.drive(0.0, 0.2)
            heard |= {told.name: told for told in rig.world.poll()}
            assert time.monotonic() < until
    assert heard["subscribe"].source == "scanners"
    assert heard["wheels"].source == "drives"
    front_left, front_right, rear_left, rear_right = heard["wheels"].value
    assert front_left == rear_right == -front_right == -rear_left < 0.0  # sideways to the left


def moved(robot, steps, dt=0.01):
    """How far it goes, m, and its speeds, m/s."""
    x, y, _ = robot.place
    speeds = []
    for _ in range(steps):
        robot.step(dt)
        speeds.append(math.hypot(*robot.velocity[:2]))
    return math.hypot(robot.place[0] - x, robot.place[1] - y), speeds


TWIST = {"linear": {"x": 0.3, "y": 0.4}, "angular": {"z": 0.0}}


def test_the_robot_drives_on_for_its_watchdog_and_then_brakes_with_its_ramp():
    robot = KairosWheels()
    for _ in range(100):
        robot.command(TWIST)
        robot.step(0.01)
    assert math.hypot(*robot.velocity[:2]) == pytest.approx(0.5)
    way, speeds = moved(robot, 300)
    assert speeds[45] == pytest.approx(0.5)
    assert speeds[-1] == 0.0
    assert way == pytest.approx(0.5 * 0.5 + 0.5**2 / (2 * 0.6), abs=0.02)


def test_its_emergency_stop_beats_every_command():
    robot = KairosWheels(stopped=True)
    robot.command(TWIST)
    assert moved(robot, 50)[0] == 0.0
