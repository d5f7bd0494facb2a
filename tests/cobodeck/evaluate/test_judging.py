"""A run is judged alike by the truth, by a recorded truth, and by what is measured."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.evaluate.arm_contact import ArmWatch
from cobodeck.evaluate.evaluators import STILL, arm_outline, prop_of
from cobodeck.evaluate.figures import NOTHING
from cobodeck.evaluate.measured_truth import Senses
from cobodeck.evaluate.metrics import Evaluator, MotionHash
from cobodeck.evaluate.proximity import DriveWatch, WalkingGap
from cobodeck.evaluate.requests import RequestWatch
from cobodeck.loop.loop import Loop
from cobodeck.loop.sample_router import Inlet
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.terminal.console import OK
from engine.signals.board import Board
from engine.signals.signal_kinds import declare
from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.samples import ArmState, Sample, UserPose
from hw.truth import Truth

ROBOT = load_robot("rbkairos_ur10")
SECOND = 10**9
SLOW = (
    "robot.base_acceleration=0.5 m/s2",
    "escape.distances=[1.0 m, 1.75 m, 2.5 m]",
    "charts.paper_escape.must_reach=true",
)


class Kept:
    """An observer that keeps a copy of the truth of each tick; afterwards a plant that gives it."""

    def __init__(self, loop: Loop) -> None:
        self._plant = loop.plant
        self.kept: list[tuple[int, Truth]] = []
        self.truth: Truth | None = None

    def watch(self, now_ns: int) -> None:
        self.kept.append((now_ns, copy.deepcopy(self._plant.truth)))  # type: ignore[arg-type]

    def again(self, evaluator: Evaluator) -> dict[str, Any]:
        for now_ns, truth in self.kept:
            self.truth = truth
            evaluator.watch(now_ns)
        evaluator.finish()
        return evaluator.report()


def ran(
    scene: str, profile: str, seconds: float, user: str | None = None, sets: tuple[str, ...] = ()
) -> tuple[Loop, Kept]:
    loop = stage(open_setup(None, scene, profile, sets=sets), Options(user, 2))
    kept = Kept(loop)
    outline = ROBOT.footprint
    senses = Evaluator(
        Senses(loop.wired.inlet, outline),
        True,
        RequestWatch(prop_of(ROBOT), base=DriveWatch(outline, STILL)),
        measured=True,
        walking_gap=WalkingGap(outline),
    )
    loop.observers = (*loop.observers, kept, senses)
    loop.go(round(seconds * SECOND))
    return loop, kept


@pytest.fixture(scope="module")
def touched() -> tuple[Loop, Kept]:
    """A robot that is slower than its user; with a contact at 98 s."""
    return ran("lab_a", "paper", 110.0, "cornering:instant", SLOW)


def figures(loop: Loop, *, measured: bool = False) -> dict[str, Any]:
    found = next(o for o in loop.observers if isinstance(o, Evaluator) and o.measured is measured)
    found.finish()
    return found.report()


@pytest.mark.slow
def test_over_recorded_truth_the_figures_are_the_same(touched: tuple[Loop, Kept]) -> None:
    loop, kept = touched
    requests = RequestWatch(prop_of(ROBOT), base=DriveWatch(ROBOT.footprint))
    arm = ArmWatch(arm_outline(ROBOT))
    again = Evaluator(kept, True, requests, arm, walking_gap=WalkingGap(ROBOT.footprint))

    found = kept.again(again)

    assert found == figures(loop)
    assert found["contacts"] == 1
    assert found["served"] >= 1


def test_a_contact_is_told_with_time_place_part_and_cause(touched: tuple[Loop, Kept]) -> None:
    loop, kept = touched
    (contact,) = figures(loop)["contact_list"]

    assert (contact["part"], contact["by"], contact["granted"]) == ("base", "person", False)
    _, before = next(pair for pair in reversed(kept.kept) if pair[0] / 1e9 < contact["at_s"])
    assert before.body is not None
    assert before.body.distance_to(Pose2(contact["x"], contact["y"])) == pytest.approx(0.5, abs=0.1)
    assert contact["person_closing_m_s"] > 0.5 > contact["robot_closing_m_s"]


def test_measured_figures_are_near_the_true_ones_and_say_what_they_are(
    touched: tuple[Loop, Kept],
) -> None:
    loop, _ = touched
    true, measured = figures(loop), figures(loop, measured=True)

    assert measured.keys() == true.keys()
    assert (true["measured"], measured["measured"]) == (False, True)
    for name in ("requests", "served", "refused"):
        assert measured[name] == true[name]
    assert measured["situations"] == pytest.approx(true["situations"], abs=1)
    near = pytest.approx
    assert measured["response_s"]["mean"] == near(true["response_s"]["mean"], abs=0.07)
    braked_s = math.sqrt(2.0 * STILL / 0.5)  # the last centimetre, at 0.5 m/s2
    assert 0.0 <= measured["arm_s"]["mean"] - true["arm_s"]["mean"] <= braked_s + 0.04
    gaps = measured["least_gap_walking_m"], true["least_gap_walking_m"]
    assert gaps[0] == near(gaps[1], abs=0.05)
    assert measured["walking_s"] == near(true["walking_s"], rel=0.05)
    assert measured["beside_share"] == near(true["beside_share"], abs=0.05)
    assert measured["distance_m"] == near(true["distance_m"], rel=0.03)
    assert measured["min_gap_m"] == near(true["min_gap_m"], abs=0.05)
    for name in ("contacts", "contacts_by_robot", "contacts_slow_arm", "contact_list"):
        assert measured[name] is None
    assert (measured["wall_hits"], measured["energy_j"]) == (None, None)


# -- what is measured, sample by sample ----------------------------------------------------------


class Heard:
    """Samples given to an inlet one by one."""

    def __init__(self) -> None:
        self.inlet = Inlet(Board(declare(())))
        self.senses = Senses(self.inlet, ROBOT.footprint)
        requests = RequestWatch(None, heard=False)
        self.judge = Evaluator(self.senses, True, requests, measured=True)

    def hear(self, at_s: float, **values: Any) -> Truth:
        now = round(at_s * SECOND)
        for name, value in values.items():
            self.inlet.deliver(Sample(name.replace("__", "."), now, value), now)
        self.judge.watch(now)
        return self.senses.truth


def test_what_does_not_flow_leaves_its_figures_null() -> None:
    heard = Heard()
    for n in range(10):
        heard.hear(n / 10, base__pose=Pose2(n / 10, 0.0))
    heard.judge.finish()

    found = heard.judge.report()

    assert found["distance_m"] == pytest.approx(0.9)
    for name in ("situations", "walking_s", "beside_share", "dropouts", "min_gap_m"):
        assert found[name] is None
    assert found["requests"] is found["served"] is found["refused"] is None


def test_noise_of_a_base_that_stands_is_no_way() -> None:
    heard = Heard()
    for n in range(1000):
        truth = heard.hear(n / 30, base__pose=Pose2(0.01 * math.sin(n), 0.01 * math.cos(7 * n)))

    assert truth.distance_m == 0.0


def test_a_person_who_is_lost_is_nowhere_until_they_are_seen_again() -> None:
    heard, here, there = Heard(), UserPose(Pose2(2.0, 0.0, 1.0), 1.5), Pose2(0.0, 0.0)
    seen = heard.hear(1.0, base__pose=there, user__pose=here)
    assert (seen.body, seen.head_turn, seen.seen_ns) == (here.body, 0.5, SECOND)

    assert heard.hear(1.4, base__pose=there).body == here.body
    assert heard.hear(1.6, base__pose=there).body is None
    assert heard.hear(1.7, base__pose=there, user__pose=here).body == here.body
    heard.judge.finish()

    assert heard.judge.report()["dropouts"] == [
        {"from_s": 0.0, "to_s": 1.0},
        {"from_s": 1.0, "to_s": 1.7},
    ]


def test_joints_and_requests_are_as_they_were_told_last() -> None:
    heard, joints = Heard(), (0.1,) * 6
    truth = heard.hear(0.1, arm__joints=ArmState(joints, (0.0,) * 6, moving=True))

    assert (truth.joints, truth.arm_moving, truth.contacts) == (joints, True, None)
    deep = Pose3(1.0, 2.0, 1.3)
    assert heard.hear(0.2, vr__haptic_request=deep).request == deep
    assert heard.hear(0.3).request == deep
    assert heard.hear(0.4, vr__haptic_request=None).request is None


# -- the hash of the motion ----------------------------------------------------------------------

STANDING = Truth(base=Pose2(1.0, 2.0, 0.3), body=Pose2(0.0, 1.0, 0.0), joints=(0.1, 0.2))


def hashed(*snapshots: Truth) -> str | None:
    motion = MotionHash()
    for n, truth in enumerate(snapshots):
        motion.watch(n, truth)
    return motion.sha256


@pytest.mark.parametrize(
    "other",
    [
        STANDING._replace(base=Pose2(math.nextafter(1.0, 2.0), 2.0, 0.3)),
        STANDING._replace(body=Pose2(-0.0, 1.0, 0.0)),
        STANDING._replace(joints=(0.1, math.nextafter(0.2, 0.0))),
        STANDING._replace(base=STANDING.body, body=STANDING.base),
        STANDING._replace(base=None),
    ],
)
def test_one_bit_of_motion_is_another_hash(other: Truth) -> None:
    assert hashed(STANDING, other) != hashed(STANDING, STANDING)
    assert hashed(STANDING, other) == hashed(STANDING, other)


def test_who_moved_is_in_the_hash() -> None:
    assert hashed(Truth(base=STANDING.base)) != hashed(Truth(body=STANDING.base))


def test_what_moves_nothing_does_not_count_and_nothing_at_all_is_null() -> None:
    assert hashed(STANDING) == hashed(STANDING._replace(energy_j=7.0, speed=1.0))
    assert hashed(Truth(), Truth(request=None)) is None


# -- on real parts, from the command line --------------------------------------------------------

DRIVERS = '''
from hw.geometry import STILL, Pose2, Pose3
from hw.samples import Sample, UserPose


class Standing:
    """A base that stands."""

    signals = ("base.pose", "base.twist")
    mode = "omni"

    def __init__(self, now):
        pass

    def drive(self, command):
        pass

    def use(self, mode):
        pass

    def stop(self):
        pass

    def samples(self, now_ns):
        return [Sample("base.pose", now_ns, Pose2(0.0, 0.0)), Sample("base.twist", now_ns, STILL)]


class Walking:
    """Somebody who comes nearer at 1 m/s."""

    signals = ("user.pose",)

    def __init__(self, now):
        pass

    def samples(self, now_ns):
        return [Sample("user.pose", now_ns, UserPose(Pose2(4.0 - now_ns * 1e-9, 0.0, 3.14), 3.14))]


class Asking:
    """They ask for a touch after half a second."""

    signals = ("vr.haptic_request",)

    def __init__(self, now):
        self.told = None

    def inform(self, show, sign=True, least=0.0):
        pass

    def stop(self):
        pass

    def samples(self, now_ns):
        asked = now_ns > 5e8
        if asked == self.told:
            return []
        self.told = asked
        return [Sample("vr.haptic_request", now_ns, Pose3(1.0, 0.0, 1.2) if asked else None)]
'''
CHART = """
chart: waits
outcomes: [asked, required]
any:
  danger: {watch: EscapeRequired, next: {required: .required}}
  request: {watch: HapticRequest, next: {requested: .asked}}
"""
CONNECTION = """
connection: here
model: rbkairos_ur10
parts:
  base: {driver: "judged_drivers:Standing"}
  trackers: {driver: "judged_drivers:Walking"}
  vr: {driver: "judged_drivers:Asking"}
"""


@pytest.fixture
def real(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    monkeypatch.chdir(tmp_path)
    project = '[project]\nname = "own"\n[project.entry-points."cobodeck.states"]\n'
    (tmp_path / "pyproject.toml").write_text(f'{project}own = "judged_drivers"\n')
    files = {"judged_drivers.py": DRIVERS, "waits.yaml": CHART, "here.yaml": CONNECTION}
    for name, text in files.items():
        (tmp_path / name).write_text(text)

    def run(*more: str) -> str:
        call = ["run", "waits.yaml", "--robot", "here.yaml", "--scene", "lab_a", *more]
        assert main(call) == OK
        return capsys.readouterr().out

    return run


@pytest.mark.slow
def test_a_run_on_real_parts_has_the_figures_of_what_was_measured(real: Any) -> None:
    found = json.loads(real("--json"))

    assert (found["measured"], found["outcome"]) == (True, "asked")
    assert (found["requests"], found["served"], found["situations"]) == (1, None, 0)
    assert 0.2 < found["walking_s"] < 0.6
    assert (found["beside_share"], found["beside_share_3_4"]) == (1.0, 1.0)
    assert found["min_gap_m"] == pytest.approx(4.0 - 0.565 - 0.5 - found["sim_s"], abs=0.05)
    assert found["contacts"] is found["wall_hits"] is found["contact_list"] is None
    assert found.keys() >= NOTHING.keys()


def test_where_nobody_can_ask_for_a_touch_all_else_is_judged(real: Any, tmp_path: Path) -> None:
    (tmp_path / "here.yaml").write_text(CONNECTION[: CONNECTION.index("  vr:")])
    (tmp_path / "waits.yaml").write_text(CHART[: CHART.index("  request:")].replace("asked, ", ""))

    found = json.loads(real("--json"))

    assert (found["outcome"], found["requests"]) == ("required", None)
    assert found["walking_s"] > 0.2


def test_the_summary_of_a_run_on_real_parts_says_that_it_was_measured(real: Any) -> None:
    shown = real()

    title = shown.splitlines()[0]
    assert title.startswith("waits in lab_a: tuned (")
    assert title.endswith("; measured, not true")
    assert "requests served  - of 1" in shown
    assert "contacts         not known; least gap" in shown
