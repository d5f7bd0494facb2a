"""Selects the evaluators of a run: by the plant's ground truth, or by its samples alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from behaviors import ESTIMATE
from cobodeck.evaluate.arm_contact import ArmOutline, ArmWatch
from cobodeck.evaluate.figures import escape_figures
from cobodeck.evaluate.localization import LocalizationWatch
from cobodeck.evaluate.measured_truth import Senses
from cobodeck.evaluate.metrics import Evaluator
from cobodeck.evaluate.proximity import DriveWatch, WalkingGap
from cobodeck.evaluate.requests import RequestWatch
from cobodeck.evaluate.separation_figures import SeparationWatch
from cobodeck.evaluate.stuck import StuckWatch
from cobodeck.loop import Inlet, Observer, Plant, Wired
from engine.run import ChartRun
from hw import BASE, Joints, Pose2, Pose3
from hw.model import RobotModel
from hw.scene import Scene

STILL = 0.01
"""Poses of a base that stands differ by up to this, m and rad, if they are measured, or if physics
moves it, as the arm shakes it."""


def watchers(plant: Plant, wired: Wired, robot: RobotModel, scene: Scene | None) -> list[Observer]:
    """The observers that evaluate a run: by ground truth if the plant has it, else by samples."""
    truth, seen = plant.truth, "user.pose" in wired.inlet.flowing
    if truth is None or (truth.body is None and seen):  # a world does not contain the dummy
        found: list[Observer] = [_by_samples(wired.inlet, robot)]
    else:
        found = [_by_truth(plant, robot, truth.body is not None)]
    if truth is not None and ESTIMATE in wired.board.slots:
        found.append(LocalizationWatch(plant, wired.board))
    if truth is not None and scene is not None:
        found.append(StuckWatch(plant, wired.run, scene, robot.footprint))
    if plant.cycles is not None:
        found.append(SeparationWatch(plant.cycles))
    return found


def run_figures(evaluator: Evaluator, run: ChartRun) -> dict[str, Any]:
    """The figures of robot and person, and those of Escapes, so far."""
    return {**evaluator.report(), **escape_figures(run)}


def _by_truth(plant: Plant, robot: RobotModel, person: bool) -> Evaluator:
    outline = robot.footprint
    if not person or robot.arm is None:
        return Evaluator(plant, person, walking_gap=WalkingGap(outline))
    still = STILL if getattr(plant, "shaken", False) else 0.0
    requests = RequestWatch(prop_of(robot), base=DriveWatch(outline, still))
    arm = ArmWatch(arm_outline(robot))
    return Evaluator(plant, person, requests, arm, walking_gap=WalkingGap(outline))


def _by_samples(inlet: Inlet, robot: RobotModel) -> Evaluator:
    heard = "vr.haptic_request" in inlet.flowing
    person = heard or "user.pose" in inlet.flowing
    prop = prop_of(robot) if heard and robot.arm is not None else None
    outline = robot.footprint
    requests = RequestWatch(prop, heard, DriveWatch(outline, STILL))
    senses = Senses(inlet, outline)
    return Evaluator(senses, person, requests, measured=True, walking_gap=WalkingGap(outline))


def prop_of(robot: RobotModel) -> Callable[[Pose2, Joints], Pose3]:
    """A function that gives map_from_prop for map_from_base and the joint angles, rad."""
    from states.arm.description import manipulator_of
    from states.arm.kinematics import forward

    arm = manipulator_of(robot)

    def prop(base: Pose2, joints: Joints) -> Pose3:
        matrix = forward(arm, joints)
        map_from_rover = base.upright()
        return map_from_rover @ Pose3.from_matrix(matrix.tolist())

    return prop


def arm_outline(robot: RobotModel) -> ArmOutline:
    """The robot's arm as capsules, with the names of its parts."""
    from states.arm.description import manipulator_of
    from states.arm.kinematics import outline

    arm = manipulator_of(robot)
    parts = tuple("arm_base" if part == BASE else part for part in arm.parts)
    return ArmOutline(partial(outline, arm), parts, arm.tool.name, robot.footprint)
