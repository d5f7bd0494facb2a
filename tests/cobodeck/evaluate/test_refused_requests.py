"""Of what walls are in the way of, the place and the numbers are told, and how to go on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.evaluate.refusals import NO_POSE, TOO_NEAR
from cobodeck.terminal.console import FAILED, OK

AHEAD = 0.75


@pytest.fixture
def simulated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Any:
    """Simulates one request by a person who stands at x and looks at the wall x = 0."""
    monkeypatch.chdir(tmp_path)

    def run(x: float, side: float, *more: str, code: int = OK) -> tuple[str, str]:
        Path("asker.yaml").write_text(
            "user: asker\nrepeat: false\nsteps:\n  - stand: 1\n"
            f"  - request: {{hold: 12, ahead: {AHEAD}, height: 1.2}}\n  - stand: 1\n"
        )
        Path("room.yaml").write_text(
            f"scene: room\nroom: {{outer: [[0, 0], [{side}, 0], [{side}, {side}], [0, {side}]]}}\n"
            f"robot: {{start: {{x: 3.6, y: {side / 2}, yaw: 0}}}}\n"
            f"user: {{source: asker.yaml, start: {{x: {x}, y: {side / 2}, yaw: 3.14159265}}}}\n"
        )
        words = ["simulate", "--scene", "room.yaml", "--requests", "1", "--duration", "20"]
        assert main([*words, *more]) == code
        found = capsys.readouterr()
        return found.out, found.err

    return run


@pytest.mark.parametrize(("gap", "reason"), [(0.15, TOO_NEAR), (0.28, NO_POSE)])
@pytest.mark.few(1)
def test_a_deep_too_near_a_wall_comes_with_its_distance_and_the_one_that_is_needed(
    simulated: Any, gap: float, reason: str
) -> None:
    figures = json.loads(simulated(AHEAD + gap, 9.0, "--json")[0])
    (refused,) = figures["refused_requests"]
    wall = refused["wall"]

    assert figures["refusals"] == {reason: 1}
    assert (wall["x"], wall["gap"]) == pytest.approx((0.0, gap), abs=1e-3)
    assert wall["needed"] > gap
    served = json.loads(simulated(AHEAD + wall["needed"] + 0.02, 9.0, "--json")[0])
    assert (served["served"], served["refused_requests"]) == (1, [])
    told = simulated(AHEAD + gap, 9.0)[0]
    assert (
        f"{gap:.2f} m from the wall at (0.0, 4.5); the robot needs {wall['needed']:.2f} m" in told
    )


@pytest.mark.requirement(124)
def test_a_room_that_is_refused_can_be_run_in_all_the_same_and_the_run_says_so(
    simulated: Any,
) -> None:
    refused = simulated(1.8, 5.5, code=FAILED)[1]
    out, _ = simulated(1.8, 5.5, "--set", "navigation.quarter=3 m")
    figures = json.loads(simulated(1.8, 5.5, "--set", "navigation.quarter=3 m", "--json")[0])

    assert "the largest is of 3.5 m" in refused
    assert "--set 'navigation.quarter=2 m'" in refused
    assert "navigation.quarter=3 m" in out.splitlines()[0]
    assert "the largest is of 3.5 m" in figures["small_floor"]
    assert figures["served"] == 1
