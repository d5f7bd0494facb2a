"""Records of the three conditions, and the figures that are drawn from them and from the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cobodeck.campaign import run_cell
from cobodeck.paper.conditions import CONDITIONS, Asked

Progress = Callable[[str, float | None], None]


def record_conditions(asked: Asked, folder: Path, progress: Progress) -> dict[str, Path]:
    """Run each condition once more, the same bits, and keep a record of it in a folder."""
    records = {name: folder / f"{name}.mcap" for name in CONDITIONS}
    for number, (name, file) in enumerate(records.items()):
        progress(f"record of {name}", number / len(records))
        run_cell(asked.cell(name), file)
    return records


def draw_figures(
    result: Mapping[str, Any], records: Mapping[str, Path], folder: Path, progress: Progress
) -> list[Path]:
    """Figures 8, 9 and 10 as PNG files in a folder."""
    from cobodeck.paper.drawings import draw_responses, draw_to_safety, draw_trajectories

    conditions, files = result["conditions"], []
    for number, (name, record) in enumerate(records.items()):
        progress(f"figure 8, {name}", number / len(records))
        files.append(folder / f"figure_8_{name}.png")
        draw_trajectories(name, record, conditions[name], files[-1])
    files += [folder / "figure_9.png", folder / "figure_10.png"]
    draw_responses(conditions, files[-2])
    draw_to_safety(conditions, files[-1])
    return files
