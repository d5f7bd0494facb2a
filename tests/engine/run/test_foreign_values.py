"""What states hand out may be of any class: nothing of it ends a tick or spoils the trace."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import pytest

from engine.interfaces import interface
from engine.machine.outputs import checked
from engine.run.trace import encode
from engine.state import Action, Context, Monitor, On, Run, Until
from engine.state_class import StateError
from engine.types import ANY, DEPTH, freeze
from tests.engine.conftest import Bench


class Array:
    """Compares item by item, so that the result is no truth value."""

    def __eq__(self, other: object) -> Any:
        return Array()

    def __bool__(self) -> bool:
        raise ValueError("the truth value of an array is ambiguous")

    __hash__ = None  # type: ignore[assignment]


class Hostile:
    """Raises whatever is asked of it."""

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("==")

    def __hash__(self) -> int:
        raise RuntimeError("hash")

    def __repr__(self) -> str:
        raise RuntimeError("repr")

    def __bool__(self) -> bool:
        raise RuntimeError("bool")


class Mute(Exception):
    """Says nothing about itself."""

    def __str__(self) -> str:
        raise SystemExit(1)


class Circular(Exception):
    """Is its own cause."""

    def __init__(self) -> None:
        super().__init__("round \ud800 and round")
        other = Mute()
        self.__cause__, other.__cause__ = other, self


class Handing(Action):
    """Ends with whatever it was given, or raises it."""

    outcomes = ("done",)
    outputs: ClassVar = {"done": {"value": object}}
    given: Any = None

    def run(self, ctx: Context) -> Run:
        yield
        if isinstance(self.given, Exception):
            raise self.given
        return self.given


HANDING = """
chart: c
outcomes: [x, wrong]
outputs: {x: {d: any}}
data: {d: {type: any, initial: none}}
states:
  a: {do: Handing, out: {value: d}, next: {done: .x, error: .wrong}}
"""


def handed(given: Any, monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setattr(Handing, "given", given)
    bench = Bench(HANDING, states=(Handing,), scripted=False)
    bench.tick(2)
    return bench


HANDED: dict[str, Any] = {
    "array": Array(),
    "hostile": Hostile(),
    "class": Array,
    "number": 10**5000,
    "surrogate": "\ud800",
    "array as output": ("done", {"value": Array()}),
    "hostile output": ("done", {"value": Hostile()}),
    "hostile outcome": (Hostile(), {}),
    "hostile outputs": ("done", Hostile()),
    "class as output": ("done", {"value": int}),
    "mute": Mute(),
    "circular": Circular(),
}


@pytest.mark.parametrize("name", HANDED)
def test_rule_8_whatever_a_state_hands_out_or_raises_is_its_error(
    name: str, monkeypatch: pytest.MonkeyPatch
):
    bench = handed(HANDED[name], monkeypatch)
    assert bench.run.outcome == "wrong"
    (error,) = bench.run.errors
    str(error).encode()
    assert json.loads(json.dumps(bench.run.notes)) == bench.run.notes


@dataclass(frozen=True)
class Point:
    """Numbers alone."""

    x: float
    y: float


@dataclass(frozen=True)
class Route:
    """Points, one after the other."""

    points: tuple[Point, ...]
    name: str | None = None


@dataclass(frozen=True)
class Bag:
    """Whatever is put into it."""

    things: Any
    more: Any = ()


@dataclass(frozen=True)
class Cached:
    """Has a list beside its value."""

    value: float
    seen: list[float] = field(default_factory=list, compare=False, repr=False)


@dataclass(frozen=True)
class Late:
    """A field is set later, if at all."""

    value: Any = field(init=False)


@dataclass(frozen=True)
class Chain:
    """Links of itself."""

    last: Chain | None
    held: Any = None


class Pair(NamedTuple):
    """Two values."""

    one: Any
    two: Any


def linked(depth: int, held: Any = None) -> Chain:
    chain = Chain(None, held)
    for _ in range(depth):
        chain = Chain(chain)
    return chain


def looped() -> Bag:
    bag = Bag(())
    object.__setattr__(bag, "things", (1, bag))
    return bag


RIGHT: dict[str, Any] = {
    "point": Point(1.0, 2.0),
    "route": Route((Point(1.0, 2.0),), "home"),
    "bag": Bag((1, "a", Point(1.0, 2.0)), frozenset({1, Point(0.0, 0.0)})),
    "chain": linked(20, Bag((1,))),
    "pair": Pair(Bag(1), ("a", b"b")),
    "surrogate": Bag("\ud800 and \udfff"),
    "number": Bag(-(10**5000)),
}
WRONG: dict[str, tuple[Any, str]] = {
    "list": (
        Bag([1]),
        "Bag.things: a list can be changed by others; use tuples or frozen dataclass",
    ),
    "in a tuple": (
        Pair(1, (Bag(({},)),)),
        "Bag.things: a dict can be changed by others; use tuples",
    ),
    "in a set": (
        frozenset({Bag(Array)}),
        "Bag.things: the class Array is no value; make an instance",
    ),
    "beside it": (Cached(1.0), "Cached.seen: a list can be changed by others"),
    "deep": (linked(20, [1]), "a list can be changed by others"),
    "never set": (Late(), "Late.value was never set"),
    "itself": (looped(), f"a Bag holds itself, or is nested deeper than {DEPTH} levels"),
    "too deep": (
        linked(2 * DEPTH),
        f"a Chain holds itself, or is nested deeper than {DEPTH} levels",
    ),
}


@pytest.mark.parametrize("name", RIGHT)
def test_rule_9_what_holds_nothing_mutable_is_taken_as_it_is(
    name: str, monkeypatch: pytest.MonkeyPatch
):
    value = RIGHT[name]
    bench = handed(("done", {"value": value}), monkeypatch)
    assert bench.run.outcome == "x"
    assert bench.run.results["d"] is value
    for line in bench.run.trace.lines():
        line.encode()
        json.loads(line)
    assert bench.run.trace.sha256() == bench.run.trace.sha256()


@pytest.mark.parametrize("name", WRONG)
def test_rule_9_what_holds_something_mutable_is_refused_with_its_place(
    name: str, monkeypatch: pytest.MonkeyPatch
):
    value, told = WRONG[name]
    bench = handed(("done", {"value": value}), monkeypatch)
    assert bench.run.outcome == "wrong"
    assert told in bench.run.errors[0].text
    bench.run.trace.sha256()
    bench = Bench(HANDING, states=(Handing,), scripted=False)
    bench.tick()
    assert told in str(bench.operator.force("a", "done", {"value": value}))


def test_rule_9_a_freezer_reaches_into_tuples_and_not_into_dataclasses():
    frozen = freeze((Point(0.0, 0.0), [1]), {list: tuple})
    assert frozen == (Point(0.0, 0.0), (1,))
    with pytest.raises(TypeError, match=r"Bag\.things can be changed by others; freeze it before"):
        freeze(Bag([1]), {list: tuple})


def test_rule_11_an_output_that_a_freezer_cannot_take_is_refused():
    def fail(_value: Any) -> Any:
        raise ValueError("no array of numbers")

    bench = Bench(HANDING, states=(Handing,), scripted=False, freezers={list: fail})
    bench.tick()
    assert bench.operator.force("a", "done", {"value": [1]}) == "no array of numbers"
    assert bench.operator.force("a", "done", {"value": 1}) is None


def test_rule_9_a_field_that_says_what_it_holds_is_not_looked_into():
    looks: list[Any] = []
    freezers = {float: lambda value: looks.append(value) or value}
    assert checked({"d": Route((Point(1.0, 2.0),) * 1000)}, {"d": ANY}, freezers)
    assert looks == []
    freeze(Bag(1.0), freezers)
    assert looks == [1.0]


def test_rule_15_what_cannot_be_written_is_told_in_another_way():
    assert encode("\ud800é") == '"\\ud800é"'
    assert json.loads(encode("\ud800é")) == "\ud800é"
    assert json.loads(encode(16**2000)) == {"int": hex(16**2000)}
    assert json.loads(encode(Hostile())) == {"Hostile": "?"}


class Waiting(Monitor):
    """Yields what it was given."""

    outcomes = ("seen",)
    reads: ClassVar = {"voice": None}
    make: Any = None

    def run(self, ctx: Context) -> Run:
        yield self.make()
        return "seen"


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: On(), "On() waits for no signal; name some, or yield Until(t) or None"),
        (lambda: On(until=5), "On() waits for no signal"),
        (lambda: On("voice", older=-1.0), "On(…, older=-1.0): a silence, in s, is 0 or more"),
        (lambda: On("voice", older=float("nan")), "On(…, older=nan): a silence"),
        (lambda: On("voice", older=float("inf")), "On(…, older=inf): a silence"),
        (lambda: On("voice", until=float("nan")), "nan is no instant; give chart time in ns"),
        (lambda: Until(float("nan")), "nan is no instant; give chart time in ns"),
    ],
)
def test_rule_2_a_wait_for_nothing_is_an_error_that_says_what_would_be_right(make: Any, told: str):
    with pytest.raises(ValueError) as found:  # noqa: PT011  compared below
        make()
    assert told in str(found.value)


def test_rule_2_a_wait_without_end_is_one():
    assert Until(float("inf")).ns == On("voice", until=float("inf")).until == On("voice").until


@pytest.mark.parametrize("age", [-0.1, float("nan"), float("inf")])
def test_an_age_that_no_value_can_have_is_refused_in_the_class(age: float):
    class Reader(Waiting):
        """Reads with an odd age."""

        reads: ClassVar = {"voice": age}

    with pytest.raises(
        StateError, match=r"Reader\.reads\['voice'\]: the greatest age accepted, s, or"
    ):
        interface(Reader)


def test_a_note_with_a_lone_surrogate_can_be_shown(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(Waiting, "make", lambda _self: "so \ud800")
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Waiting, next: {seen: .x}}\n"
    bench = Bench(text, states=(Waiting,), scripted=False)
    bench.tick()
    assert bench.run.notes == {"a": "so \\ud800"}
