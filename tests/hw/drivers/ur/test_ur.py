"""The UR driver: the real client library in its own process, against the fake controller."""

import contextlib
import os
import select
import signal
import struct
import subprocess
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from statistics import quantiles
from types import SimpleNamespace

import pytest

from cobodeck.real.connected import connect
from cobodeck.setup.setup import Uses
from hw.connection.connection import Connection, ServedPart
from hw.drivers.ur.probe import DashboardClient, probe, require_running
from hw.drivers.ur.ur_arm import MISSING, UrArm
from hw.drivers.ur.ur_settings import Servo, WorkerSettings
from hw.drivers.ur.worker import UrController, Worker
from hw.fakes.peers import Cb3
from hw.ipc.datagrams import Datagram, Intake, Outlet
from hw.samples import ArmState
from tests.hw.drivers.rigs import PATIENCE_S, Listener, opening, own_address
from tests.hw.drivers.ur.ur_rig import CYCLE_S, OUT, PARKED, ROBOT, UrRig, course
from tests.hw.fakes.ur_client import Client
from tests.repeats import TIMES, long_form

needs_rtde = pytest.mark.skipif(find_spec("rtde_control") is None, reason=MISSING)


@pytest.fixture
def stack():
    with contextlib.ExitStack() as stack:
        yield stack


@pytest.fixture
def rig(stack):
    return UrRig(stack)


@pytest.fixture(scope="module")
def shared():
    with contextlib.ExitStack() as stack:
        yield UrRig(stack)


@pytest.fixture
def calm(shared):
    """One for all tests that leave it as it was: parked, without a fault."""
    if shared.faulty():  # the test before broke off
        shared.fake.fault("release")
        shared.fake.fault("well")
        shared.recover()
        shared.arrive(PARKED)
    return shared


def test_without_the_client_library_it_says_so(monkeypatch):
    monkeypatch.setattr("hw.drivers.ur.ur_arm.find_spec", lambda _: None)
    with pytest.raises(OSError, match="ur-rtde is not installed"):
        UrArm("127.0.0.1", opening(ROBOT), time.monotonic_ns)


def test_the_engine_imports_no_client_library():
    look = "import sys, hw.drivers.ur.ur_arm; print([m for m in sys.modules if 'rtde' in m])"
    found = subprocess.run([sys.executable, "-c", look], capture_output=True, check=True)
    assert found.stdout == b"[]\n"


# ---- courses


@needs_rtde
@pytest.mark.requirement(45)
def test_a_course_is_taken_and_followed_to_its_end(calm):
    number = calm.follow(OUT)
    calm.until(lambda: calm.state.course == number)
    assert calm.state.refused is None
    calm.until(lambda: not calm.state.moving)
    assert calm.state.joints == pytest.approx(OUT, abs=0.002)
    calm.arrive(PARKED)
    stamps = [sample.stamp_ns for sample in calm.got]
    assert stamps == sorted(stamps)
    assert {sample.name for sample in calm.got} == {"arm.joints"}


@needs_rtde
@pytest.mark.requirement(45)
def test_a_stopped_arm_rests_within_a_fifth_of_a_second_and_stays(calm):
    calm.moving()
    calm.arm.stop()
    way = calm.cycles(40)
    last = next(n for n in range(40) if way[n] == pytest.approx(way[-1], abs=1e-4))
    assert last <= 25 + 2
    calm.until(lambda: not calm.state.moving)
    assert calm.state.refused is None
    assert calm.state.joints != pytest.approx(OUT, abs=0.05)
    calm.arrive(PARKED)


@needs_rtde
def test_a_course_that_begins_elsewhere_or_in_mid_move_is_refused_with_the_reason(calm):
    number = calm.arm.follow(course(OUT, PARKED))
    calm.until(lambda: calm.state.course == number)
    assert "from its start" in calm.state.refused
    assert calm.stands()
    calm.moving()
    number = calm.follow(PARKED)
    calm.until(lambda: calm.state.course == number)
    assert calm.state.refused == "the arm moves"
    calm.until(lambda: not calm.state.moving)
    calm.arrive(PARKED)


@needs_rtde
@pytest.mark.slow
def test_a_long_course_arrives_in_pieces(calm):
    points = course(PARKED, OUT, 2.0)
    number = calm.arm.follow([(0.2 * time, joints) for time, joints in points])
    calm.until(lambda: calm.state.course == number)
    assert calm.state.refused is None
    calm.until(lambda: not calm.state.moving)
    assert calm.state.joints == pytest.approx(OUT, abs=0.002)
    calm.arrive(PARKED)


@needs_rtde
@pytest.mark.parametrize("points", [[], [(0.0, (0.0,) * 5)], [(0.0, PARKED), (0.01, OUT)]])
def test_a_course_no_arm_can_follow_is_a_bug_of_the_caller(calm, points):
    with pytest.raises(ValueError, match="arm:"):
        calm.arm.follow(points)


@needs_rtde
@pytest.mark.requirement(48)
def test_a_pulled_stop_line_brakes_the_arm_and_takes_no_course(calm):
    calm.moving()
    calm.line.pull("button")
    calm.arm.stop()
    calm.until(lambda: not calm.state.moving)
    assert calm.stands()
    number = calm.follow(PARKED)
    calm.until(lambda: calm.state.course == number)
    assert calm.state.refused == "the stop line is pulled"
    assert calm.arm.acknowledge()
    calm.line.reset()
    assert calm.stands()
    calm.arrive(PARKED)


@needs_rtde
@pytest.mark.slow
def test_at_a_third_of_the_speed_the_course_takes_three_times_as_long(calm):
    calm.fake.fault("slow", 1.0 / 3.0)
    calm.until(lambda: calm.state.scaling < 0.5)
    first = len(calm.got)
    calm.arrive(OUT, 0.3)
    calm.fake.fault("well")
    cycles = sum(sample.value.moving for sample in calm.got[first:])
    assert cycles > 2.5 * 0.3 / CYCLE_S
    calm.until(lambda: calm.state.scaling == 1.0)
    calm.arrive(PARKED)


@needs_rtde
@pytest.mark.slow
def test_while_the_loop_does_not_turn_the_arm_waits_on_its_way(calm):
    calm.moving(OUT, 1.0)
    calm.truth.poll(1_000_000)
    way = []
    while len(way) < 50:
        assert select.select([calm.truth], [], [], PATIENCE_S)[0]
        way += [told.value for told in calm.truth.poll()]
    assert way[-1] == pytest.approx(way[-10], abs=1e-6)
    assert way[-1] != pytest.approx(OUT, abs=0.05)
    calm.until(lambda: not calm.state.moving)
    assert calm.state.joints == pytest.approx(OUT, abs=0.002)
    calm.arrive(PARKED)


@needs_rtde
def test_chain_and_engine_hear_joints_and_that_the_link_is_well(calm):
    calm.chain.poll(1_000_000)
    told = []
    while len([t for t in told if t.name == "arm.link"]) < 3:
        assert select.select([calm.chain], [], [], PATIENCE_S)[0]
        told += calm.chain.poll()
        calm.turn()
    assert {(t.source, t.name) for t in told} == {("arm", "arm.joints"), ("arm", "arm.link")}
    assert {t.value for t in told if t.name == "arm.link"} == {None}
    assert all(isinstance(t.value, ArmState) for t in told if t.name == "arm.joints")


@needs_rtde
@pytest.mark.requirement(150)
def test_the_controller_knows_what_the_arm_carries(calm):
    client = Client(calm.host, 30004)
    client.answer("V", struct.pack(">H", 2))
    client.answer("O", struct.pack(">d", 125.0) + b"payload,payload_cog")
    client.answer("S")
    _, content = client.package()
    client.link.close()
    assert struct.unpack(">x4d", content) == (ROBOT.prop.mass, *ROBOT.prop.center_of_mass)


# ---- opening


@needs_rtde
@pytest.mark.parametrize(
    ("fault", "value", "told"),
    [
        ("close", None, "port 29999"),
        ("mute", None, "timed out"),
        ("refuse", "actual_qd", "actual_qd"),
        ("protective_stop", None, "protective stop"),
        pytest.param(
            "program",
            "external_control.urp",
            r"another program drives the arm \(PLAYING external_control.urp\): .* RB-KAIROS",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "refuse",
            "input_int_register_3",
            "Or another client has registers: .* RB-KAIROS",
            marks=pytest.mark.slow,
        ),
        pytest.param("safeguard_stop", None, "safeguard", marks=pytest.mark.slow),
        pytest.param("emergency_stop", None, "EMERGENCY", marks=pytest.mark.slow),
    ],
)
@pytest.mark.few(3)
def test_a_controller_that_cannot_be_used_is_an_error_that_says_why(stack, fault, value, told):
    host = own_address()
    fake = Cb3(host, joints=PARKED)
    stack.callback(fake.close)
    fake.wait()
    fake.fault(fault, value)
    arm = UrArm(host, opening(ROBOT), time.monotonic_ns)
    stack.callback(arm.close)
    with pytest.raises(OSError, match=told):
        arm.wait()


@needs_rtde
@pytest.mark.parametrize(
    ("version", "old"),
    [
        ((3, 2, 18744, 0), True),
        ((3, 3, 4, 310), True),
        ((3, 4, 0, 0), False),
        ((5, 11, 6, 1), False),
    ],
)
def test_a_polyscope_that_is_too_old_is_named_before_the_library_meets_it(calm, version, old):
    calm.fake.fault("version", version)
    told = ".".join(map(str, version))
    while (found := probed(calm.host)) == "3.15.8.106339":
        calm.turn()
    calm.fake.fault("version", (3, 15, 8, 106339))
    refused = f"{calm.host} has PolyScope {told}; 3.4 is needed at least: update it"
    assert found == (refused if old else told)
    while probed(calm.host) != "3.15.8.106339":
        calm.turn()


def probed(host):
    try:
        return probe(host)
    except OSError as error:
        return str(error)


@needs_rtde
def test_who_finds_a_program_running_does_not_take_the_arm_from_it(calm):
    dashboard = DashboardClient(calm.host)  # what runs is ours: it is another's to whoever comes
    with pytest.raises(OSError, match=r"another program drives the arm \(PLAYING control.urp\)"):
        require_running(dashboard, acknowledged=False)
    dashboard.close()


class Still:
    """A controller as the worker sees it, whose arm does as the test says."""

    version, stamp, rate, ended = "", 0.0, 0.0, False

    def measured(self):
        return PARKED, (self.rate, *(0.0,) * 5)

    def safety(self):
        return 1

    def scaling(self):
        return 1.0

    def playing(self):
        return True

    def kick(self):
        pass

    def end(self):
        self.ended = True


ODD = [
    None, True, 7, -1, 1.5, float("nan"), float("inf"), "x", (), (1,), (1, 2, 3, 4), ("x",) * 4,
    (1, 0, 1, ()), (1, 0, 1, (1,)), (1, 0, 1, ((0.0, ()),)), (1, 0, 1, ((0.0, ("x",) * 6),)),
    (1, 0, 2, ((0.0, (0.0,) * 6), "x")), (1, -1, 0, ((0.0, (0.0,) * 6),)),
    (1, 0, 1, ((0.0, (float("nan"),) * 6),)), (1, 0, 10**9, ((0.0, (0.0,) * 6),)),
]  # fmt: skip


@pytest.mark.parametrize("name", ["here", "pace", "stop", "follow", "reset", ""])
def test_no_order_that_is_none_ends_the_worker_or_moves_the_arm(name):
    controller, outlet = Still(), Outlet()
    worker = Worker(controller, WorkerSettings("", (), ROBOT.arm, 0.0, (0.0, 0.0, 0.0)), outlet)
    now = time.monotonic_ns()
    worker.on_datagram(Datagram("engine", 1, "here", now, None), now)
    for value in ODD:
        for stamp in (now, now - 10**18, now + 10**18):
            worker.on_datagram(Datagram("engine", 1, name, stamp, value), now)
    controller.stamp += CYCLE_S
    worker.look(now)
    assert worker._run is None
    assert 0.0 <= worker._pace <= 1.0
    assert worker._ticked <= now  # a stamp ahead of the clock does not make an engine live longer
    outlet.close()


def test_an_arm_that_moves_without_a_command_is_another_programs():
    host = own_address()
    intake, controller = Intake(("arm",), host), Still()
    doors = (intake.door("arm"),)
    outlet, settings = Outlet(doors), WorkerSettings(host, doors, ROBOT.arm, 0.0, (0.0, 0.0, 0.0))
    worker = Worker(controller, settings, outlet)
    now = time.monotonic_ns()
    for n in range(1, 200):
        controller.stamp = n * CYCLE_S
        controller.rate = 0.1 if n > 20 else 0.0
        worker.look(now + n * 8_000_000)
        if worker.fault is not None:
            break
    intake.close()
    outlet.close()
    assert 20 * 8 + 500 < n * 8 <= 20 * 8 + 500 + 16
    assert worker.fault.startswith(
        "it moves without a command of ours; if the robot's own bring-up"
    )
    assert controller.ended


@pytest.mark.parametrize(
    ("servo", "told"),
    [
        ({"lookahead": 0.02}, "servo: lookahead: 0.02: 0.03 to 0.2"),
        ({"gain": 3000}, "servo: gain: 3000: 100 to 2000"),
        ({"gain": float("nan")}, "servo: gain: nan: 100 to 2000"),
        ({"gian": 300}, "servo: 'gian' is not known; there are lookahead, gain"),
    ],
)
@needs_rtde
def test_how_the_arm_follows_has_the_controllers_ranges(servo, told):
    with pytest.raises(ValueError, match=told):
        UrArm("127.0.0.1", opening(ROBOT), time.monotonic_ns, servo=servo)


@needs_rtde
@pytest.mark.parametrize("lookahead", [0.1, 0.11])
def test_a_lag_that_the_separation_does_not_count_on_is_told(lookahead, stack):
    told = []
    with_tell = replace(opening(ROBOT), tell=told.append)
    servo = {"lookahead": lookahead}
    arm = UrArm("127.0.0.1", with_tell, time.monotonic_ns, servo=servo)
    stack.callback(arm.close)
    arm.child.kill()
    assert [one.startswith("arm: with a lookahead of 0.11 s") for one in told] == (
        [True] if lookahead > 0.1 else []
    )


def test_how_the_arm_follows_reaches_the_controller():
    assert Servo.of({}) == Servo(0.03, 500.0)
    controller, sent = UrController.__new__(UrController), []
    controller._servo = Servo.of({"lookahead": 0.1, "gain": 300})
    controller._control = SimpleNamespace(servoJ=lambda *values: bool(sent.append(values)) or True)
    assert controller.servo(PARKED)
    assert sent == [(list(PARKED), 0.0, 0.0, 0.008, 0.1, 300)]


def test_a_body_without_an_arm_has_none(stack):
    bare = replace(ROBOT, arm=None, prop=None, parked=None)
    with pytest.raises((ValueError, OSError)):
        UrArm("127.0.0.1", opening(bare), time.monotonic_ns)


# ---- faults

FAULTS = (
    "protective_stop", "safeguard_stop", "emergency_stop", "freeze", "mute", "drop", "close",
    "killed",
)  # fmt: skip
GATES = dict.fromkeys(("freeze", "mute", "drop", "close", "killed"), 7)
"""After so many cycles of the controller silence counts: 50 ms. A stop is told in the next one."""
QUICK = ("safeguard_stop", "mute", "drop")


def strike(rig, fault):
    """Let a fault happen in mid move; seconds and cycles of the controller until it is told."""
    rig.truth.poll(1_000_000)
    begun = time.monotonic_ns()
    if fault == "killed":
        os.kill(rig.arm.pid, signal.SIGKILL)
    else:
        rig.fake.fault(fault)
    rig.until(rig.faulty)
    told = rig.line.pulled_ns
    cycles = sum(begun < joints.stamp_ns < told for joints in rig.truth.poll(1_000_000))
    return (told - begun) * 1e-9, cycles


def endure(rig, fault):
    """A fault in mid move, the end of its cause, and the operator's answer to it."""
    rig.moving()
    taken = strike(rig, fault)
    rig.cycles(20)
    assert rig.stands(10)
    if fault.endswith("_stop") and fault != "emergency_stop":
        assert rig.state.mode == fault
    where = rig.cycles(1)[0]
    rig.fake.fault("release")
    rig.fake.fault("well")
    assert set(rig.cycles(12)) == {where}
    rig.recover()
    assert rig.arm.fault is None
    assert set(rig.cycles(12)) == {where}
    rig.until(lambda: rig.state.mode == "normal")
    rig.arrive(PARKED)
    return taken


@needs_rtde
@pytest.mark.requirement(48, 49)
@pytest.mark.parametrize("fault", QUICK)
def test_after_a_fault_nothing_moves_until_it_is_acknowledged(calm, fault):
    endure(calm, fault)


@needs_rtde
@long_form
@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_each_of_twenty_faults_is_told_within_its_gate(rig, fault, capsys):
    taken = [endure(rig, fault) for _ in range(TIMES)]
    shares = quantiles([1e3 * seconds for seconds, _ in taken], n=100)
    cycles = sorted(cycles for _, cycles in taken)
    with capsys.disabled():
        print(f"\n{fault}: p50 {shares[49]:.1f} ms, p99 {shares[98]:.1f} ms, cycles {cycles}")  # noqa: T201
    assert cycles[-1] <= GATES.get(fault, 1) + 2


@needs_rtde
@pytest.mark.slow
def test_a_fault_whose_cause_holds_is_not_acknowledged_and_says_why(calm):
    rig = calm
    rig.fake.fault("safeguard_stop")
    rig.until(rig.faulty)
    assert not rig.arm.acknowledge()
    rig.until(lambda: "safeguard input" in rig.arm.fault)
    assert not rig.arm.acknowledge()
    rig.fake.fault("release")
    rig.recover()
    rig.arrive(OUT)
    rig.arrive(PARKED)


@needs_rtde
def test_a_connection_opens_it_and_the_operators_reset_has_it_started_again():
    uses = Uses(frozenset(("arm",)), frozenset(("arm.joints",)))
    here = {"host": own_address()}
    peers = {"controller": ServedPart("hw.fakes.peers", "Cb3", here | {"unlock": 0.0}, "peers")}
    parts = {"arm": ServedPart("hw.drivers.ur.ur_arm", "UrArm", here, "parts")}
    plant = connect(Connection("own", "", "m", parts, {}, peers), opening(ROBOT), uses)
    try:
        arm, line = plant.parts["arm"], plant.parts["stop_line"]
        assert arm.line is line
        listener = Listener(arm)
        listener.until(lambda: bool(listener.got))
        os.kill(arm.pid, signal.SIGKILL)
        listener.until(lambda: line.reason is not None)
        assert line.reason == "arm: the arm's process has ended (killed by signal 9, SIGKILL)"
        assert not line.reset()
        listener.until(line.reset)
        assert (line.reason, arm.fault) == (None, None)
    finally:
        plant.close()
    assert plant.failures == []


ENGINE = """
import sys, time
from hw.drivers.ur.ur_arm import UrArm
from tests.hw.drivers.rigs import opening
from tests.hw.drivers.ur.ur_rig import OUT, PARKED, ROBOT, course
arm = UrArm(sys.argv[1], opening(ROBOT), time.monotonic_ns)
arm.wait()
arm.samples(0)
arm.follow(course(PARKED, OUT, 3.0))
print("going", flush=True)
while True:
    arm.samples(time.monotonic_ns())
"""


@needs_rtde
def test_an_engine_that_is_killed_leaves_an_arm_that_stands_and_a_program_that_is_over(rig):
    rig.arm.close()
    engine = subprocess.Popen([sys.executable, "-c", ENGINE, rig.host], stdout=subprocess.PIPE)
    assert engine.stdout.readline() == b"going\n"
    while len(set(rig.cycles(5))) == 1:
        pass
    engine.kill()
    engine.wait()
    engine.stdout.close()
    rig.cycles(40)
    assert rig.stands()
    client = Client(rig.host, 29999)
    client.line()
    while client.ask("running") != "Program running: false":
        rig.cycles(1)
    client.link.close()
    assert rig.cycles(1)[0] != pytest.approx(OUT, abs=0.05)
