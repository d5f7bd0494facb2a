"""The trace of a long run is whole, though only its newest records stay in memory."""

from __future__ import annotations

from typing import Any

import pytest

from cobodeck.loop.old_lines import OldLines
from cobodeck.record.read.record_comparison import COMPUTING
from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup


def test_what_is_written_is_read_again_whatever_is_read_and_written_meanwhile() -> None:
    lines = OldLines()
    assert list(lines) == []
    expected = [f'[{n},"é {"x" * (n % 7)}"]' for n in range(20_000)]
    for n, line in enumerate(expected):
        lines.append(line)
        if n % 5_000 == 0:
            assert list(lines) == expected[: n + 1]
            begun = iter(lines)
            next(begun)
    assert list(zip(lines, lines, strict=True)) == list(zip(expected, expected, strict=True))


def test_a_run_that_lets_records_go_has_the_same_figures_and_trace(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    setup, options = open_setup("cobodeck", "lab_a"), Options(tier=0, duration_s=300.0, seed=3)

    def told() -> tuple[dict[str, Any], list[str], int]:
        result = simulate(setup, options)
        figures = {k: v for k, v in result.figures.items() if k not in COMPUTING}
        return figures, list(result.wired.run.trace.lines()), result.wired.run.trace.gone

    whole = told()
    for module in ("engine.run.trace", "engine.run.life"):
        monkeypatch.setattr(f"{module}.KEPT", 50)
    figures, lines, gone = told()
    assert gone > 500
    assert whole == (figures, lines, 0)
