"""The converter, rule by rule, on behaviours of a few states."""

from __future__ import annotations

from hypothesis import given, settings, strategies as st

from engine.check.all_checks import check
from engine.files.declared.values import is_name
from engine.files.source import read
from engine.machine.machine import Machine
from tests.flexbe.conftest import Play, library_of
from tests.flexbe.convert import Known, convert
from tests.flexbe.names import identifier
from tests.flexbe.writing import text
from tests.repeats import examples


def state(name, transitions, **more):
    """A state of the class `Log`, unless `more` says otherwise."""
    kind = {} if more.keys() & {"container", "behavior"} else {"class": "Log"}
    autonomy = dict.fromkeys(transitions, "Autonomy.Inherit")
    rest = {"name": name, "args": {}, "pos": [], "transitions": transitions, "autonomy": autonomy}
    return kind | rest | more


def machine(*states, outcomes=("done",), **more):
    return {"kind": "statemachine", "states": list(states), "outcomes": list(outcomes)} | more


def behaviour(root, parameters=None, **containers):
    return {
        "behaviors": [],
        "parameters": parameters or {},
        "containers": {"_state_machine": root} | containers,
    }


def charts(known=None, **behaviours):
    """The conversion; its charts are without errors."""
    conversion = convert(behaviours, known)
    findings = check(library_of(conversion), conversion.interfaces)
    assert [f.message for f in findings if f.severity == "error"] == []
    return conversion


def play(conversion, name="b"):
    library = library_of(conversion)
    started = Play(Machine(library[name], library, conversion.interfaces))
    started.tick()
    return started


# -- names -----------------------------------------------------------------------------------------


def test_names_become_identifiers_and_stay_apart():
    root = machine(
        state("is it, really?", {"yes, it is": "2nd"}),
        state("2nd", {"done": "a b"}),
        state("a b", {"done": "a_b"}, **{"class": "other_pkg__Log"}),
        state("a_b", {"done": "done"}),
    )
    nodes = charts(b=behaviour(root)).charts["b"]["states"]
    assert list(nodes) == ["is_it_really", "_2nd", "a_b", "a_b_2"]
    assert nodes["is_it_really"]["next"] == {"yes_it_is": "_2nd"}
    assert nodes["_2nd"]["next"] == {"done": "a_b"}
    assert nodes["a_b"]["next"] == {"done": "a_b_2"}
    assert nodes["a_b_2"]["next"] == {"done": ".done"}


def test_outcomes_that_mean_something_to_the_engine_get_another_name():
    ends = {"timeout": "preempted", "error": "done"}
    root = machine(
        state("a", ends, autonomy={"timeout": "Autonomy.High", "error": "Autonomy.Inherit"}),
        outcomes=("done", "preempted"),
    )
    chart = charts(b=behaviour(root)).charts["b"]
    assert chart["outcomes"] == ["done", "preempted_"]
    assert chart["states"]["a"]["next"] == {"timeout_": ".preempted_", "error_": ".done"}
    assert chart["states"]["a"]["autonomy"] == {"timeout_": "high"}


@settings(deadline=None, max_examples=examples(200))
@given(st.text())
def test_an_identifier_is_one_that_charts_allow(name):
    assert is_name(identifier(name))


@settings(deadline=None, max_examples=examples(200))
@given(
    st.dictionaries(
        st.sampled_from(("a", "true", "null", "on", "1")),
        st.one_of(
            st.none(),
            st.booleans(),
            st.integers(-(10**18), 10**18),
            st.floats(allow_nan=False, allow_infinity=False),
            st.text(),
            st.sampled_from(
                ("", "~", "012", "1e3", "off", "true", "12:30", ".5", "+1", "- a", "a: b")
            ),
            st.lists(st.text()),
        ),
    )
)
def test_what_is_written_is_what_the_engine_reads(values):
    source = read(text({"with": values}).encode(), "<text>")
    assert not source.findings
    found = source.value["with"]
    assert found == values
    assert {key: type(v) for key, v in found.items() if not isinstance(v, list)} == {
        key: type(v) for key, v in values.items() if not isinstance(v, list)
    }


# -- state classes ---------------------------------------------------------------------------------


def test_a_class_is_known_by_all_its_uses():
    root = machine(
        state("a", {"done": "b"}, args={"text": "x", "size": 1}),
        state("b", {"done": "done"}, args={"text": "y", "size": "big", "loud": True}),
    )
    found = charts(b=behaviour(root)).interfaces["Log"]
    assert found.outcomes == ("done",)
    kinds = {name: (str(a.type), a.required) for name, a in found.parameters.items()}
    assert kinds == {
        "text": ("text", True),
        "size": ("any | none", True),
        "loud": ("boolean", False),
    }


def test_a_class_with_several_sets_of_outcomes_is_several():
    ask = {"class": "Decision"}
    root = machine(
        state("a", {"go": "b", "stay": "b"}, args={"outcomes": ["go", "stay"], "hint": "?"}, **ask),
        state("b", {"up": "a", "down": "c"}, args={"outcomes": ["up", "down"], "hint": "?"}, **ask),
        state(
            "c", {"go": "a", "stay": "done"}, args={"outcomes": ["go", "stay"], "hint": ""}, **ask
        ),
    )
    conversion = charts(b=behaviour(root))
    nodes = conversion.charts["b"]["states"]
    assert [node["do"] for node in nodes.values()] == ["GoOrStay", "UpOrDown", "GoOrStay"]
    assert nodes["a"]["with"] == {"hint": "?"}
    assert conversion.interfaces["UpOrDown"].outcomes == ("up", "down")


def test_python_code_becomes_a_class_of_its_own():
    code = {"expr": "lambda x: self.near(x) * self.gain"}
    root = machine(state("scale it", {"done": "done"}, args={"calculation": code, "loud": True}))
    conversion = charts(b=behaviour(root, {"gain": 2.0}))
    assert conversion.charts["b"]["states"]["scale_it"] == {
        "do": "ScaleIt",
        "with": {"loud": True, "gain": "$gain"},
        "next": {"done": ".done"},
    }
    assert conversion.notes == (
        "b: scale_it: write a class ScaleIt that does what this did: "
        "lambda x: self.near(x) * self.gain",
    )


def test_expressions_are_parameters_known_values_or_told():
    arguments = {
        "a": {"expr": "self.gain"},
        "b": {"expr": "Logger.HINT"},
        "c": {"expr": "message"},
        "d": {"x": 1},
    }
    root = machine(state("s", {"done": "done"}, args=arguments))
    known = Known(values={"Logger.HINT": "hint"})
    conversion = charts(known, b=behaviour(root, {"gain": 2.0}))
    given = conversion.charts["b"]["states"]["s"]["with"]
    assert given == {"a": "$gain", "b": "hint", "c": "message", "d": "{'x': 1}"}
    assert conversion.notes == (
        "b: s: the value of message is not known",
        "b: s: a mapping is no argument; give its parts, not {'x': 1}",
    )


# -- data ------------------------------------------------------------------------------------------

WRITES = Known(outputs={"Set": ("Key",)})


def put(name, key, then):
    return state(name, {"done": then}, remapping={"Key": key}, **{"class": "Set"})


def get(name, key, then):
    return state(name, {"done": then}, remapping={"Value": key}, **{"class": "Get"})


def test_a_key_of_a_container_is_not_that_of_another():
    inner = machine(put("put", "key", "get"), get("get", "key", "done"))
    root = machine(
        put("put", "key", "in"),
        state("in", {"done": "get"}, container="inner"),
        get("get", "key", "done"),
    )
    conversion = charts(WRITES, b=behaviour(root, inner=inner))
    assert conversion.charts["b"]["states"]["in"]["out"] == {"key": "in_key"}
    run = play(conversion)
    run.end(("put", "done"), Key="outer")
    run.end(("in/put", "done"), Key="inner")
    run.end(("in/get", "done"))
    assert run.script.inputs == {
        "put": {},
        "in/put": {},
        "in/get": {"Value": "inner"},
        "get": {"Value": "outer"},
    }


def test_remapping_renames_keys_through_all_levels():
    deep = machine(
        get("get", "c", "put"), put("put", "d", "done"), input_keys=["c"], output_keys=["d"]
    )
    inner = machine(
        state("deep", {"done": "done"}, container="deep", remapping={"c": "b", "d": "a"}),
        input_keys=["b"],
        output_keys=["a"],
    )
    root = machine(
        put("put", "a", "in"),
        state("in", {"done": "get"}, container="inner", remapping={"b": "a", "a": "x"}),
        get("get", "x", "done"),
    )
    conversion = charts(WRITES, b=behaviour(root, inner=inner, deep=deep))
    outer = conversion.charts["b"]["states"]["in"]
    assert (outer["in"], outer["out"]) == ({"b": "a"}, {"a": "x"})
    assert outer["states"]["deep"]["in"] == {"c": "b"}
    assert outer["states"]["deep"]["out"] == {"d": "a"}
    run = play(conversion)
    run.end(("put", "done"), Key=1)
    run.end(("in/deep/get", "done"))
    run.end(("in/deep/put", "done"), Key=2)
    assert run.script.inputs["in/deep/get"] == {"Value": 1}
    assert run.script.inputs["get"] == {"Value": 2}


def test_first_values_of_userdata_are_initial():
    root = machine(get("get", "key", "put"), put("put", "key", "done"))
    known = Known(WRITES.outputs, {}, {"b": {"key": 7}})
    conversion = charts(known, b=behaviour(root))
    assert conversion.charts["b"]["data"] == {"key": {"type": "any", "initial": 7}}
    assert play(conversion).script.inputs["get"] == {"Value": 7}


def test_a_key_that_nobody_reads_is_left_out():
    root = machine(put("put", "key", "done"))
    conversion = charts(WRITES, b=behaviour(root))
    assert "data" not in conversion.charts["b"]
    assert "out" not in conversion.charts["b"]["states"]["put"]
    assert conversion.notes == ("b: key 'key' is never read; left out",)


def test_an_embedded_behaviour_is_given_keys_and_parameters():
    used = behaviour(machine(get("get", "goal", "done"), input_keys=["goal"]), {"gain": 1})
    root = machine(
        put("put", "pose", "go"),
        state(
            "go",
            {"done": "done"},
            behavior="My_GoalSM",
            args={"parameters": {"gain": {"expr": "self.gain"}}},
            remapping={"goal": "pose"},
        ),
    )
    conversion = charts(WRITES, my_goal=used, b=behaviour(root, {"gain": 3}))
    assert conversion.charts["b"]["states"]["go"] == {
        "use": "my_goal",
        "with": {"gain": "$gain"},
        "in": {"goal": "pose"},
        "next": {"done": ".done"},
    }
    run = play(conversion)
    run.end(("put", "done"), Key="here")
    assert run.script.inputs["go/get"] == {"Value": "here"}


# -- containers ------------------------------------------------------------------------------------


def concurrency(conditions, *states, outcomes=("done",), **more):
    kind = {"kind": "concurrency", "conditions": conditions}
    return machine(*states, outcomes=outcomes, **more) | kind


def test_children_of_a_concurrency_container_lead_nowhere():
    inner = concurrency(
        [["done", [["a", "done"], ["b c", "done"]]]],
        state("a", {"done": "done"}),
        state("b c", {"done": "done"}),
    )
    root = machine(state("in", {"done": "done"}, container="inner"))
    node = charts(b=behaviour(root, inner=inner)).charts["b"]["states"]["in"]
    assert node == {
        "any": {"a": {"do": "Log"}, "b_c": {"do": "Log"}},
        "when": [{"outcome": "done", "if": {"a": "done", "b_c": "done"}}],
        "next": {"done": ".done"},
    }


def test_a_whole_behaviour_may_be_a_concurrency_container():
    root = concurrency([["done", [["a", "done"]]]], state("a", {"done": "done"}))
    run = play(charts(b=behaviour(root)))
    run.end(("a", "done"))
    assert run.run.outcome == "done"


def test_what_can_never_happen_is_left_out_and_told():
    forever = machine(state("a", {"done": "a"}), outcomes=("gone",))
    inner = concurrency(
        [["lost", [["never", "gone"]]], ["done", [["b", "done"]]]],
        state("never", {"gone": "lost"}, container="forever"),
        state("b", {"done": "done"}),
        outcomes=("done", "lost"),
    )
    root = machine(
        state("in", {"done": "done", "lost": "lost"}, container="inner"), outcomes=("done", "lost")
    )
    conversion = charts(b=behaviour(root, inner=inner, forever=forever))
    node = conversion.charts["b"]["states"]["in"]
    assert node["when"] == [{"outcome": "done", "if": {"b": "done"}}]
    assert node["next"] == {"done": ".done"}
    assert conversion.notes == (
        "b: in: a condition for 'lost' is left out: never can never end with 'gone'",
        "b: in: outcome 'lost' can never come; left out",
        "b: outcome 'lost' can never come",
    )


def test_what_a_chart_cannot_say_is_told():
    inner = machine(state("a", {"done": "done"}, pos=[1]), kind="priority")
    root = machine(
        state("in", {"done": "go"}, container="inner", autonomy={"done": "Autonomy.High"}),
        state("go", {"done": "done"}, behavior="ElsewhereSM"),
    )
    assert convert({"b": behaviour(root, inner=inner)}).notes == (
        "b: in: the autonomy of a container is left out; set that of its states",
        "b: in: a priority container; taken as a state machine",
        "b: in/a: arguments without a name are left out: [1]",
        "b: the embedded behaviour ElsewhereSM is not here",
    )
