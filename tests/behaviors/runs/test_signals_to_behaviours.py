"""From a signal to the behaviour: how fast, what ties give, and the whole table of edges."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from behaviors.profile.profile import Profile
from cobodeck.testing.testing import ChartTester
from hw.geometry import Pose2, Pose3, Twist2
from hw.samples import UserPose
from states.environment.environment import Environment
from tests.behaviors.conftest import behaviour

CHARTS = Path(__file__).parents[3] / "charts"
DEEP = Pose3(1.0, 2.0, 1.5)
ASKED: tuple[str, dict[str, Any]] = ("requested", {"deep": DEEP, "since": 7})
PARKED = {"chase/follow/park": "parked", "chase/follow/leave": "away"}
SETTLED = PARKED | {"chase/follow/wait/settled": "settled"}
DRIVING = SETTLED | {"chase/follow/choose": "chosen"}
PHASES = {
    "park": ({}, "chase/follow/park"),
    "leave": ({"chase/follow/park": "parked"}, "chase/follow/leave"),
    "wait": (PARKED, "chase/follow/wait/settled"),
    "choose": (SETTLED, "chase/follow/choose"),
    "drive": (DRIVING, "chase/follow/drive/go"),
    "approach": (PARKED | {"chase/follow/wait/far": "far"}, "chase/follow/approach/go"),
    "make_room": (PARKED | {"chase/follow/wait/crowded": "crowded"}, "chase/follow/make_room"),
    "stay": (SETTLED | {"chase/follow/choose": "none"}, "chase/follow/stay/settled"),
}

# figure 4, and what a robot needs beside it: lost tracking, faults and errors warn the user, and
# where there is no way out, though nobody is in danger, the operator is asked
FIGURE_4 = {
    ("chase", "haptic_request"): "haptic",  # R60
    ("chase", "escape_required"): "escape",  # R62
    ("chase", "failed"): "retreat",  # R66: Escape, but safe only at a pose
    ("haptic", "released"): "chase",  # R61
    ("haptic", "failed"): "chase",
    ("escape", "safe"): "chase",  # R63
    ("escape", "failed"): "inform",  # R64
    ("retreat", "safe"): "chase",
    ("retreat", "failed"): "inform",
    ("inform", "restarted"): "chase",  # R65
    ("chase", "cornered"): "ask",
    ("ask", "restarted"): "chase",
    ("ask", "error"): "inform",
} | {
    (behaviour, trouble): "inform"
    for behaviour in ("chase", "haptic", "escape", "retreat")
    for trouble in ("user_lost", "fault", "error")
}


@pytest.mark.requirement(57, 58, 59, 60, 61, 62, 63, 64, 65, 66)
def test_the_top_chart_has_the_edges_of_figure_4_and_no_other() -> None:
    chart = yaml.safe_load((CHARTS / "cobodeck.yaml").read_text())

    found = {
        (name, outcome): target
        for name, node in chart["states"].items()
        for outcome, target in node["next"].items()
    }

    assert found == FIGURE_4
    assert next(iter(chart["states"])) == "chase"
    uses = {name: node["use"] for name, node in chart["states"].items()}
    assert uses == {name: name for name in uses} | {"ask": "inform", "retreat": "escape"}


@pytest.mark.requirement(68, 71, 102)
@pytest.mark.parametrize("phase", PHASES)
def test_danger_leaves_every_phase_of_chase_in_its_tick(sim: ChartTester, phase: str) -> None:
    script, where = PHASES[phase]
    sim.start("cobodeck", script, real=["chase/danger"], signals={"escape.required": False})
    sim.until(where, timeout=1)
    sim.tick(3)
    assert where in sim.active

    sim.signal("escape.required", True)
    sim.tick()

    assert behaviour(sim) == "escape"


@pytest.mark.requirement(60, 73, 102)
@pytest.mark.parametrize("phase", PHASES)
def test_a_request_leaves_every_phase_of_chase_in_its_tick(sim: ChartTester, phase: str) -> None:
    script, where = PHASES[phase]
    sim.start("cobodeck", script, real=["chase/request"])
    sim.until(where, timeout=1)
    sim.tick(3)
    assert where in sim.active

    sim.signal("vr.haptic_request", DEEP)
    sim.tick()

    assert behaviour(sim) == "haptic"
    assert sim.run.value_of("deep") == DEEP


@pytest.mark.requirement(71, 86)
def test_danger_and_request_in_one_tick_are_escape_then_haptic(sim: ChartTester) -> None:
    sim.start(
        "cobodeck", PARKED, real=["chase/danger", "chase/request"],
        signals={"escape.required": False},
    )  # fmt: skip
    sim.tick(5)

    sim.signal("escape.required", True)
    sim.signal("vr.haptic_request", DEEP)
    sim.tick()
    assert behaviour(sim) == "escape"
    sim.signal("escape.required", False)
    sim.end("escape/away/drive/safe", "safe")
    sim.tick(2)

    assert sim.path("chase", "haptic", "escape") == ["chase", "escape", "chase", "haptic"]


@pytest.mark.requirement(86, 105, 117)
@pytest.mark.parametrize(
    "phase", ["haptic/serve/park", "haptic/serve/choose", "haptic/serve/drive", "haptic/serve/hold"]
)
def test_danger_waits_from_the_entry_of_haptic_to_the_release_and_comes_then(
    sim: ChartTester, phase: str
) -> None:
    """Escape is off during Haptic, its drive included; after the Release it may come at once."""
    steps = ["park", "choose", "drive", "reach"]
    ends = {"park": "parked", "choose": "chosen", "drive": "arrived", "reach": "reached"}
    done = steps[: (*steps, "hold").index(phase.rpartition("/")[2])]
    script = {"chase/request": ASKED} | {f"haptic/serve/{step}": ends[step] for step in done}
    sim.start("cobodeck", script, real=["chase/danger"], signals={"escape.required": False})
    sim.until(phase, timeout=1)

    for _ in range(150):
        sim.signal("escape.required", True)
        sim.tick()
        assert behaviour(sim) == "haptic"
    sim.end("haptic/release", "released")
    sim.tick(2)

    assert sim.path("haptic", "escape", "chase")[-2:] == ["chase", "escape"]


TIES = [  # the monitor, the action that ends in the same tick, and who wins
    ({}, ("chase/danger", "required"), ("chase/follow/park", "failed"), "escape_required"),
    ({}, ("chase/request", ASKED), ("chase/follow/park", "failed"), "haptic_request"),
    (DRIVING, ("chase/danger", "required"), ("chase/follow/drive/go", "stuck"), "escape_required"),
    (DRIVING, ("chase/fault", "there"), ("chase/follow/drive/go", "stuck"), "fault"),
    ({}, ("chase/tracking", "lost"), ("chase/follow/park", "failed"), "user_lost"),
]


@pytest.mark.requirement(68)
@pytest.mark.parametrize(("route", "monitor", "action", "outcome"), TIES)
def test_in_a_tie_the_monitor_wins_over_the_action(
    sim: ChartTester, route: dict[str, Any], monitor: Any, action: Any, outcome: str
) -> None:
    sim.start("cobodeck", route)
    sim.tick(3)

    for path, how in (action, monitor):
        name, outputs = (how, {}) if isinstance(how, str) else how
        sim.end(path, name, **outputs)
    sim.tick()

    ended = [r.detail[0] for r in sim.run.trace if r.kind == "outcome" and r.subject == "chase"]
    assert ended == [outcome]


@pytest.mark.requirement(63, 64, 68)
@pytest.mark.parametrize(("monitor", "outcome"), [("fault", "there"), ("tracking", "lost")])
def test_an_escape_that_is_safe_with_a_fault_in_one_tick_goes_on_to_inform(
    sim: ChartTester, monitor: str, outcome: str
) -> None:
    sim.start("cobodeck", {"chase/danger": "required"})
    sim.tick(3)
    assert behaviour(sim) == "escape"

    sim.end("escape/away/drive/safe", "safe")
    sim.end(f"escape/{monitor}", outcome)
    sim.tick()

    assert behaviour(sim) == "inform"


@pytest.mark.requirement(57)
def test_an_edit_of_the_yaml_is_enough_to_change_what_the_robot_does(
    sim: ChartTester, tmp_path: Path
) -> None:
    """Escape gives up after 1 s, and a Chase that fails warns the user instead of escaping."""
    for name in ("cobodeck", "escape"):
        text = (CHARTS / f"{name}.yaml").read_text()
        text = text.replace("default: 3 s", "default: 1 s").replace(
            "failed: retreat", "failed: inform"
        )
        (tmp_path / f"{name}.yaml").write_text(text)
    chart = str(tmp_path / "cobodeck.yaml")

    sim.start(chart, {"chase/danger": "required"})
    sim.until("inform", timeout=1.1)
    assert sim.now == pytest.approx(1.0, abs=0.04)
    sim.finish()

    sim.start(chart, {"chase/follow/park": "failed"})
    sim.tick(2)
    assert sim.path("chase", "retreat", "inform") == ["chase", "inform"]


@pytest.mark.requirement(115)
def test_the_restart_counts_from_the_tick_it_comes_and_only_in_inform(
    sim: ChartTester, tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    environment = environment_of(tuned)
    fixed = {"environment": environment, "settings": tuned.settings}
    seen = {
        "base.pose": Pose2(10.0, 10.0), "base.twist": Twist2(0.0), "user.velocity": Twist2(0.0),
        "user.pose": UserPose(Pose2(14.0, 10.0), 0.0),
        "escape.planner": environment.static_planners["escape"],
    }  # fmt: skip
    sim.start("cobodeck", {}, real=["inform/ready"], signals=fixed | seen)

    def go_on(ticks: int) -> None:
        for _ in range(ticks):
            for name, value in seen.items():
                sim.signal(name, value)
            sim.tick()

    sim.signal("vr.restart", True)
    go_on(3)
    for path, outcome in (("chase/danger", "required"), ("escape/away/drive/no_pose", "none")):
        sim.end(path, outcome)
    go_on(125)
    assert behaviour(sim) == "inform"  # a restart from before is no restart

    sim.signal("vr.restart", True)
    go_on(1)

    assert behaviour(sim) == "chase"
    assert sim.run.value_of("shown") == seen["user.pose"]


@pytest.mark.requirement(70)
def test_every_state_of_the_charts_says_what_it_reads_and_commands(sim: ChartTester) -> None:
    """States read signals, process, and send commands; what they do not declare is refused."""
    sim.start("cobodeck", real=["chase/danger"], signals={"escape.required": False})
    danger: Any = sim.run.nodes["chase/danger"]

    assert set(danger.interface.reads) == {"escape.required"}
    assert danger.interface.commands == ()
    commanding = {
        leaf.interface.name: set(leaf.interface.commands) for leaf in sim.run.machine.leaves
    }
    assert commanding["Approach"] == commanding["DriveTo"] == commanding["MakeRoom"] == {"base"}
    assert commanding["DriveToBest"] == {"base"}
    assert commanding["Leave"] == {"base", "vr"}
    assert commanding["ParkArm"] == {"arm"}
    sim.tick()
    with pytest.raises(LookupError):
        danger.context.value("user.pose")
    with pytest.raises(LookupError):
        danger.context.part("base")
