"""The form that starts a run: the command line that it becomes, and what a page is told."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.live.charts import started_runs
from cobodeck.live.charts.started_runs import StartedRun, StartedRuns, arguments
from cobodeck.project.state_catalogue import CHARTS

PYTHON = (sys.executable, "-IS", "-c")
"""It begins soon, without what is installed."""
CHART = "chart: mine\noutcomes: [done]\nstates:\n  a: {do: ParkArm, next: {parked: .done}}\n"


@pytest.fixture
def chart(tmp_path: Path) -> Path:
    file = tmp_path / "file.yaml"
    file.write_text(CHART)
    return file


@pytest.mark.requirement(57)
def test_a_form_becomes_a_command_line(chart: Path) -> None:
    form = {
        "parameters": {"speed": "1 m/s", "left": " "},
        "inputs": {"goal": "{x: 2 m, y: -1 m}"},
        "scene": "lab_a",
        "user": "",
    }

    assert list(arguments(chart, "paper", form)) == [
        "simulate", "--profile=paper", "--scene=lab_a", "--in=goal={x: 2 m, y: -1 m}",
        "--set=charts.mine.speed=1 m/s", str(chart), "--live",
    ]  # fmt: skip
    assert list(arguments(chart, "paper", {}, "10.0.0.2"))[-1] == "--live=10.0.0.2:0"


@pytest.mark.parametrize(
    "form",
    [
        {"inputs": ["a"]},
        {"inputs": {"a": 3}},
        {"parameters": {"a=b": "3"}},
        {"scene": {"a": 3}},
        {"user": "a\0b"},
    ],
)
def test_a_form_of_another_shape_is_refused_and_nothing_is_started(
    chart: Path, form: dict[str, Any]
) -> None:
    started = play(chart, "raise SystemExit('never run')", form)

    assert started.url is None
    assert "never" not in started.text


def play(chart: Path, program: str, form: dict[str, Any] | None = None) -> StartedRun:
    """Start a program in place of cobodeck, and end it."""

    async def run() -> StartedRun:
        runs = StartedRuns((*PYTHON, program))
        try:
            return await runs.start(chart, "tuned", form or {})
        finally:
            await runs.close()

    return asyncio.run(run())


@pytest.mark.realtime
def test_the_answer_is_the_line_with_the_url() -> None:
    told = "print('-' * 100_000); print('live page: http://127.0.0.1:81/  token: x')"

    started = play(Path("a.yaml"), f"import time; {told}; time.sleep(60)")

    assert started == StartedRun(
        "http://127.0.0.1:81/", "live page: http://127.0.0.1:81/  token: x"
    )


@pytest.mark.realtime
def test_it_is_said_that_a_start_takes_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(started_runs, "SAYING_S", 0.005)

    async def run() -> None:
        runs, said = StartedRuns((*PYTHON, "print('http://127.0.0.1/')")), list[str]()
        assert (await runs.start(Path("a.yaml"), "tuned", {}, said.append)).url
        assert said
        assert all(told.startswith("a.yaml has not begun after 0 s") for told in said)
        await runs.close()

    asyncio.run(run())


@pytest.mark.realtime
def test_what_is_wrong_is_told_as_on_the_command_line() -> None:
    complain = "import sys; sys.exit('cobodeck: no scene \\'lab_b\\'')"

    assert play(Path("a.yaml"), complain) == StartedRun(None, "no scene 'lab_b'")
    assert play(Path("a.yaml"), "raise SystemExit(3)").text == "it has ended with exit code 3"


@pytest.mark.realtime
def test_only_so_many_run_at_once_and_all_end_when_it_is_closed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    most = 2
    monkeypatch.setattr(started_runs, "MOST_RUNS", most)

    async def run() -> None:
        told = "print('http://127.0.0.1/', flush=True); import time; time.sleep(60)"
        runs = StartedRuns((*PYTHON, told))
        asked = (runs.start(Path("a.yaml"), "tuned", {}) for _ in range(most + 2))
        started = await asyncio.gather(*asked)
        processes = list(runs.running)
        await runs.close()

        assert sum(run.url is not None for run in started) == most
        assert (await runs.start(Path("a.yaml"), "tuned", {})).url is None
        assert len(processes) == most
        assert all(process.returncode is not None for process in processes)

    asyncio.run(run())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "told"),
    [
        ({"scene": "lab_z"}, "lab_z"),
        ({"inputs": {"goal": "{x: 1 m}"}}, "goal"),
        ({"parameters": {"speed": "1 kg"}}, "speed"),
    ],
)
def test_wrong_values_are_refused_in_the_words_of_the_command_line(
    form: dict[str, Any], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    async def run() -> StartedRun:
        runs = StartedRuns()
        try:
            return await runs.start(CHARTS / "cobodeck.yaml", "tuned", form)
        finally:
            await runs.close()

    started = asyncio.run(run())
    main([*arguments(CHARTS / "cobodeck.yaml", "tuned", form)])

    assert started.url is None
    assert told in started.text
    assert capsys.readouterr().err.strip() == f"cobodeck: {started.text}"
