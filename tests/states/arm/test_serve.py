"""From a request to the prop at the DEEP: states, planner and simulated arm together."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from hw.geometry import Pose2, Pose3, wrap
from hw.model.calibration import load_calibration
from hw.model.robot import FOLDER as ROBOTS, load_robot
from hw.samples import EXACT, UserPose
from hw.sim.sim_arm import SimArm
from states.arm.arm_situation import ArmSituation
from states.arm.motion.timing import line_durations
from states.arm.planning.planning import Plan, ended, in_turn
from states.arm.states import ParkArm, ReachDeep
from states.environment.environment import Environment

HZ = 30
ANGLES = [math.radians(degrees) for degrees in (0, 30, -30, 60, -60, 90, -90)]


class Rig:
    """A simulated arm, and a state that moves it, tick by tick."""

    def __init__(self, environment: Environment, context: Any, base: Pose2, user: Pose2) -> None:
        self.arm = SimArm(environment.robot.arm, environment.robot.parked)
        values = {
            "environment": environment,
            "base.pose": base,
            "base.pose_sigma": EXACT,
            "user.pose": UserPose(user, user.yaw),
        }
        self.ctx = context(values, {"arm": self.arm})
        self.tick = 0
        self.advance()

    def advance(self) -> None:
        now, self.tick = self.tick * 10**9 // HZ, self.tick + 1
        self.arm.advance(now)
        self.ctx.now, self.ctx.values["arm.joints"] = now, self.arm.state

    def run(self, run: Any, seconds: float = 15.0) -> str | None:
        """The outcome of a state, None if it takes longer."""
        for _ in range(round(seconds * HZ)):
            try:
                next(run)
            except StopIteration as ended:
                return str(ended.value)
            self.advance()
        return None


def request(rng: np.random.Generator, environment: Environment) -> tuple[Pose2, Pose3, Pose2]:
    """A user, their DEEP, and the rover up to 0.2 m and 0.1 rad off the best of its poses."""
    user = Pose2(5.0, 4.0, rng.uniform(-math.pi, math.pi))
    deep = Pose3.from_yaw(*user.transform(0.85, 0.0), rng.uniform(0.5, 1.5), user.yaw)
    poses = []
    for angle in ANGLES:
        way = user.yaw + angle
        x, y = deep.x + math.cos(way), deep.y + math.sin(way)
        poses.append(Pose2(x, y, wrap(way + math.pi)))
    best = environment.workspace.best(
        poses, rng.uniform(1.0, 4.0, 7).tolist(), deep, user, (0.2, 0.1)
    )
    assert best is not None
    off, way, turn = 0.2 * math.sqrt(rng.uniform()), rng.uniform(0.0, 6.3), rng.uniform(-0.1, 0.1)
    pose = poses[best]
    return user, deep, Pose2(
        pose.x + off * math.cos(way), pose.y + off * math.sin(way), wrap(pose.yaw + turn)
    )  # fmt: skip


def errors(screws: Any, base: Pose2, joints: tuple[float, ...], deep: Pose3) -> tuple[float, float]:
    """How far the true prop is from the DEEP, m and rad, by other kinematics than the planner's."""
    prop = screws.tcp(np.array([joints]))[0]
    turned = Rotation.from_euler("z", base.yaw)
    place = turned.apply(prop[:3, 3]) + np.array([base.x, base.y, 0.0])
    asked = Rotation.from_quat([deep.qx, deep.qy, deep.qz, deep.qw])
    wrong = asked.inv() * turned * Rotation.from_matrix(prop[:3, :3])
    return math.dist(place, (deep.x, deep.y, deep.z)), float(wrong.magnitude())


@pytest.mark.requirement(44, 47, 79, 80, 84, 143)
@pytest.mark.parametrize("count", [20, pytest.param(300, marks=pytest.mark.slow)])
def test_every_request_is_served_to_5_mm_wherever_the_rover_stands_in_its_tolerance(
    environment: Environment, context: Any, screws: Any, count: int
) -> None:
    rng = np.random.default_rng(5)
    for _ in range(count):
        user, deep, base = request(rng, environment)
        rig = Rig(environment, context, base, user)

        assert rig.run(ReachDeep().run(rig.ctx, deep=deep)) == "reached"

        away, turned = errors(screws, base, rig.arm.state.joints, deep)
        assert away <= 0.005
        assert turned <= 0.01
        assert rig.run(ParkArm().run(rig.ctx)) == "parked"


@pytest.mark.requirement(44, 82, 147)
@pytest.mark.parametrize("height", [1.6, 1.65, 1.7, 1.8, 2.0])
@pytest.mark.few(2)
def test_high_deeps_are_met_within_the_tolerance_or_it_is_told_by_how_much_they_are_missed(
    environment: Environment, context: Any, screws: Any, height: float
) -> None:
    user = Pose2(5.0, 4.0, 0.4)
    deep = Pose3.from_yaw(*user.transform(0.85, 0.0), height, user.yaw)
    poses = [
        Pose2(deep.x + math.cos(way), deep.y + math.sin(way), wrap(way + math.pi))
        for way in (user.yaw + angle for angle in ANGLES)
    ]
    chosen = environment.workspace.best(poses, [1.0] * 7, deep, user, (0.2, 0.1))
    assert (chosen is not None) == (height <= 1.7)
    base = poses[chosen or 0]
    rig = Rig(environment, context, base, user)
    run = ReachDeep().run(rig.ctx, deep=deep)

    if chosen is None:
        told = next(run)
        assert rig.run(run) == "no_solution"
        missed = float(told.removeprefix("the DEEP is ").removesuffix(" m out of reach"))
        least = least_miss(screws, base, deep)
        assert 0.02 < least < missed + 1e-3
        assert missed < 1.05 * least
    else:
        assert rig.run(run) == "reached"
        away, turned = errors(screws, base, rig.arm.state.joints, deep)
        assert away <= 0.02
        assert turned <= 0.1


def least_miss(screws: Any, base: Pose2, deep: Pose3) -> float:
    """How near a level prop gets to a DEEP that is too high, by trying: m."""
    rover = Pose3.from_yaw(base.x, base.y, 0.0, base.yaw).inverse() @ deep
    turn = Rotation.from_quat([rover.qx, rover.qy, rover.qz, rover.qw])

    def miss(q: np.ndarray) -> np.ndarray:
        prop = screws.tcp(q[None])[0]
        wrong = (turn.inv() * Rotation.from_matrix(prop[:3, :3])).as_rotvec()
        return np.concatenate([prop[:3, 3] - (rover.x, rover.y, rover.z), 1e3 * wrong])

    rng = np.random.default_rng(0)
    starts = rng.uniform(-math.pi, math.pi, (60, 6))
    ends = [least_squares(miss, start, max_nfev=200) for start in starts]
    return min(float(np.linalg.norm(end.fun[:3])) for end in ends)


USER, DEEP = Pose2(5.0, 4.0, 0.0), Pose3.from_yaw(5.85, 4.0, 1.2, 0.0)
BASE = Pose2(6.85, 4.0, math.pi)


@pytest.fixture
def rig(environment: Environment, context: Any) -> Rig:
    return Rig(environment, context, BASE, USER)


@pytest.mark.requirement(43, 82)
def test_a_deep_inside_a_person_is_blocked_and_says_by_what(rig: Rig) -> None:
    rig.ctx.values["user.pose"] = UserPose(Pose2(6.0, 4.0, math.pi), 0.0)
    run = ReachDeep().run(rig.ctx, deep=DEEP)

    assert "surroundings" in next(run)
    assert rig.run(run) == "blocked"


@pytest.mark.requirement(43, 45)
def test_whoever_steps_into_the_way_stops_the_arm_before_it_touches_them(
    rig: Rig, environment: Environment
) -> None:
    run = ReachDeep().run(rig.ctx, deep=DEEP)
    assert rig.run(run, 0.4) is None
    assert rig.arm.state.moving
    stepped = Pose2(5.6, 4.0, 0.0)
    rig.ctx.values["user.pose"] = UserPose(stepped, 0.0)

    assert rig.run(run, 3.0) == "blocked"

    assert not rig.arm.state.moving
    look = ArmSituation(BASE, stepped, rig.arm.state.joints)
    assert environment.workspace.checker(look, DEEP).clearance(np.array(look.joints))[0] > 0.0


@pytest.mark.requirement(43, 45)
def test_a_base_that_turns_the_arm_into_a_person_stops_the_arm(
    rig: Rig, environment: Environment
) -> None:
    beside = Pose2(*BASE.transform(1.1 * math.cos(0.8), 1.1 * math.sin(0.8)))
    rig.ctx.values["user.pose"] = UserPose(beside, 0.0)
    run = ReachDeep().run(rig.ctx, deep=DEEP)
    assert rig.run(run, 0.4) is None
    assert rig.arm.state.moving
    turned = rig.ctx.values["base.pose"] = BASE @ Pose2(0.0, 0.0, 0.3)
    before = rig.arm.state.course

    for _ in range(3 * HZ):
        with suppress(StopIteration):
            next(run)
        rig.advance()
        look = ArmSituation(turned, beside, rig.arm.state.joints)
        assert environment.workspace.checker(look, DEEP).clearance(np.array(look.joints))[0] > 0.0
    assert rig.arm.state.course > before  # another way was taken


@pytest.mark.requirement(43)
@pytest.mark.parametrize(
    ("distance", "radius"), [(0.85, 0.5), (0.6, 0.45), (0.5, 0.35), (0.3, 0.25)]
)
def test_the_cylinder_of_a_user_who_is_granted_a_touch_ends_15_cm_before_the_deep(
    environment: Environment, distance: float, radius: float
) -> None:
    user = Pose2(DEEP.x - distance, DEEP.y, 0.0)
    look = ArmSituation(BASE, user, environment.robot.parked)

    assert environment.workspace.checker(look, DEEP).around.cylinders[0, 2] == pytest.approx(radius)
    assert environment.workspace.checker(look).around.cylinders[0, 2] == 0.5


@pytest.mark.requirement(45)
def test_a_user_who_only_shifts_does_not_stop_the_arm(rig: Rig) -> None:
    run = ReachDeep().run(rig.ctx, deep=DEEP)
    rig.run(run, 0.4)
    rig.ctx.values["user.pose"] = UserPose(Pose2(4.97, 4.02, 0.1), 0.0)

    assert rig.run(run, 0.1) is None
    assert rig.arm.state.moving
    assert rig.run(run) == "reached"


@pytest.mark.requirement(45)
def test_a_jerk_limit_of_the_profile_is_kept_on_the_way(environment: Environment) -> None:
    smooth = Environment(
        environment.room,
        environment.robot,
        replace(environment.limits, arm_jerk=40.0),
        environment.navigation,
    )
    look = ArmSituation(BASE, USER, environment.robot.parked)
    durations = []
    for each in (environment, smooth):
        answer = ended(in_turn(each.workspace.reaching(look, DEEP)))
        assert isinstance(answer, Plan)
        durations.append(answer.trajectory.duration)
    assert isinstance(answer, Plan)
    t = np.linspace(0.0, answer.trajectory.duration, 4001)
    _, _, acceleration = answer.trajectory.at(t)
    assert np.abs(np.diff(acceleration, axis=0)).max() <= 40.0 * (t[1] - t[0]) * 1.01
    assert durations[0] < durations[1] < 1.5 * durations[0]


@pytest.mark.requirement(17, 26, 44)
def test_a_calibrated_robot_is_served_by_its_own_chain(
    environment: Environment, context: Any, tmp_path: Path
) -> None:
    text = (ROBOTS / "rbkairos_ur10.yaml").read_text()
    file = tmp_path / "measured.yaml"
    file.write_text(text.replace("calibration: null", "calibration: robotnik_ur10"))
    own = Environment(
        environment.room, load_robot(file), environment.limits, environment.navigation
    )
    rng = np.random.default_rng(6)
    for _ in range(10):
        user, deep, base = request(rng, own)
        rig = Rig(own, context, base, user)

        assert rig.run(ReachDeep().run(rig.ctx, deep=deep)) == "reached"

        x, y, z = measured_place(base, rig.arm.state.joints)
        assert math.dist((x, y, z), (deep.x, deep.y, deep.z)) <= 0.005


def measured_place(base: Pose2, joints: tuple[float, ...]) -> tuple[float, float, float]:
    """Where the 0.15 m prop of the measured arm is in the map, frame by frame."""
    turn, place = Rotation.from_euler("z", math.pi), np.array([0.0, 0.0, 0.511])
    for joint, angle in zip(load_calibration(), joints, strict=True):
        place = place + turn.apply(joint.xyz)
        turn = turn * Rotation.from_euler("xyz", joint.rpy) * Rotation.from_euler("z", angle)
    x, y, z = place + turn.apply([0.0, 0.0, 0.15])
    return (*base.transform(x, y), float(z))


@pytest.mark.requirement(80)
def test_a_base_that_comes_to_rest_later_is_made_up_for(rig: Rig, screws: Any) -> None:
    run = ReachDeep().run(rig.ctx, deep=DEEP)
    rig.run(run, 0.2)
    rests = rig.ctx.values["base.pose"] = BASE @ Pose2(0.01, -0.02, 0.04)

    assert rig.run(run) == "reached"
    away, turned = errors(screws, rests, rig.arm.state.joints, DEEP)
    assert away <= 0.005
    assert turned <= 0.01


@pytest.mark.requirement(45, 47)
def test_an_arm_that_a_person_leans_on_folds_away_from_them(rig: Rig) -> None:
    assert rig.run(ReachDeep().run(rig.ctx, deep=DEEP)) == "reached"
    rig.ctx.values["user.pose"] = UserPose(Pose2(5.6, 4.0, 0.0), 0.0)

    assert rig.run(ParkArm().run(rig.ctx)) == "parked"


@pytest.mark.requirement(45)
def test_the_way_back_begins_only_after_the_arm_has_come_to_rest(rig: Rig) -> None:
    reaching = ReachDeep().run(rig.ctx, deep=DEEP)
    rig.run(reaching, 0.5)
    reaching.close()

    assert rig.run(ParkArm().run(rig.ctx)) == "parked"


@pytest.mark.requirement(45, 48)
def test_a_stop_line_pulled_on_the_way_fails_the_move_and_brakes_in_a_fifth_of_a_second(
    rig: Rig,
) -> None:
    run = ReachDeep().run(rig.ctx, deep=DEEP)
    rig.run(run, 0.5)
    rig.ctx.values["stop.engaged"] = "bumper"

    assert rig.run(run, 0.1) == "failed"
    for _ in range(6):
        rig.advance()
    assert not rig.arm.state.moving


@pytest.mark.requirement(78, 82)
def test_no_rover_pose_is_best_for_a_deep_that_is_too_high(environment: Environment) -> None:
    high = Pose3.from_yaw(5.85, 4.0, 2.6, 0.0)

    assert environment.workspace.best([BASE], [1.0], high, USER, (0.05, 0.1)) is None


@pytest.mark.requirement(76, 78)
def test_a_long_drive_puts_a_pose_behind_one_that_is_near(environment: Environment) -> None:
    beside = Pose2(5.85 + math.cos(0.5), 4.0 + math.sin(0.5), wrap(0.5 + math.pi))
    best = environment.workspace.best

    assert best([BASE, beside], [1.0, 9.0], DEEP, USER, (0.05, 0.1)) == 0
    assert best([BASE, beside], [9.0, 1.0], DEEP, USER, (0.05, 0.1)) == 1


@pytest.mark.requirement(76, 78)
def test_of_many_poses_the_soonest_is_best_by_drive_and_arm_together(
    environment: Environment,
) -> None:
    rng, workspace, chosen = np.random.default_rng(4), environment.workspace, set()
    for _ in range(10):
        ways = rng.uniform(-1.2, 1.2, 8).tolist()
        poses = [
            Pose2(5.85 + 0.9 * math.cos(w), 4.0 + 0.9 * math.sin(w), wrap(w + math.pi))
            for w in ways
        ]
        drives = rng.uniform(0.0, 2.0, 8).tolist()
        times = []
        for pose, drive in zip(poses, drives, strict=True):
            query = next(workspace.reaching(ArmSituation(pose, USER, workspace.parked), DEEP))
            goals = query.goals[query.checker.free(query.goals)]
            lines = line_durations(query.checker.arm, query.start, goals, query.limits)
            times.append(drive + lines.min())  # the line to the DEEP takes as long from all poses

        best = workspace.best(poses, drives, DEEP, USER, (0.0, 0.0))

        assert best == int(np.argmin(times))
        chosen.add(best != int(np.argmin(drives)))
    assert chosen == {True, False}


@pytest.mark.requirement(75, 126)
def test_what_the_arm_holds_at_the_deep_lies_beyond_it_as_seen_from_the_user(
    environment: Environment,
) -> None:
    deep = Pose3.from_yaw(1.0, 2.0, 1.2, 0.5 * math.pi)

    ends, radii = environment.workspace.held(deep)

    assert ends[:, :, 0] == pytest.approx(1.0, abs=2e-3)
    assert ends[:, :, 2] == pytest.approx(1.2, abs=2e-3)
    beyond = sorted(ends[:, :, 1].ravel() - 2.0)
    assert beyond[0] == pytest.approx(0.05)  # a prop of 0.15 m, its capsule from 0.03 to 0.1 m
    assert beyond[-1] == pytest.approx(0.172)
    assert radii.max() == pytest.approx(0.055)


@pytest.mark.requirement(78, 79)
def test_a_pose_that_reaches_from_all_its_disc_goes_before_a_quicker_one_that_does_not(
    environment: Environment,
) -> None:
    far = Pose2(7.12, 4.0, math.pi)

    found = environment.workspace.best([far, BASE], [0.0, 5.0], DEEP, USER, (0.2, 0.1))

    assert found == 1
    assert environment.workspace.best([far], [0.0], DEEP, USER, (0.2, 0.1)) == 0
