"""The table of `cobodeck/FIGURES.md`, made from the committed JSON of a benchmark run."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

PAGE = Path("cobodeck/FIGURES.md")
RESULT = Path(__file__).with_name("engine.json")
BEGIN, END = "<!-- bench engine -->\n", "<!-- bench engine end -->"
ROWS = {
    "no new sample": "tick, no new sample",
    "every tick recorded": "… every tick recorded",
    "five fresh samples": "… five fresh samples",
    "100 in parallel": "tick, 100 in parallel",
    "edge without timeout": "edge without timeout",
    "edge with timeout": "edge with timeout",
    "a lock set": "edge, a lock set elsewhere",
    "guard out of a two-leaf any": "guard out of a two-leaf `any`",
    "guard out of a chart as in chase": "guard out of a chart as in `chase`",
    "load and check 1000 leaves": "load and check 1000 leaves (to a C-YAML parse)",
    "read 10000 numbers": "read an input of 10 000 numbers (to a float)",
}
NOTE = (
    "py_trees makes the 1000 leaves in Python, without a file; transitions and python-statemachine "
    "read JSON."
)
VARIANTS = ("cobodeck", "py_trees", "transitions", "python-statemachine", "sismic")


def table(result: Mapping[str, Any]) -> str:
    """The rows of an engine benchmark as a Markdown table, with the machine's name."""
    ratios = {(row["name"], row["variant"]): row["ratio"] for row in result["rows"]}
    lines = [f"| | {' | '.join(VARIANTS)} |", "|---|" + "---|" * len(VARIANTS)]
    for name, about in ROWS.items():
        cells = [_shown(ratios.get((name, variant))) for variant in VARIANTS]
        lines.append(f"| {about} | {' | '.join(cells)} |")
    machine = result["machine"]
    named = f"{machine['name']}, {machine['cores']} cores, {machine['system']}, {machine['python']}"
    return "\n".join([*lines, "", f"{NOTE}\n\nMachine: {named}."]) + "\n"


def _shown(ratio: float | None) -> str:
    if ratio is None:
        return "–"
    return f"{float(f'{ratio:.2g}'):.0f}" if ratio >= 10 else f"{ratio:.2f}"


def with_table(page: str) -> str:
    """The page's text with its table replaced by that of the committed run."""
    before, rest = page.split(BEGIN)
    after = rest[rest.index(END) :]
    return before + BEGIN + table(json.loads(RESULT.read_text())) + after


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text()))
