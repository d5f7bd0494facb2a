"""Charts are drawn, listed and run with the values of one profile; mistakes have their place."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK, USAGE

CHART = """\
chart: mine
parameters: {limit: {type: length, default: $profile.chase.inner, about: not nearer}}
outcomes: [x]
states:
  s: {do: MakeRoom, with: {room: $limit, far: $profile.chase.outer}, next: {clear: .x, lost: .x}}
"""

SPEEDS = """\
chart: mine
parameters: {limit: {type: speed, default: $profile.robot.base_speed, about: not faster}}
outcomes: [x]
states:
  s: {do: MakeRoom, with: {walking: $limit}, next: {clear: t, lost: .x}}
  t: {do: MakeRoom, with: {walking: $profile.user.still_speed}, next: {clear: .x, lost: .x}}
"""
EMPTY = "robot.tool_speed"
"""A speed in the profile tuned, none in paper."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(CHART)
    return tmp_path


def drawn(*more: str) -> str:
    assert main(["render", "mine.yaml", "-o", "mine.dot", *more]) == OK
    return Path("mine.dot").read_text()


def test_a_chart_is_drawn_with_the_values_of_the_profile(folder: Path) -> None:
    tuned, paper = drawn(), drawn("--profile", "paper", "--set", "chase.inner=1 m")
    assert "limit: 1.5 m (base: chase.inner)" in tuned
    assert "far: 4.0 m (tuned: chase.outer)" in tuned
    assert "room: 1.5 m" in tuned
    assert "limit: 1 m (--set chase.inner=1 m)" in paper
    assert "far: 3.0 m (paper: chase.outer)" in paper
    assert "room: 1 m" in paper

    narrowed = drawn("--set", "charts.mine.limit=2 m")
    assert "limit: 2 m (--set charts.mine.limit=2 m)" in narrowed


@pytest.mark.parametrize("command", ["render", "validate", "simulate"])
@pytest.mark.parametrize("name", ["chase.iner", "chase.outr"])
def test_a_value_that_there_is_not_is_told_with_what_is_near(
    command: str, name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    right = {"chase.iner": "chase.inner", "chase.outr": "chase.outer"}[name]
    Path("mine.yaml").write_text(CHART.replace(right, name))

    assert main([command, "mine.yaml"]) == FAILED

    told = "".join(capsys.readouterr())
    assert f"there is no value $profile.{name}" in told
    assert f"did you mean 'profile.{right}'" in told
    assert f"mine.yaml:{2 if name == 'chase.iner' else 5}:" in told


@pytest.mark.parametrize(
    ("picked", "wrong"),
    [
        ("robot.base_speed", f"mine.yaml:2:44: limit: $profile.{EMPTY} (paper: {EMPTY}): "),
        ("user.still_speed", f"mine.yaml:6:37: $profile.{EMPTY} (paper: {EMPTY}): "),
    ],
)
def test_an_empty_value_of_a_shipped_profile_is_told_where_the_chart_picks_it(
    picked: str, wrong: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mine.yaml").write_text(SPEEDS.replace(picked, EMPTY))
    assert main(["validate", "mine.yaml"]) == OK  # by the profile tuned
    capsys.readouterr()

    assert main(["simulate", "mine.yaml", "--profile", "paper"]) == FAILED

    told = capsys.readouterr().err
    assert "profiles/paper.yaml:" not in told
    assert f"{wrong}nothing given" in told


@pytest.mark.parametrize("picked", ["robot.base_speed", "user.still_speed"])
def test_an_empty_value_of_one_s_own_profile_is_told_there(
    picked: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mine.yaml").write_text(SPEEDS.replace(picked, EMPTY))
    Path("own.yaml").write_text("profile: own\nbase: tuned\nrobot: {tool_speed: null}\n")

    assert main(["simulate", "mine.yaml", "--profile", "own.yaml"]) == FAILED

    told = capsys.readouterr().err
    assert told.startswith("cobodeck: own.yaml:3:21: ")
    assert EMPTY in told


def test_each_mistake_with_a_value_is_one_finding_in_the_chart(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = CHART.replace("$limit, far: $profile.chase.outer", "$profile.navigation.max_speed")
    Path("mine.yaml").write_text(text.replace("chase.inner", "escape.reaction"))
    Path("own.yaml").write_text("profile: own\nbase: tuned\nchase: {inner: 2 m}\n")
    Path("wrong_name.yaml").write_text(
        "chart: wrong_name\noutcomes: [x]\nstates:\n"
        "  s: {watch: Wait, with: {time: $profile.chase.max_speed}, next: {over: .x}}\n"
    )

    assert main(["validate", ".", "--json"]) == FAILED

    found = json.loads(capsys.readouterr().out)["findings"]
    errors = [(f["file"], f["line"], f["column"]) for f in found if f["severity"] == "error"]
    assert errors == [("mine.yaml", 2, 45), ("mine.yaml", 5, 34), ("wrong_name.yaml", 4, 33)]
    assert found[-1]["hint"] == "did you mean 'profile.navigation.chase.max_speed'?"


def test_a_mistake_in_a_chart_keeps_no_others_from_being_run(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mine.yaml").write_text(CHART.replace("chase.inner", "escape.reaction"))
    Path("good.yaml").write_text(
        "chart: good\noutcomes: [x]\nstates:\n"
        "  s: {watch: Wait, with: {time: 1 s}, next: {over: .x}}\n"
    )

    assert main(["simulate", "good.yaml", "--json"]) == OK


def test_a_value_on_top_that_does_not_fit_is_a_mistake_of_the_command(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mine.yaml").write_text(SPEEDS.replace("user.still_speed", EMPTY))
    assert main(["simulate", "mine.yaml", "--set", f"{EMPTY}=null"]) == USAGE
    assert f"--set {EMPTY}=null: $profile.{EMPTY}" in capsys.readouterr().err


def test_a_run_tells_what_the_profile_says_of_its_charts(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = ["simulate", "mine.yaml", "--tier", "0", "--duration", "1"]
    sets = ["--set", "charts.mine.limit=2 m", "--set", "charts.escape.within=2 s"]
    assert main([*run, "--json"]) == OK
    assert json.loads(capsys.readouterr().out)["chart_values"] == {}
    assert main([*run, *sets, "--json"]) == OK
    assert json.loads(capsys.readouterr().out)["chart_values"] == {
        "mine.limit": {"value": "2 m", "origin": "--set charts.mine.limit=2 m"}
    }
    assert main([*run, *sets]) == OK
    assert "mine.limit: 2 m (--set charts.mine.limit=2 m)" in capsys.readouterr().out
