"""A parameter of a campaign, drawn: the same file each time, values to scale, nothing made up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from cobodeck.pictures import campaign_picture
from cobodeck.pictures.campaign_picture import draw_parameter

KNOWN = {"mean": 6.0, "share": 0.02, "low": 0.01, "high": 0.04}


def row(value: Any, known: bool = True) -> dict[str, Any]:
    shares = ("contacts", "contacts_by_robot", "unserved", "escape_failures")
    return {
        "value": value,
        "response_s": KNOWN if known else None,
        "shares": dict.fromkeys(shares, KNOWN if known else None),
        "least_gap_m": 0.3 if known else None,
    }


def svg(folder: Path, *rows: dict[str, Any]) -> str:
    path = folder / "p.svg"
    draw_parameter({"name": "chase.risk", "values": rows}, path)
    return path.read_text()


def test_the_same_tables_give_the_same_file(tmp_path: Path) -> None:
    assert svg(tmp_path, row(3), row(6)) == svg(tmp_path, row(3), row(6))


@pytest.mark.parametrize(
    ("labels", "places"),
    [
        (["3", "6", "12"], [3.0, 6.0, 12.0]),
        (["12", "3"], [0.0, 1.0]),
        (["100 ms", "2 s"], [0.0, 1.0]),
        (["lab_a"], [0.0]),
        (["3", "3"], [0.0, 1.0]),
        (["nan", "inf"], [0.0, 1.0]),
    ],
)
def test_rising_numbers_stand_to_scale_and_all_else_side_by_side(
    labels: list[str], places: list[float]
) -> None:
    from cobodeck.pictures.campaign_picture import _places

    assert _places(labels) == places


def test_what_there_is_none_of_is_not_drawn(tmp_path: Path) -> None:
    empty = svg(tmp_path, row("lab_a", known=False), row("lab_b", known=False))

    assert empty.count(">none<") == 6
    assert svg(tmp_path, row("lab_a"), row("lab_b")).count(">none<") == 0


def test_gaps_of_contacts_are_inside_of_their_panel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr(campaign_picture, "save_figure", lambda figure, _: drawn.append(figure))
    rows = [row(3) | {"least_gap_m": gap} for gap in (-0.05, 0.0)]

    draw_parameter({"name": "chase.risk", "values": rows}, tmp_path / "p.svg")

    *shares, gaps = drawn[0].axes
    assert gaps.get_ylim()[0] < -0.05
    assert list(gaps.lines[-1].get_ydata()) == [-0.05, 0.0]
    assert {axes.get_ylim()[0] for axes in shares} == {0.0}
