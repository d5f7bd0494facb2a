"""The evaluation's person at seven random poses: the script `study` in any room, by seed.

The evaluation repeats one walk (R130), so that its means hold for that walk only; other poses tell
how far they hold. As there, poses are chosen so that the robot has room to bring the prop (5.2).
"""

from __future__ import annotations

import math
import random
from dataclasses import replace

from engine.files import mistake
from hw.geometry import Pose2
from hw.people.walking.script import Script, WalkStep, load_script
from hw.samples import USER_RADIUS
from hw.scene import Room

NAME = "route"
ABOUT = "The evaluation's person at seven random poses, by --seed; attentive."
STUDY = "study"

AHEAD, WIDE = 1.85, 1.2
"""The floor this far ahead of a pose is this far from walls, m: there stands the robot that brings
the prop, 1 m behind a DEEP 0.85 m ahead, with its inflation of 1 m and 20 cm of tolerance."""
APART = 3.0
"""Least distance from one pose to the next, m; in `study` it is 3.2 m."""
OFF_ROBOT = 2.0
"""Least distance of the start from that of the robot, m."""
_ROUTES, _POSES = 200, 100


def route(room: Room, robot: Pose2, seed: int) -> Script:
    """A random script for a room in which the robot starts at `robot`; starts at its last pose.

    Raises:
        FileError: the room has no seven such poses with straight ways between them.
    """
    study, chance = load_script(STUDY), random.Random(f"{NAME} user {seed}")
    number = sum(isinstance(step, WalkStep) for step in study.steps)
    for _ in range(_ROUTES):
        poses = _poses(room, robot, number, chance)
        if poses is not None:
            return _walked(study, poses)
    raise mistake(NAME, f"{_ROUTES} tries found no {number} poses with straight ways between them")


def _walked(study: Script, poses: list[Pose2]) -> Script:
    """The script with these poses in place of its own."""
    rest, steps = iter(poses), list(study.steps)
    for number, step in enumerate(steps):
        if isinstance(step, WalkStep):
            pose = next(rest)
            steps[number] = replace(step, x=pose.x, y=pose.y, yaw=pose.yaw)
    return replace(study, name=NAME, about=ABOUT, path=NAME, start=poses[-1], steps=tuple(steps))


def _poses(room: Room, robot: Pose2, number: int, chance: random.Random) -> list[Pose2] | None:
    """Poses of a closed route, the last one off the robot; None if chance found none."""
    found: list[Pose2] = []
    while len(found) < number:
        pose = _pose(room, found[-1] if found else None, chance)
        if pose is None:
            return None
        found.append(pose)
    off_robot = found[-1].distance_to(robot) >= OFF_ROBOT
    return found if off_robot and _is_way(room, found[-1], found[0]) else None


def _pose(room: Room, before: Pose2 | None, chance: random.Random) -> Pose2 | None:
    x_low, y_low, x_high, y_high = room.bounds
    for _ in range(_POSES):
        x, y = chance.uniform(x_low, x_high), chance.uniform(y_low, y_high)
        pose = Pose2(x, y, chance.uniform(-math.pi, math.pi))
        if room.clearance(x, y) < USER_RADIUS or not _has_room(room, pose):
            continue
        if before is None or _is_way(room, before, pose):
            return pose
    return None


def _has_room(room: Room, pose: Pose2) -> bool:
    """Whether the robot can stand opposite."""
    there = pose.transform(AHEAD, 0.0)
    return room.sees(pose.x, pose.y, *there) and room.clearance(*there) >= WIDE


def _is_way(room: Room, start: Pose2, end: Pose2) -> bool:
    clear = room.way_clearance(start.x, start.y, end.x, end.y) >= USER_RADIUS
    return clear and start.distance_to(end) >= APART
