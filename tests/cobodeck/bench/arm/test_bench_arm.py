"""The benchmark of the arm: its problems are what they should be, its figures are counted right."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cobodeck.bench.arm import arm_bench as bench
from cobodeck.bench.arm.arm_bench import (
    differing,
    durations,
    ik_errors,
    ik_rows,
    joint_sets,
    plan_rows,
    single_rows,
    touching,
    unsolved,
)
from cobodeck.bench.arm.arm_lines import contact_rows, duration_rows
from cobodeck.bench.arm.arm_peers import IK_PEERS, found, solutions
from cobodeck.bench.arm.arm_problems import problems
from cobodeck.bench.table import RESULTS
from hw.model import inverted
from hw.model.robot import load_robot
from states.arm.description.robot_arm import manipulator_of
from states.arm.kinematics.collision import CollisionChecker, Surroundings
from states.arm.kinematics.kinematics import forward
from states.arm.planning.planning import NoPlan, Plan

FEW = 6


@pytest.fixture(scope="module")
def arm():
    return manipulator_of(load_robot("rbkairos_ur10"))


@pytest.fixture(scope="module")
def outcomes(arm):
    return [bench.solved(arm, "tuned", problem) for problem in problems(FEW)]


def test_problems_are_within_their_bounds_and_the_same_every_time():
    asked = problems(50)
    for one, other in zip(asked, problems(50), strict=True):
        assert np.array_equal(one.deep, other.deep)
        assert np.array_equal(one.around.cylinders, other.around.cylinders)
        x, y, z = one.deep[:3, 3]
        assert 0.5 <= z <= 1.6
        assert 0.8 <= np.hypot(x, y) <= 1.2
        turn = one.deep[:3, :3]
        assert np.allclose(turn @ turn.T, np.eye(3))
        assert np.linalg.det(turn) == pytest.approx(1.0)
        person, pillar = one.around.cylinders
        assert np.hypot(*(person[:2] - [x, y])) == pytest.approx(0.85)
        ahead = turn[:2, 0] / np.hypot(*turn[:2, 0])
        assert (person[:2] - [x, y]) @ ahead == pytest.approx(-0.85)  # the deep's x looks away
        assert np.hypot(*(pillar[:2] - [x, y])) > pillar[2] + 0.2


@pytest.mark.requirement(43)
def test_singular_sets_are_singular_where_they_say(arm):
    tenth = slice(0, 5)
    assert np.abs(np.sin(joint_sets(arm, "wrist", 50)[tenth, 4])).max() < 1e-12
    assert np.abs(np.sin(joint_sets(arm, "elbow", 50)[tenth, 2])).max() < 1e-12
    # link 6's origin is d6 from the wrist along its axis; the wrist is over the shoulder's axis
    flanges = inverted(arm.base) @ forward(arm, joint_sets(arm, "shoulder", 50)[tenth])
    flanges = flanges @ inverted(arm.tip)
    wrist = flanges[:, :2, 3] - arm.dh[5] * flanges[:, :2, 2]
    assert np.hypot(*wrist.T) == pytest.approx(arm.dh[3], abs=1e-9)


@pytest.mark.requirement(43)
def test_what_is_not_solved_is_counted(arm):
    targets = forward(arm, joint_sets(arm, "anywhere", 4))
    missed, error = ik_errors(arm, targets)
    assert missed == 0.0
    assert error <= 1e-9
    targets[0, 0, 3] += 10.0
    assert ik_errors(arm, targets)[0] == 0.25


@pytest.mark.requirement(43, 45)
def test_rows_of_kinematics_and_plans_have_times_and_errors(arm):
    rows = [*ik_rows(arm, rounds=1, poses=20), *plan_rows(arm, "paper", problems(FEW), 1)]
    own = [row for row in rows if row.variant == "cobodeck"]
    names = {row.name for row in own}
    many = [f"inverse kinematics of many, {kind}" for kind in bench.SETS]
    assert {f"{name}{end}" for name in many for end in ("", ": unsolved")} <= names
    assert {"plan paper", "plan paper, 99% quantile", "move paper, mean"} <= names
    for row in own:
        if row.goal is not None:
            assert row.error <= row.goal, row
        assert row.time_us is not None or row.error is not None


@pytest.mark.requirement(45, 142)
def test_moves_of_the_paper_take_longer_than_tuned_ones(arm, outcomes):
    paper = [bench.solved(arm, "paper", problem) for problem in problems(FEW)]
    assert np.mean(durations(paper)) > 1.5 * np.mean(durations(outcomes))


@pytest.mark.requirement(43)
def test_a_plan_through_somebody_is_noticed(outcomes):
    assert touching(outcomes) == 0
    first = next(o for o in outcomes if isinstance(o.answer, Plan))
    goal = first.query.goals[first.answer.goal]
    x, y = forward(first.query.checker.arm, goal)[:2, 3]
    person = Surroundings(np.zeros((0, 6)), np.array([[x, y, 0.3, 0.0, 1.8]]))
    blocked = CollisionChecker.of(first.query.checker.arm, person)
    query = replace(first.query, checker=blocked)
    assert touching([replace(first, query=query)]) == 1


@pytest.mark.requirement(67)
def test_another_answer_to_the_same_query_is_noticed(outcomes):
    assert differing(outcomes) == 0
    plans = [o for o in outcomes if isinstance(o.answer, Plan)]
    mixed = [replace(plans[0], answer=plans[1].answer), replace(plans[1], answer=NoPlan("none"))]
    assert differing(mixed) == 2


def test_only_reachable_problems_count_as_unsolved(outcomes):
    plans = [o for o in outcomes if isinstance(o.answer, Plan)]
    nowhere = replace(
        plans[0], query=replace(plans[0].query, goals=np.zeros((0, 6))), answer=NoPlan("far")
    )
    assert unsolved([plans[0], nowhere]) == 0.0
    assert unsolved([plans[0], replace(plans[1], answer=NoPlan("given up"))]) == 0.5


@pytest.mark.parametrize("name", IK_PEERS)
def test_a_peer_solves_the_same_arm(arm, name):
    if not found([name]):
        pytest.skip(f"{name} is not installed")
    q = np.array([0.3, -1.0, 1.0, -0.5, 1.2, 0.3])
    flange = inverted(arm.base) @ forward(arm, q) @ inverted(arm.tip)
    reached = forward(arm, solutions(IK_PEERS[name](arm)(flange)))
    wanted = arm.base @ flange @ arm.tip
    assert np.abs(reached - wanted).max(axis=(1, 2)).min() < 1e-3


@pytest.mark.parametrize(("profile", "own"), [("tuned", "parked"), ("paper", "parked_paper")])
def test_plans_start_where_the_profile_parks_the_arm(arm, profile, own):
    (problem,) = problems(1)
    assert bench.solved(arm, profile, problem).query.start.tolist() == list(getattr(arm.tool, own))


@pytest.mark.skipif(not found(["ompl"]), reason="needs the extra 'ompl'")
def test_ompl_is_asked_for_the_same_ways(arm):
    rows = list(plan_rows(arm, "tuned", problems(FEW), 1))
    names = {row.name for row in rows if row.variant == "cobodeck"}
    assert {row.name for row in rows if row.variant == "ompl"} == names
    assert not any(row.error for row in rows if row.variant == "ompl" and row.goal is not None)


def errors_of(rows, variant):
    return [row.error for row in rows if row.variant == variant and row.time_us is not None]


@pytest.mark.requirement(43)
def test_more_steps_bring_a_calibrated_chain_nearer(arm):
    rows = list(single_rows(arm, rounds=1, poses=3))
    found = errors_of(rows, "calibrated")
    assert found == sorted(found, reverse=True)
    assert found[0] > 1e-4
    assert found[-1] < 1e-9
    assert errors_of(rows, "cobodeck")[0] < 1e-9


def test_finer_samples_along_lines_are_more_exact(arm):
    asked = problems(2)
    by_samples = [row.error for row in duration_rows(arm, asked, 1, (3, 9, 33))]
    assert by_samples == sorted(by_samples, reverse=True)
    assert by_samples[-1] < 1.5
    rows = list(contact_rows(arm, asked, 1, (0.4, 0.1), count=12))
    by_step = errors_of(rows, "sampled")
    assert by_step == sorted(by_step, reverse=True)
    missed = {row.variant: row.error for row in rows if row.name.endswith("missed")}
    assert missed["cobodeck"] == 0.0


def test_the_committed_result_keeps_the_goals_of_errors_and_times():
    rows = json.loads((RESULTS / "arm.json").read_text())["rows"]
    own = [row for row in rows if row["variant"] == "cobodeck"]
    assert all(row["error"] <= row["goal"] for row in own if row["goal"] is not None)
    moves = {row["name"]: row["error"] for row in own if row["name"].startswith("move")}
    assert 3.2 <= moves["move paper, mean"] <= 5.3
    assert moves["move tuned, 50% quantile"] <= 2.3
    assert moves["move tuned, 95% quantile"] <= 3.5
