"""Four drives and a bumper behind CAN: they follow, and whatever goes wrong, they stop."""

import logging
import math
import random
import re

import can
import pytest

from hw.drivers.can.can_base import CanBase
from hw.drivers.can.ds402 import OPTIONAL, REMEDIES
from hw.drivers.can.mecanum import Mecanum, along
from hw.fakes.can.drive import Traits
from hw.geometry import STILL, Pose2, Twist2
from tests.hw.drivers.can.can_rig import CYCLE_NS, MODEL, WHEELS, Rig, rig

LOG = logging.getLogger(__name__)
AHEAD = Twist2(0.6, 0.1, 0.2)
MS = 1_000_000


def wheel_rates(made):
    scale = WHEELS["gear"] * WHEELS["increments"] / math.tau
    signs = WHEELS["signs"]
    return tuple(s * v / scale for s, v in zip(signs, made.nodes.velocities(), strict=True))


@pytest.mark.requirement(1, 2)
def test_wheels_turn_as_the_velocity_needs_and_odometry_tells_where_that_leads():
    with rig() as made:
        made.ready()
        made.cycle(AHEAD, 100)
        assert made.base.fault is None
        wanted = Mecanum.of(MODEL).rates(AHEAD)
        assert wheel_rates(made) == pytest.approx(wanted, abs=1e-3)
        stamp, before = made.base.odometry
        made.cycle(AHEAD, 50)
        after_stamp, after = made.base.odometry
        assert after_stamp - stamp == 50 * CYCLE_NS
        assert made.now_ns - after_stamp == 2 * CYCLE_NS  # the SYNC before the last
        there = along(before.pose, AHEAD, 0.5)
        assert after.pose.distance_to(there) < 1e-4
        assert after.pose.yaw == pytest.approx(there.yaw, abs=1e-4)
        assert (after.twist.vx, after.twist.vy, after.twist.wz) == pytest.approx(
            (AHEAD.vx, AHEAD.vy, AHEAD.wz), abs=1e-3
        )


def test_nothing_moves_while_the_drives_are_being_enabled_however_it_is_commanded():
    with rig() as made:
        for _ in range(50):
            made.cycle(AHEAD)
            if not made.enabled():
                assert made.stands()
        assert made.base.fault is None
        assert not made.stands()


SECOND = 2
FAULTS = {
    "dead": (("kill", SECOND), "revive", SECOND, 150 * MS, "drive 2 (front right)"),
    "emergency": (("emcy", SECOND), None, None, 0, "EMCY 0x7500"),
    "silent velocity": (("silence", SECOND), "well", None, 50 * MS, "reports no velocity"),
    "started anew": (("boot", SECOND), None, None, 0, "has restarted"),
    "bus quiet": (("quiet", True), "well", None, 150 * MS, ""),
    "foam touched": (("touch", 0.7), "release", None, 0, "bumper: touched at front left"),
    "line cut": (("line", None), "unlatch", None, 20 * MS, "line"),
    "frames of the bumper stay away": (("mute", True), "well", None, 60 * MS, "bumper: no frames"),
    "wrong counter": (("jump", 5), None, None, 20 * MS, "bumper: the counter jumps"),
    "counter stands": (("stalled", True), "well", None, 20 * MS, "the counter stands still"),
    "wrong check sum": (("bad_check", True), "well", None, 20 * MS, "bumper: wrong check sum"),
    "self-test failed": (("untested", True), "well", None, 20 * MS, "self-test"),
}


def fault_and_recovery(made, case, velocity):
    """Cycles until all drives brake; then nothing moves until it is acknowledged."""
    (name, value), mend, mended, gate_ns, text = FAULTS[case]
    made.cycle(velocity, 30)
    assert not made.stands()
    made.nodes.fault(name, value)
    cycles = made.cycles_until(lambda: "enabled" not in made.states(), velocity)
    assert cycles * CYCLE_NS <= gate_ns + 2 * CYCLE_NS, (case, cycles)
    made.cycle(velocity)
    assert text in made.base.fault
    made.cycles_until(made.stands, velocity)
    for _ in range(30):
        made.cycle(velocity)
        assert made.stands()
    if mend is not None:
        assert not made.base.acknowledge()
        made.nodes.fault(mend, mended)
        made.nodes.fault("unlatch")
    made.cycle(velocity, 20)
    assert made.stands()
    assert made.base.fault is not None
    assert made.acknowledge(), made.base.fault
    made.cycle(STILL, 5)
    assert made.stands()
    made.cycle(velocity, 20)
    assert not made.stands()
    assert made.base.fault is None
    return cycles


@pytest.mark.requirement(4, 5, 49)
@pytest.mark.parametrize("case", FAULTS)
@pytest.mark.few(6)
def test_a_fault_stops_all_drives_in_time_and_nothing_moves_until_it_is_acknowledged(case):
    with rig() as made:
        fault_and_recovery(made.ready(), case, AHEAD)


@pytest.mark.slow
@pytest.mark.parametrize("case", FAULTS)
def test_faults_at_twenty_moments(case):
    chance = random.Random(7)
    with rig() as made:
        made.ready()
        found = []
        for _ in range(20):
            made.cycle(AHEAD, chance.randrange(30))
            made.pass_time(chance.randrange(0, 5) * 2 * MS)
            turn = Twist2(
                chance.uniform(0.2, 0.8), chance.uniform(-0.5, 0.5), chance.uniform(-1, 1)
            )
            found.append(fault_and_recovery(made, case, turn))
        LOG.info("%s: cycles until all brake %s", case, sorted(found))


@pytest.mark.requirement(4, 5)
def test_a_touch_is_an_event_with_its_bearing_and_brakes_within_two_cycles():
    with rig() as made:
        made.ready().cycle(AHEAD, 20)
        made.base.hits()
        made.nodes.fault("touch", -math.pi / 2)
        made.cycle(AHEAD, 2)
        assert [hit.bearing for hit in made.base.hits()] == [pytest.approx(-math.pi / 2)]
        assert made.base.fault == "bumper: touched at right"
        assert {drive.value(0x60FF) for drive in made.nodes.drives.values()} == {0}
        assert "enabled" not in made.states()
        made.cycle(AHEAD, 10)
        assert made.base.hits() == []  # it is still pressed


def test_no_reset_of_ours_closes_the_line_and_without_it_nothing_is_acknowledged():
    with rig() as made:
        made.ready()
        made.nodes.fault("touch", 0.0)
        made.cycle(AHEAD, 5)
        made.nodes.fault("release")
        for _ in range(40):
            made.cycle(AHEAD)
            assert not made.base.acknowledge()
        assert made.nodes.board.opened
        made.nodes.fault("unlatch")
        made.cycle(AHEAD, 20)
        assert made.stands()
        assert made.acknowledge()
        assert not made.nodes.board.latched


def test_a_touch_that_does_not_open_the_line_is_told():
    with rig() as made:
        made.ready()
        made.nodes.fault("welded", True)
        made.nodes.fault("touch", 0.0)
        made.cycle(AHEAD, 10)
        assert made.base.fault == "bumper: touched at front"
        assert not made.base.acknowledge()
        assert "disagree" in made.base._bumper.cause


@pytest.mark.requirement(49)
def test_drives_whose_master_is_silent_brake_by_themselves_within_a_tenth_of_a_second():
    with rig() as made:
        made.ready().cycle(AHEAD, 30)
        silent_since = made.now_ns - CYCLE_NS  # the instant of the last cycle
        while "enabled" in made.states():
            made.pass_time(2 * MS)
            assert made.now_ns - silent_since <= 100 * MS
        made.pass_time(400 * MS)
        assert made.stands()
        made.cycle(AHEAD, 100)
        assert made.stands()  # the master is back: it has to ask the operator
        assert made.base.fault is not None
        assert made.acknowledge()


def test_a_stop_brakes_by_the_drives_and_holds_until_it_is_acknowledged():
    with rig() as made:
        made.ready().cycle(AHEAD, 50)
        rates = wheel_rates(made)
        made.base.stop()
        cycles = made.cycles_until(made.stands, AHEAD)
        radius = MODEL.wheel_radius
        most = max(map(abs, rates)) * radius / MODEL.brake_deceleration
        assert cycles * 1e-9 * CYCLE_NS <= most + 0.02
        made.cycle(AHEAD, 50)
        assert made.stands()
        assert made.acknowledge()
        made.cycle(AHEAD, 20)
        assert not made.stands()


def test_drives_that_all_start_anew_tell_their_way_again_before_anybody_acknowledges():
    with rig() as made:
        made.ready().cycle(AHEAD, 50)
        for node in WHEELS["nodes"]:
            made.nodes.fault("boot", node)
        made.cycle(AHEAD, 60)
        stamp, odometry = made.base.odometry
        assert made.now_ns - stamp < 5 * CYCLE_NS
        assert odometry.twist == STILL
        assert made.stands()
        assert made.acknowledge()


def test_a_drive_that_leaves_operation_takes_the_others_with_it():
    with rig() as made:
        made.ready().cycle(AHEAD, 20)
        made.nodes.drives[4].state = "disabled"
        made.cycle(AHEAD, 2)
        assert made.base.fault == "drive 4 (rear right): is in 'switch on disabled'"
        assert "enabled" not in made.states()


def test_a_drive_that_tells_the_same_velocity_for_ever_is_found_by_the_other_three():
    with rig() as made:
        made.ready().cycle(AHEAD, 50)
        made.nodes.fault("stick", 1)
        made.cycles_until(lambda: made.base.fault is not None, STILL, most=100)
        assert made.base.fault.startswith("the wheels disagree")


def test_the_way_goes_on_being_told_when_one_drive_is_dead():
    with rig() as made:
        made.ready().cycle(Twist2(1.0), 60)
        made.nodes.fault("kill", 3)
        made.cycle(Twist2(1.0), 10)
        before = made.base.odometry[0]
        made.cycle(Twist2(1.0), 30)
        stamp, odometry = made.base.odometry
        assert stamp - before == 30 * CYCLE_NS
        assert odometry.twist.speed < 0.01


def test_frames_of_a_wrong_length_are_passed_over():
    with rig() as made:
        made.ready().cycle(AHEAD, 20)
        made.nodes.fault("cut", 8)
        made.cycle(AHEAD, 10)
        assert made.base.fault is None
        for identifier in (0x701, 0x81, 0x181, 0x581, 0x110):
            made.wire.send(can.Message(arbitration_id=identifier, is_extended_id=False))
        made.cycle(AHEAD, 2)
        assert made.base.fault == "bumper: wrong check sum"


def test_a_bus_that_was_off_stops_the_wheels():
    with rig() as made:
        made.ready().cycle(AHEAD, 10)
        made.wire.send(can.Message(is_error_frame=True, arbitration_id=0x40, is_extended_id=False))
        made.cycle(AHEAD, 2)
        assert "bus-off" in made.base.fault
        made.cycles_until(made.stands, AHEAD)
        assert made.acknowledge()


def test_one_error_frame_stops_nothing_and_is_told_and_many_stop():
    with rig() as made:
        made.ready().cycle(AHEAD, 10)
        made.base.remarks()
        made.nodes.fault("error", 0x80)
        made.cycle(AHEAD, 20)
        assert made.base.fault is None
        assert not made.stands()
        [remark] = made.base.remarks()
        assert "error frame (bus error)" in remark
        for _ in range(16):
            made.nodes.fault("error", 0x80)
        made.cycle(AHEAD, 2)
        assert "more than 16 error frames in 1 s" in made.base.fault
        made.cycles_until(made.stands, AHEAD)
        assert not made.base.acknowledge()
        made.cycle(AHEAD, 110)
        assert made.acknowledge()


@pytest.mark.parametrize("rtr", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_drives_without_remote_requests_are_set_up_like_others(rtr):
    with rig(traits=Traits(rtr=rtr)) as made:
        made.ready().cycle(AHEAD, 30)
        assert not made.stands()
        own = 0 if rtr else 0x4000_0000
        for number, drive in made.nodes.drives.items():
            assert drive.value(0x1800, 1) == own | 0x180 + number
            assert drive.value(0x1400, 1) == own | 0x200 + number


@pytest.mark.parametrize("lacking", sorted(OPTIONAL))
@pytest.mark.slow
def test_what_drives_may_lack_is_told_and_they_drive(lacking):
    with rig(traits=Traits(lacks=frozenset((lacking,)))) as made:
        [remark] = made.base.remarks()
        assert "drive 2 (front right), drive 3 (rear left)" in remark
        assert f": no object 0x{lacking:04X}: " in remark
        made.ready().cycle(AHEAD, 20)
        assert not made.stands()


@pytest.mark.parametrize("lacking", sorted(REMEDIES))
@pytest.mark.few(1)
def test_what_must_be_made_up_for_is_refused_until_the_connection_accepts_it(lacking):
    traits = Traits(lacks=frozenset((lacking,)))
    with pytest.raises(OSError, match=r"drive \d .*: has no object") as refused:
        Rig(traits=traits)
    assert f"without: [0x{lacking:04X}]" in str(refused.value)
    with rig(traits=traits, wheels=WHEELS | {"without": [f"0x{lacking:04X}"]}) as made:
        [remark] = made.base.remarks()
        assert f": no object 0x{lacking:04X}: accepted: " in remark
        made.ready().cycle(AHEAD, 20)
        assert not made.stands()


@pytest.mark.slow
def test_what_is_accepted_to_be_lacking_is_written_where_it_is_there():
    with rig(wheels=WHEELS | {"without": [0x6007]}) as made:
        assert made.base.remarks() == []
        assert {drive.value(0x6007) for drive in made.nodes.drives.values()} == {3}


RPM = {name: value for name, value in WHEELS.items() if name != "increments"}


@pytest.mark.parametrize(("unit", "per_turn"), [("rpm", 60.0), ("0.1 rpm", 600.0), ("mrpm", 6e4)])
@pytest.mark.few(1)
def test_drives_that_count_revolutions_turn_as_fast_as_others(unit, per_turn):
    with rig(traits=Traits(unit=unit), wheels=RPM | {"unit": unit}) as made:
        made.ready().cycle(AHEAD, 100)
        scale = WHEELS["gear"] * per_turn / math.tau
        signed = zip(WHEELS["signs"], made.nodes.velocities(), strict=True)
        wanted = Mecanum.of(MODEL).rates(AHEAD)
        assert [s * v / scale for s, v in signed] == pytest.approx(wanted, abs=0.51 / scale)
        assert made.base.odometry[1].twist.vx == pytest.approx(AHEAD.vx, abs=2e-3)
        ramp = math.sqrt(2.0) * MODEL.brake_deceleration / MODEL.wheel_radius * scale
        assert made.nodes.drives[1].value(0x6085) == pytest.approx(ramp, abs=0.5)


@pytest.mark.parametrize(("theirs", "ours"), [("rpm", "increments/s"), ("0.1 rpm", "rpm")])
@pytest.mark.few(1)
def test_drives_that_count_in_another_unit_are_refused(theirs, ours):
    told = f"counts velocities in {theirs}, and wheels: unit: is '{ours}'"
    with pytest.raises(OSError, match=told):
        Rig(traits=Traits(unit=theirs), wheels=WHEELS | {"unit": ours})


def test_drives_of_a_unit_that_is_not_known_are_refused():
    told = "counts velocities in an unknown unit (object 0x60A9: 0x00B40300; 0x00B50300 is incr"
    with pytest.raises(OSError, match=re.escape(told)):
        Rig(traits=Traits(unit="rev/s"))
    with rig(traits=Traits(unit="not told")) as made:
        made.ready()


@pytest.mark.parametrize("identifier", [0x00, 0x80, 0x77F])
def test_another_master_on_the_bus_stops_the_wheels(identifier):
    with rig() as made:
        made.ready().cycle(AHEAD, 10)
        made.wire.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=[5, 99]))
        made.cycle(AHEAD, 2)
        assert "another master drives there" in made.base.fault
        assert not made.base.acknowledge()
        made.cycle(AHEAD, 110)
        assert made.stands()
        assert made.acknowledge()


def test_a_second_driver_at_the_same_bus_is_refused_and_the_first_goes_on():
    with rig() as made:
        made.ready()
        speaker = can.Bus(ignore_config=True, **made.bus)
        task = speaker.send_periodic(
            can.Message(arbitration_id=0x80, is_extended_id=False, data=b""), 0.01
        )
        try:
            with pytest.raises(OSError, match="another master drives there"):
                CanBase(MODEL, made.bus, WHEELS)
        finally:
            task.stop()
            speaker.shutdown()


def test_a_drive_that_does_not_answer_is_named_with_its_wheel():
    with pytest.raises(OSError, match=r"drive 3 \(rear left\): does not answer"):
        Rig(prepare=lambda nodes: nodes.fault("kill", 3))


def test_a_bumper_that_was_touched_before_the_start_has_to_be_acknowledged():
    def touched(nodes):
        nodes.fault("touch", 0.0)
        nodes.fault("release")
        nodes.fault("unlatch")

    with rig(prepare=touched) as made:
        made.cycle(AHEAD, 100)
        assert made.stands()
        assert made.base.fault == "bumper: the board has latched a touch"
        assert made.acknowledge()


def test_quick_stop_ramps_of_the_drives_brake_the_base_no_weaker_than_its_file_says():
    with rig() as made:
        made.ready()
        scale = WHEELS["gear"] * WHEELS["increments"] / math.tau
        for drive in made.nodes.drives.values():
            ramp = drive.value(0x6085) * MODEL.wheel_radius / scale
            assert ramp == pytest.approx(math.sqrt(2.0) * MODEL.brake_deceleration, rel=1e-4)
            assert drive.value(0x6084) == drive.value(0x6085)
            assert drive.value(0x1016, 1) == 127 << 16 | 80
            assert drive.value(0x1017) == 50
            assert (drive.value(0x605A), drive.value(0x6007)) == (2, 3)


def test_closing_stands_and_switches_off():
    made = Rig()
    made.ready().cycle(Twist2(1.0), 50)
    made.close()
    assert made.stands()
    assert made.states() == {"disabled"}


@pytest.mark.parametrize(
    ("entry", "text"),
    [
        ({}, "'nodes' is missing"),
        ({"nodes": [1, 2, 3]}, "four different numbers"),
        ({"nodes": [1, 2, 3, 3]}, "four different numbers"),
        ({"nodes": [1, 2, 3, 4], "signs": [1, 1, 1, 2]}, "four times 1 or -1"),
        ({"nodes": [1, 2, 3, 4], "gear": 0.0}, "above 0"),
        ({"nodes": [1, 2, 3, 4], "master": 3}, "no drive has"),
        ({"nodes": [1, 2, 3, 4], "silence": 0.5}, "0.03 to 0.1 s"),
        ({"nodes": [1, 2, 3, 4], "geer": 3}, "'geer' is not known"),
        ({"nodes": [1, 2, 3, 4], "unit": "rad/s"}, "there are increments/s, rpm, 0.1 rpm, mrpm"),
        ({"nodes": [1, 2, 3, 4], "without": [0x60FF]}, "what may be lacking: 0x1016, "),
        ({"nodes": [1, 2, 3, 4], "without": 0x6007}, "without 24583: a list"),
        ({"nodes": [1, 2, 3, 4], "without": ["ramp"]}, "without .'ramp',.: a list; what may be"),
        ({"nodes": [1, 2, 3, 4], "unit": "rpm", "gear": 0.5}, "one step is 0.027 m/s at the rim"),
        ({"nodes": [1, 2, 3, 4], "unit": "mrpm", "gear": 1e5}, "no object holds numbers as large"),
    ],
)
def test_wrong_entries_are_told(entry, text):
    with pytest.raises(ValueError, match=text):
        CanBase(MODEL, {"interface": "virtual", "channel": "none"}, entry)


def test_the_way_of_a_turn_is_an_arc():
    assert along(Pose2(0.0, 0.0), Twist2(1.0, 0.0, math.pi), 0.5).x == pytest.approx(1 / math.pi)
