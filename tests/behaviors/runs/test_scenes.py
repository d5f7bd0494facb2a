"""The four behaviours together in the reduced simulation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cobodeck.testing.testing import ChartTester
from engine.run.trace import TraceRecord

BEHAVIOURS = ("chase", "haptic", "escape", "inform")


def spans(sim: ChartTester) -> list[tuple[str, int, int]]:
    """Behaviours with the time of entry and of leaving, ns."""
    entered = [(r.subject, r.time) for r in sim.run.trace if _is_entry(r)]
    ends = [*(time for _, time in entered[1:]), round(sim.now * 1e9)]
    return [(name, begin, end) for (name, begin), end in zip(entered, ends, strict=True)]


def _is_entry(record: TraceRecord) -> bool:
    return record.kind == "enter" and record.subject in BEHAVIOURS


@pytest.mark.requirement(60, 61, 83, 88, 131, 143)
def test_three_requests_are_served_one_after_the_other(sim: ChartTester) -> None:
    sim.start("cobodeck", scene="study", requests=3)

    sim.wait(170)

    served = [r for r in sim.run.trace if r.kind == "enter" and r.subject == "haptic/serve/hold"]
    assert len(served) == 3
    assert sim.metrics is not None
    figures = sim.metrics()
    assert figures["contacts"] == 0
    assert figures["served"] == 3


@pytest.mark.requirement(67)
def test_the_same_scene_gives_the_same_trace(sim: ChartTester) -> None:
    hashes = set()
    for _ in range(2):
        sim.start("cobodeck", scene="study", requests=1)
        sim.wait(40)
        hashes.add(sim.run.trace.sha256())

    assert len(hashes) == 1


STUCK = """
scene: stuck
room: {outer: [[0.0, 0.0], [2.2, 0.0], [2.2, 5.0], [9.0, 5.0], [9.0, 12.0], [0.0, 12.0]]}
robot: {file: rbkairos_ur10, start: {x: 1.1, y: 0.9, yaw: 1.571}}
"""
IN_FRONT = """
user: in_front
about: Walks up to the robot at the end of a corridor, stays, and goes back into the hall.
start: {x: 1.1, y: 4.5, yaw: -1.571}
repeat: false
steps:
  - stand: 1
  - walk: {x: 1.1, y: 3.2, speed: 0.6}
  - stand: 4
  - walk: {x: 1.1, y: 9.0, speed: 0.8}
  - walk: {x: 6.0, y: 9.0, speed: 0.8}
  - stand: 30
"""


@pytest.mark.requirement(101, 116, 117)
def test_a_robot_at_a_dead_end_goes_round_the_loop_and_recovers(
    sim: ChartTester, tmp_path: Path
) -> None:
    (tmp_path / "stuck.yaml").write_text(STUCK)
    (tmp_path / "in_front.yaml").write_text(IN_FRONT)
    sim.start("cobodeck", scene=str(tmp_path / "stuck.yaml"), user=str(tmp_path / "in_front.yaml"))

    sim.wait(60)

    assert sim.metrics is not None
    assert sim.metrics()["contacts"] == 0
    behaviours = [name for name, _, _ in spans(sim)]
    rounds = list(zip(behaviours, behaviours[1:], behaviours[2:], strict=False))
    assert ("chase", "escape", "inform") in rounds
    last, begin, end = spans(sim)[-1]
    assert last == "chase"
    assert end - begin > 5 * 10**9


@pytest.mark.requirement(72)
def test_in_inform_the_base_comes_to_rest_and_stays(sim: ChartTester, tmp_path: Path) -> None:
    (tmp_path / "lost.yaml").write_text(
        "user: lost\nrepeat: false\nstart: {x: 5.5, y: 5.0, yaw: 0.0}\nsteps:\n"
        "  - stand: 1.5\n  - lose_tracking: 3\n  - stand: 30\n"
    )
    sim.start("cobodeck", scene="lab_a", user=str(tmp_path / "lost.yaml"))

    sim.until("inform", timeout=5)
    sim.wait(2.0)

    wheels: Any = sim.run.parts["base"].base
    assert wheels.twist.speed == 0.0
    sim.until("chase", timeout=10)


@pytest.mark.requirement(18, 114)
def test_the_robot_is_shown_from_the_tick_inform_begins_until_it_ends(sim: ChartTester) -> None:
    script = {"chase/danger": "required", "escape/away/drive/no_pose": "none"}
    sim.start("cobodeck", script=script, real=["inform/warn"])
    shown = sim.parts["vr"].commands
    sim.until("inform", timeout=1)
    assert shown[-1] == ("inform", True)

    sim.wait(1)
    assert shown[-1] == ("inform", True)
    sim.end("inform/ready", "restarted")
    sim.until("chase", timeout=0.1)

    assert shown[-1] == ("inform", False)


@pytest.mark.requirement(11, 18)
def test_only_inform_escape_and_a_robot_that_leaves_show_the_robot(sim: ChartTester) -> None:
    sim.start("cobodeck")

    showing = [v.path for v in sim.run.machine.leaves if "vr" in v.interface.commands]

    assert showing == [
        "chase/follow/leave",
        "escape/sign/show",
        "retreat/sign/show",
        "inform/warn",
        "ask/warn",
    ]
