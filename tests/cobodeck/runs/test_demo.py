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
REQUESTS = 2
"""As many as it takes until every edge is taken; 5 in the slow form."""


@pytest.mark.requirement(59, 60, 61, 62, 63, 64, 65)
@pytest.mark.parametrize("requests", [REQUESTS, pytest.param(5, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("profile", "edges"), [("paper", EDGES | WARNED), ("tuned", EDGES)])
def test_beside_a_person_who_corners_the_robot_every_edge_of_the_machine_is_taken(
    profile, edges, requests, tmp_path, capsys
):
    """In `tuned` it never gives up: nobody has to be warned."""
    record = tmp_path / "cornered.jsonl"
    arguments = ["--scene", "cornered", "--requests", str(requests), "--json", "--profile", profile]
    assert main(["simulate", *arguments, "--record", str(record)]) == 0
    result = json.loads(capsys.readouterr().out)
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    moves = [line for line in lines if isinstance(line, list) and line[1:3] == ["move", ""]]
    assert {tuple(move[3:6]) for move in moves} >= edges
    entered = [line[2] for line in lines if isinstance(line, list) and line[1] == "enter"]
    assert entered[1] == "chase"
    assert (result["requests"], result["served"]) == (requests, requests)
    if profile == "tuned":
        assert result["contacts"] == 0


@pytest.mark.parametrize(
    ("scene", "requests"),
    [
        ("lab_a", REQUESTS),
        *(pytest.param(scene, 5, marks=pytest.mark.slow) for scene in ("lab_a", "lab_b", "hall")),
    ],
)
def test_the_demo_serves_every_request_without_a_contact(scene, requests, capsys):
    wanted = ["--scene", scene, "--user", "demo", "--requests", str(requests)]
    assert main(["simulate", *wanted, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["requests"], result["served"], result["contacts"]) == (requests, requests, 0)
