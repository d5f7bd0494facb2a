"""The machine of figure 4, with every leaf scripted: edges, priorities, errors."""

from __future__ import annotations

from typing import Any

import pytest

from cobodeck.testing.testing import ChartTester
from hw.geometry import Pose2, Pose3
from hw.samples import UserPose
from tests.behaviors.conftest import behaviour

STANDING = UserPose(Pose2(3.0, 4.0, 0.5), 0.5)
ASKED: tuple[str, dict[str, Any]] = ("requested", {"deep": Pose3(1.0, 2.0, 1.5), "since": 7})

TO_CHASE: dict[str, Any] = {}
TO_HAPTIC = {"chase/request": ASKED}
TO_ESCAPE = {"chase/danger": "required"}
TO_INFORM = {"chase/danger": "required", "escape/away/drive/no_pose": "none"}
TO_RETREAT = {"chase/follow/park": "failed"}
SERVED = {"haptic/serve/park": "parked", "haptic/serve/choose": "chosen"}
REACHED = SERVED | {"haptic/serve/drive": "arrived"}
PARKED = {"chase/follow/park": "parked", "chase/follow/leave": "away"}
CHOSEN = PARKED | {"chase/follow/wait/settled": "settled", "chase/follow/choose": "chosen"}
STUCK = {"chase/follow/drive/go": "stuck"}
NO_PATH = {"chase/follow/drive/go": "no_path"}
FAILS = {"chase/follow/stay/give_up": "failed"}
TO_ASK = {"chase/cornered": "cornered"}

EDGES = [
    pytest.param(TO_CHASE, {"chase/request": ASKED}, "haptic", id="R60 request"),
    pytest.param(TO_HAPTIC, {"haptic/release": "released"}, "chase", id="R61 release"),
    pytest.param(TO_HAPTIC | SERVED, {"haptic/serve/drive": "stuck"}, "chase", id="R61 stuck"),
    pytest.param(
        TO_HAPTIC | SERVED | {"haptic/serve/choose": "close"},
        {"haptic/serve/drive_close": "no_path"},
        "chase",
        id="R61 no path",
    ),
    pytest.param(
        TO_HAPTIC | REACHED,
        {"haptic/serve/reach": "no_solution", "haptic/serve/retreat": "parked"},
        "chase",
        id="R82 out of reach",
    ),
    pytest.param(TO_HAPTIC, {"haptic/serve/park": "failed"}, "chase", id="arm does not fold"),
    pytest.param(TO_CHASE, {"chase/danger": "required"}, "escape", id="R62 danger"),
    pytest.param(TO_ESCAPE, {"escape/away/drive/safe": "safe"}, "chase", id="R63 safe"),
    pytest.param(TO_ESCAPE, {"escape/away/drive/no_pose": "none"}, "inform", id="R64 no pose"),
    pytest.param(TO_ESCAPE, {"escape/away/drive/go": "no_way"}, "inform", id="R64 no way"),
    pytest.param(TO_INFORM, {"inform/ready": "restarted"}, "chase", id="R65 restart"),
    pytest.param(TO_INFORM, {"inform/operator": "helped"}, "chase", id="the operator helped"),
    pytest.param(TO_RETREAT, {"retreat/away/drive/no_pose": "none"}, "inform", id="R64 retreat"),
    pytest.param(TO_RETREAT, {"retreat/away/drive/safe": "safe"}, "chase", id="retreat, safe"),
    pytest.param(TO_RETREAT, {"retreat/fault": "there"}, "inform", id="fault in retreat"),
    pytest.param(TO_RETREAT, {"retreat/tracking": "lost"}, "inform", id="lost in retreat"),
    pytest.param(TO_RETREAT, {"retreat/away/drive/go": OSError()}, "inform", id="error in retreat"),
    pytest.param(TO_CHASE, TO_ASK, "ask", id="no way out"),
    pytest.param(TO_ASK, {"ask/ready": "restarted"}, "chase", id="no way out, restart"),
    pytest.param(TO_ASK, {"ask/operator": "helped"}, "chase", id="no way out, operator helped"),
    pytest.param(TO_ASK, {"ask/ready": OSError()}, "inform", id="error in asking"),
    pytest.param(TO_CHASE, {"chase/follow/park": "failed"}, "retreat", id="R66 park fails"),
    pytest.param(CHOSEN | STUCK, FAILS, "retreat", id="R66 stuck"),
    pytest.param(CHOSEN | NO_PATH, FAILS, "retreat", id="R66 no path"),
    pytest.param(CHOSEN, STUCK, "chase", id="R66 stays"),
    pytest.param(TO_CHASE, {"chase/fault": "there"}, "inform", id="fault in Chase"),
    pytest.param(TO_HAPTIC, {"haptic/fault": "there"}, "inform", id="fault in Haptic"),
    pytest.param(TO_ESCAPE, {"escape/fault": "there"}, "inform", id="fault in Escape"),
    pytest.param(TO_CHASE, {"chase/tracking": "lost"}, "inform", id="user lost in Chase"),
    pytest.param(TO_HAPTIC, {"haptic/tracking": "lost"}, "inform", id="user lost in Haptic"),
    pytest.param(TO_ESCAPE, {"escape/tracking": "lost"}, "inform", id="user lost in Escape"),
    pytest.param(TO_CHASE, {"chase/follow/park": OSError()}, "inform", id="error in Chase"),
    pytest.param(TO_HAPTIC, {"haptic/serve/park": OSError()}, "inform", id="error in Haptic"),
    pytest.param(TO_ESCAPE, {"escape/away/drive/go": OSError()}, "inform", id="error in Escape"),
]  # fmt: skip


@pytest.mark.requirement(58, 60, 61, 62, 63, 64, 65, 66, 82)
@pytest.mark.parametrize(("route", "script", "target"), EDGES)
def test_every_edge_of_the_machine_is_taken(
    sim: ChartTester, route: dict[str, Any], script: dict[str, Any], target: str
) -> None:
    sim.start("cobodeck", script=route | script)

    sim.wait(0.5)

    assert sim.path("chase", "haptic", "escape", "retreat", "inform", "ask")[-1] == target
    assert behaviour(sim) == target


@pytest.mark.requirement(59)
def test_it_starts_in_chase(sim: ChartTester) -> None:
    sim.start("cobodeck")
    sim.tick()

    assert behaviour(sim) == "chase"


@pytest.mark.requirement(69)
def test_ten_quiet_minutes_change_nothing(sim: ChartTester) -> None:
    sim.start("cobodeck", script=PARKED)

    sim.wait(600)

    assert sim.path("chase", "haptic", "escape", "inform") == ["chase"]


@pytest.mark.requirement(71, 86)
def test_danger_goes_before_a_request_of_the_same_tick(sim: ChartTester) -> None:
    sim.start("cobodeck", script={"chase/request": [ASKED, ASKED], "chase/danger": "required"})

    sim.until("escape", timeout=0.1)
    assert "haptic" not in sim.path("haptic")
    sim.end("escape/away/drive/safe", "safe")
    sim.until("haptic", timeout=0.1)


@pytest.mark.requirement(86)
def test_nothing_in_haptic_watches_for_danger(sim: ChartTester) -> None:
    sim.start("cobodeck")

    classes = {
        leaf.interface.name for leaf in sim.run.machine.leaves if leaf.path.startswith("haptic/")
    }
    assert "EscapeRequired" not in classes
    assert "Released" in classes


@pytest.mark.requirement(68, 71)
@pytest.mark.parametrize("behind", [{}, PARKED, CHOSEN])
def test_danger_ends_whatever_chase_is_doing_within_the_tick(
    sim: ChartTester, behind: dict[str, Any]
) -> None:
    sim.start("cobodeck", script=behind)
    sim.tick(3)
    assert behaviour(sim) == "chase"

    sim.end("chase/danger", "required")
    sim.tick()

    assert behaviour(sim) == "escape"
    assert not [path for path in sim.active if path.startswith("chase/")]


@pytest.mark.requirement(83)
@pytest.mark.parametrize(
    ("phase", "script"),
    [
        ("park", {}),
        ("drive", SERVED),
        ("reach", REACHED),
        ("hold", REACHED | {"haptic/serve/reach": "reached"}),
        ("retreat", REACHED | {"haptic/serve/reach": "failed"}),
    ],
)
def test_a_release_is_heard_in_every_phase(
    sim: ChartTester, phase: str, script: dict[str, Any]
) -> None:
    sim.start("cobodeck", script=TO_HAPTIC | script)
    sim.until(f"haptic/serve/{phase}", timeout=1)

    sim.end("haptic/release", "released")
    sim.tick()

    assert behaviour(sim) == "chase"


@pytest.mark.requirement(47, 87)
def test_after_a_release_the_arm_folds_before_anything_drives(sim: ChartTester) -> None:
    sim.start("cobodeck", script=TO_HAPTIC | {"haptic/release": "released"} | PARKED)

    sim.wait(1)

    after = sim.path()[sim.path().index("haptic/release") :]
    assert after.index("chase/follow/park") < after.index("chase/follow/wait/settled")


@pytest.mark.requirement(87)
def test_nothing_drives_before_the_arm_is_parked(sim: ChartTester) -> None:
    sim.start("cobodeck")

    sim.wait(5)

    assert "base" not in {
        part
        for leaf in sim.run.machine.leaves
        if leaf.path in sim.path()
        for part in leaf.interface.commands
    }


@pytest.mark.requirement(62, 87)
def test_escape_does_not_wait_for_the_arm(sim: ChartTester) -> None:
    sim.start("cobodeck")
    sim.tick(2)
    assert "chase/follow/park" in sim.active

    sim.end("chase/danger", "required")
    sim.tick()

    assert "escape/away/drive/go" in sim.active


@pytest.mark.requirement(113)
def test_an_escape_that_takes_too_long_has_failed(sim: ChartTester) -> None:
    sim.start("cobodeck", script=TO_ESCAPE)

    sim.until("inform", timeout=3.2)

    assert sim.now == pytest.approx(3.0, abs=0.04)


@pytest.mark.requirement(72)
def test_nothing_in_inform_commands_base_or_arm(sim: ChartTester) -> None:
    sim.start("cobodeck")

    commands = {
        part
        for leaf in sim.run.machine.leaves
        if leaf.path.startswith(("inform/", "ask/"))
        for part in leaf.interface.commands
    }
    assert commands == {"vr", "operator", "stop_line"}


@pytest.mark.requirement(65, 115)
@pytest.mark.parametrize("end", ["inform/ready restarted", "inform/operator helped"])
def test_inform_hands_chase_where_the_user_stands(sim: ChartTester, end: str) -> None:
    leaf, outcome = end.split()
    sim.start("cobodeck", script=TO_INFORM)
    sim.wait(2)
    assert behaviour(sim) == "inform"

    sim.end(leaf, outcome, user=STANDING)
    sim.until("chase", timeout=0.1)

    assert sim.run.value_of("shown") == STANDING
    assert sim.run.value_of("shown", "chase") == STANDING


@pytest.mark.requirement(116)
def test_chase_escape_inform_go_round_until_chase_finds_a_place(sim: ChartTester) -> None:
    rounds = 3
    sim.start(
        "cobodeck",
        script={
            "chase/follow/park": ["failed"] * rounds + ["parked"],
            "retreat/away/drive/no_pose": ["none"] * rounds,
            "inform/ready": ["restarted"] * rounds,
        },
    )

    sim.wait(2)

    again = ["chase", "retreat", "inform"] * rounds + ["chase"]
    assert sim.path("chase", "retreat", "inform") == again


@pytest.mark.requirement(60, 61)
def test_a_request_that_could_not_be_served_is_handed_to_chase_to_ignore(sim: ChartTester) -> None:
    sim.start("cobodeck", script={"chase/request": ASKED, "haptic/serve/park": "failed"})

    sim.wait(0.2)

    assert sim.run.value_of("refused") == 7


@pytest.mark.requirement(57)
def test_the_parameters_of_the_charts_are_numbers_with_units(sim: ChartTester) -> None:
    sim.start("cobodeck")

    for chart in sim.run.machine.library.values():
        assert all(parameter.about for parameter in chart.parameters.values()), chart.name
        assert chart.about
