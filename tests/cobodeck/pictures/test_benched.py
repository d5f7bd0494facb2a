"""The page of benchmarks: a plot per error, a line per setting, nothing else."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, strategies as st

from cobodeck.bench.harness import BenchRow
from cobodeck.pictures.benched import bench_plots, draw_bench, round_numbers
from cobodeck.terminal.console import Problem


def rows(*values: tuple[str, str | None, float | None, float | None]) -> list[dict[str, Any]]:
    return [
        BenchRow(
            "b", "x", variant, knob, value, time_us=10.0 * (1 + n), error=error,
            error_unit=None if error is None else "m", reference="truth", default=n == 0,
        ).plain()
        for n, (variant, knob, value, error) in enumerate(values)
    ]  # fmt: skip


CURVE = rows(
    ("ours", "step", 0.1, 1.0), ("ours", "step", 0.05, 0.0), ("ours", "beams", 8.0, 0.5),
    ("peer", None, None, 3.0),
)  # fmt: skip


def test_a_line_is_one_setting_of_one_variant() -> None:
    (plot,) = bench_plots(CURVE)

    assert plot.title == "b: x"
    assert list(plot.lines) == ["ours, step", "ours, beams", "peer"]
    assert plot.has_errors


def test_over_a_size_there_are_times_alone() -> None:
    (plot,) = bench_plots(rows(("ours", "leaves", 10.0, None), ("ours", "leaves", 99.0, None)))

    assert list(plot.lines) == ["ours"]
    assert not plot.has_errors


def test_errors_of_two_kinds_are_two_plots() -> None:
    other = [{**row, "error_unit": "%"} for row in CURVE]

    assert len(list(bench_plots([*CURVE, *other]))) == 2


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
def test_a_page_is_drawn_and_is_the_same_each_time(tmp_path, form: str) -> None:  # type: ignore[no-untyped-def]
    files = [tmp_path / f"{name}.{form}" for name in "ab"]
    for file in files:
        draw_bench(CURVE, file)

    assert files[0].read_bytes() == files[1].read_bytes()
    if form == "svg":
        text = files[0].read_text()
        for told in ("b: x", "against truth", "ours, step", "peer", "what we use", "time, µs"):
            assert f">{told}<" in text


@pytest.mark.parametrize(
    "left",
    [
        [],
        rows(("ours", "step", 0.1, 1.0), ("peer", None, None, 2.0)),
        [{**row, "time_us": None} for row in CURVE],
    ],
)
def test_without_a_curve_there_is_no_page(tmp_path, left: list[dict[str, Any]]) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(Problem, match="no row"):
        draw_bench(left, tmp_path / "a.svg")


@given(least=st.floats(1e-9, 1e9), factor=st.floats(1.0, 1e6))
def test_ticks_are_a_few_round_numbers_within_the_range(least: float, factor: float) -> None:
    ticks = round_numbers(least, least * factor)

    assert 1 <= len(ticks) <= 6
    assert ticks == sorted(set(ticks))
    for tick in ticks:
        assert least / 1.35 <= tick <= 1.55 * least * factor
        assert len(f"{tick:.9e}".split("e")[0].rstrip("0").rstrip(".")) <= 3
    assert all(math.isfinite(tick) for tick in ticks)
