"""`cobodeck import-flexbe` makes a project that is right, and refuses what is wrong."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.flexbe import read_json
from cobodeck.project import catalogue, open_chart
from engine.chart import load_files
from engine.machine import Machine
from tests.cobodeck.flexbe.conftest import Play
from tests.cobodeck.flexbe.generated import generated
from tests.cobodeck.flexbe.test_convert import behaviour, concurrency, machine, state
from tests.cobodeck.flexbe.test_reading import everything

NEXT = {"done": "done"}


def nasty():
    """Names and values that mean something to YAML, Python or the engine."""
    calculate = {"expr": "lambda x: [x + self.speed, len(joints)]"}
    root = machine(
        state("true", {"yes": "no?", "timeout": "class"}, args={"class_": "5 s", "x": "$y"}),
        state("no?", {"done": "Follow"}, **{"class": "Follow"}, args={"text": 'say "\\\\"'}),
        state("Follow", {"done": "class"}, **{"class": "CalculationState"})
        | {"args": {"calculation": calculate}}
        | {"remapping": {"input_value": "in", "output_value": "in"}},
        state("class", NEXT, args={"lambda_": {"a": 1}, "y": [1, [None, "off"]]}),
        outcomes=("done", "null"),
        input_keys=["in"],
        output_keys=["out", "in"],
    )
    return behaviour(root, {"speed": 0.5, "path": "none", "ends": None})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    found = tmp_path / "given"
    found.mkdir()
    create = "joints = ['a', 'b']\n_state_machine.userdata.out = {'a': (1, 2)}"
    manual = {"FUNC": "\tdef near(self):\n\t\tprint 'near'"}
    comments = "# ! 1 2 /in\n# Take care"
    text = generated(nasty(), "NastySM", create=create, manual=manual, comments=comments)
    (found / "nasty_sm.py").write_text(text)
    (found / "x__everything.json").write_text(json.dumps(everything()))
    return found


def test_the_project_has_charts_states_comments_and_manual_code(folder, tmp_path):
    project = tmp_path / "brought_over"
    assert main(["import-flexbe", str(folder), "-o", str(project)]) == 0
    names = sorted(file.stem for file in (project / "brought_over" / "charts").iterdir())
    assert names == ["Other", "everything", "nasty"]
    library = load_files(sorted((project / "brought_over" / "charts").glob("*.yaml")))
    assert [str(finding) for finding in library.findings] == []
    assert "Take care" in (project / "brought_over/charts/nasty.yaml").read_text().splitlines()[0]
    assert "print 'near'" in (project / "MANUAL_CODE.md").read_text()
    assert "`lambda z: z`" in (project / "WORK.md").read_text()
    for module in ("stubs", "ready"):
        ast.parse((project / "brought_over" / f"{module}.py").read_text())


def wide():
    """More states side by side than the explorer ends together."""
    names = [f"s{number}" for number in range(7)]
    conditions = [["done", [[name, "done"] for name in names]]]
    inner = concurrency(conditions, *(state(name, NEXT) for name in names))
    inside = state("in", NEXT, container="_sm_in_0")
    return behaviour(machine(inside), _sm_in_0=inner)


@pytest.mark.slow
def test_the_project_works_on_its_own(folder, tmp_path):
    (folder / "wide.json").write_text(json.dumps(wide()))
    project = tmp_path / "brought_over"
    assert main(["import-flexbe", str(folder), "-o", str(project)]) == 0
    root = Path(__file__).resolve().parents[3]
    around = os.environ | {"PYTHONPATH": str(root)}
    for command in (["cobodeck", "validate"], ["pytest", "-q"]):
        done = subprocess.run(
            [sys.executable, "-m", *command],
            cwd=project,
            env=around,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_states_that_everybody_has_are_written(tmp_path, capsys):
    said = {"args": {"text": "met {}", "severity": "info"}, "remapping": {"data": "who"}}
    named = {"args": {"Value": "Ada"}, "remapping": {"Key": "who"}}
    root = machine(
        state("say", {"done": "wait"}, **{"class": "LogState"}, args={"text": "off we go"}),
        state("wait", {"done": "set"}, **{"class": "WaitState"}, pos=[], args={"wait_time": 2}),
        state("set", {"done": "tell"}, **{"class": "SetKey"}) | named,
        state("tell", NEXT, **{"class": "LogKeyState"}) | said,
    )
    (tmp_path / "waiting.json").write_text(json.dumps(behaviour(root)))
    project = tmp_path / "waits"
    assert main(["import-flexbe", str(tmp_path / "waiting.json"), "-o", str(project)]) == 0
    told = (
        "1 chart of 1 behaviour with 4 states of 4 classes: 4 translated, 0 as they are, 0 stubs."
    )
    assert told in capsys.readouterr().out
    known = catalogue(project)
    chart, library = open_chart(str(project / "waits/charts/waiting.yaml"), known)
    play = Play(Machine(chart, library, known.interfaces, types=known.types), scripted=False)
    play.until(lambda: play.run.outcome)
    notes = [str(record.detail) for record in play.run.trace if record.kind == "note"]
    assert (play.run.outcome, "off we go" in notes[0], "met Ada" in notes[1]) == (
        "done",
        True,
        True,
    )
    assert 2 <= play.seconds <= 2.5


LOOK = """
from flexbe_core import EventState

{before}
class {name}(EventState):
    def __init__(self, far=1.0):
        super().__init__(outcomes=['done'], output_keys=['pose'])

    def execute(self, userdata):
        userdata.pose = 1
        return 'done'
"""


@pytest.mark.slow
def test_states_that_stand_alone_run_as_they_are_and_others_are_stubs(tmp_path):
    given = tmp_path / "given"
    given.mkdir()
    (given / "look.py").write_text(LOOK.format(name="Look", before=""))
    (given / "bad.py").write_text(LOOK.format(name="Bad", before="raise RuntimeError('no')"))
    root = machine(
        state("a", {"done": "b"}, **{"class": "Look"}, args={"far": 2.0}),
        state("b", NEXT, **{"class": "Bad"}),
    )
    (given / "looking.json").write_text(json.dumps(behaviour(root)))
    project = tmp_path / "looks"
    assert main(["import-flexbe", str(given), "--states", "-o", str(project)]) == 0
    assert (project / "looks/flexbe/look.py").read_text() == (given / "look.py").read_text()
    assert not (project / "looks/flexbe/bad.py").exists()
    stubs = (project / "looks/stubs.py").read_text()
    assert ("class Bad(" in stubs, "class Look(" in stubs) == (True, False)


def test_neutral_prints_the_behaviour_as_json(folder, capsys):
    assert main(["import-flexbe", str(folder / "nasty_sm.py"), "--neutral"]) == 0
    printed = capsys.readouterr().out
    assert json.loads(printed) == read_json(json.dumps(nasty()), "x", "x").json


def test_the_report_is_json(folder, tmp_path, capsys):
    project = tmp_path / "brought_over"
    assert main(["import-flexbe", str(folder), "-o", str(project), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    figures = {key: report[key] for key in ("behaviours", "charts", "translated", "wrong")}
    assert figures == {"behaviours": 2, "charts": 3, "translated": 1, "wrong": []}
    assert {"chart", "path", "what", "code"} == report["work"][0].keys()


@pytest.mark.parametrize(
    ("name", "data", "told"),
    [
        ("a_sm.py", b"def f(:", "a_sm.py:1:"),
        ("a_sm.py", b"x = 1", "no FlexBE behaviour here"),
        ("a_sm.py", b"\x00\x01\xff", "a_sm.py:1:"),
        ("a.json", b'{"containers": {', "this is not JSON"),
        ("a.json", b"[1]", "it is not an object"),
    ],
)
def test_what_is_no_behaviour_is_refused_and_nothing_written(tmp_path, capsys, name, data, told):
    (tmp_path / name).write_bytes(data)
    assert main(["import-flexbe", str(tmp_path / name), "-o", str(tmp_path / "brought_over")]) == 1
    assert told in capsys.readouterr().err
    assert not (tmp_path / "brought_over").exists()


def test_a_folder_without_behaviours_is_refused(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    assert (
        main(["import-flexbe", str(tmp_path / "empty"), "-o", str(tmp_path / "brought_over")]) == 1
    )
    assert "no FlexBE behaviour in this folder" in capsys.readouterr().err
    assert (
        main(["import-flexbe", str(tmp_path / "none.json"), "-o", str(tmp_path / "brought_over")])
        == 2
    )


def test_what_is_there_is_never_overwritten(folder, tmp_path, capsys):
    (tmp_path / "brought_over").mkdir()
    (tmp_path / "brought_over" / "kept").write_text("kept")
    assert main(["import-flexbe", str(folder), "-o", str(tmp_path / "brought_over")]) == 1
    assert "is there already" in capsys.readouterr().err
    assert [file.name for file in (tmp_path / "brought_over").iterdir()] == ["kept"]


def test_a_broken_file_beside_others_is_told_and_the_others_are_made(folder, tmp_path, capsys):
    (folder / "broken_sm.py").write_text("class A(Behavior):\n  def create(self):\n ?\n")
    assert main(["import-flexbe", str(folder), "-o", str(tmp_path / "brought_over")]) == 1
    assert "broken_sm.py:3:" in capsys.readouterr().err
    assert (tmp_path / "brought_over" / "brought_over" / "charts" / "nasty.yaml").exists()
