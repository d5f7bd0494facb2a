"""The engine against a second reading of its rules, on random charts; and faulty runners."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import pytest

from tests.engine.compared import Runner, check, difference, read_by, run_by_engine
from tests.engine.operated import operated_by_engine, operated_case
from tests.engine.reading import Item, Reading, Route
from tests.repeats import fewer


def compare_all(seeds: Iterable[int], runner: Runner) -> int:
    """The number of rounds in which three or more guards of one container tied.

    Raises:
        AssertionError: a runner differs from the rules; on which chart, and by which rule.
    """
    return sum(check(seed, runner) for seed in seeds)


def test_the_engine_does_as_the_rules_say():
    assert compare_all(range(300), run_by_engine) >= 100


@pytest.mark.slow
def test_the_engine_does_as_the_rules_say_on_3000_charts():
    assert compare_all(range(300, 3300), run_by_engine) >= 1000


def operated_alike(seeds: Iterable[int]) -> Counter[str]:
    """Compare runs with an operator; what the operator did, and what of it was refused."""
    done: Counter[str] = Counter()
    for seed in seeds:
        case = operated_case(seed)
        entries, refused = operated_by_engine(case.charts, case.script, case.acts)
        assert refused == case.reading.refused, seed
        assert difference(case.reading.entries, entries) is None, seed
        for acts in case.acts:
            done.update(act.what for act in acts)
            done["two replacements"] += [act.what for act in acts].count("replace") > 1
        done.update(f"refused {what}" for _, what in refused)
        done["broken"] += any(e.record[-1] == "breakpoint" for e in case.reading.entries)
    return done


def test_the_engine_does_as_the_rules_say_whatever_the_operator_does():
    done = operated_alike(range(100, 125))
    for what in (
        "force", "replace", "two replacements", "pause", "refused force", "step", "break", "broken"
    ):  # fmt: skip
        assert done[what] >= 5


@pytest.mark.slow
def test_the_engine_does_as_the_rules_say_whatever_the_operator_does_on_3000_charts():
    done = operated_alike(fewer(range(3000)))
    assert min(done.values()) >= 50


class DepthBeforePriority(Reading):
    """Takes the outer transition first and looks at priorities then, as rule 4 once was."""

    def outdone(
        self, box: Item, routes: list[Route], matched: Route | None, due: list[Item]
    ) -> list[Route]:
        return []

    def rank(self, route: Route) -> tuple[int, ...]:
        return route.place, route.cause.depth, -route.cause.priority, route.cause.order


class LowPriorityFirst(Reading):
    def rank_in_container(self, route: Route) -> tuple[int, ...]:
        return route.cause.priority, route.place, route.cause.order


class LastInDocumentFirst(Reading):
    def rank_in_container(self, route: Route) -> tuple[int, ...]:
        return -route.cause.priority, route.place, -route.cause.order


class InnerTransitionFirst(Reading):
    def rank_in_container(self, route: Route) -> tuple[int, ...]:
        return -route.cause.priority, -route.place, route.cause.order


class KeptGuardsCompete(Reading):
    def competes(self, route: Route, box: Item) -> bool:
        return route.cause.guard


class LosersComeBack(Reading):
    """A guard that lost in its container is taken where the winner leaves it running."""

    def lose(self, routes: list[Route], due: list[Item]) -> None:
        super().lose([route for route in routes if route.cause.priority <= 0], due)


class MonitorsInDocumentOrder(Reading):
    def monitors(self, box: Item):
        return (item for item in box.walk() if item.form == "watch")


class HandsOverInsideWhatIsDue(Reading):
    def forbidden(self, route: Route, due: list[Item]) -> bool:
        return False


class InnerTimeoutFirst(Reading):
    def due(self) -> list[Item]:
        return super().due()[::-1]


class NeverPutsOff(Reading):
    def choose(self, item: Item, *, again: bool = False) -> None:
        super().choose(item, again=True)


class ForgetsTimeouts(Reading):
    def due(self) -> list[Item]:
        return []


class ClosesTheFirstFirst(Reading):
    def take(self, route: Route) -> None:
        self.started.reverse()
        super().take(route)
        self.started.reverse()


class EntersContainersWithEachLeaf(Reading):
    def enter(self, item: Item) -> None:
        if item.leaf and item.parent is not None and item.parent.running:
            self.record(7, "enter", item.parent.path)
        super().enter(item)


class SwallowsErrors(Reading):
    def step(self, leaf: Item) -> str | None:
        outcome = super().step(leaf)
        return None if outcome == "error" else outcome


@pytest.mark.parametrize(
    ("rule", "faulty"),
    [
        (3, MonitorsInDocumentOrder),
        (4, DepthBeforePriority),
        (4, LowPriorityFirst),
        (4, LastInDocumentFirst),
        (4, InnerTransitionFirst),
        (4, KeptGuardsCompete),
        (4, LosersComeBack),
        (5, HandsOverInsideWhatIsDue),
        (5, InnerTimeoutFirst),
        (5, ForgetsTimeouts),
        (6, NeverPutsOff),
        (7, ClosesTheFirstFirst),
        (7, EntersContainersWithEachLeaf),
        (8, SwallowsErrors),
    ],
)
def test_a_runner_that_breaks_a_rule_is_reported_with_its_number(rule, faulty):
    with pytest.raises(AssertionError, match=rf"rule {rule}, tick \d+: the runner does not do"):
        compare_all(range(300), read_by(faulty))


def test_a_difference_is_reported_on_a_small_chart():
    """Two guards of one container: an outer target beside a higher priority."""
    with pytest.raises(AssertionError) as caught:
        compare_all(range(300), read_by(DepthBeforePriority))
    report = str(caught.value)
    assert report.count("watch") == 2
    assert report.count('"do"') <= 1
