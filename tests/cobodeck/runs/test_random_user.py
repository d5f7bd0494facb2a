"""Random people are safe and served: nothing touches them, and each request has its answer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import OK
from tests.repeats import SHORT


@pytest.fixture
def wandered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Any:
    monkeypatch.chdir(tmp_path)

    def wander(
        scene: str, requests: int, seed: int, user: str = "random", *more: str
    ) -> dict[str, Any]:
        wanted = ["--scene", scene, "--requests", str(requests), "--seed", str(seed), *more]
        assert main(["simulate", "--user", user, *wanted, "--json"]) == OK
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return found

    return wander


REFUSALS = {
    "DEEP in, behind or too near a wall",
    "no Haptic pose",
    "Haptic poses cut off",
    "DEEP out of reach",
}


def check(figures: dict[str, Any], requests: int, faults: int = 0) -> None:
    assert figures["requests"] == requests
    assert figures["served"] + figures["refused"] == requests
    assert set(figures["refusals"]) <= REFUSALS
    assert figures["served"] > 0.5 * requests
    assert (figures["contacts"], figures["wall_hits"]) == (0, 0)
    assert figures["faults"] <= faults
    assert figures["min_gap_m"] > 0.0
    assert figures["sim_s"] < 60.0 * requests  # it has come to its end, not to that of the time


@pytest.mark.requirement(56, 64, 65, 116)
@pytest.mark.parametrize("scene", ["lab_a", pytest.param("lab_b", marks=pytest.mark.slow)])
@pytest.mark.parametrize("requests", [5, pytest.param(10, marks=pytest.mark.slow)])
def test_requests_of_a_random_person_are_answered_without_a_contact(
    wandered: Any, scene: str, requests: int
) -> None:
    check(wandered(scene, requests, seed=2), requests)


@pytest.mark.parametrize(
    ("kind", "reaction"), [("hasty", 0.4773316158870233), ("deaf", None), ("instant", 0.0)]
)
def test_figures_tell_the_manner_of_the_person(
    wandered: Any, kind: str, reaction: float | None
) -> None:
    figures = wandered("lab_a", 1, 1, f"random:{kind}", "--duration", "1")

    assert (figures["manner"], figures["reaction_s"]) == (kind, reaction)


@pytest.mark.requirement(49, 116)
@pytest.mark.slow
def test_after_a_contact_the_run_goes_on_and_the_contact_stays_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    wanted = ["--scene", "study", "--profile", "paper", "--requests", "8"]
    wanted += [
        "--set",
        "robot.base_acceleration=0.5 m/s2",
        "--set",
        "charts.paper_escape.must_reach=true",
    ]
    assert main(["simulate", *wanted, "--json"]) == OK
    figures = json.loads(capsys.readouterr().out)

    assert figures["contacts"] >= 1  # the robot is slower than its user
    assert figures["fault_names"]["bumper: person"] == figures["contacts"]
    assert figures["served"] + figures["refused"] == figures["requests"] == 8
    assert figures["sim_s"] < 60.0 * 8


@pytest.mark.slow
@pytest.mark.requirement(56, 64, 65, 116, 117)
@pytest.mark.parametrize("scene", ["lab_a", "lab_b"])
def test_many_requests_of_a_random_person_are_answered_without_a_contact(
    wandered: Any, scene: str
) -> None:
    """The robot may have to be shown, and the operator asked, where there is no way out."""
    requests = 25 if SHORT else 100
    figures = wandered(scene, requests, seed=0, user="random:instant")

    check(figures, requests, faults=2)
    assert figures["signs"] > 0  # it was shown to them, and both went on
