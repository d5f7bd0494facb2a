"""What `make demo` shows: every edge of the machine, every request served, nobody touched."""

from __future__ import annotations

import json

import pytest

from cobodeck.__main__ import main

EDGES = {
    ("chase", "haptic_request", "haptic"),
    ("haptic", "released", "chase"),
    ("chase", "escape_required", "escape"),
    ("escape", "safe", "chase"),
    ("escape", "failed", "inform"),
    ("inform", "restarted", "chase"),
    ("chase", "failed", "escape"),
}


@pytest.mark.requirement(59, 60, 61, 62, 63, 64, 65, 66)
def test_the_demo_takes_every_edge_of_the_machine(tmp_path, capsys):
    record = tmp_path / "demo.jsonl"
    arguments = ["--scene", "lab_a", "--user", "demo", "--requests", "5", "--json"]
    assert main(["simulate", *arguments, "--record", str(record)]) == 0
    result = json.loads(capsys.readouterr().out)
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    moves = [line for line in lines if isinstance(line, list) and line[1:3] == ["move", ""]]
    assert {tuple(move[3:6]) for move in moves} >= EDGES
    entered = [line[2] for line in lines if isinstance(line, list) and line[1] == "enter"]
    assert entered[1] == "chase"
    assert (result["requests"], result["served"], result["contacts"]) == (5, 5, 0)
