"""The converter, rule by rule, on behaviours of a few states."""

from __future__ import annotations

from hypothesis import given, settings, strategies as st

from cobodeck.flexbe import Behaviour, convert, identifier, yaml_of
from engine.check.all_checks import check
from engine.files.declared.values import is_name
from engine.files.source import read
from engine.machine.machine import Machine
from tests.cobodeck.flexbe.conftest import Play, library_of
from tests.cobodeck.flexbe.known import writer
from tests.repeats import examples


def state(name, transitions, **more):
    """A state of the class `Log`, unless `more` says otherwise."""
    kind = {} if more.keys() & {"container", "behavior"} else {"class": "Log"}
    autonomy = dict.fromkeys(transitions, "Autonomy.Inherit")
    given = {} if "container" in more else {"args": {}, "pos": []}
    rest = {"name": name, **given, "transitions": transitions, "autonomy": autonomy}
    return kind | rest | more


def machine(*states, outcomes=("done",), **more):
    return {"kind": "statemachine", "states": list(states), "outcomes": list(outcomes)} | more


def behaviour(root, parameters=None, **containers):
    return {
        "behaviors": [],
        "parameters": parameters or {},
        "containers": {"_state_machine": root} | containers,
    }


def charts(known=(), userdata=None, **behaviours):
    """The conversion; its charts are without errors."""
    first = {"_state_machine": userdata or {}}
    read = [Behaviour(name, json, userdata=first) for name, json in behaviours.items()]
    conversion = convert(read, {cls.name: cls for cls in known})
    findings = check(library_of(conversion), conversion.interfaces())
    assert [f.message for f in findings if f.severity == "error"] == []
    return conversion


def play(conversion, name="b"):
    library = library_of(conversion)
    started = Play(Machine(library[name], library, conversion.interfaces()))
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
    source = read(yaml_of({"with": values}).encode(), "<text>")
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
    found = charts(b=behaviour(root)).interfaces()["Log"]
    assert found.outcomes == ("done",)
    kinds = {name: (str(a.type), a.required) for name, a in found.parameters.items()}
    assert kinds == {
        "text": ("text", True),
        "size": ("any | none", True),
        "loud": ("boolean", False),
    }


def test_outcomes_that_are_an_argument_stay_one():
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
    assert [node["do"] for node in nodes.values()] == ["Decision"] * 3
    assert nodes["a"]["with"] == {"outcomes": ["go", "stay"], "hint": "?"}
    run = play(conversion)
    assert run.end(("a", "stay")) == ["b"]
    assert run.end(("b", "down")) == ["c"]


def test_python_code_becomes_a_class_of_its_own():
    code = {"expr": "lambda x: self.near(x) * self.gain"}
    root = machine(state("scale it", {"done": "done"}, args={"calculation": code, "loud": True}))
    conversion = charts(b=behaviour(root, {"gain": 2.0}))
    assert conversion.charts["b"]["states"]["scale_it"] == {
        "do": "ScaleIt",
        "with": {"loud": True, "gain": "$gain"},
        "next": {"done": ".done"},
    }
    assert list(map(str, conversion.left)) == [
        "b: scale_it: write ScaleIt, which is to do what this did: "
        "lambda x: self.near(x) * self.gain",
    ]


def test_expressions_are_parameters_known_values_or_told():
    arguments = {
        "a": {"expr": "self.gain"},
        "b": {"expr": "Logger.REPORT_HINT"},
        "c": {"expr": "message"},
        "d": {"x": 1},
    }
    root = machine(state("s", {"done": "done"}, args=arguments))
    conversion = charts(b=behaviour(root, {"gain": 2.0}))
    given = conversion.charts["b"]["states"]["s"]["with"]
    assert given == {"a": "$gain", "b": "hint", "c": "message", "d": "{'x': 1}"}
    assert list(map(str, conversion.left)) == [
        "b: s: give the value of: message",
        "b: s: a mapping is no value of a chart; it is text now: {'x': 1}",
    ]


# -- data ------------------------------------------------------------------------------------------

WRITES = (writer("Set", "Key"), writer("Get"))


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
    conversion = charts(WRITES, {"key": "7"}, b=behaviour(root))
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
    conversion = charts(b=behaviour(root, inner=inner))
    assert conversion.notes == (
        "b: in: the autonomy of a container is left out; set that of its states",
        "b: in: a priority container pauses all beside it; here they go on beside it",
    )
    assert list(map(str, conversion.left)) == ["b: the embedded behaviour ElsewhereSM is not here"]
    assert conversion.charts["b"]["states"]["in"]["states"]["a"]["with"] == {"argument_1": 1}
    assert conversion.charts["Elsewhere"]["outcomes"] == ["done"]


def test_a_class_with_several_sets_of_outcomes_is_several():
    root = machine(
        state("a", {"up": "b", "down": "b"}),
        state("b", {"done": "a", "failed": "done"}),
    )
    nodes = charts(b=behaviour(root)).charts["b"]["states"]
    assert [node["do"] for node in nodes.values()] == ["LogUpOrDown", "LogDoneOrFailed"]


def test_what_states_of_one_class_alone_name_is_written_by_them():
    ends = {"remapping": {"success": "ok", "value": "on"}}
    root = machine(
        state("a", {"done": "b"}, **{"class": "Switch"}) | ends,
        state("b", {"done": "c"}, **{"class": "Switch"}) | ends,
        state("c", {"done": "done"}, **{"class": "Check"}, remapping={"seen": "ok"}),
    )
    read = Behaviour(
        "b", behaviour(root), userdata={"_state_machine": {"on": "True"}}, is_python=True
    )
    states = convert([read]).charts["b"]["states"]
    for name in ("a", "b"):
        assert (states[name]["in"], states[name]["out"]) == ({"value": "on"}, {"success": "ok"})
    assert states["c"]["in"] == {"seen": "ok"}


def test_a_condition_that_wants_one_state_to_end_in_two_ways_never_matches():
    inner = concurrency(
        [["done", [["a", "done"], ["a", "failed"]]], ["done", [["b", "done"]]]],
        state("a", {"done": "done", "failed": "done"}),
        state("b", {"done": "done"}),
    )
    inside = state("in", {"done": "done"}, container="_sm_in_0")
    conversion = charts(b=behaviour(machine(inside), _sm_in_0=inner))
    when = conversion.charts["b"]["states"]["in"]["when"]
    assert when == [{"outcome": "done", "if": {"b": "done"}}]
    assert "a can never end with 'done' as well" in conversion.notes[0]


def test_combinations_that_no_condition_names_have_an_outcome_of_their_own():
    inner = concurrency(
        [["done", [["a", "done"], ["b", "done"]]]],
        state("a", {"done": "done", "failed": "done"}),
        state("b", {"done": "done"}),
    )
    root = machine(state("in", {"done": "done"}, container="inner"))
    conversion = charts(b=behaviour(root, inner=inner))
    assert conversion.charts["b"]["outcomes"] == ["done", "no_condition"]
    run = play(conversion)
    run.end(("in/a", "failed"))
    assert run.run.outcome is None
    run.end(("in/b", "done"))
    assert run.run.outcome == "no_condition"


def test_concurrent_writers_of_one_key_are_told_and_the_first_is_kept():
    inner = concurrency(
        [["done", [["a", "done"]]], ["done", [["b", "done"]]]],
        put("a", "key", "done"),
        put("b", "key", "done"),
        output_keys=["key"],
    )
    root = machine(
        state("in", {"done": "get"}, container="inner", remapping={"key": "key"}),
        get("get", "key", "done"),
    )
    conversion = charts(WRITES, b=behaviour(root, inner=inner))
    assert [left.path for left in conversion.left] == ["in/b"]
    run = play(conversion)
    run.end(("in/a", "done"), Key=3)
    assert run.run.active == ["get"]
    run.tick()
    assert run.script.inputs["get"] == {"Value": 3}


def test_outputs_of_an_embedded_behaviour_arrive_and_default_keys_keep_their_defaults():
    used = behaviour(
        machine(
            get("get", "start", "put"),
            put("put", "found", "done"),
            input_keys=["start"],
            output_keys=["found"],
        )
    )
    root = machine(
        state(
            "go",
            {"done": "get"},
            behavior="pkg__GoSM",
            args={"default_keys": ["start"], "parameters": {"expr": "{'x': self.y}"}},
            remapping={"found": "here"},
        ),
        get("get", "here", "done"),
    )
    conversion = charts(WRITES, {"start": "[1, None]"}, go=used, b=behaviour(root))
    run = play(conversion)
    assert run.script.inputs["go/get"] == {"Value": (1, None)}
    run.end(("go/get", "done"))
    run.end(("go/put", "done"), Key="x")
    run.tick()
    assert run.script.inputs["get"] == {"Value": "x"}


def test_a_target_that_is_not_there_ends_the_chart_and_an_empty_container_is_a_state():
    root = machine(
        state("a", {"done": "nowhere", "no": "in"}),
        state("in", {"done": "done"}, container="inner"),
    )
    conversion = charts(b=behaviour(root, inner=machine()))
    assert conversion.charts["b"]["outcomes"] == ["done", "nowhere"]
    assert conversion.charts["b"]["states"]["in"]["do"] == "inContainer"
    run = play(conversion)
    run.end(("a", "done"))
    assert run.run.outcome == "nowhere"


def test_a_behaviour_that_embeds_itself_is_told():
    root = machine(state("again", {"done": "done"}, behavior="BSM"))
    conversion = charts(b=behaviour(root))
    assert [left.what for left in conversion.left] == ["b embeds itself, which no chart can"]


def test_an_empty_behaviour_has_a_state_in_its_place():
    conversion = charts(b=behaviour(machine(outcomes=("done", "failed"))))
    assert conversion.charts["b"]["states"] == {
        "empty": {"do": "bContainer", "next": {"done": ".done", "failed": ".failed"}}
    }
    assert "the behaviour is empty" in conversion.left[0].what


def test_a_parameter_that_is_named_like_an_input_gets_another_name():
    inner = behaviour(machine(state("a", {"done": "done"}), input_keys=["x"]), {"x": 1})
    given = {"args": {"parameters": {"x": 2}}, "remapping": {"x": "x"}}
    root = machine(state("in", {"done": "done"}, behavior="InnerSM", **given), input_keys=["x"])
    found = charts(inner=inner, b=behaviour(root)).charts
    assert found["inner"]["parameters"] == {"x_parameter": {"type": "number", "default": 1}}
    assert found["b"]["states"]["in"]["with"] == {"x_parameter": 2}


def test_two_outcomes_of_one_name_are_one_and_told():
    root = machine(state("a", {"error": "a", "error_": "done"}))
    conversion = charts(b=behaviour(root))
    assert conversion.charts["b"]["states"]["a"]["next"] == {"error_": "a"}
    assert "'error_' as another" in conversion.left[0].what
