"""The dummy stage: a recorded person without a human, beside a robot simulated or mocked (R56)."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import OK


@pytest.fixture
def walk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A recording of somebody who walks round a circle of 2.5 m at 0.7 m/s, 30 samples a second."""
    monkeypatch.chdir(tmp_path)
    rows = [
        f"1,{n / 30:.4f},{2.5 * math.cos(0.28 * n / 30):.4f},{2.5 * math.sin(0.28 * n / 30):.4f}"
        for n in range(900)
    ]
    (tmp_path / "walk.csv").write_text("\n".join(["id,t,x,y", *rows]) + "\n")
    return "walk.csv#1@7,7,0"


COMMANDS = {
    "mock": ["run", "cobodeck", "--robot", "mock", "--fast"],
    "simulated": ["simulate", "cobodeck"],
}


@pytest.mark.requirement(24, 56)
@pytest.mark.parametrize("robot", COMMANDS)
@pytest.mark.few(1)
def test_the_same_recording_runs_beside_either_robot(
    walk: str, robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [*COMMANDS[robot], "--scene", "hall", "--user", walk, "--duration", "15", "--json"]

    runs: list[dict[str, Any]] = []
    for _ in range(2):
        assert main(arguments) == OK
        runs.append(json.loads(capsys.readouterr().out))

    first, second = runs
    assert first["trace_sha256"] == second["trace_sha256"]
    assert first["sim_s"] == 15.0
    assert first["walking_s"] > 12.0
    assert first["distance_m"] > 1.0
    assert first["contacts"] == 0
