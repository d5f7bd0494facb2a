"""Subjects of `states.navigation`, `states.floors` and `states.arm`."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from cobodeck.bench.navigation.drive_trials import Trial, drive
from hw.geometry import Pose3
from hw.model.calibration import load_calibration
from hw.scene.room import Disc
from states.arm.arm_separation import Brakes, Governor
from states.arm.description.robot_arm import manipulator_of
from states.arm.kinematics.collision import CollisionChecker, Cylinder, Limb, Surroundings
from states.arm.kinematics.dynamics import Bodies, effort
from states.arm.kinematics.inverse_kinematics import inverse
from states.arm.kinematics.kinematics import forward, jacobian
from states.arm.kinematics.model import Manipulator
from states.arm.motion.joint_path import JointPath
from states.arm.motion.timing import time_path
from states.arm.planning.reach import Reach, ReachPlace, rover_from_deep
from states.floors.floor_plan import RoomFloor
from states.floors.usable_space import measure
from states.navigation.exact.visibility import ExactPlanner
from states.navigation.grid.grid_planners import NavfnPlanner, ThetaStarPlanner
from states.navigation.local.profile_planner import ProfilePlanner
from states.navigation.local.teb_planner import TebPlanner
from states.navigation.planner_interfaces import Limits, Tolerance
from tests.stress.bodies import LIMITS, ROBOT, ROOM
from tests.stress.elsewhere import Elsewhere

WAYS = (((2.0, 2.0), (9.0, 1.0)), ((2.0, 5.0), (6.0, 5.1)), ((0.2, 0.3), (10.0, 8.0)))
USER = (3.0, 3.5, 1.0)


def exact_planner(at: Elsewhere, radius: float = 0.77) -> ExactPlanner:
    room = at.room(ROOM)
    return ExactPlanner(room.outer, room.obstacles, inflation_radius=radius)


def exact_paths(at: Elsewhere) -> list[float]:
    box = ((5.0, 6.0), (5.5, 6.0), (5.5, 6.5), (5.0, 6.5))
    planner, found = exact_planner(at).among([at.ring(box)]), []
    user = Disc(*at.point(*USER[:2]), USER[2])
    for start, goal in WAYS:
        for disc, side in ((None, 0), (user, 0), (user, 1), (user, -1)):
            path = planner.plan(at.point(*start), at.point(*goal), disc, side)
            assert path is not None
            ends = path.line[:, :2].tolist()
            found += [path.length, *(v for x, y in ends for v in at.home_point(x, y))]
    for x, y in ((0.1, 0.1), (4.25, 4.95), (7.12, 1.0), (3.0, 3.4)):
        out = planner.nearest_free(at.point(x, y), user)
        found += [planner.clearance(at.point(x, y)), planner.is_free(at.point(x, y))]
        found += [math.nan] if out is None else at.home_point(*out)
    ways = at.points([(5.0, 2.0), (8.0, 5.0), (7.1, 1.0), (3.0, 8.0)])
    return [*found, *planner.are_free(ways), planner.allows_each(at.point(2.0, 2.0), ways)]


def grid_paths(at: Elsewhere) -> list[float]:
    """Cells move with the room, by whole cells."""
    room, found = at.room(ROOM), []
    for kind in (ThetaStarPlanner, NavfnPlanner):
        planner = kind.in_room(room.outer, room.obstacles, inflation_radius=0.7, resolution=0.125)
        for start, goal in WAYS[:2]:
            path = planner.plan(at.point(*start), at.point(*goal))
            assert path is not None
            found += [path.length, *(v for point in path.points for v in at.home_point(*point))]
        found += [planner.clearance(at.point(5.0, 2.1))]
    return found


def profile_drive(at: Elsewhere) -> list[float]:
    """Around somebody who stands in the way, past a wall, with a turn through half a turn."""
    found = []
    for mode in ("omni", "differential"):
        driver = ProfilePlanner(exact_planner(at, 0.6), Limits(), Tolerance(), mode)
        user = Disc(*at.point(*USER[:2]), USER[2])
        trial = Trial("", at.pose(1.5, 2.2, 2.9), at.pose(6.0, 4.5, -2.7), user, 1.0)
        outcome = drive(driver, trial, longest=3.0)
        found += [v for x, y in outcome.places for v in at.home_point(x, y)]
        found += [outcome.intrusion, outcome.speed]
    return found


def teb_drive(at: Elsewhere) -> list[float]:
    room = at.room(ROOM)
    driver = TebPlanner(
        exact_planner(at, 0.6), Limits(), Tolerance(), walls=(room.outer, *room.obstacles),
        wall_distance=0.6,
    )  # fmt: skip
    trial = Trial("", at.pose(1.5, 2.2, 2.9), at.pose(4.0, 2.5, -2.7), None, 1.0)
    outcome = drive(driver, trial, longest=1.0)
    return [v for x, y in outcome.places for v in at.home_point(x, y)]


def floor_space(at: Elsewhere) -> list[float]:
    space = measure(RoomFloor(at.room(ROOM)), 1.0)
    assert space.share is not None
    ends = [v for passage in space.closed for v in at.home_point(*passage.middle)]
    return [space.free_m2, space.usable_m2, *space.pieces, *ends]


@cache
def arm() -> Manipulator:
    return manipulator_of(ROBOT)


JOINTS = np.array([0.4, -1.2, 1.5, -0.9, 1.3, 0.2])


def arm_seen(at: Elsewhere) -> list[float]:
    """What the arm sees of the map: walls, people, limbs, a DEEP, from a rover there."""
    rover, deep = at.pose(3.0, 2.0, 3.0), Pose3.from_yaw(*at.point(2.2, 2.3), 1.1, at.yaw(0.2))
    room, person = at.room(ROOM), Cylinder(*at.point(1.6, 2.3), 0.4, 1.8)
    limb = Limb((*at.point(1.8, 2.4), 1.0), (*at.point(2.0, 2.5), 1.1), 0.1)
    around = Surroundings.seen_from(rover, room.segments, [person], [limb])
    checker = CollisionChecker.of(arm(), around)
    reach = Reach(arm(), arm())
    place = ReachPlace(room.segments, [person])
    poses = [at.pose(3.0 + 0.2 * k, 2.0, 3.0 + 0.4 * k) for k in range(5)]
    reached = reach.reached(poses, deep, place)
    target = rover_from_deep(rover, deep)
    return [*checker.clearance(JOINTS).tolist(), *reached.tolist(), *target.ravel().tolist()]


def governed_arm(at: Elsewhere) -> list[float]:
    """The pace of a motion beside somebody who comes nearer."""
    goal = JOINTS + 0.8
    course = time_path(arm(), JointPath.through(np.array([JOINTS, goal])), LIMITS)
    governor = Governor(arm(), course, Brakes(16.0, 5.0), at.pose(2.2, 2.3), granted=True)
    governor.expect(at.pose(1.2, 2.3))
    found = []
    for k in range(20):
        t = 0.03 * k
        hand = Limb((*at.point(2.0, 2.4), 1.0), (*at.point(2.1, 2.4), 1.2), 0.05)
        governor.add_user_pose(at.ns(t), at.pose(1.2 + 0.8 * t, 2.3), (hand,))
        pace = governor.pace(at.ns(t + 0.01), min(t, course.duration), 0.03, at.pose(3.0, 2.0, 3.0))
        assert pace is not None
        found += list(pace)
    return found


def arm_kinematics(at: Elsewhere) -> list[float]:
    """Nothing of it knows the map: here joints are wound up and rounded."""
    joints = np.array([at.number(q + 2.0 * math.pi * at.windings) for q in JOINTS])
    pose = forward(arm(), joints)
    found = inverse(arm(), pose).branches()
    moved = forward(arm(), found)
    exerted = effort(arm(), Bodies.of(arm()), joints[None], 0.3 * JOINTS[None], 0.5 * JOINTS[None])
    real = arm().calibrated(load_calibration())
    solved = inverse(real, forward(real, joints)).branches()
    assert len(solved)
    met = forward(real, solved) - forward(real, joints)
    return [
        *met.ravel(), *pose.ravel(), *jacobian(arm(), joints).ravel(), *moved.ravel(),
        *(0.01 * exerted.torque).ravel(), *exerted.momentum,
    ]  # fmt: skip
