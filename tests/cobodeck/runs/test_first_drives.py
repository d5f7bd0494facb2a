"""Charts that begin with a drive, at both tiers: it waits for the first pose, and hits nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main

pytestmark = pytest.mark.usefixtures("own_path")

STATES = '''\
from engine import Action, Context, Run
from hw import Pose2


class Tour(Action):
    """Gives places in the hall."""

    outcomes = ("given",)
    outputs = {"given": {"first": Pose2, "goals": tuple[Pose2, ...]}}

    def run(self, ctx: Context) -> Run:
        return "given", {"first": Pose2(2.0, 10.0), "goals": (Pose2(3.0, 8.5), Pose2(2.0, 7.0))}
'''
ENDS = "no_path: .failed, lost: .failed"
CHARTS = {
    "tour": f"""\
chart: tour
outcomes: [done, failed]
data: {{first: {{type: Pose2, initial: none}}, goals: {{type: list of Pose2, initial: none}}}}
states:
  plan: {{do: Tour, out: {{first: first, goals: goals}}, next: {{given: go}}}}
  go: {{do: DriveTo, in: {{goal: first}}, next: {{arrived: on, stuck: .failed, {ENDS}}}}}
  on: {{do: DriveThrough, in: {{goals: goals}}, next: {{arrived: .done, stuck: .failed, {ENDS}}}}}
""",
    "follow_me": f"""\
chart: follow_me
outcomes: [failed]
states:
  follow: {{do: Follow, with: {{distance: 2.5 m}}, next: {{{ENDS}}}}}
""",
}


def figures_of(
    chart: str, tier: int, folder: Path, capsys: pytest.CaptureFixture[str], *more: str
) -> dict[str, Any]:
    package = folder / "own_tours"
    package.mkdir()
    (folder / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nown = "own_tours.states"\n'
    )
    (package / "states.py").write_text(STATES)
    for name, text in CHARTS.items():
        (package / f"{name}.yaml").write_text(text)
    main(["simulate", chart, "--scene", "hall", "--tier", str(tier), "--json", *more])
    figures: dict[str, Any] = json.loads(capsys.readouterr().out)
    return figures


@pytest.mark.parametrize("tier", [1, 2])
def test_a_tour_is_driven_from_the_first_tick(
    tier: int, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = figures_of("tour", tier, folder, capsys)

    assert (figures["outcome"], figures["errors"]) == ("done", [])
    assert (figures["wall_hits"], figures["contacts"]) == (0, 0)


@pytest.mark.parametrize("tier", [1, 2])
def test_a_walker_is_followed_from_the_first_tick(
    tier: int, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = figures_of("follow_me", tier, folder, capsys, "--user", "demo", "--duration", "30")

    assert (figures["outcome"], figures["errors"]) == (None, [])
    assert (figures["wall_hits"], figures["contacts_by_robot"]) == (0, 0)
    assert figures["beside_share"] > 0.8
