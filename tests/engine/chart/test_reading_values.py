"""The engine against a second reading of rule 9 on random charts with values; faulty runners."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from functools import partial

import pytest

from tests.engine.reading import Item, Route
from tests.engine.written_charts import written_of
from tests.engine.written_compared import (
    Play,
    Played,
    errors_of,
    play_of,
    played_by,
    played_by_engine,
    unlike,
)
from tests.engine.written_reading import Scope, WrittenReading
from tests.repeats import fewer


def compare_all(seeds: Iterable[int], runner: Callable[[Play], Played]) -> Counter[str]:
    """Compare runs; how many leaves were entered, keys written, and which classes' leaves.

    Raises:
        AssertionError: a runner differs from the rules; on which seed, and in what.
    """
    done: Counter[str] = Counter()
    for seed in seeds:
        play = play_of(seed)
        different = unlike(play.expected, runner(play))
        assert not different, f"seed {seed}: {different}"
        done["written"] += len(play.expected.written)
        for _, _, parameters, inputs, parts in play.expected.entered:
            done.update([*parameters, *inputs, *("part" for _ in parts)])
        done["outputs of the chart"] += bool(play.expected.results)
    return done


WORDS = (
    "written", "pace", "via", "times", "cases", "items", "goal", "leg", "value", "part", "heading",
    "outputs of the chart",
)  # fmt: skip


def test_rule_9_the_engine_gives_reads_and_writes_values_as_the_rules_say():
    done = compare_all(range(120), played_by_engine)
    assert min(done[word] for word in WORDS) >= 10, done


def test_rule_13_ticks_in_which_no_named_signal_has_news_may_be_left_out():
    compare_all(range(40), partial(played_by_engine, leave_out=True))


@pytest.mark.slow
def test_rule_9_the_engine_gives_reads_and_writes_values_on_3000_charts():
    seeds = fewer(range(200, 3200))
    done = compare_all(seeds, played_by_engine)
    assert min(done[word] for word in WORDS) >= len(seeds) // 20, done
    compare_all(seeds[::4], partial(played_by_engine, leave_out=True))


def test_rule_10_nothing_in_random_charts_with_values_is_taken_for_a_mistake():
    """But for what `seeded_charts` has: uncovered combinations, several writers, unknown ends."""
    for seed in range(60):
        found = [e for e in errors_of(written_of(seed)) if e.code not in ("S06", "S08", "F03")]
        found = [e for e in found if not (e.code == "N05" and e.message[0] == "'")]
        assert not found, seed


class WritesFailedTries(WrittenReading):
    def take(self, route: Route) -> None:
        if route.kind == "retry":
            self.write(self.handed_on(route), "")
        super().take(route)


class WritesKeptAtOnce(WrittenReading):
    def take(self, route: Route) -> None:
        if route.kind == "keep":
            self.write(self.handed_on(route), "")
        super().take(route)


class WritesLosers(WrittenReading):
    def lose(self, routes: list[Route], due: list[Item]) -> None:
        for route in routes:
            for item, _ in route.ends:
                self.write(self.outputs.get(item.path, []), "")
        super().lose(routes, due)


class OpensOnce(WrittenReading):
    """A used chart keeps the data of its last use."""

    def open(self, item: Item, scope: Scope) -> None:
        if not scope.data:
            super().open(item, scope)


class ReadsItsOwnKeys(WrittenReading):
    """The inputs of a used chart are those of its own keys."""

    def around(self, item: Item) -> Scope:
        return self.inside[item.path]


class ForgetsHowLong(WrittenReading):
    def watched(self, item: Item) -> str | None:
        self.above[item.path] = None
        return super().watched(item)


class TakesAnyAge(WrittenReading):
    def watched(self, item: Item) -> str | None:
        held = self.inputs[item.path]
        held.pop("older", None)
        return super().watched(item)


@pytest.mark.parametrize(
    "faulty",
    [
        WritesFailedTries,
        WritesKeptAtOnce,
        WritesLosers,
        OpensOnce,
        ReadsItsOwnKeys,
        ForgetsHowLong,
        TakesAnyAge,
    ],
)
def test_a_runner_that_breaks_rule_9_is_noticed(faulty):
    with pytest.raises((AssertionError, LookupError)):
        compare_all(range(400), partial(played_by, faulty))
