"""Rule 11: a state may ask to hear of pauses and of the end of its run, also after it has ended."""

from typing import ClassVar

from engine.state import Action, Context, Run, RunNews
from tests.engine.conftest import Bench

TEXT = """
chart: c
outcomes: [ok]
states:
  first: {do: Listens, next: {done: second}}
  second: {do: Lasts, next: {done: .ok}}
"""


class Listens(Action):
    """Listens for as long as its run lasts."""

    outcomes = ("done",)
    heard: ClassVar[list[str]] = []

    def run(self, ctx: Context) -> Run:
        ctx.hear_run(self.raises)
        ctx.hear_run(self.heard.append)
        yield
        return "done"

    def raises(self, news: RunNews) -> None:
        raise ValueError(f"not {news}")


class Lasts(Action):
    """Lasts some ticks."""

    outcomes = ("done",)

    def run(self, ctx: Context) -> Run:
        for _ in range(5):
            yield
        return "done"


def test_rule_11_a_state_hears_of_pauses_and_the_end_once_even_if_another_one_raises():
    Listens.heard.clear()
    bench = Bench(TEXT, (Listens, Lasts), scripted=False)
    bench.operator.pause()
    bench.tick(2)
    assert Listens.heard == []  # not entered yet
    bench.operator.resume()
    bench.tick()
    bench.operator.pause()
    bench.operator.pause()
    bench.tick(2)
    assert Listens.heard == ["paused"]
    bench.operator.resume()
    bench.tick(2)
    assert bench.active[-1] == "second"
    assert Listens.heard == ["paused", "resumed"]
    bench.tick(9)
    bench.run.close()
    assert bench.run.outcome == "ok"
    assert Listens.heard == ["paused", "resumed", "over"]
    told = [str(error).rpartition("ValueError: ")[2] for error in bench.run.errors]
    assert told == ["not paused", "not resumed", "not over"]


def test_rule_11_a_run_that_is_stopped_is_over():
    Listens.heard.clear()
    bench = Bench(TEXT, (Listens, Lasts), scripted=False)
    bench.tick()
    bench.run.close()
    assert Listens.heard == ["over"]
