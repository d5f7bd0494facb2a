"""A run that is set to another run's place decides from then on what the other decides."""

from __future__ import annotations

import json
from random import Random

import pytest

from engine.machine import RETRYING, Leaf
from engine.operator.place import place_of, set_place
from tests.engine.conftest import Bench
from tests.engine.seeded_charts import made_of

TICKS = 15


def bench_of(seed: int) -> Bench:
    return Bench("---\n".join(json.dumps(chart) + "\n" for chart in made_of(seed).values()))


def chosen_ends(bench: Bench, chance: Random) -> dict[str, str]:
    found = {}
    for path in bench.active:
        leaf = bench.machine.vertices[path]
        assert isinstance(leaf, Leaf)
        if chance.random() < 0.25:
            found[path] = chance.choice(leaf.interface.outcomes)
    return found


def ticked(bench: Bench, ends: dict[str, str]) -> list[tuple[str, str, tuple[object, ...]]]:
    """What was decided in a tick in which leaves end so; what has not ended goes on."""
    assert bench.script is not None
    for path, outcome in ends.items():
        bench.end(path, outcome)
    before = sum(1 for _ in bench.run.trace)
    bench.tick()
    for path in ends:
        bench.script.next_end(path)  # of one that has not got to its end
    records = [*bench.run.trace][before:]
    return [(r.kind, r.subject, r.detail) for r in records if r.kind in ("outcome", "move")]


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 120, 40))
def test_both_decide_the_same_from_then_on(first: int) -> None:
    compared = 0
    for seed in range(first, first + 40):
        chance = Random(seed)
        one, other = bench_of(seed), bench_of(seed)
        for _ in range(TICKS):
            ticked(one, chosen_ends(one, chance))
        for _ in range(chance.randrange(1, 8)):  # it is somewhere else
            ticked(other, chosen_ends(other, chance))
        retrying = any(node.status == RETRYING for node in one.run.nodes.values())
        if one.run.over or retrying:  # a further try may come sooner
            continue

        set_place(other.run, place_of(one.run))
        other.ticks = one.ticks

        if ticked(one, {}) or ticked(other, {}):
            continue  # rule 6: what is entered in a tick does not come again in it
        for _ in range(TICKS):
            ends = chosen_ends(one, chance)
            decided = ticked(one, ends)
            assert ticked(other, ends) == decided, (seed, one.ticks)
            assert set(other.active) == set(one.active), (seed, one.ticks)
            compared += len(decided)
    assert compared > 50


MAIN = """
chart: main
outcomes: [over]
states:
  a: {do: Do, timeout: 2 s, next: {done: b, failed: .over, other: .over, timeout: .over}}
  b: {use: inner, next: {x: a}}
---
chart: inner
outcomes: [x]
data: {value: {type: float, initial: 0.0}}
states:
  give: {do: Give, out: {value: value}, next: {done: use, failed: .x, other: .x}}
  use: {do: Use, in: {value: value}, next: {done: .x, failed: .x, other: .x}}
"""


def test_values_come_along_and_timeouts_stay_due() -> None:
    one, other = Bench(MAIN), Bench(MAIN)
    one.tick()
    one.end("a", "done")
    one.tick()
    one.end("b/give", "done", value=2.5)
    one.tick(2)
    assert one.active == ["b/use"]

    set_place(other.run, place_of(one.run))
    other.ticks = one.ticks
    other.tick()

    assert other.active == ["b/use"]
    assert other.run.value_of("value", "b") == 2.5

    late = Bench(MAIN)
    one = Bench(MAIN)
    one.tick(15)
    set_place(late.run, place_of(one.run))
    late.ticks = one.ticks
    late.tick(5)
    assert late.run.outcome is None
    late.tick(2)
    assert late.run.outcome == "over"  # two seconds after the entry of the other


def test_of_a_node_that_is_missing_the_one_around_it_counts() -> None:
    one, other = Bench(MAIN), Bench(MAIN.replace("  give:", "  gave:"))
    one.tick()
    one.end("a", "done")
    one.tick(2)
    assert one.active == ["b/give"]

    set_place(other.run, place_of(one.run))
    other.ticks = one.ticks
    other.tick()

    assert other.active == ["b/gave"]


def test_a_run_that_has_ended_goes_on() -> None:
    one, other = Bench(MAIN), Bench(MAIN)
    one.tick(2)
    other.tick()
    other.end("a", "failed")
    other.tick()
    assert other.run.outcome == "over"

    set_place(other.run, place_of(one.run))
    other.ticks = one.ticks
    other.tick()

    assert other.run.outcome is None
    assert other.active == ["a"]
