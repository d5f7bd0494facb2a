"""Inputs of charts in records: of the run, and of a chart that replaced another."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.record.format.messages import command_text
from cobodeck.record.format.value_codec import value
from cobodeck.record.read.reader import Record
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from engine.chart.load import load_text
from engine.operator.commands import Replace
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from tests.cobodeck.record.read.test_record_replay import recorded, replayed

GO = """
chart: go
outcomes: [there, failed]
inputs:
  goal: Pose2
  back: {type: Pose2, default: {place: west}}
states:
  go:
    do: DriveTo
    in: {goal: goal}
    timeout: 2 s
    next: {arrived: .there, no_path: .failed, stuck: .failed, lost: .failed, timeout: .there}
"""
BACK = """
  back:
    do: DriveTo
    in: {goal: back}
    timeout: $profile.escape.warning
    next: {arrived: .there, no_path: .failed, stuck: .failed, lost: .failed, timeout: .failed}
"""
INPUTS = {"goal": {"place": "east"}}


@pytest.fixture
def chart(tmp_path: Path) -> str:
    file = tmp_path / "go.yaml"
    file.write_text(GO)
    return str(file)


def go_back(operator: Operator, run: ChartRun, setup: Setup) -> object:
    text = GO.replace("timeout: .there", "timeout: back") + BACK
    library = load_text(text, str(setup.chart.file))
    return operator.replace(run.machine.changed(library["go"], library))


def test_a_chart_that_is_replaced_keeps_inputs_and_named_values_in_the_replay_too(
    chart: str, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    options = Options(duration_s=9.0)
    result = recorded(path, options, {1.0: go_back}, chart=chart, scene="lab_a", inputs=INPUTS)

    replay = replayed(path)

    run = result.loop.wired.run
    assert run.trace.path()[-2:] == ["go", "back"]
    assert run.machine.inputs == INPUTS
    assert replay.difference is None, str(replay.difference)
    assert replay.loop.wired.run.machine.inputs == INPUTS
    assert Record(path).header["inputs"] == INPUTS


def test_a_change_of_the_chart_is_recorded_with_its_inputs(chart: str) -> None:
    inputs: dict[str, Any] = {"goal": {"x": "$profile.chase.inner", "y": "2 m", "yaw": 0}}
    machine = open_setup(chart, "lab_a", inputs=inputs).machine()

    told = json.loads(command_text(Replace(machine)))

    assert value(told["arguments"])["inputs"] == inputs


def test_a_change_of_a_shipped_chart_names_its_file_without_the_folder_of_the_program() -> None:
    told = json.loads(command_text(Replace(open_setup("inform", "study").machine())))

    assert value(told["arguments"])["charts"]["inform"][0] == "charts/inform.yaml"
