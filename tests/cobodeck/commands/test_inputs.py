"""Inputs of charts that a command line gives: `simulate --in`, `run --in`."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.record.read.reader import Record
from cobodeck.record.read.record_replay import setup_of
from cobodeck.terminal.console import FAILED, OK, USAGE
from hw.geometry import Pose2

GO = """
chart: go
about: Drive somewhere.
outcomes: [there, failed]
inputs:
  goal: Pose2
  back: {type: Pose2, default: {place: west}}
  limit: {type: duration, default: 20 s}
  note: {type: text | none, default: none}
states:
  go:
    do: DriveTo
    in: {goal: goal}
    timeout: 20 s
    next: {arrived: .there, no_path: .failed, stuck: .failed, lost: .failed, timeout: .failed}
"""
SIMULATE = ["simulate", "go.yaml", "--scene", "lab_a"]
EAST = ["--in", "goal={place: east}"]


@pytest.fixture
def folder(folder: Path) -> Path:
    (folder / "go.yaml").write_text(GO)
    return folder


def figures(capsys: pytest.CaptureFixture[str], *given: str) -> Any:
    capsys.readouterr()
    assert main([*SIMULATE, *given, "--json"]) == OK
    return json.loads(capsys.readouterr().out)


def test_a_drive_ends_where_the_command_line_says(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for goal, end in {
        "{place: east}": Pose2(9.2, 5.0, 3.142),
        "{x: 250 cm, y: 5 m, yaw: 10 deg}": Pose2(2.5, 5.0, 0.1745),
    }.items():
        found = figures(capsys, "--in", f"goal={goal}", "--record", f"{end.x}.mcap")

        poses = [g.messages("truth") for g in Record(Path(f"{end.x}.mcap")).groups()]
        base = [told["base"]["Pose2"] for group in poses for told in group][-1]
        assert found["outcome"] == "there"
        assert Pose2(*base).distance_to(end) < 0.05


def test_figures_and_trace_file_have_the_inputs_as_written(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = figures(capsys, *EAST, "--in", "limit=9 s", "--in", "note=none")

    given = {"goal": {"place": "east"}, "limit": "9 s", "note": "none"}
    assert found["inputs"] == given
    assert json.loads(Path(found["trace_file"]).read_text().splitlines()[0])["inputs"] == given
    main([*SIMULATE, *EAST])
    assert re.search(r"^inputs +goal: \{place: east\}$", capsys.readouterr().out, re.MULTILINE)


WRONG = {
    "--in limit=2 s": "put KEY=VALUE in quotes: --in 'limit=2 s'",
    "--in goal={place: east}": "put KEY=VALUE in quotes: --in 'goal={place: east}'",
    "": "needs input 'goal' (a Pose2, {x: …, y: …, yaw: …} or {place: …}); write --in 'goal=VALUE'",
    "--tier 0": "needs input 'goal' (a Pose2, ",
    "--in gaol=1": "chart go: it has no input 'gaol'; did you mean 'goal'?",
    "--in goal": "--in goal: is not KEY=VALUE; write it as in 'goal={x: 2 m, y: 1 m}'",
    "--in 'goal={x: 1'": "--in goal={x: 1: not YAML: the bracket `{` is never closed",
    "--in goal=none": "chart go: goal: nothing given; wanted: Pose2",
    "--in 'goal={place: eats}'": "goal: there is no place 'eats' here; did you mean 'east'?",
    "--in 'goal={x: 1 m}'": "goal: 'y' missing; wanted: {x: …, y: …, yaw: …} or {place: …}",
    "--in 'goal={x: 1 kg, y: 2}'": "goal.x: '1 kg' is a mass; wanted: a length, in mm, cm, m, km",
    "--in 'goal={x: $profile.chase.iner, y: 2}'": "goal.x: there is no value $profile.chase.iner",
    "--in goal='{place: east}' --in note='$profile.escape.ahead'": "'2.5 m' is a length; wanted: t",
    "--in goal='$far'": "goal: $far stands for nothing here; write a value of type Pose2",
    "--in 'goal={place: east}' --in limit=2m": "limit: '2m' is a length; wanted: a duration",
    "--in 'goal={place: east}' --in goal=1": "--in goal=1: 'goal' is given twice",
}


@pytest.mark.parametrize("given", WRONG)
@pytest.mark.parametrize(
    "command",
    ["simulate go.yaml", pytest.param("run go.yaml --robot mock --fast", marks=pytest.mark.slow)],
)
def test_what_is_wrong_or_missing_is_named_before_anything_is_run(
    command: str, given: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if command.startswith("run") and "--tier" in given:
        return

    code = main([*shlex.split(command), "--scene", "lab_a", *shlex.split(given)])

    assert code == USAGE
    assert WRONG[given] in capsys.readouterr().err
    assert not list(folder.glob("out/*"))


NEEDS = """
chart: go
outcomes: [done]
inputs:
  n: integer
  way: list of Pose2
  by: speed
  who: text
  ok: boolean
  seen: UserPose
  a: any
states: {park: {do: ParkArm, next: {parked: .done, failed: .done}}}
"""


def test_every_missing_input_is_told_with_how_its_values_are_written(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "go.yaml").write_text(NEEDS)

    assert main(SIMULATE) == USAGE

    told = capsys.readouterr().err
    assert "chart go needs inputs 'n' (an integer), 'way' (a list, each item a Pose2, {x: …" in told
    assert "'by' (a speed, in m/s, cm/s, mm/s, km/h), 'who' (text), 'ok' (true or false)" in told
    assert "'a'" not in told  # it may be empty
    assert told.rstrip().endswith("--in 'ok=VALUE' --in 'seen=VALUE'")


@pytest.mark.parametrize(
    "how", ["--tier 0", "--tier 1", pytest.param("--tier 2", marks=pytest.mark.slow), "mock"]
)
def test_a_run_with_inputs_is_recorded_and_replayed(
    how: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = SIMULATE + how.split()
    if how == "mock":
        command = ["run", "go.yaml", "--scene", "lab_a", "--robot", "mock", "--fast"]

    assert main([*command, *EAST, "--in", "limit=9 s", "--record", "a.mcap"]) in (OK, FAILED)

    record = Record(folder / "a.mcap")
    assert record.header["inputs"] == {"goal": {"place": "east"}, "limit": "9 s"}
    assert main(["replay", "a.mcap", "--check"]) == OK


def test_records_with_other_inputs_differ_in_what_was_run(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, goal in {"a": "{place: east}", "b": "{x: 3 m, y: 5 m}"}.items():
        main([*SIMULATE, "--in", f"goal={goal}", "--record", f"{name}.mcap"])
    capsys.readouterr()

    main(["compare", "a.mcap", "b.mcap"])
    assert re.search(
        r"input goal +\{place: east\} +\{x: 3 m, y: 5 m\}", shown := capsys.readouterr().out
    )
    assert "inputs" not in shown
    main(["compare", "a.mcap", "b.mcap", "--json"])
    [told] = json.loads(capsys.readouterr().out)["headers"]
    assert told == {"what": "input goal", "a": "{place: east}", "b": "{x: 3 m, y: 5 m}"}


def test_a_record_from_before_inputs_were_given_is_read(folder: Path) -> None:
    default = "goal: {type: Pose2, default: {place: east}}"
    (folder / "go.yaml").write_text(GO.replace("goal: Pose2", default))
    main([*SIMULATE, "--record", "a.mcap", "--duration", "1"])
    record = Record(folder / "a.mcap")
    record.header = {key: held for key, held in record.header.items() if key != "inputs"}

    assert setup_of(record).inputs == {}


def test_charts_are_listed_with_their_inputs(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nmine = "mine.states"\n'
    )
    (folder / "mine").mkdir()
    (folder / "mine" / "states.py").write_text("")
    (folder / "go.yaml").rename(folder / "mine" / "go.yaml")

    assert main(["list", "charts", "--json"]) == OK

    charts = json.loads(capsys.readouterr().out)["charts"]
    listed = {chart["chart"]: chart["inputs"] for chart in charts}
    assert listed["haptic"] == ["since: integer", "deep: Pose3"]
    assert listed["go"] == [
        "goal: Pose2",
        "back: Pose2 = {place: west}",
        "limit: duration = 20 s",
        "note: text | none = none",
    ]


def test_a_chart_that_nobody_uses_is_validated_without_values_of_its_inputs(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = GO.replace("timeout: 20 s", "timeout: $profile.escape.reaction")
    (folder / "go.yaml").write_text(text.replace("place: west", "place: nowhere"))

    assert main(["validate", "go.yaml"]) == OK

    shown = capsys.readouterr().out
    assert "no place 'nowhere' is known" in shown
    assert "go: 1 configurations, 5 edges, complete" in shown


def test_while_a_scene_has_mistakes_no_place_is_said_to_be_unknown(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "go.yaml").write_text(GO.replace("place: west", "place: bed"))
    scene = "scene: flat\nroom: lab_a\nrobot: {start: {x: 3.0, y: 5.0, yaw: 0.0}}\n"
    places = "places: {bed: {x: 4 m, y: 5 m, yaw: 0}}\n"
    for text, code, told in (
        (scene + places, OK, ""),
        (scene.replace("start", "strat") + places, FAILED, "flat.yaml:3"),
        (scene, OK, "no place 'bed' is known"),
    ):
        (folder / "flat.yaml").write_text(text)

        assert main(["validate", "go.yaml", "flat.yaml"]) == code

        shown = capsys.readouterr().out
        assert told in shown
        assert ("no place 'bed'" in shown) == ("no place 'bed'" in told)


@pytest.mark.parametrize(
    ("goal", "told"),
    [
        ("{x: 200 m, y: 1 m}", "its goal (200.0, 1.0) is outside of the room"),
        ("{x: 0.2 m, y: 5 m}", "its goal (0.2, 5.0) is 0.20 m from a wall"),
    ],
)
def test_a_goal_where_the_robot_cannot_stand_is_told_instead_of_what_is_near_the_robot(
    folder: Path, capsys: pytest.CaptureFixture[str], goal: str, told: str
) -> None:
    assert main([*SIMULATE, "--in", f"goal={goal}"]) == FAILED

    shown = capsys.readouterr().out
    (way,) = (line for line in shown.splitlines() if line.startswith("no way on "))
    assert re.search(rf"go no_path at \(\S+, \S+\), {re.escape(told)}, at [\d.]+ s", way)
