"""No driving with the arm out, whatever the chart does; Escape is exempt (R46)."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.loop.wiring import wire
from cobodeck.setup.setup import open_setup
from cobodeck.testing.testing import ChartTester
from hw.geometry import Pose2, Twist2
from hw.people.live import LivePerson
from hw.samples import Joints, UserPose
from hw.sim.contact.moving import MovingArm
from hw.sim.mock import mock_world
from tests.cobodeck.conftest import base_of

DRIVE = "chase/follow/drive/go"
IN_FRONT = "user: u\nrepeat: false\nstart: {x: 1.2, y: 4.39}\nsteps: [stand: 600]\n"
"""Somebody who stands before the robot, which goes to their side."""
OUT = (0.0, -1.5, 1.0, 0.0, 1.5, 0.0)
AHEAD = Twist2(0.3)


def turn(arm: MovingArm, joints: Joints) -> None:
    """Let the arm go to these angles at even speeds."""
    here = arm.state.joints
    arm.follow([(0.0, here), (1.5, joints)])


@pytest.fixture(params=["paper", "tuned"])
def driving(sim: ChartTester, tmp_path: Path, request: pytest.FixtureRequest) -> ChartTester:
    """CoboDeck while Chase drives, Escape at the test's word."""
    user = tmp_path / "user.yaml"
    user.write_text(IN_FRONT)
    script: dict[str, Any] = {"chase/danger": [], "escape/away/drive/safe": []}
    chart = load_profile(request.param).chart
    sim.start(chart, script, scene="study", user=str(user), profile=request.param)
    sim.until(DRIVE, timeout=5)
    sim.tick(5)
    assert base_of(sim).selected[1:] == ("chase", None)
    assert base_of(sim).refusal is None
    return sim


@pytest.mark.requirement(46)
def test_a_drive_is_refused_while_the_arm_is_not_folded_and_says_why(driving: ChartTester) -> None:
    turn(driving.run.parts["arm"], OUT)
    driving.wait(1.0)

    def folds() -> bool:
        return bool({"chase/follow/park", "chase/follow/fold"} & {*driving.active})

    base = base_of(driving)
    assert DRIVE in driving.active
    assert base.selected == (Twist2(0.0), None, "arm")
    driving.wait(1.5)
    assert base_of(driving).base.twist == Twist2(0.0)
    assert driving.run.notes[DRIVE] == "the arm is not folded"
    driving.until(folds, timeout=20)
    driving.until(lambda: base.selected.lock is None, timeout=20)
    assert driving.run.parts["arm"].state.joints != pytest.approx(OUT, abs=0.1)


@pytest.mark.requirement(46, 87)
def test_escape_drives_even_if_the_arm_is_not_folded(driving: ChartTester) -> None:
    turn(driving.run.parts["arm"], OUT)
    driving.wait(1.0)
    is_paper = driving.run.machine.chart.name == "paper_cobodeck"
    driving.end("danger", "inside" if is_paper else "required")
    driving.tick()

    assert base_of(driving).selected[1:] == ("escape", "arm")


class Rig:
    """The base of a run on the mock, whose states stay out of the way."""

    def __init__(self, overlap: float, chart: str = "cobodeck") -> None:
        setup = open_setup(chart, scene="hall")
        safety = dataclasses.replace(setup.profile.safety, overlap=overlap)
        profile = dataclasses.replace(setup.profile, safety=safety)
        setup = dataclasses.replace(setup, profile=profile)
        self.person, robot = LivePerson(Pose2(7.0, 7.0)), setup.environment.robot
        limits = safety.limits(robot, setup.profile.robot.limits)
        self.world = mock_world(setup.scene, robot, self.person, limits)
        self.wired = wire(setup, self.world.parts)
        self.now = 0
        self.base = self.world.guard
        assert self.wired.base is self.base

    def tick(self, source: str | None = None, left: float = 9.0) -> str | None:
        """Who drives after one tick in which a source wants to."""
        self.now += 33_000_000
        self.person.push(self.now, UserPose(Pose2(7.0, 7.0), 0.0))
        self.world.advance(self.now)
        self.wired.inlet.poll(self.now)
        if source is not None:
            self.base.drive(AHEAD, source, left)
        self.base.tick(self.now)
        return self.base.selected.source

    def turn(self, joints: Joints) -> None:
        """Let the arm go there, while nobody drives."""
        turn(self.world.arm, joints)
        self.tick()
        while self.world.arm.state.moving:
            self.tick()


@pytest.mark.requirement(46)
@pytest.mark.parametrize("source", ["own", "chase", "haptic"])
def test_no_source_but_escape_drives_with_the_arm_out(source: str) -> None:
    rig = Rig(overlap=0.0)
    assert rig.tick(source) == source
    rig.turn(OUT)
    assert rig.tick(source, left=0.0) is None
    assert rig.base.refusal == "the arm is not folded"
    assert rig.tick("escape") == "escape"
    assert rig.base.refusal is None
    rig.base.release("escape")
    rig.turn(rig.world.robot.parked)
    assert rig.tick(source) == source


CARELESS = """
chart: careless
outcomes: [over]
data: {goal: {type: Pose2, initial: none}}
states:
  choose: {do: ChooseChasePose, out: {pose: goal}, next: {chosen: drive, none: .over}}
  drive:
    do: DriveTo
    in: {goal: goal}
    next: {arrived: .over, no_path: .over, stuck: .over, lost: .over}
"""


@pytest.mark.requirement(46)
def test_it_holds_for_a_chart_that_knows_of_no_arm(tmp_path: Path) -> None:
    file = tmp_path / "careless.yaml"
    file.write_text(CARELESS)
    rig = Rig(overlap=0.0, chart=str(file))
    assert rig.tick("own") == "own"
    rig.turn(OUT)
    assert rig.tick("own") is None
    assert rig.base.selected.lock == "arm"


@pytest.mark.requirement(46)
def test_with_the_operators_leave_a_haptic_drive_ends_while_the_arm_unfolds() -> None:
    rig = Rig(overlap=0.5)
    rig.turn(OUT)
    assert rig.tick("haptic", left=0.51) is None
    assert rig.tick("chase", left=0.1) is None
    assert rig.tick("haptic", left=0.5) == "docking"
    assert rig.tick("haptic", left=1.0) is None  # the way has got longer
    assert rig.tick("haptic", left=0.5) == "docking"
    rig.base.release("haptic")
    assert rig.tick() is None


@pytest.mark.requirement(46)
def test_a_stop_line_goes_before_everything() -> None:
    rig = Rig(overlap=0.5)
    rig.turn(OUT)
    rig.world.parts["stop_line"].pull("button")
    rig.tick()
    for source in ("escape", "haptic"):
        assert rig.tick(source, left=0.1) is None
    assert rig.base.refusal == "the stop line is pulled"


@pytest.mark.requirement(46)
@pytest.mark.parametrize("profile", ["paper", "tuned"])
def test_the_shipped_profiles_allow_no_overlap(profile: str) -> None:
    assert load_profile(profile).safety.overlap == 0.0
