"""Calls per tick are exact, count all that a tick does, and do not grow unnoticed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cobodeck.bench.compare import worse
from cobodeck.bench.harness import BenchRow
from cobodeck.bench.simulation_bench import (
    CALLS,
    GROWTH,
    KNOWN_CALLS,
    calls_limit,
    calls_per_tick,
    calls_row,
)
from cobodeck.commands.bench import text
from cobodeck.record.format import versions
from cobodeck.run import simulation as simulate

COUNT = """
import sys
from cobodeck.bench.simulation_bench import CALLS, calls_per_tick
print(*(calls_per_tick(CALLS[name]) for name in sys.argv[1:]))
"""

EXACT = ("waiting", "study")
"""Cases without a page, and before there were pages: of these not one call per tick is added."""
MODULES = """
import sys
from cobodeck.__main__ import main

code = main(["simulate", "--duration", "2", "--record", sys.argv[1], "--no-project"])
print(code, *(name for name in sys.modules if name.startswith(("cobodeck.live", "websockets"))))
"""


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.few(2)
def test_a_tick_makes_no_more_calls_than_it_did(name: str) -> None:
    row = calls_row(name)

    if row.goal is None:
        known = json.loads(KNOWN_CALLS.read_text())["versions"]
        pytest.skip(f"{row.calls_per_tick:.1f} calls per tick; known with {known} only")
    assert row.calls_per_tick is not None
    most = row.goal / GROWTH + 0.1 if name in EXACT else row.goal
    assert row.calls_per_tick <= most, f"{name}; if it must be so: {KNOWN_CALLS}"


@pytest.mark.slow
def test_a_run_without_a_page_imports_nothing_of_pages(tmp_path: Path) -> None:
    command = [sys.executable, "-c", MODULES, str(tmp_path / "x.mcap")]

    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)

    assert done.stdout.splitlines()[-1] == "0", done.stdout


def test_counts_are_known_for_each_case_and_hold_for_their_versions_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    known = json.loads(KNOWN_CALLS.read_text())
    assert known["calls_per_tick"].keys() == CALLS.keys()
    assert known["versions"].keys() <= versions().keys()

    monkeypatch.setattr("cobodeck.bench.simulation_bench.versions", lambda: known["versions"])
    assert calls_limit("study") == 1.02 * known["calls_per_tick"]["study"]
    other = {**known["versions"], "numpy": "1.0"}
    monkeypatch.setattr("cobodeck.bench.simulation_bench.versions", lambda: other)
    assert calls_limit("study") is None


class Idle:
    """Does nothing, by one call."""

    def watch(self, now_ns: int) -> None:
        len(())


def test_calls_are_the_same_again_and_each_more_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    case = CALLS["waiting"]
    short = replace(case, options=replace(case.options, duration_s=10.0))
    stage, idle = simulate.stage, [Idle()]  # which needs each tick: there are no leaps

    def with_idle(*arguments: Any, **more: Any) -> Any:
        loop = stage(*arguments, **more)
        loop.observers = [*loop.observers, *idle]
        return loop

    monkeypatch.setattr(simulate, "stage", with_idle)
    before, again = calls_per_tick(short), calls_per_tick(short)
    idle.append(Idle())

    assert again == before
    assert calls_per_tick(short) - before == pytest.approx(2.0 * 301 / 300)  # watch, len; tick 0


@pytest.mark.slow
def test_every_process_counts_the_same() -> None:
    """In this one, earlier tests may have left an equal key in a cache: one comparison more."""

    def counted(seed: str) -> list[float]:
        command = [sys.executable, "-c", COUNT, "waiting", "hall", "study_tier_2"]
        env = {**os.environ, "PYTHONHASHSEED": seed}
        done = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
        return [float(number) for number in done.stdout.split()]

    first = counted("1")

    assert counted("2") == first
    here = [calls_per_tick(CALLS[name]) for name in ("waiting", "hall", "study_tier_2")]
    assert here == pytest.approx(first, abs=0.01)


def plain_row(calls: float) -> dict[str, Any]:
    return BenchRow("simulation", "calls_x", "cobodeck", calls_per_tick=calls).plain()


def test_more_calls_are_told_and_rows_of_before_they_were_counted_are_shown() -> None:
    row = {**plain_row(100.0 * GROWTH + 0.1), "time_us": None}
    old = {key: value for key, value in row.items() if key != "calls_per_tick"}
    machine = {"name": "M", "cores": 2, "system": "S", "python": "P"}

    told = list(worse([row], [plain_row(100.0)]))

    assert told == ["worse: simulation calls_x: calls_per_tick 102, was 100"]
    assert not list(worse([plain_row(101.9)], [plain_row(100.0)]))
    assert not list(worse([row], [old]))
    assert not list(worse([old], [row]))
    assert "102" in text({"machine": machine, "rows": [row]})
    assert "calls_x" in text({"machine": machine, "rows": [old]})
