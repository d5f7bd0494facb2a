"""What a lab meets on its first day: each has its words, beside the fakes."""

from __future__ import annotations

import errno
import os
import re
import time
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec

import can
import pytest

from hw.drivers.can.bus import CanBus
from hw.drivers.ur.ur_arm import MISSING, UrArm
from hw.fakes.can.drive import Traits
from hw.fakes.peers import Cb3
from tests.hw.drivers.can.can_rig import WHEELS, Rig, rig
from tests.hw.drivers.kairos import test_kairos as kairos
from tests.hw.drivers.rigs import opening, own_address
from tests.hw.drivers.sick import test_s300 as s300
from tests.hw.drivers.ur.ur_rig import PARKED, ROBOT

CAN0 = {"interface": "socketcan", "channel": "can0", "bitrate": 500_000}
TTY = {"interface": "slcan", "channel": "/dev/ttyACM7"}


def refused(act):
    """What is said instead."""
    with pytest.raises((OSError, ValueError)) as told:
        act()
    return str(told.value)


def scanner(fault, value, stack, patched):
    made = s300.Rig()
    stack.callback(made.close)
    made.fake.fault(fault, value)
    made.listener.until(lambda: made.part.fault is not None, made.tell)
    return made.part.fault


def drives(traits, stack, patched):
    return refused(lambda: Rig(traits=traits))


def drives_that_start(traits, wheels, stack, patched):
    made = stack.enter_context(rig(traits=traits, wheels=WHEELS | wheels))
    made.ready()
    return "; ".join(made.base.remarks()) or "nothing"


def error_frame(stack, patched):
    made = stack.enter_context(rig())
    made.ready().nodes.fault("error", 0x80)
    made.cycle(count=2)
    assert made.base.fault is None
    return "; ".join(made.base.remarks())


def controller(fault, value, stack, patched):
    host = own_address()
    fake = Cb3(host, joints=PARKED)
    stack.callback(fake.close)
    fake.wait()
    fake.fault(fault, value)
    arm = UrArm(host, opening(ROBOT), time.monotonic_ns)
    stack.callback(arm.close)
    return refused(arm.wait)


def jerky_arm(stack, patched):
    servo = {"lookahead": 0.5}
    return refused(lambda: UrArm("127.0.0.1", opening(ROBOT), time.monotonic_ns, servo=servo))


def robot(fault, value, stack, patched):
    made = stack.enter_context(kairos.Rig())
    for _ in range(60):  # until its clock is known
        made.cycle()
    made.fake.fault(fault, value)
    made.until(lambda: made.base.fault is not None)
    return made.base.fault


def late(stack, patched):
    made = stack.enter_context(kairos.Rig())
    made.fake.fault("late")
    made.until(lambda: not made.base.acknowledge() and "late" in made.base.fault)
    return made.base.fault


def unlatched(stack, patched):
    patched.setattr("hw.drivers.kairos.kairos_link.FIRST_S", 0.5)
    return stack.enter_context(kairos.Rig(fault=("unlatched",))).base.fault


def device(number, settings, stack, patched):
    def nothing(**_):
        raise OSError(number, os.strerror(number))

    patched.setattr(can, "Bus", nothing)
    return refused(lambda: CanBus(settings))


LACKS = Traits(lacks=frozenset((0x6007,)))
RPM = {"unit": "rpm"}
DAYS = {
    "scanner in standby": (
        partial(scanner, "standby", None),
        "front_laser: in standby (status 0x0000): an input of its own, or its controller, has to",
    ),
    "scanner locked out": (
        partial(scanner, "lockout", None),
        "front_laser: locked out (status 0x0001): it has found a fault of its own",
    ),
    "scanner with other beams": (
        partial(scanner, "beams", 381),
        "front_laser: it sends 381 distances, and the robot file says 541 beams: correct it, or",
    ),
    "drive that lacks an object": (
        partial(drives, LACKS),
        "drive 1 (front left): has no object 0x6007:0: without its master it may drive on: set its "
        "reaction to a lost link to quick stop with its maker's tool, then accept that (wheels: "
        "without: [0x6007])",
    ),
    "drive that lacks it, accepted": (
        partial(drives_that_start, LACKS, {"without": [0x6007]}),
        "drive 4 (rear right): no object 0x6007: accepted: without its master it may drive on: set",
    ),
    "drive without remote requests": (
        partial(drives_that_start, Traits(rtr=False), {}),
        "nothing",
    ),
    "drive that counts rpm": (
        partial(drives, Traits(unit="rpm")),
        "drive 1 (front left): counts velocities in rpm, and wheels: unit: is 'increments/s'",
    ),
    "drive that counts rpm, written": (
        partial(drives_that_start, Traits(unit="rpm"), {"unit": "rpm"}),
        "nothing",
    ),
    "one error frame": (error_frame, "error frame (bus error); look at plugs, bit rate and"),
    "CAN interface down": (
        partial(device, errno.ENETDOWN, CAN0),
        "it is down: sudo ip link set can0 up type can bitrate 500000",
    ),
    "CAN adapter not plugged in": (
        partial(device, errno.ENODEV, CAN0),
        "there is no such interface: is its adapter plugged in? `ip link` lists them",
    ),
    "no right to a serial device": (
        partial(device, errno.EACCES, TTY),
        "no right to it: sudo usermod -aG dialout $USER, then log in again",
    ),
    "PolyScope of before": (
        partial(controller, "version", (3, 2, 18744, 0)),
        "has PolyScope 3.2.18744.0; 3.4 is needed at least: update it",
    ),
    "bring-up drives the arm, too": (
        partial(controller, "program", "external_control.urp"),
        "another program drives the arm (PLAYING external_control.urp): end it; if the robot's own "
        "bring-up drives the arm, too, as that of an RB-KAIROS does, start it without the arm's",
    ),
    "jerky arm": (jerky_arm, "servo: lookahead: 0.5: 0.03 to 0.2"),
    "gap in the WLAN": (
        partial(robot, "mute", None),
        "ms old: nothing comes any more; is it the WLAN, or does the robot's PC hang?",
    ),
    "messages that come late": (
        late,
        "ms old: its messages come late; is it the WLAN, or the robot's PC?",
    ),
    "clock set back": (partial(robot, "clock", -3.2), "was set back by 3.2 s; it counts again"),
    "clock set forward": (
        partial(robot, "clock", 3600.0),
        "was set forward by 3600.0 s; it counts",
    ),
    "emergency stop not latched": (
        unlatched,
        "which counts as stopped; if it tells changes only, press and release the button",
    ),
}
NEEDS = {controller: "rtde_control", jerky_arm: "rtde_control", robot: "roslibpy", late: "roslibpy"}


@pytest.mark.requirement(48, 49)
@pytest.mark.parametrize("case", DAYS)
@pytest.mark.slow
def test_what_a_lab_meets_has_its_words(case, monkeypatch):
    act, words = DAYS[case]
    needed = NEEDS.get(getattr(act, "func", act))
    if needed is not None and find_spec(needed) is None:
        pytest.skip(MISSING)
    with ExitStack() as stack:
        assert re.search(re.escape(words), act(stack, monkeypatch))
