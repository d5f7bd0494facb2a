"""Generated Python is read as the neutral JSON it was written from; nothing of it is run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cobodeck.flexbe import convert, found_in, read_json, read_python
from engine.files import FileError
from tests.cobodeck.flexbe.conftest import NAMES
from tests.cobodeck.flexbe.generated import generated
from tests.cobodeck.flexbe.test_convert import behaviour, concurrency, machine, state

PYTHON_2 = {
    "IMPORT": "import no_such_module",
    "INIT": "\t\tself.mode = 0777L",
    "CREATE": "\t\tprint 'made', self.mode",
    "FUNC": "\tdef near(self, pose):\n\t\tprint >>log, pose\n\t\texec 'x = 1'\n\t\traise Oh, no",
}


@pytest.mark.parametrize("version", [1, 4])
@pytest.mark.parametrize("name", NAMES)
def test_python_says_what_the_json_says(behaviours, name, version):
    text = generated(behaviours[name], "SomeSM", version=version)
    read = read_python(text, "some_sm.py", name)
    assert json.dumps(read.json) == json.dumps(behaviours[name])  # in this order, too


def everything():
    """A behaviour with a form of everything."""
    inner = concurrency(
        [["done", [["a", "done"], ["b c", "it's done"]]]],
        state("a", {"done": "done"}, args={"x": [1, {"y": None}], "f": {"expr": "lambda z: z"}}),
        state("b c", {"it's done": "done"}, pos=[{"expr": "self.speed * 2"}]),
        input_keys=["goal"],
        output_keys=["found"],
    )
    root = machine(
        state("in", {"done": "go"}, container="_sm_in_0", remapping={"goal": "g", "found": "f"}),
        state(
            "go",
            {"done": "done"},
            behavior="pkg__Other_SM",
            args={"default_keys": ["k"], "parameters": {"expr": "{'x': self.speed}"}},
        ),
    )
    found = behaviour(root, {"speed": 0.5, "mode": "slow", "off": False}, _sm_in_0=inner)
    return found | {"behaviors": [["pkg__Other_SM", "go"]], "root": None}


@pytest.mark.parametrize("manual", [None, PYTHON_2])
def test_everything_is_read_whatever_is_in_manual_blocks(manual):
    text = generated(
        everything(),
        "Every_ThingSM",
        create="_state_machine.userdata.g = self.speed\njoints = ['j%d' % i for i in range(2)]",
        manual=manual,
        comments="# ! 909 135 /in\n# Look here|nand there\n\n# O 1 2 \n# Fine",
    )
    found = read_python(text, "every_thing_sm.py", "every")
    assert found.json == everything()
    assert (found.class_name, found.about) == ("Every_ThingSM", "Does what it does.")
    assert found.userdata == {"_state_machine": {"g": "self.speed"}}
    assert found.variables == {"joints": "['j%d' % i for i in range(2)]"}
    told = [(c.path, c.text, c.important) for c in found.comments]
    assert told == [("in", "Look here\nand there", True), ("", "Fine", False)]
    blocks = {block.tag.removeprefix("MANUAL_"): block.code for block in found.manual}
    assert blocks == (manual or {})


def test_text_without_quotes_is_text():
    ask = {"outcomes": ["yes", "no"], "hint": "Go on, or wait?", "suggestion": "not"}
    json_of = behaviour(machine(state("ask", {"yes": "done", "no": "done"}, args=ask)))
    text = generated(json_of, "ASM")
    typed = text.replace("'Go on, or wait?'", "Go on, or wait?").replace("'not'", "not")
    assert typed != text
    assert read_python(typed, "a_sm.py", "a").root == json_of["containers"]["_state_machine"]


BY_HAND = """
        look = Look(far=2)
        ends = {'done': 'done'}
        with _state_machine:
            Machine.add(label='a', state=look, transitions=ends, remapping=dict(x='y'))
            Machine.add('b', self.kept, transitions=self.ends)
"""


def test_states_that_were_added_by_hand_are_read():
    text = generated(behaviour(machine()), "ASM", version=4)
    text = text.replace("        return _state_machine", f"{BY_HAND}        return _state_machine")
    a, b = read_python(text, "a_sm.py", "a").root["states"]
    assert (a["name"], a["class"], a["args"]) == ("a", "Look", {"far": 2})
    assert (a["transitions"], a["remapping"]) == ({"done": "done"}, {"x": "y"})
    assert (b["name"], b["class"], b["transitions"]) == ("b", "self.kept", {})


METHODS = """
\tdef more(self, x):
\t\t'Adds.'
\t\treturn x + self.speed

\t@staticmethod
\tdef big(x: int) -> bool:
\t\treturn x > 5

\tdef first(self, x):
\t\tfor item in x:
\t\t\treturn item
"""


def test_methods_that_only_return_something_are_translated():
    keys = {"input_value": "a", "output_value": "a"}
    calls = {"calculation": {"expr": "self.more"}}, {"calculation": {"expr": "self.first"}}
    root = machine(
        state("m", {"done": "n"}, **{"class": "CalculationState"}, args=calls[0], remapping=keys),
        state("n", {"done": "o"}, **{"class": "CalculationState"}, args=calls[1], remapping=keys),
        state("o", {"true": "done", "false": "done"}, **{"class": "CheckConditionState"})
        | {"args": {"predicate": {"expr": "self.big"}}, "remapping": {"input_value": "a"}},
    )
    text = generated(behaviour(root, {"speed": 0.5}), "ASM", manual={"FUNC": METHODS})
    classes = convert([read_python(text, "a_sm.py", "a")]).classes
    ready = {name: cls.ready.body.splitlines()[-1] for name, cls in classes.items() if cls.ready}
    assert ready == {
        "M": 'return "done", {"output_value": freeze(x + self.speed)}',
        "O": 'return "true" if x > 5 else "false"',
    }


def test_variables_that_change_are_not_known():
    text = generated(
        behaviour(machine(state("a", {"done": "done"}))),
        "ASM",
        create="once = 1\ntwice = 1\ntwice = 2\nfiles = []\nfiles.append(1)\nn = 0\nn += 1",
    )
    assert read_python(text, "a_sm.py", "a").variables == {"once": "1"}


def test_the_outermost_container_is_the_one_that_is_returned_and_constants_have_values():
    text = generated(
        behaviour(machine(state("a", {"done": "done"}, args={"x": {"expr": "FAR"}}))),
        "ASM",
        create="_state_machine.userdata.g = FAR",
    )
    text = text.replace("_state_machine", "top").replace("class ASM", "FAR = 3\nN = 1\nclass ASM")
    read = read_python(text + "\nN = 2\n", "a_sm.py", "a")
    assert [*read.json["containers"]] == ["_state_machine"]
    assert read.userdata == {"_state_machine": {"g": "FAR"}}
    assert read.variables == {"FAR": "3"}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("def f(:\n", "a_sm.py:1:1: error[C01]: this is not Python 3"),
        ("x = 1\n", "there is no FlexBE behaviour here"),
        ("class A(Behavior):\n    def create(self):\n        return 1\n", "has no state machine"),
    ],
)
def test_other_python_is_refused_with_its_place(text, told):
    with pytest.raises(FileError) as error:
        read_python(text, "a_sm.py", "a")
    assert told in str(error.value) or told.rpartition(": ")[2] in str(error.value)
    assert "a_sm.py" in str(error.value)


WRONG = {
    "it is not an object": [],
    "it has no `containers`": {"containers": {}},
    "has no list `states`": {"containers": {"_state_machine": {"states": 3}}},
    "`outcomes` is no list of names": behaviour(machine(outcomes=[1])),
    "state 'a': it needs one of": behaviour(machine({"name": "a"})),
    "no container 'x'": behaviour(machine({"name": "a", "container": "x"})),
    "`transitions` has values": behaviour(machine(state("a", {"done": 3}))),
    "`conditions` are not": behaviour(concurrency([["done"]], state("a", {"done": "done"}))),
}


@pytest.mark.parametrize("told", WRONG)
def test_json_of_another_shape_is_refused_with_its_place(told):
    with pytest.raises(FileError) as error:
        read_json(json.dumps(WRONG[told]), "a.json", "a")
    assert told in str(error.value)


def test_a_folder_gives_behaviours_and_state_classes(tmp_path: Path):
    (tmp_path / "states").mkdir()
    (tmp_path / "states" / "look.py").write_text(
        "from flexbe_core import EventState\n\n"
        "class Look(EventState):\n"
        "    def __init__(self, far):\n"
        "        super().__init__(outcomes=['seen'], output_keys=['pose'])\n"
    )
    text = generated(everything(), "EverySM").replace("# -*- coding: utf-8", "# coding: latin-1")
    (tmp_path / "every_sm.py").write_bytes(text.replace("Does", "Fährt").encode("latin-1"))
    (tmp_path / "broken_sm.py").write_text("class A(Behavior):\n  def create(self):\n ?\n")
    (tmp_path / "package.json").write_text("{}")
    found = found_in(tmp_path)
    assert [behaviour.name for behaviour in found.behaviours] == ["every"]
    assert found.behaviours[0].about == "Fährt what it does."
    assert found.classes["Look"].output_keys == ("pose",)
    assert ["broken_sm.py" in wrong for wrong in found.wrong] == [True]
