"""Charts that begin with a drive, at both tiers: it waits for the first pose, and hits nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main

ENDS = "no_path: .failed, lost: .failed"
CHARTS = {
    "tour": f"""\
chart: tour
outcomes: [done, failed]
data: {{goals: {{type: list of Pose2, initial: [{{x: 3 m, y: 8.5 m}}, {{x: 2 m, y: 7 m}}]}}}}
states:
  go:
    do: DriveTo
    in: {{goal: {{x: 2 m, y: 10 m}}}}
    next: {{arrived: on, stuck: .failed, {ENDS}}}
  on: {{do: DriveThrough, in: {{goals: goals}}, next: {{arrived: .done, stuck: .failed, {ENDS}}}}}
""",
    "follow_me": f"""\
chart: follow_me
outcomes: [failed]
states:
  follow: {{do: Follow, with: {{distance: 2.5 m}}, next: {{{ENDS}}}}}
""",
}
TIERS = pytest.mark.parametrize("tier", [1, pytest.param(2, marks=pytest.mark.slow)])


def figures_of(
    chart: str, tier: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], *more: str
) -> dict[str, Any]:
    file = tmp_path / f"{chart}.yaml"
    file.write_text(CHARTS[chart])
    main(["simulate", str(file), "--scene", "hall", "--tier", str(tier), "--json", *more])
    figures: dict[str, Any] = json.loads(capsys.readouterr().out)
    return figures


@TIERS
def test_a_tour_is_driven_from_the_first_tick(
    tier: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = figures_of("tour", tier, tmp_path, capsys)

    assert (figures["outcome"], figures["errors"]) == ("done", [])
    assert (figures["wall_hits"], figures["contacts"]) == (0, 0)


@TIERS
def test_a_walker_is_followed_from_the_first_tick(
    tier: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = figures_of("follow_me", tier, tmp_path, capsys, "--user", "demo", "--duration", "30")

    assert (figures["outcome"], figures["errors"]) == (None, [])
    assert (figures["wall_hits"], figures["contacts_by_robot"]) == (0, 0)
    assert figures["beside_share"] > 0.8
