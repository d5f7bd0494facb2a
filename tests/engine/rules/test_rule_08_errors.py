"""Rule 8 of engine/README.md: errors."""

from __future__ import annotations

import pytest

from engine.state import Action, Context, Monitor, On, Run, Until
from tests.engine.conftest import Part
from tests.engine.rules.charts import NESTED, SEQUENCE


def test_rule_8_an_unmapped_error_bubbles_up_and_the_robot_is_held(bench):
    b = bench(NESTED)
    b.tick()
    stops = b.base.stops
    b.end("chase/inner/drive", RuntimeError("broken"))
    b.tick()
    assert b.run.outcome == "error"
    assert b.base.stops > stops
    assert list(b.last("error")) == [("error", "chase/inner/drive", "RuntimeError")]


@pytest.mark.parametrize("command", ["stop", "pause"])
def test_rule_8_a_part_that_cannot_stop_does_not_keep_the_others_from_it(bench, command):
    class Broken:
        """Cannot stop."""

        def stop(self) -> None:
            raise OSError("no connection")

    sound = Part()
    b = bench(NESTED, parts={"lamp": Broken(), "arm": sound})
    b.tick()
    getattr(b.operator, command)()
    b.tick()
    assert sound.stops == 1
    assert b.last("error") == [("error", "", "OSError")]
    assert b.run.notes[""] == "OSError: no connection"


def test_rule_8_a_part_that_cannot_stop_is_an_error_of_what_would_start_on_it(bench):
    class Broken:
        """Cannot stop."""

        def stop(self) -> None:
            raise OSError("no connection")

    b = bench(NESTED, parts={"base": Broken()})
    b.tick()
    assert b.run.outcome == "error"
    assert b.records("error")[0] == ("error", "chase/inner/drive", "OSError")


def test_rule_8_a_mapped_error_is_an_outcome(bench):
    b = bench(SEQUENCE.replace("other: a}", "other: a, error: b}"))
    b.tick()
    b.end("a", RuntimeError("broken"))
    b.tick()
    assert b.active == ["b"]


def test_rule_8_an_undeclared_outcome_is_an_error(bench):
    class Liar(Action):
        """Returns what it does not declare."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            yield
            return "finished"

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Liar, next: {done: .x}}\n"
    b = bench(text, states=(Liar,), scripted=False)
    b.tick(2)
    assert b.run.outcome == "error"
    assert b.records("error") == [("error", "a", "UndeclaredOutcome")]


class Unprintable(Exception):
    """Cannot be written out."""

    def __str__(self) -> str:
        raise ValueError("no text")

    __repr__ = __str__


ODD_YIELDS = {
    "a number": (lambda: 5, "TypeError"),
    "a signal nobody declared": (lambda: On("nowhere"), "LookupError"),
    "what is no name": (lambda: On(["user.pose"]), "TypeError"),
    "no instant": (lambda: Until(None), "TypeError"),
}


@pytest.mark.parametrize("odd", ODD_YIELDS)
@pytest.mark.parametrize("first", [True, False], ids=["at once", "later"])
@pytest.mark.parametrize("kind", [Action, Monitor])
def test_rule_8_a_yield_that_means_nothing_is_an_error_at_once(bench, odd, first, kind):
    make, error = ODD_YIELDS[odd]
    closed = []

    class Odd(kind):
        """Yields something odd."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            try:
                if not first:
                    yield
                yield make()
                yield
            finally:
                closed.append(self)
            return "done"

    form = "watch" if kind is Monitor else "do"
    text = f"chart: c\noutcomes: [x]\nstates:\n  a: {{{form}: Odd, next: {{done: .x}}}}\n"
    b = bench(text, states=(Odd,), scripted=False)
    b.tick(1 if first else 2)
    assert b.run.outcome == "error"
    assert b.records("error") == [("error", "a", error)]
    assert len(closed) == 1


ODD_ENDS = {
    "nothing": None,
    "three things": ("done", {}, {}),
    "a list of outputs": ("done", ["value"]),
    "a number of outputs": ("done", 5),
    "other outputs": ("done", {"other": 1.0}),
    "no outputs": "done",
    "outputs where there are none": ("failed", {"value": 1.0}),
    "something that cannot be printed": Unprintable(),
    "what cannot be frozen": ("done", {"value": []}),
}


@pytest.mark.parametrize("odd", ODD_ENDS)
@pytest.mark.parametrize("instant", [True, False], ids=["instant", "with steps"])
def test_rule_8_a_result_of_the_wrong_shape_is_an_error(bench, odd, instant):
    class Odd(Action):
        """Ends with something odd."""

        outcomes = ("done", "failed")
        outputs = {"done": {"value": float}}

        if instant:

            def run(self, ctx: Context) -> Run:
                return ODD_ENDS[odd]
        else:

            def run(self, ctx: Context) -> Run:
                yield
                return ODD_ENDS[odd]

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Odd, next: {done: .x, failed: .x}}\n"
    b = bench(text, states=(Odd,), scripted=False)
    b.tick(2)
    assert b.run.outcome == "error"
    assert len(b.records("error")) == 1


def test_rule_8_an_error_that_cannot_be_printed_is_an_error_like_any_other(bench):
    b = bench(SEQUENCE)
    b.end("a", Unprintable())
    b.tick()
    assert b.run.outcome == "error"
    assert b.run.notes == {"a": "Unprintable"}


@pytest.mark.parametrize("where", ["__init__", "run", "a step"])
def test_rule_8_a_stray_stop_iteration_is_no_outcome(bench, where):
    class Stray(Action):
        """Raises what only a generator's end should."""

        outcomes = ("done",)

        def __init__(self) -> None:
            if where == "__init__":
                raise StopIteration("done")

        if where == "a step":

            def run(self, ctx: Context) -> Run:
                yield
                raise StopIteration("done")
        else:

            def run(self, ctx: Context) -> Run:
                raise StopIteration("done")

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Stray, next: {done: .x}}\n"
    b = bench(text, states=(Stray,), scripted=False)
    b.tick(2)
    assert b.run.outcome == "error"
    assert b.records("error") == [("error", "a", "RuntimeError")]


def test_rule_8_nothing_is_retried_silently(bench):
    b = bench(SEQUENCE.replace("other: a}", "other: a, error: .x}"))
    b.tick()
    b.end("a", RuntimeError("broken"))
    b.tick()
    assert b.run.outcome == "x"
    assert b.records("enter").count(("enter", "a")) == 1
