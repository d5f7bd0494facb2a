"""From the states through the multiplexer to the base, in running charts (R41, R42, R71)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.testing.testing import ChartTester
from engine.machine.node import Substitute
from engine.machine.vertices import Leaf
from hw.geometry import Pose2, Twist2
from hw.model.robot import load_robot
from hw.samples import UserPose
from hw.scene.scene import load_scene
from states.environment.environment import Environment
from states.navigation.states import DriveTo
from tests.cobodeck.conftest import base_of

DRIVE, FLEE = "chase/follow/drive/go", "escape/away/drive/go"
IN_FRONT = "user: u\nrepeat: false\nstart: {x: 1.2, y: 4.39}\nsteps: [stand: 600]\n"
"""Somebody who stands before the robot, which goes to their side."""
WEST = Twist2(-0.3)


def never_lets_go(sim: ChartTester) -> None:
    """Chase's drive is one whose clean-up does nothing."""
    leaf = sim.run.machine.vertices[DRIVE]
    assert isinstance(leaf, Leaf)

    class Hanging(DriveTo):
        def run(self, ctx: Any, goal: Pose2) -> Any:
            while ctx.now >= 0:
                ctx.part("base").drive(WEST, self.subsystem)
                yield None
            return "arrived"

    sim.run.put_in(DRIVE, Substitute(Hanging, leaf.interface.outputs))


@pytest.fixture
def driving(sim: ChartTester, tmp_path: Path) -> ChartTester:
    """CoboDeck while Chase drives, Escape at the test's word."""
    user = tmp_path / "user.yaml"
    user.write_text(IN_FRONT)
    script = {"chase/danger": [], "escape/away/drive/safe": []}
    sim.start("cobodeck", script, scene="study", user=str(user))
    sim.until(DRIVE, timeout=5)
    sim.tick(5)
    assert base_of(sim).selected.source == "chase"
    return sim


@pytest.mark.requirement(41, 71)
def test_escape_drives_in_the_tick_in_which_danger_is_seen(driving: ChartTester) -> None:
    driving.end("danger", "required")
    driving.tick()

    beside = ["fault", "tracking", "sign/calm", "away/drive/safe", "away/drive/no_pose"]
    assert driving.active == [*(f"escape/{name}" for name in beside), FLEE]
    assert base_of(driving).selected.source == "escape"


@pytest.mark.requirement(42, 71)
def test_a_navigation_whose_cancel_never_answers_does_not_keep_escape_from_driving(
    sim: ChartTester,
) -> None:
    script = {"chase/danger": [], "escape/fault": [], "inform/ready": []}
    script["escape/away/drive/safe"] = []
    sim.start("cobodeck", script, scene="study")
    never_lets_go(sim)
    sim.until(DRIVE, timeout=60)
    sim.tick(5)
    base = base_of(sim)
    assert base.selected[:2] == (WEST, "chase")

    sim.end("danger", "required")
    for _ in range(10):
        base.drive(WEST, "chase")  # it goes on, whoever has taken over
        sim.tick()
        assert base.selected.source == "escape"
    sim.end("escape/fault", "there")
    sim.tick(10)
    assert base.selected[:2] == (WEST, "chase")  # its last word still counts
    sim.tick(6)

    assert "inform/warn" in sim.active
    assert base.selected.source is None
    sim.wait(1.0)
    assert base.base.twist.speed == 0.0


@pytest.mark.requirement(42)
def test_a_drive_that_is_over_has_released_the_base(driving: ChartTester) -> None:
    driving.until("chase/follow/wait", timeout=30)

    assert base_of(driving).selected.source is None


@pytest.mark.requirement(42, 149)
def test_a_drive_that_says_nothing_any_more_is_stopped(driving: ChartTester) -> None:
    leaf = driving.run.nodes[DRIVE]
    leaf.step = lambda: None
    driving.tick(15)
    assert base_of(driving).selected.source == "chase"

    driving.wait(2.0)

    assert DRIVE in driving.active
    assert base_of(driving).selected.source is None
    assert base_of(driving).base.twist.speed == 0.0


@pytest.mark.requirement(41, 48)
def test_a_pulled_stop_line_locks_the_base_in_the_tick_in_which_it_is_seen(
    driving: ChartTester,
) -> None:
    driving.run.parts["stop_line"].pull("button")
    driving.tick()

    assert base_of(driving).selected[1:] == (None, "stop")


@pytest.mark.requirement(41)
def test_the_operator_s_stop_takes_the_base_from_whoever_drives(driving: ChartTester) -> None:
    driving.operator.stop()
    driving.tick()

    assert driving.outcome is not None
    assert base_of(driving).selected.source is None


@pytest.mark.requirement(41)
def test_in_a_pause_nobody_drives_and_afterwards_the_drive_goes_on(driving: ChartTester) -> None:
    driving.operator.pause()
    driving.tick()
    assert base_of(driving).selected.source is None

    driving.operator.resume()
    driving.tick()
    assert base_of(driving).selected.source == "chase"


@pytest.mark.requirement(35, 41)
def test_each_behaviour_drives_as_itself(sim: ChartTester) -> None:
    sim.start("cobodeck", scene="lab_a")
    found: dict[str, set[str]] = {}
    for _ in range(3000):
        sim.tick()
        source = base_of(sim).selected.source
        if source is not None:
            found.setdefault(source, set()).update(p.partition("/")[0] for p in sim.active)

    assert found == {"chase": {"chase"}, "haptic": {"haptic"}, "escape": {"escape"}}


def test_a_real_drive_works_on_a_stand_in_and_releases_it(
    sim: ChartTester, environment: Environment
) -> None:
    found = {"pose": Pose2(3.0, 5.0), "user": UserPose(Pose2(9.0, 9.0), 0.0)}
    script = {
        "park": "parked", "leave": "away", "wait/settled": "settled", "choose": ("chosen", found),
    }  # fmt: skip
    signals = {
        "environment": environment,
        "base.mode": "omni",
        "base.pose": Pose2(3.0, 3.0),
        "base.twist": Twist2(0.0),
    }
    sim.start("chase", script, real=["drive/go"], signals=signals)

    sim.tick(3)

    told = sim.parts["base"].commands
    assert [name for name, *_ in told] == ["stop", "stop", "drive", "drive", "drive"]
    assert told[2][2] == "chase"
    sim.end("drive/settled", "settled")
    sim.end("choose", "none")
    sim.tick()
    assert told[-2:] == [("release", "chase"), ("stop",)]  # the next state that drives begins
    assert not sim.parts.moving


@pytest.fixture
def environment() -> Environment:
    return load_profile("tuned").environment(load_scene("lab_a").room, load_robot("rbkairos_ur10"))
