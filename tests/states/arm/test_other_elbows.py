"""Poses of arms by URDF that only one elbow reaches without a contact: balls are where others are.

Elbows come from a walk along the null space in small steps, not from the solver.
"""

from __future__ import annotations

import numpy as np
import pytest

from hw.model import MotionLimits, load_robot
from states.arm.description import manipulator_of
from states.arm.kinematics import (
    CollisionChecker,
    Limb,
    Surroundings,
    followed,
    forward,
    inverse,
    jacobian,
)
from states.arm.kinematics.kernels import place_links
from states.arm.planning import Plan, Query, goals_at, plan
from tests.states.arm.other_arms import robot_file

pytestmark = pytest.mark.slow
FOLDED = {
    "panda": "[-0.64, -0.57, 0.44, -1.78, -0.49, 1.57, 1.68]",
    "ball": "[0.21, -0.84, 0.82, -3.14, 0, 0.39]",
}
ELBOW = {"panda": 4, "ball": 3}
"""The link that begins at the elbow."""
BALL, NEAR = 0.05, 0.22
EMPTY = np.zeros((0, 6)), np.zeros((0, 5))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("arms")


@pytest.fixture(scope="module")
def panda(folder):
    return load_robot(robot_file(folder, "panda", FOLDED["panda"]))


@pytest.fixture(scope="module")
def ball(folder):
    return load_robot(robot_file(folder, "ball", FOLDED["ball"]))


def elbow(arm, name, q):
    frames = np.zeros((arm.count + 1, 4, 4))
    place_links(arm.base, arm.origins, q, frames)
    return frames[ELBOW[name], :3, 3]


def self_motion(arm, q) -> np.ndarray:
    """Joint sets (n, 7) that keep the tool where it is, 0.05 rad apart, as far as limits allow."""
    target, found = forward(arm, q), [q]
    for side in (-1.0, 1.0):
        at, before = q, None
        for _ in range(80):
            along = side * np.linalg.svd(jacobian(arm, at))[2][-1]
            if before is not None and along @ before < 0.0:
                along = -along
            new, worth = followed(arm, (at + 0.05 * along)[None], target[None])
            if worth[0] > 1e-18 or np.abs(new[0] - at).max() < 0.01:
                break
            at, before = new[0], along
            found.append(at)
    return np.array(found)


def among(arm, name, elbows, kept):
    """A checker with balls at all elbows that are not close to the one that is kept free."""
    away = [at for at in elbows if np.linalg.norm(at - kept) > NEAR]
    balls = tuple(Limb(tuple(at), tuple(at), BALL) for at in away)
    return CollisionChecker.of(arm, Surroundings(*EMPTY, balls)), len(balls)


def hard(arm, name, seed, count):
    """Joints, target and checkers where the nearest goals collide and these joints are free."""
    rng, found = np.random.default_rng(seed), []
    alone = CollisionChecker.of(arm, Surroundings.empty())
    middle, half = 0.5 * (arm.lower + arm.upper), 0.4 * (arm.upper - arm.lower)
    for q in middle + half * rng.uniform(-1.0, 1.0, (60 * count, arm.count)):
        if not alone.free(q)[0] or elbow(arm, name, q)[2] < 0.75:
            continue
        others = self_motion(arm, q) if arm.count > 6 else inverse(arm, forward(arm, q)).branches()
        others = others[alone.free(others)]
        checker, balls = among(
            arm, name, [elbow(arm, name, o) for o in others], elbow(arm, name, q)
        )
        if balls and checker.free(q)[0] and not checker.free(others).all():
            found.append((q, others, checker))
        if len(found) == count:
            break
    return found


def served(arm, cases) -> int:
    return sum(
        bool(checker.free(goals_at(arm, forward(arm, q), others[0])).any())
        for q, others, checker in cases
    )


@pytest.mark.parametrize(
    ("count", "least"), [(6, 6), pytest.param(100, 97, marks=pytest.mark.slow)]
)
def test_of_seven_joints_another_elbow_serves_where_others_collide(panda, count, least):
    arm = manipulator_of(panda)
    cases = hard(arm, "panda", 5, count)
    assert len(cases) == count
    assert served(arm, cases) >= least


@pytest.mark.parametrize(
    ("count", "least"), [(60, 0.6), pytest.param(1000, 0.7, marks=pytest.mark.slow)]
)
def test_solutions_of_seven_joints_sample_the_whole_self_motion(panda, count, least):
    arm = manipulator_of(panda)
    q = np.random.default_rng(2).uniform(arm.lower, arm.upper, (count, arm.count))
    found = inverse(arm, forward(arm, q))
    away = np.abs((found.joints - q[:, None] + np.pi) % (2.0 * np.pi) - np.pi).max(axis=2)
    near = np.where(found.valid, away, np.inf).min(axis=1)
    assert (near < 0.4).mean() > least


@pytest.mark.parametrize("name", FOLDED)
def test_a_plan_leads_to_the_elbow_that_is_free(name, request):
    robot = request.getfixturevalue(name)
    arm, limits = manipulator_of(robot), MotionLimits()
    made = 0
    for q, others, checker in hard(arm, name, 7, 5):
        start = others[~checker.free(others)][0]  # where the nearest goal is itself, in contact
        target = forward(arm, q)
        assert not checker.free(goals_at(arm, target, start)[:1])[0]
        goals = goals_at(arm, target, np.array(robot.parked))
        answer = plan(Query(checker, limits, np.array(robot.parked), goals))
        if isinstance(answer, Plan):
            end = answer.trajectory.path.at(np.array([answer.trajectory.path.length]))[0]
            assert checker.free(end)[0]
            assert np.abs(forward(arm, end[0]) - target).max() < 1e-6
            made += 1
    assert made >= 4
