"""The demo serves every request and touches nobody; the cornered robot takes every edge."""

from __future__ import annotations

import json

import pytest

from cobodeck.__main__ import main

EDGES = {
    ("chase", "haptic_request", "haptic"),
    ("haptic", "released", "chase"),
    ("chase", "escape_required", "escape"),
    ("escape", "safe", "chase"),
}
WARNED = {("escape", "failed", "inform"), ("inform", "restarted", "chase")}


@pytest.mark.requirement(59, 60, 61, 62, 63, 64, 65)
@pytest.mark.parametrize(("profile", "edges"), [("paper", EDGES | WARNED), ("tuned", EDGES)])
def test_beside_a_person_who_corners_the_robot_every_edge_of_the_machine_is_taken(
    profile, edges, tmp_path, capsys
):
    """In `tuned` it never gives up: nobody has to be warned."""
    record = tmp_path / "cornered.jsonl"
    arguments = ["--scene", "cornered", "--requests", "5", "--json", "--profile", profile]
    assert main(["simulate", *arguments, "--record", str(record)]) == 0
    result = json.loads(capsys.readouterr().out)
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    moves = [line for line in lines if isinstance(line, list) and line[1:3] == ["move", ""]]
    assert {tuple(move[3:6]) for move in moves} >= edges
    entered = [line[2] for line in lines if isinstance(line, list) and line[1] == "enter"]
    assert entered[1] == "chase"
    assert (result["requests"], result["served"]) == (5, 5)
    if profile == "tuned":
        assert result["contacts"] == 0


@pytest.mark.parametrize("scene", ["lab_a", "lab_b", "hall"])
@pytest.mark.few(1)
def test_the_demo_serves_every_request_without_a_contact(scene, capsys):
    assert main(["simulate", "--scene", scene, "--user", "demo", "--requests", "5", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["requests"], result["served"], result["contacts"]) == (5, 5, 0)
