"""The paper's charts beside section 4.4: each sentence's node is there."""

from __future__ import annotations

import re

import pytest

from cobodeck.project import CHARTS
from engine.chart.load import load_files

PAPER = CHARTS / "paper"
ROWS = [
    line.strip("|\n ").split(" | ")
    for line in (PAPER / "README.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("| ") and "`" in line
]
LIBRARY = load_files(sorted(PAPER.glob("*.yaml")))


def nodes(cell: str) -> list[tuple[str, str]]:
    """The nodes that a cell of the table names, each with its chart, which counts for the next."""
    chart, found = "", []
    for quoted in re.findall(r"`([^`]*)`", cell):
        named, _, node = quoted.rpartition(": ")
        chart = named or chart
        if chart:
            found.append((chart, node))
    return found


def there(chart: str) -> set[str]:
    """The names of the nodes of a chart, and of their ways out as `node.outcome`."""
    found = set()
    for node in LIBRARY[chart].root.walk():
        found |= {node.name, *(f"{node.name}.{way}" for way in node.next)}
    return found


@pytest.mark.requirement(58)
def test_each_node_that_stands_beside_a_sentence_is_in_its_chart() -> None:
    named = [pair for _, cell in ROWS for pair in nodes(cell)]

    assert len(ROWS) > 25
    assert not [pair for pair in named if pair[1] not in there(pair[0])]
