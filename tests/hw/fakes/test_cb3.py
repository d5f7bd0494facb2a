"""The fake UR controller by clients of our own, byte for byte as UR's RTDE guide lays it out."""

import contextlib
import itertools
import select
import socket
import struct
import time

import pytest

from hw.fakes.peers import Cb3
from hw.ipc.datagrams import Intake
from tests.hw.drivers.rigs import PATIENCE_S, own_address
from tests.hw.fakes.ur_client import Client

START = (0.0, -1.5, 1.5, -1.0, 0.5, 0.25)
SCRIPT = b"def some_program():\n  sync()\nend\n"


class Robot:
    """A fake, its RTDE with some outputs, and the inputs of the control script."""

    def __init__(self, stack, unlock=0.0):
        self.host = own_address()
        self.heard = Intake(("cb3",), self.host)
        stack.callback(self.heard.close)
        self.fake = Cb3(self.host, tells=self.heard, joints=START, unlock=unlock)
        stack.callback(self.fake.close)
        self.fake.wait()
        self.stack = stack

    def begin(self):
        """A new link to it, which stands as at the start, whatever happened to it before."""
        self.fake.fault("well")
        self.fake.fault("place", START)
        while self.fake.fault("well"):
            with contextlib.suppress(ConnectionError):
                self.rtde = self.client(30004)
                break
        assert self.rtde.answer("V", struct.pack(">H", 2)) == b"\x01"
        names = b"timestamp,actual_q,runtime_state,safety_status_bits,output_int_register_0,"
        assert self.rtde.answer("O", struct.pack(">d", 125.0) + names) == (
            b"\x01DOUBLE,VECTOR6D,UINT32,UINT32,INT32"
        )
        doubles = b",".join(b"input_double_register_%d" % n for n in range(11))
        named = b"input_int_register_0,input_int_register_1," + doubles + b","
        assert self.rtde.answer("I", named) == b"\x01INT32,INT32" + b",DOUBLE" * 11
        assert self.rtde.answer("S") == b"\x01"
        self.until(lambda _t, joints, _r, bits, _w: (joints, bits) == (START, 1))

    def client(self, port):
        client = Client(self.host, port)
        self.stack.callback(client.link.close)
        return client

    def state(self):
        """The next package: time, joints, runtime state, safety bits, the script's word."""
        kind, content = self.rtde.package()
        assert (kind, content[0], len(content)) == ("U", 1, 1 + 8 + 48 + 4 + 4 + 4)
        time_s, *joints, runtime, bits, word = struct.unpack(">d6dIIi", content[1:])
        return time_s, tuple(joints), runtime, bits, word

    def command(self, number, *values, flag=0):
        values = (*values, *(0.0,) * (11 - len(values)))
        self.rtde.send("U", b"\x01" + struct.pack(">ii11d", number, flag, *values))

    def until(self, wanted):
        for _ in range(2000):
            state = self.state()
            if wanted(*state):
                return state
        raise AssertionError("it did not come")

    def play(self):
        self.client(30003).link.sendall(SCRIPT)
        self.command(0)
        self.until(lambda _t, _q, runtime, _b, word: (runtime, word) == (2, 1))


@pytest.fixture(scope="module")
def shared():
    with contextlib.ExitStack() as stack:
        yield Robot(stack)


@pytest.fixture
def robot(shared):
    """One for all tests, put where it was for each."""
    shared.begin()
    return shared


def moves(robot, packages=20):
    """Does a joint move within some packages?"""
    before = robot.state()[1]
    return any(robot.state()[1] != before for _ in range(packages))


def test_versions_are_told_byte_for_byte(robot):
    client = robot.client(30004)
    client.link.sendall(bytes([0, 5, 86, 0, 2]))
    assert client.exactly(4) == bytes([0, 4, 86, 1])
    client.link.sendall(bytes([0, 3, 118]))
    head, numbers = client.exactly(3), client.exactly(16)
    assert head == bytes([0, 19, 118])
    assert struct.unpack(">4I", numbers)[:2] == (3, 15)


def test_a_package_is_laid_out_as_it_was_agreed(robot):
    client = robot.client(30004)
    client.answer("V", struct.pack(">H", 2))
    asked = struct.pack(">d", 125.0) + b"actual_q,robot_mode,actual_digital_input_bits"
    assert client.answer("O", asked) == b"\x01VECTOR6D,INT32,UINT64"
    client.link.sendall(bytes([0, 3, 83]))
    assert client.exactly(4) == bytes([0, 4, 83, 1])
    golden = struct.pack(">HBB6diQ", 64, 85, 1, *START, 7, 0)
    assert client.exactly(64) == golden


def test_packages_come_each_cycle_or_as_seldom_as_asked(robot):
    stamps = [robot.state()[0] for _ in range(20)]
    steps = [b - a for a, b in itertools.pairwise(stamps)]
    assert steps == [pytest.approx(0.008)] * 19
    client = robot.client(30004)
    client.answer("V", struct.pack(">H", 2))
    client.answer("O", struct.pack(">d", 25.0) + b"timestamp")
    client.answer("S")
    first, second = (struct.unpack(">xd", client.package()[1])[0] for _ in range(2))
    assert second - first == pytest.approx(0.04)


def test_the_first_version_of_rtde_has_neither_frequency_nor_recipe(robot):
    client = robot.client(30004)
    assert client.answer("O", b"timestamp,nonsense") == b"DOUBLE,NOT_FOUND"
    client.answer("S")
    assert len(client.package()[1]) == 8


def test_what_a_controller_does_not_know_is_not_found(robot):
    robot.fake.fault("refuse", "actual_qd")
    limit = time.monotonic() + PATIENCE_S
    while True:
        client = robot.client(30004)
        client.answer("V", struct.pack(">H", 2))
        found = client.answer("O", struct.pack(">d", 125.0) + b"actual_q,actual_qd,my_own")
        if found == b"\x01VECTOR6D,NOT_FOUND,NOT_FOUND" or time.monotonic() > limit:
            break
    assert found == b"\x01VECTOR6D,NOT_FOUND,NOT_FOUND"
    assert client.answer("I", b"input_int_register_0,my_own")[:1] == b"\x00"


@pytest.mark.parametrize("nonsense", [b"\x00\x00\x55", b"\x00\x04U\x07", b"\xff\xff\xff", b"GET /"])
def test_nonsense_ends_no_controller(robot, nonsense):
    client = robot.client(30004)
    client.link.sendall(nonsense)
    client.link.shutdown(socket.SHUT_WR)
    while client.link.recv(100):
        pass
    assert not moves(robot)


def test_a_script_is_ready_does_a_command_once_and_is_done(robot):
    robot.play()
    goal = tuple(angle + 0.1 for angle in START)
    robot.command(1, *goal, 1.0, 2.0)
    states = []
    robot.until(lambda *state: states.append(state) or state[4] == 2)
    rates = [abs(b[1][0] - a[1][0]) / 0.008 for a, b in itertools.pairwise(states)]
    assert max(rates) <= 1.0 + 1e-9
    assert states[-1][1] == pytest.approx(goal)
    assert not moves(robot)
    robot.command(0)
    robot.until(lambda *state: state[4] == 1)


def test_a_servo_target_counts_until_there_is_another_one(robot):
    robot.play()
    goal = (0.2, *START[1:])
    robot.command(11, *goal, 0.0, 0.0, 0.008, 0.05, 300.0)
    robot.until(lambda _t, joints, *_: joints == pytest.approx(goal, abs=1e-4))
    robot.command(16, 10.0)
    robot.until(lambda *state: state[4] == 2)
    assert robot.state()[1] == pytest.approx(goal, abs=1e-3)


def test_without_a_watchdog_a_speed_goes_on_when_the_client_is_silent(robot):
    robot.play()
    robot.command(9, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0)
    robot.until(lambda time_s, joints, *_: joints[0] > START[0] + 0.2)
    assert moves(robot)


def test_a_watchdog_ends_the_program_a_tenth_of_a_second_after_the_last_word(robot):
    robot.play()
    robot.command(35, 10.0)
    robot.until(lambda *state: state[4] == 2)
    robot.command(9, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0)
    begun = robot.until(lambda _t, joints, *_: joints != START)[0]
    ended = robot.until(lambda _t, _q, runtime, *_: runtime == 1)[0]
    assert 0.08 < ended - begun < 0.13
    robot.until(lambda *state: not moves(robot, 1))
    assert not moves(robot)


@pytest.mark.parametrize(
    ("fault", "bits", "runtime"),
    [
        ("protective_stop", 1 << 2 | 1 << 10, 4),
        ("safeguard_stop", 1 << 4 | 1 << 10, 4),
        ("emergency_stop", 1 << 6 | 1 << 7 | 1 << 10, 1),
    ],
)
def test_a_safety_stop_shows_in_its_bits_and_halts_the_arm(robot, fault, bits, runtime):
    robot.play()
    robot.command(9, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0)
    robot.until(lambda _t, joints, *_: joints[0] > START[0] + 0.1)
    robot.fake.fault(fault)
    assert robot.until(lambda *state: state[3] != 1)[2:4] == (runtime, bits)
    for _ in range(8):
        robot.state()
    assert not moves(robot, 10)


def test_a_safeguard_that_closes_again_lets_the_program_go_on(robot):
    robot.play()
    robot.command(9, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0)
    robot.fake.fault("safeguard_stop")
    robot.until(lambda *state: state[2] == 4)
    robot.fake.fault("release")
    robot.until(lambda *state: state[2:4] == (2, 1))
    assert moves(robot)


def test_the_dashboard_answers_as_a_cb3_does(robot):
    dashboard = robot.client(29999)
    assert dashboard.line() == "Connected: Universal Robots Dashboard Server"
    assert dashboard.ask("PolyscopeVersion").startswith("URSoftware 3.15.")
    assert dashboard.ask("robotmode") == "Robotmode: RUNNING"
    assert dashboard.ask("safetymode") == "Safetymode: NORMAL"
    robot.play()
    assert dashboard.ask("running") == "Program running: true"
    robot.fake.fault("protective_stop")
    robot.until(lambda *state: state[3] != 1)
    assert dashboard.ask("safetymode") == "Safetymode: PROTECTIVE_STOP"
    assert dashboard.ask("unlock protective stop") == "Protective stop releasing"
    assert dashboard.ask("stop") == "Stopped"
    robot.until(lambda *state: state[2] == 1)
    assert "could not understand" in dashboard.ask("sing")


def test_a_protective_stop_is_not_unlocked_in_its_first_seconds():
    with contextlib.ExitStack() as stack:
        robot = Robot(stack, unlock=5.0)
        robot.begin()
        robot.fake.fault("protective_stop")
        robot.until(lambda *state: state[3] != 1)
        dashboard = robot.client(29999)
        dashboard.line()
        assert "until 5s after" in dashboard.ask("unlock protective stop")
        assert dashboard.ask("safetymode") == "Safetymode: PROTECTIVE_STOP"


def test_frozen_its_time_stands_still_while_packages_come(robot):
    robot.fake.fault("freeze")
    stamps = [robot.state()[0]]
    robot.until(lambda time_s, *_: stamps.append(time_s) or stamps[-1] == stamps[-2])
    stood = stamps[-1]
    assert {robot.state()[0] for _ in range(10)} == {stood}
    robot.fake.fault("well")
    robot.until(lambda time_s, *_: time_s > stood)


def test_mute_it_takes_links_and_says_nothing(robot):
    robot.fake.fault("mute")
    while select.select([robot.rtde.link], [], [], 0.1)[0]:
        robot.rtde.exactly(1)
    client = robot.client(30004)
    client.link.sendall(bytes([0, 5, 86, 0, 2]))
    assert not select.select([client.link], [], [], 0.1)[0]


@pytest.mark.parametrize("fault", ["drop", "close"])
def test_it_can_hang_up(robot, fault):
    robot.fake.fault(fault)
    with contextlib.suppress(ConnectionError):
        while robot.rtde.link.recv(1000):
            pass
    if fault == "drop":
        assert robot.client(29999).line().startswith("Connected")
    else:
        with pytest.raises(ConnectionError):
            robot.client(29999)


def test_it_tells_its_joints_to_who_wants_them(robot):
    robot.heard.poll(1_000_000)
    assert select.select([robot.heard], [], [], PATIENCE_S)[0]
    told = robot.heard.poll()[-1]
    assert (told.source, told.name, told.value) == ("cb3", "joints", START)


def test_an_address_that_is_taken_is_refused(robot):
    other = Cb3(robot.host)
    with pytest.raises(OSError, match="in use"):
        other.wait()
    other.close()
