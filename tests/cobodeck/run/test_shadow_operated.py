"""A shadow beside a run with an operator; what a shadow can get at; which ones are refused."""

from __future__ import annotations

import gc
import random
import types
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from cobodeck.loop.loop import Loop
from cobodeck.loop.ticked import Ticked
from cobodeck.run import simulation
from cobodeck.run.shadow import Shadow
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from engine.files.text import noting
from engine.operator.operator import Operator
from engine.operator.place import place_of
from tests.cobodeck.record.read.test_operated_replays import anything, errands  # noqa: F401
from tests.cobodeck.record.read.test_record_replay import Act
from tests.repeats import fewer

pytestmark = pytest.mark.slow
ROVER = "rbkairos_ur10"


class Operated:
    """An observer that does things at instants, and a tap that calls `after` at last."""

    def __init__(self, loop: Loop, setup: Setup, acts: dict[float, Act], after: Any) -> None:
        self.loop, self.setup, self.left, self.after = loop, setup, sorted(acts.items()), after

    def watch(self, now_ns: int) -> None:
        while self.left and self.left[0][0] * 1e9 <= now_ns:
            run = self.loop.wired.run
            self.left.pop(0)[1](Operator(run), run, self.setup)

    def failed(self, part: str, error: BaseException) -> None:
        raise error

    def tick(self, ticked: Ticked) -> None:
        if ticked.kind != "end":
            self.after()


def shadowed(acts: dict[float, Act], other: str, after: Any = None, seconds: float = 9.0) -> Shadow:
    """A run of `errands.yaml`, operated, with a shadow."""
    said: list[str] = []
    with noting():
        setup = open_setup("errands.yaml", robot=ROVER)
        shadow = Shadow(setup.beside(other), said.append)
        loop = simulation._staged(setup, Options(duration_s=seconds), None, None, shadow)
        operated = Operated(loop, setup, acts, partial(after or (lambda *_: None), loop, shadow))
        loop.observers, loop.taps = (operated, *loop.observers), (*loop.taps, operated)
        loop.go(round(seconds * 1e9))
    assert said == []
    return shadow


def set_alike(loop: Loop, shadow: Shadow) -> None:
    """What the operator has set is the same in both, unless the shadow stands still."""
    if shadow._held is None:
        one, other = place_of(loop.wired.run), place_of(shadow._wired.run)
        names = ("paused", "level", "locks", *([] if one.paused else ["paused_ns"]))
        for name in names:
            assert getattr(one, name) == getattr(other, name), (loop.now_ns, name)


@pytest.mark.parametrize("seed", fewer(range(8)))
def test_whatever_the_operator_does_the_same_chart_decides_the_same(
    errands: Path,  # noqa: F811
    seed: int,
) -> None:
    chance = random.Random(seed)
    act = partial(anything, chance=chance)
    acts: dict[float, Act] = {chance.random() * 9.0: act for _ in range(60)}

    shadow = shadowed(acts, "errands.yaml", set_alike)

    assert shadow.rows == []
    assert shadow.decided == shadow.same > 3


@pytest.mark.parametrize("seed", fewer(range(8)))
def test_another_chart_is_operated_alike_whenever_it_is_beside_the_run(
    errands: Path,  # noqa: F811
    seed: int,
) -> None:
    chance = random.Random(seed)
    acts: dict[float, Act] = {
        chance.random() * 9.0: partial(anything, chance=chance) for _ in range(60)
    }
    text = Path("errands.yaml").read_text()
    Path("hasty.yaml").write_text(text.replace("errands", "hasty").replace("700 ms", "300 ms"))

    shadow = shadowed(acts, "hasty.yaml", set_alike)

    assert shadow.ended is None
    assert shadow.rows


def test_what_the_operator_did_while_it_stood_still_is_not_done_again(
    errands: Path,  # noqa: F811
) -> None:
    only = "  fetch: {{do: Fetch, with: {{seconds: {}}}, next: {{done: fetch, failed: fetch}}}}\n"
    Path("errands.yaml").write_text("chart: errands\nstates:\n" + only.format("2 s"))
    Path("hasty.yaml").write_text("chart: hasty\nstates:\n" + only.format("1 s"))
    outputs = {"weight": 1.0, "label": "x"}
    acts: dict[float, Act] = {
        1.2: lambda op, *_: op.pause(),
        1.4: lambda op, *_: op.resume(),
        1.5: lambda op, *_: op.force("fetch", "done", outputs),
    }

    shadow = shadowed(acts, "hasty.yaml", set_alike, seconds=2.2)

    assert (shadow.decided, shadow.later, shadow.rows[1:]) == (1, 1, [])  # and the one at 1 s


def reachable(start: object) -> Iterator[object]:
    """All objects that something holds, but for modules, classes and what functions name."""
    seen, waiting = {id(start)}, [start]
    while waiting:
        one = waiting.pop()
        yield one
        if isinstance(one, types.FunctionType):
            inner: list[Any] = [*(one.__closure__ or ()), *(one.__defaults__ or ())]
        else:
            inner = gc.get_referents(one)
        for found in inner:
            if id(found) not in seen and not isinstance(found, type | types.ModuleType):
                seen.add(id(found))
                waiting.append(found)


@pytest.mark.parametrize("leaks", [False, True])
def test_no_part_of_the_run_is_within_reach_of_the_shadow(leaks: bool) -> None:
    """So that no command of its states can get to one; a part that leaked would be found."""
    with noting():
        setup = open_setup(scene="lab_a", sets=["charts.chase.near=2.9 m"])
        shadow = Shadow(setup.beside("cobodeck"), print)
        loop = simulation._staged(setup, Options(duration_s=2.0, seed=1), None, None, shadow)
        loop.go(2_000_000_000)
    if leaks:
        shadow._answers["base", "motion"] = loop.plant.parts["base"]
    parts = {id(part) for part in loop.plant.parts.values()} | {id(loop.plant), id(loop.wired)}

    found = [one for one in reachable(shadow._wired) if id(one) in parts]

    assert bool(found) is leaks
    assert shadow.decided > 0


@pytest.mark.parametrize(
    ("chart", "said"),
    [
        ("do: Fetch\n    with: {seconds: $nothing.there}", "nothing.there"),
        ("do: Nowhere", "Nowhere"),
        ("do: DriveTo\n    in: {goal: place(nowhere)}", "nowhere"),
        ("do: ParkArm\n    next: {parked: only, failed: only}", "needs a room"),
        ("watch: Above\n    with: {signal: arm.load, limit: 1}\n    next: {above: only}", "load"),
    ],
)
def test_a_chart_that_cannot_be_beside_the_run_is_refused(
    errands: Path,  # noqa: F811
    chart: str,
    said: str,
) -> None:
    Path("odd.yaml").write_text(f"chart: odd\nstates:\n  only:\n    {chart}\n")
    with pytest.raises(Exception, match=said):
        shadowed({}, "odd.yaml", seconds=0.1)
