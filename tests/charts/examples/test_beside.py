"""Changes beside a person that are YAML alone: a zone, a ring, a behaviour."""

from __future__ import annotations

import math
from typing import Any

import pytest

from cobodeck.project.named_files import EXAMPLES
from cobodeck.testing import ChartTester, EdgeCoverage
from hw.geometry import Pose2, Pose3
from hw.samples import UserPose

DEEP, USER = Pose3(2.0, 1.0, 1.5), UserPose(Pose2(1.0, 1.0), 0.0)
BUMPER = ("there", {"value": "bumper"})


def test_a_third_zone_is_left_when_the_user_walks_by(sim: ChartTester) -> None:
    sim.start("third_zone", scene="study", user="study", profile="paper")
    sim.until("escape", timeout=60.0)
    sim.until("chase", timeout=3.0)  # safe; `failed` leads to Inform, `zone` would not be left

    sim.assert_path("escape")
    truth: Any = sim.loop.plant.truth
    assert truth.body.distance_to(truth.base) > 2.0
    assert not sim.run.errors


@pytest.mark.parametrize("profile", ["tuned", "behind"])
def test_a_ring_behind_the_user_is_waited_on(sim: ChartTester, profile: str) -> None:
    sim.start("cobodeck", scene="hall", user="guest_who_looks", profile=profile)
    sim.until("chase/follow/drive", timeout=20.0)
    sim.until("chase/follow/wait", timeout=20.0)
    truth: Any = sim.loop.plant.truth

    off_the_view = abs(truth.body.bearing_to(truth.base))
    assert (off_the_view > math.radians(119.0)) is (profile == "behind")


def test_the_robot_waves_at_who_looks_at_it_and_folds_its_arm(sim: ChartTester) -> None:
    sim.start("waving", scene="hall", user="guest_who_looks")
    sim.until("wave", timeout=60.0)
    assert sim.now > 40.0  # they look for it after 40 s
    parked = joints(sim)
    sim.until("right", timeout=10.0)
    assert max(abs(a - b) for a, b in zip(joints(sim), parked, strict=True)) > 0.5
    sim.until("chase", timeout=10.0)
    assert joints(sim) == pytest.approx(parked, abs=0.02)
    sim.wait(25.0)
    sim.assert_path("wave")  # once, while they go on looking


def joints(sim: ChartTester) -> tuple[float, ...]:
    truth: Any = sim.loop.plant.truth
    found: tuple[float, ...] = truth.joints
    return found


HOW_WAVES_END = {
    "waved": {"left": "arrived", "right": "arrived", "fold": "parked"},
    "waved, the second half blocked": {"left": "arrived", "right": "blocked", "fold": "parked"},
    "waved, the second half given up": {"left": "arrived", "right": "failed", "fold": "failed"},
    "waved, blocked from the beginning": {"left": "blocked", "fold": "parked"},
    "waved, given up": {"left": "failed", "fold": "parked"},
    "waved, too slow": {},
    "haptic_request": {"request": ("requested", {"deep": DEEP, "since": 3})},
    "escape_required": {"danger": "required"},
    "user_lost": {"tracking": "lost"},
    "fault": {"fault": BUMPER},
}
HOW_ESCAPES_END = {
    "safe": {"safe": "outside"},
    "safe, after a pose that was not": {"safe": [], "go": ["reached", "reached"]},
    "failed": {"no_pose": "none"},
    "failed, no way": {"go": "no_way"},
    "failed, too slow": {},
    "user_lost": {"tracking": "lost"},
    "fault": {"fault": BUMPER},
}


@pytest.mark.parametrize(
    ("chart", "ends", "given"),
    [("wave", HOW_WAVES_END, {}), ("third_escape", HOW_ESCAPES_END, {"around": 2.0})],
)
def test_every_edge_of_a_behaviour_leads_where_it_should(
    sim: ChartTester, chart: str, ends: dict[str, Any], given: dict[str, Any]
) -> None:
    edges = EdgeCoverage()
    for end, script in ends.items():
        sim.start(chart, script, parameters=given)
        if script.get("safe") == []:
            sim.wait(1.0)
            sim.end("safe", "outside")
        sim.until(lambda: sim.outcome, timeout=20.0)
        assert sim.outcome == end.partition(",")[0]
        edges.add(sim.run)
    assert [line for line in edges.report(EXAMPLES) if line.startswith(" ")] == []


def test_a_touch_and_a_danger_go_before_the_wave(sim: ChartTester) -> None:
    parks = {"chase/stay/follow/park": ["parked"] * 9, "leave": ["away"] * 9}
    sim.start("waving", parks, real=("Wait", "Below"), signals={"user.gaze": 0.1})
    sim.signal("user.gaze", 0.1, hold=True)
    for leaf, outcome, outputs, after in (
        ("wave/danger", "required", {}, "escape"),
        ("wave/request", "requested", {"deep": DEEP, "since": 3}, "haptic"),
        ("wave/tracking", "lost", {}, "inform"),
    ):
        sim.until("wave", timeout=40.0)
        sim.end(leaf, outcome, **outputs)
        sim.until(after, timeout=1.0)
        sim.end(*BACK[after][:2], **BACK[after][2])
        sim.until("chase", timeout=1.0)


BACK: dict[str, tuple[str, str, dict[str, Any]]] = {
    "escape": ("escape/away/drive/safe", "safe", {}),
    "haptic": ("haptic/release", "released", {}),
    "inform": ("inform/ready", "restarted", {"user": USER}),
}
