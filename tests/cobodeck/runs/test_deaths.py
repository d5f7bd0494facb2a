"""Each process of a run on fakes is killed or halted while the robot drives, and named in time."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from hw.geometry import Twist2
from hw.model.robot import MotionLimits, load_robot
from hw.safety.limits import SafetyLimits
from hw.scene.scene import load_scene
from tests.hw.fakes_rig import FakesRig
from tests.repeats import fewer

pytestmark = pytest.mark.realtime

AHEAD = Twist2(0.2, 0.0, 0.0)
WITHIN = 30
"""Ticks in a second."""
NAMES = {
    "ChainLink": "the safety chain",
    "Unity": "the VR server",
    "UrArm": "the arm's process",
    "WorldPeer": "the world of the fakes",
    "Cb3": "the fake UR controller",
    "CanNodes": "the fake CAN nodes",
    "S300Peer": "the fake scanners",
    "VrClient": "the fake VR application",
}
HOW = {
    signal.SIGKILL: "has ended (killed by signal 9, SIGKILL)",
    signal.SIGSTOP: "is halted by a signal",
}


@pytest.fixture
def rig() -> Iterator[FakesRig]:
    robot, motion = load_robot("rbkairos_ur10"), MotionLimits(1.0, 2.0)
    made = FakesRig(robot, load_scene("lab_a"), motion, SafetyLimits.of(robot, motion))
    yield made
    made.close()


@pytest.mark.slow
@pytest.mark.requirement(48, 149)
@pytest.mark.parametrize("number", HOW, ids=lambda number: number.name)
@pytest.mark.parametrize("kind", fewer([*NAMES], 3))
def test_a_process_that_dies_or_is_halted_while_driving_is_named_within_a_second(
    rig: FakesRig, kind: str, number: signal.Signals
) -> None:
    opened = {type(one).__name__: one for one in (*rig.plant.beside, *rig.parts.values())}
    said = f"{NAMES[kind]} {HOW[number]}"
    rig.drive(AHEAD, 15)
    assert rig.parts["stop_line"].reason is None, rig.told
    os.kill(opened[kind].pid, number)
    begin = rig.n
    try:
        while not any(said in text for text in rig.told):
            rig.drive(AHEAD, 1)
            assert rig.n - begin <= WITHIN, rig.told
        assert rig.parts["stop_line"].reason is not None
        assert not rig.parts["stop_line"].reset()
        assert NAMES[kind] in str(rig.parts["stop_line"].why)
    finally:
        if number == signal.SIGSTOP:
            os.kill(opened[kind].pid, signal.SIGKILL)
