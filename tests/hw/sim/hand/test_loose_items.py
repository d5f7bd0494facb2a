"""Items that are picked up, carried and put down, and a tool that is pushed into a surface."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hw.geometry import Pose2, Pose3
from hw.model.robot import RobotModel, load_robot
from hw.samples import GripperState, Joints, WrenchReading
from hw.scene.items import SURFACE, Graspable
from hw.scene.scene import load_scene
from hw.sim.hand.loose_items import GRAVITY, STIFFNESS, TOLERANCE
from hw.sim.mock import MockArm, mock_hand
from hw.sim.sim_arm import SimArm
from hw.sim.world import World
from states.arm.description.robot_arm import manipulator_of
from states.arm.kinematics.kinematics import pose_matrix
from states.arm.planning.planning import goals_at

ROBOT = load_robot("rbkairos_ur10_gripper")
HALL = load_scene("hall")
BASE = HALL.robot_start
HZ = 30
ABOVE = 0.3
DOWN = -math.pi / 2


def on_rover(x: float, y: float, z: float) -> tuple[float, float, float]:
    return BASE.upright().transform(x, y, z)


CUP = Graspable("cup", on_rover(0.8, 0.1, 0.7), width=0.06, height=0.1, mass=0.4)
BOX = Graspable("box", on_rover(0.8, -0.2, 0.7), width=0.05, mass=1.0)
WEIGHT = GRAVITY * CUP.mass


def joints_at(pose: Pose3, near: Joints, robot: RobotModel = ROBOT) -> Joints:
    """The joints with the tool at rover_from_tcp, near others."""
    found = goals_at(manipulator_of(robot), pose_matrix(pose), near)
    least = min(found, key=lambda joints: np.abs(joints - near).max())
    return tuple(least.tolist())


def tool(x: float, y: float, z: float, roll: float = 0.0) -> Pose3:
    """Above this place of the rover's frame, pointing down."""
    return Pose3.written(x, y, z, roll, DOWN)


AT_CUP = joints_at(tool(0.8, 0.1, 0.7), (0.0, -1.2, 1.8, -2.2, -1.57, 0.0))


class Cell:
    """A world with items whose arm begins at the cup, stepped at 30 Hz."""

    def __init__(
        self,
        *items: Graspable,
        joints: Joints = AT_CUP,
        robot: RobotModel = ROBOT,
        mocked: bool = False,
    ) -> None:
        assert robot.arm is not None
        assert robot.prop is not None
        arm = (MockArm if mocked else SimArm)(robot.arm, joints)
        hand = mock_hand(robot.prop) if mocked else None
        scene = replace(HALL, items=items or (CUP,))
        self.world = World(scene, robot, None, arm=arm, hand=hand)
        self.parts: Any = self.world.parts
        self.values: dict[str, Any] = {}
        self.n = 0
        self.ticks(1)

    def ticks(self, count: int) -> None:
        for _ in range(count):
            now = self.n * 10**9 // HZ
            self.world.advance(now)
            for part in self.parts.values():
                self.values |= {one.name: one.value for one in part.samples(now)}
            self.parts["base"].tick(now)
            self.n += 1

    def close(self, opening: float | None = 0.0) -> GripperState:
        self.parts["gripper"].open_to(opening)
        self.ticks(30)
        found: GripperState = self.values["gripper.state"]
        return found

    def move(self, to: Pose3) -> None:
        here = self.parts["arm"].state.joints
        there = joints_at(to, here)
        seconds = 0.1 + max(abs(a - b) for a, b in zip(here, there, strict=True))
        self.parts["arm"].follow([(0.0, here), (seconds, there)])
        self.ticks(round(seconds * HZ) + 3)
        assert self.parts["arm"].state.joints == pytest.approx(there)

    @property
    def reading(self) -> WrenchReading:
        found: WrenchReading = self.values["wrench.reading"]
        return found


@pytest.mark.requirement(150)
@pytest.mark.parametrize("mocked", [False, True])
def test_fingers_hold_what_they_close_around_and_carry_it(mocked: bool) -> None:
    cell = Cell(CUP, BOX, mocked=mocked)
    assert cell.world.items == {"cup": CUP.at, "box": BOX.at}

    assert cell.close() == GripperState(CUP.width, holding=True)
    cell.move(tool(0.7, -0.3, 0.7 + ABOVE))

    assert cell.world.items["cup"] == pytest.approx(on_rover(0.7, -0.3, 0.7 + ABOVE), abs=1e-6)
    assert cell.world.items["box"] == BOX.at


@pytest.mark.requirement(150)
def test_what_is_held_weighs_on_the_flange_wherever_it_points() -> None:
    cell = Cell()
    assert cell.reading == WrenchReading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    cell.close()
    assert cell.reading.force == pytest.approx((0.0, 0.0, WEIGHT))  # the flange's z points down
    assert cell.reading.torque == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)

    cell.move(Pose3.written(0.7, 0.1, 1.0, yaw=math.pi))  # it points ahead, level
    x, y, z = cell.reading.force
    assert math.hypot(x, y) == pytest.approx(WEIGHT)
    assert z == pytest.approx(0.0, abs=1e-6)
    assert math.hypot(*cell.reading.torque) == pytest.approx(0.2 * WEIGHT)  # 20 cm ahead of it


@pytest.mark.requirement(150)
@pytest.mark.parametrize("mocked", [False, True])
@pytest.mark.parametrize(
    ("place", "height"),
    [((0.7, -0.1), 0.7), ((0.8, 0.1 - SURFACE - 0.05), CUP.half_height)],
)
def test_what_is_let_go_falls_onto_the_surface_below_it(
    place: tuple[float, float], height: float, mocked: bool
) -> None:
    cell = Cell(mocked=mocked)
    cell.close()
    cell.move(tool(*place, 0.9))

    assert cell.close(None) == GripperState(0.085)

    assert cell.world.items["cup"] == pytest.approx(on_rover(*place, height), abs=1e-6)
    assert cell.reading == WrenchReading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert cell.close() == GripperState(0.0)  # it is not between the fingers any more


def test_what_is_put_down_can_be_picked_up_again() -> None:
    cell = Cell()
    cell.close()
    cell.move(tool(0.75, 0.0, 0.705))
    cell.close(None)
    assert cell.world.items["cup"] == pytest.approx(on_rover(0.75, 0.0, 0.7), abs=1e-6)

    assert cell.close() == GripperState(CUP.width, holding=True)
    cell.move(tool(0.75, 0.0, 0.9))
    assert cell.world.items["cup"] == pytest.approx(on_rover(0.75, 0.0, 0.895), abs=1e-6)


@pytest.mark.parametrize(("away", "holding"), [(0.9, True), (1.1, False)])
def test_what_is_too_far_from_the_tool_is_not_held(away: float, holding: bool) -> None:
    beside = tool(0.8 + away * TOLERANCE, 0.1, 0.7)

    assert Cell(joints=joints_at(beside, AT_CUP)).close().holding == holding


@pytest.mark.parametrize(("width", "holding"), [(0.084, True), (0.086, False)])
def test_what_is_wider_than_the_fingers_are_open_is_not_held(width: float, holding: bool) -> None:
    assert Cell(replace(CUP, width=width)).close().holding == holding


def test_a_prop_held_from_the_start_is_no_item_of_the_scene() -> None:
    robot = load_robot("rbkairos_ur10", prop="gripped")
    joints = joints_at(tool(0.8, 0.1, 0.7), AT_CUP, robot)
    cell = Cell(joints=joints, robot=robot)
    assert cell.close() == GripperState(0.05, holding=True)
    assert cell.reading.force == (0.0, 0.0, 0.0)

    cell.close(None)
    assert cell.close() == GripperState(CUP.width, holding=True)


@pytest.mark.requirement(150)
def test_a_tool_that_is_pushed_into_a_surface_presses_on_the_sensor() -> None:
    cell = Cell()
    cell.move(tool(0.9, 0.3, CUP.surface - BASE.upright().z + 0.001))
    assert cell.reading.force == (0.0, 0.0, 0.0)

    cell.move(tool(0.9, 0.3, CUP.surface - 0.01))
    assert cell.reading.force == pytest.approx((0.0, 0.0, -0.01 * STIFFNESS))
    cell.parts["wrench"].zero()
    cell.move(tool(0.9, 0.3, CUP.surface - 0.012))
    assert cell.reading.force == pytest.approx((0.0, 0.0, -0.002 * STIFFNESS))


def test_a_held_item_that_is_pressed_down_carries_its_weight_first() -> None:
    cell = Cell()
    cell.close()
    cell.move(tool(0.8, 0.0, 0.75))
    cell.move(tool(0.8, 0.0, 0.7 - 0.004))

    assert cell.reading.force == pytest.approx((0.0, 0.0, WEIGHT - 0.004 * STIFFNESS))
    cell.close(None)
    assert cell.world.items["cup"] == pytest.approx(on_rover(0.8, 0.0, 0.7), abs=1e-6)


def test_a_held_item_is_taken_along_by_the_base() -> None:
    cell = Cell()
    cell.close()
    cell.world.base.block(BASE @ Pose2(0.5, 0.2, 0.3))
    cell.ticks(2)

    moved = (BASE @ Pose2(0.5, 0.2, 0.3)).upright().transform(0.8, 0.1, 0.7)
    assert cell.world.items["cup"] == pytest.approx(moved, abs=1e-6)


def test_without_a_gripper_items_stand_and_without_items_there_are_none() -> None:
    other = load_robot("rbkairos_ur10")
    assert Cell(robot=other).world.items == {"cup": CUP.at}
    assert World(HALL, ROBOT, None).items == {}


def picked(cell: Cell) -> None:
    cell.close()
    cell.move(tool(0.8, 0.0, 0.9))


def pressed(cell: Cell) -> None:
    cell.move(tool(0.9, 0.3, CUP.surface - 0.01))


def put_down(cell: Cell) -> None:
    picked(cell)
    cell.close(None)


@pytest.mark.parametrize("acts", [picked, pressed, put_down])
def test_nothing_changes_while_it_stands_so_it_is_leapt_over(acts: Callable[[Cell], None]) -> None:
    stepped, leapt = Cell(), Cell()
    for cell in (stepped, leapt):
        acts(cell)
        cell.ticks(30)
    before = dict(leapt.values)
    assert leapt.world.quiet_until() > leapt.world.now_ns + 10 * 10**9

    leapt.world.leap(10 * 10**9)
    leapt.n += 10 * HZ
    stepped.ticks(10 * HZ)
    for cell in (stepped, leapt):
        cell.ticks(1)
        assert {n: v for n, v in cell.values.items() if n != "base.pose"} == {
            n: v for n, v in before.items() if n != "base.pose"
        }
    assert all(leapt.values[n] is before[n] for n in ("gripper.state", "wrench.reading"))
    assert leapt.world.items == stepped.world.items


def test_the_world_is_not_quiet_while_fingers_close_around_an_item() -> None:
    cell = Cell()
    cell.parts["gripper"].open_to(0.0)
    for _ in range(8):  # 25 mm at 15 cm/s are five of these
        cell.ticks(1)
        state = cell.values["gripper.state"]
        if not state.holding or state.moving:
            assert cell.world.quiet_until() == cell.world.now_ns
    assert state == GripperState(CUP.width, holding=True)
