"""Arm, gripper and force sensor together: a cup is picked up, carried, and put down by feel."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from behaviors.profile.profile import load_profile
from engine.state import State
from hw.geometry import Pose3
from hw.model.robot import MotionLimits, load_robot
from hw.samples import EXACT
from hw.scene.items import Graspable
from hw.scene.scene import load_scene
from hw.sim.mock import mock_world
from hw.sim.world import World
from states.arm.states import MoveArmJoints, MoveArmTo, ParkArm
from states.gripper.states import CloseGripper, OpenGripper, WaitForForce
from tests.states.conftest import step

HZ = 30
ROBOT = load_robot("rbkairos_ur10_gripper")
HALL = load_scene("hall")
ON_FLOOR = HALL.robot_start.upright()
TABLE = 0.65
CUP = Graspable("cup", ON_FLOOR.transform(0.8, 0.1, TABLE + 0.05), 0.06, mass=0.4, height=0.1)
SCENE = replace(HALL, items=(CUP,))
READY = (0.0, -1.57, 1.57, -1.57, -1.57, 0.0)


def simulated() -> World:
    return World(SCENE, ROBOT, None, MotionLimits(2.0, 2.0, 5.0))


def mocked() -> World:
    return mock_world(SCENE, ROBOT, None)


def above(y: float, height: float) -> Pose3:
    """The tool 80 cm ahead of the robot, so high above the table, pointing down."""
    return Pose3.written(0.8, y, TABLE + height, pitch=-math.pi / 2)


class Cell:
    """A world whose states are stepped by hand; the first state that ends ends all."""

    def __init__(self, world: World, context: Any) -> None:
        self.world, self.n = world, 0
        environment = load_profile("tuned").environment(HALL.room, ROBOT)
        values = {"environment": environment, "base.pose_sigma": EXACT}
        self.ctx = context(values, dict(world.parts))

    def run(self, *states: tuple[State, dict[str, Any]], seconds: float = 30.0) -> Any:
        runs: list[Any] = [state.run(self.ctx, **inputs) for state, inputs in states]
        for _ in range(round(seconds * HZ)):
            self.ctx.now = now = self.n * 10**9 // HZ
            self.n += 1
            self.world.advance(now)
            for part in self.world.parts.values():
                for one in part.samples(now):
                    self.ctx.values[one.name], self.ctx.stamps[one.name] = one.value, now
            for run in runs:
                outcome = step(run)
                if outcome is not None:
                    for other in runs:
                        other.close()
                    return outcome
        return None

    def cup(self) -> tuple[float, float, float]:
        """Where it is, in the rover's frame."""
        x, y, z = ON_FLOOR.inverse().transform(*self.world.items["cup"])
        return round(x, 3), round(y, 3), round(z, 3)


@pytest.mark.requirement(43, 150)
@pytest.mark.parametrize("made", [simulated, mocked])
def test_a_cup_is_picked_up_carried_and_put_down_where_it_is_felt(
    made: Callable[[], World], context: Any
) -> None:
    cell = Cell(made(), context)

    def moved(y: float, height: float) -> Any:
        return MoveArmTo(frame="rover"), {"goal": above(y, height)}

    assert cell.run((OpenGripper(), {})) == "opened"
    assert cell.run(moved(0.1, 0.25)) == "arrived"
    assert cell.run((CloseGripper(), {})) == "empty"  # nothing is up here
    assert cell.run((OpenGripper(), {})) == "opened"
    assert cell.run(moved(0.1, 0.05)) == "arrived"
    assert cell.run((CloseGripper(), {})) == "holding"
    assert cell.run(moved(0.1, 0.25)) == "arrived"
    assert cell.cup() == pytest.approx((0.8, 0.1, TABLE + 0.25), abs=0.003)

    assert cell.run(moved(-0.2, 0.25)) == "arrived"
    felt = cell.run((WaitForForce(limit=15.0, along="z"), {}), moved(-0.2, 0.0))
    assert felt == "felt"  # the arm would have gone on into the table
    assert cell.run((OpenGripper(), {})) == "opened"
    put_down = cell.cup()  # somewhere on the way, which is straight in the joints only
    assert put_down[2] == pytest.approx(TABLE + 0.05)
    assert put_down[:2] == pytest.approx((0.8, -0.2), abs=0.02)

    assert cell.run(moved(-0.2, 0.25)) == "arrived"
    assert cell.run((MoveArmJoints(READY), {})) == "arrived"
    assert cell.run((ParkArm(), {})) == "parked"
    assert cell.cup() == put_down
