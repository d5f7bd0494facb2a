"""What a node makes of its class: names that parameters give, types that vary (rules 9 and 10)."""

from __future__ import annotations

import re
from typing import Any, ClassVar, TypeVar

import pytest
from hypothesis import given, settings, strategies as st

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.source import read
from engine.files.units import Duration, Length
from engine.interfaces import bindings, interface, python_name, resolved
from engine.state import Action, Context, Key, Monitor, Run
from engine.state_class import StateError
from engine.types import ANY, Type, bind, fits, from_annotation, substituted
from tests.engine.written_states import Keep, Leg, Over, Pick, Push, Spot
from tests.repeats import examples

T = TypeVar("T")
N = TypeVar("N", bound=float)
LENGTH, INTEGER, TEXT = Type("length"), Type("integer"), Type("text")


class Many(Action):
    """All that parameters can name."""

    outcomes = ("first", "$more", "last")
    outputs: ClassVar = {"$more": {"item": T, "all": tuple[T, ...]}, "last": {"text": str}}
    reads: ClassVar = {"$signal": "$older", "$others": 0.5, "clock": None}
    commands = ("base", "$parts")

    def __init__(
        self,
        more: tuple[str, ...],
        signal: Key[T],
        others: tuple[Key[N], ...] = (),
        older: Duration | None = 2.0,
        parts: tuple[str, ...] = ("arm",),
        limit: N | None = None,
    ) -> None:
        self.given = more, signal, others, older, parts, limit

    def run(self, ctx: Context, value: T, values: tuple[N, ...]) -> Run:
        yield
        return "first"


MANY = interface(Many)


def test_rule_10_names_of_a_node_take_the_place_of_parameters_in_their_order():
    found = resolved(
        MANY, {"more": ("a", "b"), "signal": "x", "others": ("y", "z"), "parts": ("gripper",)}
    )
    assert found.outcomes == ("first", "a", "b", "last")
    assert list(found.outputs) == ["a", "b", "last"]
    assert found.reads == {"x": 2.0, "y": 0.5, "z": 0.5, "clock": None}
    assert found.commands == ("base", "gripper")
    assert found.make is Many


def test_rule_10_a_parameter_that_is_not_given_names_what_its_default_does():
    found = resolved(MANY, {"more": (), "signal": "x", "older": None})
    assert found.outcomes == ("first", "last")
    assert found.outputs == {"last": {"text": TEXT}}
    assert found.reads == {"x": None, "clock": None}
    assert found.commands == ("base", "arm")


def test_rule_10_a_name_that_is_not_known_yet_stays_as_it_is():
    found = resolved(MANY, {"more": (), "signal": "$eye", "parts": "$hand"})
    assert list(found.reads) == ["$eye", "clock"]
    assert found.commands == ("base", "$hand")
    assert MANY.named_by == {"more", "signal", "others", "older", "parts"}
    assert MANY.is_open


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (("a", "a"), "the outcome 'a' is there already; keep one of them"),
        (("first",), "the outcome 'first' is there already; keep one of them"),
        (("error",), "'error' is a reserved outcome; take another name"),
        (("timeout",), "'timeout' is a reserved outcome; take another name"),
        (("two words",), "'two words' cannot be an outcome; letters, digits and _ are allowed"),
        (("",), "'' cannot be an outcome; letters, digits and _ are allowed"),
    ],
)
def test_rule_10_what_cannot_be_an_outcome_is_refused(more: Any, told: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(told)}$"):
        resolved(MANY, {"more": more, "signal": "x"})


def test_rule_10_the_first_that_says_what_a_type_stands_for_counts():
    found = bindings(MANY, {"signal": LENGTH}, {"value": INTEGER, "values": from_list(INTEGER)})
    assert found == {"T": LENGTH, "N": INTEGER}
    assert bindings(MANY, {}, {"value": TEXT, "limit": INTEGER}) == {"T": TEXT, "N": INTEGER}
    assert bindings(MANY, {"signal": ANY}, {}) == {}


def from_list(item: Type) -> Type:
    return Type("list", item=item)


def test_rule_9_what_a_type_stands_for_is_put_in_everywhere():
    found = resolved(MANY, {"more": ("a",), "signal": "x"}, {"T": TEXT, "N": LENGTH})
    assert found.inputs["value"].type == TEXT
    assert found.inputs["values"].type == from_list(LENGTH)
    assert found.parameters["limit"].type == Type("length", optional=True)
    assert found.parameters["others"].type.item == Type("signal", item=LENGTH)
    assert found.outputs["a"] == {"item": TEXT, "all": from_list(TEXT)}


@pytest.mark.parametrize("cls", [Over, Pick, Push, Keep, Many])
def test_rule_9_what_a_node_makes_of_a_class_is_the_class_but_for_names_and_types(cls):
    of = interface(cls)
    given = {name: of.parameters[name].default for name in of.named_by}
    given |= {name: ("a",) for name in given if of.parameters[name].required}
    found = resolved(of, given)
    assert (found.name, found.monitor, found.about) == (of.name, of.monitor, of.about)
    assert found.parameters.keys() == of.parameters.keys()
    assert found.inputs.keys() == of.inputs.keys()
    assert not found.named_by


kinds = st.recursive(
    st.sampled_from([LENGTH, INTEGER, TEXT, from_annotation(Spot), from_annotation(Leg)]),
    lambda inner: inner.map(from_list),
    max_leaves=3,
)


@given(kinds, st.booleans(), st.integers(0, 2))
@settings(deadline=None, max_examples=examples(200), derandomize=True)
def test_rule_9_what_a_type_was_bound_to_fits_where_it_is_put(kind, optional, depth):
    """A variable inside as many lists as what is given."""
    wanted, given = Type("any", variable="T", optional=optional), kind
    for _ in range(depth):
        wanted, given = from_list(wanted), from_list(given)
    bound: dict[str, Type] = {}
    bind(wanted, given, bound)
    assert bound == {"T": kind}
    assert fits(given, substituted(wanted, bound))
    assert substituted(given, bound) == given


def test_rule_9_arguments_named_like_keywords_have_a_line_behind_them_in_python():
    assert "for" in interface(Over).parameters
    assert python_name("for") == "for_"
    assert python_name("limit") == "limit"


class NamesNothing(Monitor):
    """Names a parameter that it does not have."""

    outcomes = ("$cases",)

    def run(self, ctx: Context) -> Run:
        yield
        return ""


class AgeOfNothing(Monitor):
    """The age is that of no parameter."""

    outcomes = ("seen",)
    reads: ClassVar = {"x": "$older"}

    def __init__(self, limit: Length) -> None:
        self.limit = limit

    def run(self, ctx: Context) -> Run:
        yield
        return "seen"


class AgeOfText(AgeOfNothing):
    """The age is no number."""

    reads: ClassVar = {"x": ""}


@pytest.mark.parametrize(
    ("cls", "told"),
    [
        (NamesNothing, "NamesNothing: '$cases' stands for no parameter of __init__"),
        (AgeOfNothing, "AgeOfNothing: '$older' stands for no parameter of __init__"),
        (AgeOfText, "AgeOfText.reads['x']: the greatest age accepted, s, or None for any; not ''"),
    ],
)
def test_rule_10_a_class_that_names_nothing_is_refused(cls: Any, told: str) -> None:
    with pytest.raises(StateError) as caught:
        interface(cls)
    assert str(caught.value) == told


class Talks(Action):
    """Names topics, which stand for signals and parts."""

    outcomes = ("done",)
    reads: ClassVar = {"$topics": 0.5, "clock": None}
    optional = ("$topics",)
    commands = ("$topics", "arm")

    def __init__(self, topics: tuple[str, ...]) -> None:
        self.topics = topics

    @classmethod
    def stands_for(cls, name: str, what: str) -> tuple[str, ...]:
        found = {"/odom": ("base.pose",)} if what == "signal" else {"/cmd_vel": ("base", "arm")}
        return found.get(name, ())

    def run(self, ctx: Context) -> Run:
        yield
        return "done"


def test_rule_2_a_value_may_stand_for_other_signals_and_parts():
    talks = interface(Talks)
    found = resolved(talks, {"topics": ("/odom", "/cmd_vel", "/none")})
    assert found.reads == {"base.pose": 0.5, "clock": None}
    assert found.needed == ("clock",)
    assert found.commands == ("base", "arm")


def test_rule_10_a_part_that_a_value_stands_for_exists():
    node = "{do: Talks, with: {topics: [/cmd_vel]}, next: {done: .x}}"
    text = f"chart: c\noutcomes: [x]\nstates: {{n: {node}}}\n"
    library = Library()
    library.add(read(text.encode(), "c.yaml"))
    known = {"Talks": interface(Talks)}
    found = check(library, known, parts=("arm", "bases"))
    assert [(f.code, f.message, f.hint) for f in found if f.code == "N12"] == [
        ("N12", "topics: there is no part 'base'", "did you mean 'bases'?")
    ]
    assert not [f for f in check(library, known, parts=("arm", "base")) if f.code == "N12"]
