"""Tier 3, end to end: with all sensors, base and arm moved by physics."""

from __future__ import annotations

import sys
from dataclasses import replace

import pytest

from cobodeck.run.build_run import stage
from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.terminal.console import Problem

PHYSICAL = Options(requests=1, tier=3, seed=5)


def test_tier_3_without_its_extra_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(Problem, match=r"tier 3 needs the package mujoco: .*cobodeck\[reference\]"):
        stage(open_setup(scene="study"), PHYSICAL)


def test_tier_3_says_which_robots_it_cannot_move() -> None:
    pytest.importorskip("mujoco", reason="the extra `reference` is not installed")
    setup = open_setup(scene="study")
    robot, arm = setup.robot, setup.robot.arm
    assert arm is not None
    rolling = replace(robot, base=replace(robot.base, modes=("differential",)))
    with pytest.raises(Problem, match="tier 3 needs Mecanum wheels"):
        stage(replace(setup, robot=rolling), PHYSICAL)
    weightless = replace(robot, arm=replace(arm, model=replace(arm.model, masses={})))
    with pytest.raises(Problem, match="arm ur10: tier 3 needs the masses of its links"):
        stage(replace(setup, robot=weightless), PHYSICAL)


@pytest.mark.slow
@pytest.mark.requirement(22)
def test_equal_seeds_give_equal_runs() -> None:
    pytest.importorskip("mujoco", reason="the extra `reference` is not installed")
    short = replace(PHYSICAL, requests=None, duration_s=4.0)
    first, again, other = (
        simulate(open_setup(scene="study"), options).figures
        for options in (short, short, replace(short, seed=6))
    )
    assert first["distance_m"] > 0.5
    names = ("trace_sha256", "motion_sha256")
    assert [first[name] for name in names] == [again[name] for name in names]
    assert first["motion_sha256"] != other["motion_sha256"]


@pytest.mark.slow
@pytest.mark.requirement(22, 25)
def test_a_request_is_served_by_physics() -> None:
    """Within what the paper asks of the prop, and about as fast as in the other tiers."""
    pytest.importorskip("mujoco", reason="the extra `reference` is not installed")
    found = {
        tier: simulate(open_setup(scene="study"), replace(PHYSICAL, tier=tier)).figures
        for tier in (1, 3)
    }
    physical = found[3]
    assert (physical["served"], physical["requests"], physical["errors"]) == (1, 1, [])
    assert physical["contacts"] == physical["faults"] == 0
    assert physical["prop_error_m"]["max"] <= 0.02
    assert physical["localization"]["rmse_m"] <= 0.01
    assert physical["response_s"]["mean"] == pytest.approx(found[1]["response_s"]["mean"], rel=0.1)
