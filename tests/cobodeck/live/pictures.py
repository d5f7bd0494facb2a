"""Pictures of shipped charts, as `cobodeck render` draws them."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

from tests.program import python


@cache
def drawn(chart: str, depth: int) -> str:
    """The SVG of a chart, used charts expanded to `depth`; -1: all."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "chart.svg"
        python(
            Path(folder), "-m", "cobodeck", "render", chart, "--depth", str(depth), "-o", str(file)
        )
        return file.read_text(encoding="utf-8")
