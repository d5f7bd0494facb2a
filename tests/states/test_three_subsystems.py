"""Three navigation subsystems with values of their own: changing one leaves the others alone."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Any

import pytest

from behaviors.profile.profile import load_profile
from hw.geometry import Pose2, Twist2
from hw.model.robot import load_robot
from hw.scene.room import Room
from states.environment.environment import Environment
from states.navigation.planners import driver_of
from states.subsystems import SubsystemName

NAMES: tuple[SubsystemName, ...] = ("chase", "haptic", "escape")
CHANGES: list[dict[str, Any]] = [
    {"inflation": 0.9},
    {"max_speed": 0.7},
    {"tolerance": 0.001},
    {"yaw_tolerance": 1e-12},
]
PILLAR = ((4.0, 3.6), (4.4, 3.6), (4.4, 4.0), (4.0, 4.0))
ROOM = Room(((0.0, 0.0), (9.0, 0.0), (9.0, 8.0), (0.0, 8.0)), columns=(PILLAR,))


def driven(environment: Environment, name: SubsystemName) -> str:
    """A digest of everything a drive commands, past the pillar to its goal."""
    driver = driver_of(environment, name, environment.static_planners[name])
    pose, twist = Pose2(1.5, 3.9), Twist2(0.0)
    driver.go_to(Pose2(7.0, 3.9, 0.5))
    digest = hashlib.sha256()
    for _ in range(300):
        twist = driver.command(pose, twist, None, environment.period)
        digest.update(repr((twist, driver.status)).encode())
        motion, step = twist.rotated(pose.yaw), environment.period
        pose = Pose2(
            pose.x + motion.vx * step, pose.y + motion.vy * step, pose.yaw + twist.wz * step
        )
    return digest.hexdigest()


@pytest.mark.requirement(35)
@pytest.mark.parametrize("changed", NAMES)
@pytest.mark.parametrize("change", CHANGES, ids=lambda change: next(iter(change)))
def test_changing_one_subsystem_changes_no_drive_of_the_others(
    changed: SubsystemName, change: dict[str, Any]
) -> None:
    environment = load_profile("paper").environment(ROOM, load_robot("rbkairos_ur10"))
    values = {name: environment.navigation.named(name) for name in NAMES}
    values[changed] = replace(values[changed], **change)
    other = replace(
        environment, navigation=replace(environment.navigation, **{changed: values[changed]})
    )

    before = {name: driven(environment, name) for name in NAMES}
    after = {name: driven(other, name) for name in NAMES}

    assert {name for name in NAMES if before[name] != after[name]} == {changed}
