"""A second chart decides beside the run, and the run is as without it."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from cobodeck.__main__ import main
from cobodeck.live.sources.seen_run import SeenRun
from cobodeck.project import catalogue, chart_file
from cobodeck.record.read.reader import Record
from cobodeck.record.read.record_replay import stage_replay
from cobodeck.record.write.start import recorder
from cobodeck.run.shadow import Shadow, ShadowRow
from cobodeck.run.simulation import RunResult, simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.files.text import noting
from tests.cobodeck.review.runs import AT

SCENES: dict[str, tuple[dict[str, Any], Options]] = {
    "lab_a": ({"scene": "lab_a"}, Options(duration_s=4.0, seed=1)),
    "lab_b": ({"scene": "lab_b"}, Options(duration_s=12.0, user="random", seed=5)),
    "study": ({"scene": "study"}, Options(duration_s=12.0, requests=1)),
    "all sensors": ({"scene": "study"}, Options(duration_s=8.0, tier=2, seed=2)),
    "paper": ({"scene": "study", "profile": "paper"}, Options(duration_s=12.0)),
    "latency": (
        {"scene": "study", "sets": ["plant.latency=20 ms"]},
        Options(duration_s=8.0),
    ),
}


def beside(
    name: str,
    other: str | None = None,
    changed: tuple[str, ...] = (),
    record: Path | None = None,
) -> tuple[RunResult, Shadow, list[str]]:
    """A run with a shadow: its own chart, `other`, or its own with other values."""
    given, options = SCENES[name]
    with noting():
        setup = open_setup(**given)
        shadowed = open_setup(**{**given, "sets": [*given.get("sets", ()), *changed]})
        chart = shadowed if other is None else setup.beside(other)
        said: list[str] = []
        shadow = Shadow(chart, said.append)
        kept = record and recorder(setup, options, record, AT, said.append)
        return simulate(setup, options, recorder=kept, shadow=shadow), shadow, said


@cache
def alone(name: str) -> str:
    """The trace's hash of the same run without a shadow."""
    given, options = SCENES[name]
    with noting():
        return str(simulate(open_setup(**given), options).figures["trace_sha256"])


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.slow
def test_the_same_chart_decides_the_same_and_the_run_is_as_without(name: str) -> None:
    result, shadow, said = beside(name)

    assert said == []
    assert shadow.rows == []
    assert shadow.decided == shadow.same > 0
    assert result.figures["trace_sha256"] == alone(name)


@pytest.mark.slow
def test_another_value_differs_where_it_matters_and_is_set_to_the_runs_place_again(
    tmp_path: Path,
) -> None:
    """What differed is on record, and a replay ignores it."""
    path = tmp_path / "run.mcap"
    result, shadow, said = beside("lab_a", changed=("charts.chase.near=2.9 m",), record=path)

    assert said == []
    assert shadow.ended is None
    assert shadow.rows
    assert all(row.ran != row.shadow for row in shadow.rows)
    assert shadow.rows[0].path.startswith("chase")
    assert 0 < shadow.same < shadow.decided  # after a difference it is beside the run again
    assert result.figures["trace_sha256"] == alone("lab_a")
    assert result.figures["shadow"]["differed"] == len(shadow.rows) == len(on_record(path))
    replay = stage_replay(Record(path))
    replay.loop.go(1 << 61)
    assert replay.difference is None, str(replay.difference)


def on_record(path: Path) -> list[dict[str, Any]]:
    with path.open("rb") as file:
        return [json.loads(m.data) for _, _, m in make_reader(file).iter_messages(["shadow"])]


def on_the_page(path: Path) -> list[dict[str, Any]]:
    """The rows by which pages tell of it."""
    record = Record(path)
    seen = SeenRun(record, catalogue())
    for group in record.groups():
        seen.add(group)
    return [row for told in seen.over_time() if told["t"] == "shadow" for row in told["rows"]]


OTHER = """
chart: alike
outcomes: [over]
states:
  chase: {use: chase, next: {haptic_request: .over, escape_required: chase, failed: .over,
    cornered: .over, fault: .over, user_lost: .over}}
"""


@pytest.mark.slow
def test_a_chart_with_fewer_nodes_is_compared_as_far_as_it_has_them(folder: Path) -> None:
    Path("alike.yaml").write_text(OTHER)

    result, shadow, said = beside("lab_a", "alike.yaml")

    assert said == []
    assert shadow.same > 0
    assert result.figures["trace_sha256"] == alone("lab_a")


@pytest.mark.slow
def test_a_shadow_that_raises_ends_and_the_run_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(self: Shadow, now_ns: int, **_: object) -> None:
        raise RuntimeError("it has broken")

    monkeypatch.setattr(Shadow, "_step", fail)
    result, shadow, said = beside("lab_a")

    assert said == ["the shadow has ended: RuntimeError: it has broken"]
    assert shadow.ended == "RuntimeError: it has broken"
    assert result.figures["errors"] == []
    assert result.figures["trace_sha256"] == alone("lab_a")


@pytest.mark.slow
def test_differences_are_on_record_and_the_same_afterwards(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chase = Path(catalogue_file("chase")).read_text().replace("chart: chase", "chart: nearer")
    Path("nearer.yaml").write_text(chase.replace("$profile.chase.near", "2.9 m"))
    cobodeck = Path(catalogue_file("cobodeck")).read_text()
    changed = cobodeck.replace("chart: cobodeck", "chart: other").replace(
        "use: chase", "use: nearer"
    )
    Path("other.yaml").write_text(changed)
    asked = ["simulate", "--scene", "lab_a", "--duration", "8", "--seed", "1", "--json"]

    assert main([*asked, "--shadow", "other.yaml", "--record", "run.mcap"]) == 0
    figures = json.loads(capsys.readouterr().out)["shadow"]
    rows = on_record(Path("run.mcap"))

    assert figures["differed"] == len(rows) > 0
    assert set(rows[0]) == {"at_ns", "path", "ran", "shadow"}
    assert on_the_page(Path("run.mcap")) == [{"at": row.pop("at_ns") / 1e9, **row} for row in rows]

    assert main(["replay", "run.mcap", "--check", "--shadow", "other.yaml", "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["equal"]
    assert again["figures"]["shadow"] == figures


def catalogue_file(name: str) -> str:
    return str(chart_file(name, catalogue(own=False)))


def test_a_difference_of_the_chart_itself_says_so() -> None:
    assert str(ShadowRow(10**9, "", "goes on", "far")).startswith("at 1.000 s, the chart: ran")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        pytest.param(["--shadow", "nothing"], "nothing", marks=pytest.mark.slow),
        (["--tier", "0", "--shadow", "cobodeck"], "--tier 0 has none"),
    ],
)
def test_a_shadow_that_cannot_be_is_refused_before_the_start(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    assert main(["simulate", *arguments]) != 0
    assert said in capsys.readouterr().err
