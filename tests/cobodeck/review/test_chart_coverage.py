"""A chart drawn with how often recorded runs took each of its edges."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest

from cobodeck.__main__ import main
from cobodeck.project import Catalogue, catalogue, open_chart
from cobodeck.record.read.reader import Record
from cobodeck.review.chart_coverage import edge_counts
from cobodeck.setup.options import Options
from engine.draw import dot, mermaid
from engine.files.text import noting
from tests.cobodeck.review.runs import recorded

pytestmark = pytest.mark.slow
LOGIC = Options(tier=0, seed=4, duration_s=150.0)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Counter[tuple[str, str]]]:
    """A record, and how often the trace tells that a move led from a child with an outcome."""
    path = tmp_path_factory.mktemp("coverage") / "run.mcap"
    trace = recorded(path, LOGIC).wired.run.trace
    moves: Counter[tuple[str, str]] = Counter()
    for record in trace:
        if record.kind == "move":
            child, outcome, _ = record.detail
            moves[f"{record.subject}/{child}".lstrip("/"), outcome] += 1
    return path, moves


@cache
def known() -> Catalogue:
    return catalogue(own=False)


@cache
def counted(path: Path, name: str, runs: int = 1) -> Mapping[tuple[str, str], int]:
    said: list[str] = []
    chart, library = open_chart(name, known())
    found = edge_counts(chart, library, [Record(path)] * runs, known(), said.append)
    assert said == []
    return found


def test_each_move_of_the_trace_is_counted_and_what_never_happened_is_0(
    run: tuple[Path, Counter[tuple[str, str]]],
) -> None:
    path, moves = run
    found = counted(path, "cobodeck")

    assert moves
    assert {event: found[event] for event in moves} == moves
    assert 0 in found.values()
    assert counted(path, "cobodeck", 2) == {event: 2 * n for event, n in found.items()}


def test_a_used_chart_is_counted_where_it_was_used(
    run: tuple[Path, Counter[tuple[str, str]]],
) -> None:
    path, _ = run
    whole, chase = counted(path, "cobodeck"), counted(path, "chase")

    inside = {p.removeprefix("chase/"): p for p, _ in whole if p.startswith("chase/")}
    assert any(chase.values())
    for (node, outcome), count in chase.items():
        assert count == whole[inside[node], outcome]


def test_a_changed_chart_counts_where_it_leads_as_it_did(
    run: tuple[Path, Counter[tuple[str, str]]],
) -> None:
    path, _ = run
    said: list[str] = []
    chart, library = open_chart("cobodeck", known())
    child = next(c for c in chart.root.children if c.name == "chase")
    elsewhere = replace(child, next={**child.next, "haptic_request": "escape"})
    source = replace(chart.source, text=chart.source.text + "\n")
    others = [elsewhere if c is child else c for c in chart.root.children]
    changed = replace(chart, root=replace(chart.root, children=tuple(others)), source=source)

    found = edge_counts(changed, library, [Record(path)], known(), said.append)
    before = counted(path, "cobodeck")

    assert "cobodeck was another" in said[0]
    assert found["chase", "haptic_request"] == 0 < before["chase", "haptic_request"]
    assert found["chase", "escape_required"] == before["chase", "escape_required"]


def test_counts_stand_in_the_picture_and_add_no_colour(
    run: tuple[Path, Counter[tuple[str, str]]], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, moves = run
    assert main(["render", "cobodeck", "--coverage", str(path), "-o", "x.svg"]) == 0
    root = ElementTree.parse("x.svg").getroot()
    shown = [t.text or "" for t in root.iter("{http://www.w3.org/2000/svg}text")]
    struck = [
        t.text
        for t in root.iter("{http://www.w3.org/2000/svg}text")
        if t.get("text-decoration") == "line-through"
    ]

    assert f"haptic_request ×{moves['chase', 'haptic_request']}" in shown
    assert struck
    assert all(text is not None and text.endswith("×0") for text in struck)

    chart, library = open_chart("cobodeck", known())
    plain, marked = dot(chart, library), dot(chart, library, counts=counted(path, "cobodeck"))
    assert set(re.findall("#[0-9a-f]{6}", marked)) == set(re.findall("#[0-9a-f]{6}", plain))
    times = f"#{ord('×')};"  # as Mermaid has it
    assert times in mermaid(chart, library, counts=counted(path, "cobodeck"))
    assert "×" not in plain
    assert times not in mermaid(chart, library)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["paper_chase", "--coverage", "RUN"], "cobodeck ran, without paper_chase"),
        (["RUN", "--coverage", "RUN"], "is drawn on a CHART"),
        (["--scene", "lab_a", "--coverage", "RUN"], "is drawn on a CHART"),
        (["chase", "--coverage", "none.mcap"], "none.mcap: cannot be read"),
    ],
)
def test_what_cannot_be_counted_is_said(
    run: tuple[Path, Counter[tuple[str, str]]],
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    said: str,
) -> None:
    given = [str(run[0]) if argument == "RUN" else argument for argument in arguments]
    with noting():
        assert main(["render", *given]) != 0
    assert said in capsys.readouterr().err
