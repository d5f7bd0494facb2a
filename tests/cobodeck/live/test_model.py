"""What pages are told of a run is what it is, at every tick."""

from __future__ import annotations

import pytest
from hypothesis import Phase, given, settings, strategies as some

from cobodeck.loop.ticked import Ticked
from cobodeck.setup.options import Options
from engine.operator import Operator
from tests.cobodeck.live.folding import Folding, recorded, require_same, study
from tests.repeats import examples

UNSHRUNK = (Phase.explicit, Phase.reuse, Phase.generate)


class Comparing:
    """A tap that compares the model with the run after each tick."""

    def __init__(self, folding: Folding) -> None:
        self.folding, self.loop, self.ticks = folding, None, 0

    def failed(self, part: str, error: BaseException) -> None:
        raise error

    def tick(self, ticked: Ticked) -> None:
        self.ticks += 1
        if ticked.kind != "end":  # the run is closed, and pages show nothing that is active
            require_same(self.folding.model, self.loop)


def compared(options: Options) -> tuple[Comparing, object]:
    comparing = Comparing(folding := Folding())
    loop, _ = recorded(study(), options, folding)
    comparing.loop = loop
    loop.taps = (*loop.taps, comparing)
    return comparing, loop


@settings(max_examples=examples(12, least=1, of=12), deadline=None, phases=UNSHRUNK)
@given(seed=some.integers(0, 10_000))
@pytest.mark.requirement(19, 21)
def test_active_nodes_and_data_are_those_of_the_run_at_every_tick(seed: int) -> None:
    comparing, loop = compared(Options(tier=0, seed=seed, duration_s=8.0))

    while loop.now_ns < 8_000_000_000 and not loop.finished:
        loop.tick()

    assert comparing.ticks == len(comparing.folding.groups) > 10
    loop.go(loop.now_ns)
    assert comparing.folding.model.active == {}


COMMANDS = some.lists(
    some.tuples(
        some.integers(1, 200),
        some.sampled_from(["pause", "resume", "lock", "unlock", "level", "consent", "refuse"]),
    ),
    max_size=12,
)


@settings(max_examples=examples(12, least=2), deadline=None, phases=UNSHRUNK)
@given(seed=some.integers(0, 10_000), commands=COMMANDS)
@pytest.mark.slow
def test_so_they_are_when_an_operator_interferes(
    seed: int, commands: list[tuple[int, str]]
) -> None:
    comparing, loop = compared(Options(tier=0, seed=seed, duration_s=8.0))
    operator, due = Operator(loop.wired.run), sorted(commands)

    while loop.now_ns < 8_000_000_000 and not loop.finished:
        while due and due[0][0] <= loop.ticks:
            interfere(operator, due.pop(0)[1])
        loop.tick()
        waiting = operator.waiting()
        assert waiting.items() <= comparing.folding.model.waiting.items()


def interfere(operator: Operator, what: str) -> None:
    if what in ("lock", "unlock"):
        getattr(operator, what)("")
    elif what == "level":
        operator.set_level("low")
    elif what in ("consent", "refuse"):
        for path in operator.waiting():
            getattr(operator, what)(path)
    else:
        getattr(operator, what)()


def test_changes_are_what_makes_the_state_of_before_that_of_now() -> None:
    _, loop = compared(Options(tier=0, seed=3, duration_s=10.0))
    model = loop.taps[-1].folding.model
    shown = model.state()
    model.changes()

    while loop.now_ns < 10_000_000_000 and not loop.finished:
        loop.tick()
        changes = model.changes() or {}
        last = [*shown["last"], *changes.get("last", [])][-200:]
        shown |= {**changes, "t": "state", "at": model.state()["at"], "last": last}
        assert shown == model.state()


def test_a_copy_is_changed_by_itself() -> None:
    _, loop = compared(Options(tier=0, seed=3, duration_s=10.0))
    model = loop.taps[-1].folding.model
    loop.tick()
    before = model.copied()
    told = before.state()

    loop.go(5_000_000_000)

    assert before.state() == told != model.state()
