"""Exploration, alone and against the runner."""

from __future__ import annotations

from hypothesis import HealthCheck, given, settings

from engine.machine.exploration import Ended, active, after, explore, initial, steps
from engine.machine.vertices import Vertex
from engine.state import Action, Context, Run
from tests.engine.conftest import Bench
from tests.engine.valid_charts import chart_texts
from tests.repeats import examples

quick = settings(
    deadline=None,
    max_examples=examples(150),
    suppress_health_check=list(HealthCheck),
    derandomize=True,
)


def test_all_configurations_of_a_small_chart_are_found(bench):
    text = """
chart: c
outcomes: [x]
all:
  left:
    states:
      a: {do: Do, next: {done: b, failed: b, other: b}}
      b: {do: Do, next: {done: a, failed: .x, other: a}}
    next: {x: .x}
  right: {watch: See, next: {seen: .x, lost: .x}}
"""
    found = explore(bench(text).machine)
    assert found.complete
    assert found.configurations == 2
    assert found.entered == {"left/a", "left/b", "right"}
    assert set(found.outcomes) == {"x"}
    assert found.outcomes["x"] == ((("right", "seen"),),)


def test_the_timeout_of_a_monitor_may_come_with_actions_and_not_with_other_monitors(bench):
    """A list is looked at after each pass: that of the monitors, then timeouts and actions."""
    text = """
chart: c
outcomes: [x, y]
any:
  slow: {watch: See, timeout: 1 s}
  near: {watch: See}
  work: {do: Do}
when:
  - {outcome: x, if: {slow: timeout, work: done}}
  - {outcome: y, if: {near: seen}}
"""
    root = bench(text).machine.root
    found = set(steps(root, initial(root)))
    assert (("slow", "timeout"), ("work", "done")) in found
    assert (("slow", "seen"), ("near", "seen")) in found
    assert (("slow", "timeout"), ("near", "seen")) not in found
    assert (("slow", "seen"), ("work", "done")) not in found


def test_the_limit_is_kept_and_said(bench):
    branches = "".join(
        f"  b{i}:\n    states:\n      s0: {{do: Do, next: {{done: s1, failed: .x, other: .x}}}}\n"
        f"      s1: {{do: Do, next: {{done: s0, failed: .x, other: .x}}}}\n"
        for i in range(10)
    )
    found = explore(bench(f"chart: c\noutcomes: [x]\nany:\n{branches}").machine, limit=100)
    assert not found.complete
    assert found.configurations == 100
    assert "not complete" in found.summary()


def test_a_configuration_in_which_nothing_can_end_is_found(bench):
    class Forever(Action):
        """Never ends."""

        outcomes = ()

        def run(self, ctx: Context) -> Run:
            yield
            return "never"

    text = """
chart: c
outcomes: [x]
states:
  a: {do: Do, next: {done: b, failed: .x, other: .x}}
  b: {do: Forever}
"""
    found = explore(bench(text, states=(Forever,)).machine)
    assert found.stuck == [((("a", "done"),),)]


def without_clocks(text):
    """A bench on which timeouts only fire when they are told to."""
    bench = Bench(text)
    for vertex in bench.machine.vertices.values():
        if vertex.timeout_ns is not None:
            vertex.timeout_ns = 10**15
    return bench


def let_time_out(bench, path):
    """Make one node due, and no other."""
    bench.run.life.set_deadline(bench.run.nodes[path], bench.now)


def run_script(bench, script):
    """Play steps on the runner and on the explorer; both must agree after each of them."""
    bench.tick()
    root: Vertex = bench.machine.root
    here = initial(root)
    for step in script:
        for path, outcome in step:
            if outcome == "timeout":
                let_time_out(bench, path)
            else:
                bench.end(path, outcome)
        here = after(root, here, step, [])
        bench.tick()
        if isinstance(here, Ended):
            assert bench.run.outcome == here.outcome
            return
        expected = [leaf.path for leaf in active(root, here)]
        while bench.run.queue.put_off:
            bench.tick()
        assert bench.active == sorted(expected, key=lambda p: bench.machine.vertices[p].order)


@quick
@given(text=chart_texts(timeouts=True))
def test_the_runner_takes_every_edge_that_exploration_finds(text):
    found = explore(Bench(text).machine, limit=200)
    for script in sorted(set(found.moves.values()) | set(found.outcomes.values()))[:40]:
        if all(len(step) == 1 or "timeout" not in dict(step).values() for step in script):
            run_script(without_clocks(text), script)
