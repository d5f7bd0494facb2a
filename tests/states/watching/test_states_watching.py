"""States that watch any signal: in charts, with signals of known types."""

from __future__ import annotations

import math
from typing import Any

import pytest

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.source import read
from engine.interfaces import interface
from engine.machine.machine import Machine
from engine.machine.named_values import NamedValues
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare, types_of
from engine.state import NEVER_NS, Stamped
from hw.geometry import Pose2
from states.watching.states import (
    Above,
    Below,
    Changed,
    Read,
    Silent,
    Wait,
    WaitFor,
    Within,
)
from tests.states.watching.against_polling import GRID

READY = (Above, Below, Changed, Read, Silent, Wait, WaitFor, Within)
INTERFACES = {cls.__name__: interface(cls) for cls in READY}


def shipped_signals() -> Any:
    from cobodeck.project.state_catalogue import catalogue

    return catalogue(own=False).signals


def chart(node: str) -> Library:
    library = Library()
    data = "data:\n  far: {type: length, initial: none}\n  place: {type: Pose2, initial: none}\n"
    text = f"chart: c\noutcomes: [x]\n{data}states:\n  a: {node}\n"
    library.add(read(text.encode(), "<text>"))
    return library


@pytest.mark.parametrize(
    ("node", "told"),
    [
        (
            "{watch: Above, with: {signal: user.distance, limit: 2 deg}, next: {above: .x}}",
            "limit: '2 deg' is an angle; wanted: a length",
        ),
        (
            "{watch: Within, with: {signal: user.distance, low: 1 m, high: 2 s}, "
            "next: {within: .x}}",
            "high: '2 s' is a duration; wanted: a length",
        ),
        (
            "{watch: Below, with: {signal: base.pose, limit: 2 m}, next: {below: .x}}",
            "signal: base.pose is a signal of Pose2; wanted: a signal of number",
        ),
        (
            "{watch: WaitFor, with: {signal: escape.safe, value: 3}, next: {there: .x}}",
            "value: 3 is not true or false",
        ),
        (
            "{watch: Changed, with: {signal: user.pos}, next: {changed: .x}}",
            "signal: there is no signal 'user.pos'",
        ),
        (
            "{do: Read, with: {signal: user.pose}, out: {value: place}, "
            "next: {read: .x, none: .x}}",
            "output 'value' of Read is a UserPose; 'place' holds a Pose2",
        ),
    ],
)
def test_what_does_not_fit_the_signal_is_refused_when_the_chart_is_loaded(
    node: str, told: str
) -> None:
    found = check(chart(node), INTERFACES, types=pose_type(), signals=shipped_signals())

    assert any(told in finding.message for finding in found), [f.message for f in found]


def pose_type() -> dict[str, Any]:
    from behaviors.signal_table import TYPES

    return {"Pose2": TYPES["Pose2"]}


@pytest.mark.parametrize(
    "node",
    [
        "{watch: Above, with: {signal: user.distance, limit: 2 m, for: 300 ms, hysteresis: 10 cm, "
        "older: 0.5 s}, out: {value: far}, next: {above: .x}}",
        "{do: Read, with: {signal: base.pose}, out: {value: place}, next: {read: .x, none: .x}}",
        "{watch: WaitFor, with: {signal: base.pose, value: {x: 1 m, y: 2 m}}, next: {there: .x}}",
    ],
)
def test_what_fits_is_taken(node: str) -> None:
    found = check(chart(node), INTERFACES, types=pose_type(), signals=shipped_signals())

    assert not [finding for finding in found if finding.severity == "error"]


SIGNALS = declare([
    Measured("level", float),
    Measured("place", Pose2),
    Measured("bell", bool, event=True),
    Measured("word", str, event=True),
])  # fmt: skip


class Alone:
    """A run of one node, ticked at 10 Hz."""

    def __init__(self, node: str) -> None:
        library = chart(node)
        around = NamedValues(signals=types_of(SIGNALS))
        self.board = Board(SIGNALS)
        machine = Machine(library["c"], library, INTERFACES, types=pose_type(), around=around)
        self.run = ChartRun(machine, self.board)
        self.ticks = 0

    def tick(self, times: int = 1, **samples: Any) -> str | None:
        """Give samples, then tick; the outcome."""
        for name, value in samples.items():
            self.board.put(name, value, GRID.instant(self.ticks))
        for _ in range(times):
            self.run.tick(GRID.instant(self.ticks))
            self.ticks += 1
        assert not self.run.errors
        return self.run.outcome


def test_a_number_is_above_at_once_unless_it_has_to_last() -> None:
    alone = Alone("{watch: Above, with: {signal: level, limit: 2}, next: {above: .x}}")

    assert alone.tick(level=2.0) is None
    assert alone.tick(level=2.1) == "x"


def test_a_number_that_has_to_last_may_fall_back_by_the_hysteresis() -> None:
    alone = Alone(
        "{watch: Above, with: {signal: level, limit: 2, for: 0.5 s, hysteresis: 0.5}, "
        "next: {above: .x}}"
    )

    assert alone.tick(2, level=2.1) is None
    assert alone.tick(2, level=1.4) is None  # 0.6 below the limit: begins anew
    assert alone.tick(level=2.1) is None
    assert alone.tick(4, level=1.5) is None
    assert alone.tick() == "x"


def test_values_before_it_began_do_not_count() -> None:
    alone = Alone("{watch: Below, with: {signal: level, limit: 2, for: 0.3 s}, next: {below: .x}}")

    alone.board.put("level", 1.0, -(10**9))

    assert alone.tick(3) is None
    assert alone.tick() == "x"


@pytest.mark.parametrize("lost", [None, math.nan])
def test_no_value_interrupts(lost: float | None) -> None:
    alone = Alone(
        "{watch: Within, with: {signal: level, low: 1, high: 2, for: 0.3 s}, next: {within: .x}}"
    )

    assert alone.tick(3, level=1.5) is None
    assert alone.tick(level=lost) is None
    assert alone.tick(3, level=2.0) is None
    assert alone.tick() == "x"


def test_a_range_from_high_to_low_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"nothing is from low 2 to high 1; swap them"):
        Within("level", 2.0, 1.0)  # type: ignore[arg-type]


def test_a_value_that_is_equal_is_no_change_and_none_is_no_value() -> None:
    alone = Alone("{watch: Changed, with: {signal: place}, next: {changed: .x}}")

    for place in (None, Pose2(1.0, 2.0, 0.0)):
        alone.board.put("place", Pose2(1.0, 2.0, 0.0), GRID.instant(alone.ticks))
        assert alone.tick() is None
        assert alone.tick(place=place) is None
    assert alone.tick(place=Pose2(1.0, 2.1, 0.0)) == "x"


def test_a_signal_that_said_none_has_changed_with_its_first_value() -> None:
    alone = Alone("{watch: Changed, with: {signal: level}, next: {changed: .x}}")

    assert alone.tick(level=None) is None
    assert alone.tick(level=1.0) == "x"


def test_where_nothing_had_come_the_first_value_is_what_others_are_compared_with() -> None:
    alone = Alone("{watch: Changed, with: {signal: level}, next: {changed: .x}}")

    assert alone.tick() is None
    assert alone.tick(level=1.0) is None
    assert alone.tick(level=2.0) == "x"


def test_a_level_may_be_there_already_and_may_have_to_last() -> None:
    there = Alone("{watch: WaitFor, with: {signal: level}, next: {there: .x}}")
    lasting = Alone("{watch: WaitFor, with: {signal: level, for: 0.2 s}, next: {there: .x}}")

    assert there.tick(level=0.0) == "x"
    assert lasting.tick(2, level=0.0) is None
    assert lasting.tick() == "x"


def test_a_place_can_be_waited_for() -> None:
    alone = Alone(
        "{watch: WaitFor, with: {signal: place, value: {x: 1 m, y: 2 m}}, out: {value: place}, "
        "next: {there: .x}}"
    )

    assert alone.tick(place=Pose2(1.0, 2.5, 0.0)) is None
    assert alone.tick(place=Pose2(1.0, 2.0, 0.0)) == "x"


def test_of_an_event_signal_only_events_since_it_began_count() -> None:
    node = "{watch: WaitFor, with: {signal: bell}, next: {there: .x}}"
    text = (
        f"{{states: {{z: {{watch: Wait, with: {{time: 0.2 s}}, next: {{over: a}}}}, a: {node}}}}}"
    )
    alone = Alone(text)

    assert alone.tick(bell=True) is None
    assert alone.tick(4) is None
    assert alone.tick(bell=True) == "x"


def test_an_event_in_the_tick_of_its_beginning_counts_and_others_may_be_meant() -> None:
    node = "{watch: WaitFor, with: {signal: word, value: go}, next: {there: .x}}"

    assert Alone(node).tick(word="go") == "x"
    alone = Alone(node)
    assert alone.tick(word="stop") is None
    alone.board.put("word", "go", GRID.instant(alone.ticks))
    assert alone.tick(word="wait") == "x"  # both come in one tick


def test_an_event_cannot_last(context: Any) -> None:
    ctx = context({})
    ctx.events_of = {"bell"}

    with pytest.raises(ValueError, match="bell is an event, which does not last; no `for`"):
        next(WaitFor("bell", for_=1.0).run(ctx))  # type: ignore[arg-type]


def test_a_signal_is_silent_when_nothing_comes_for_the_time() -> None:
    alone = Alone("{watch: Silent, with: {signal: level, time: 0.25 s}, next: {silent: .x}}")

    assert alone.tick(2) is None
    for _ in range(5):  # repeats
        assert alone.tick(level=1.0) is None
    assert alone.tick(2) is None
    assert alone.tick() == "x"


def test_a_signal_that_says_none_is_silent_at_once() -> None:
    alone = Alone("{watch: Silent, with: {signal: level, time: 10 s}, next: {silent: .x}}")

    assert alone.tick(level=None) == "x"


@pytest.mark.parametrize(("time", "ticks"), [("0 s", 1), ("0.2 s", 3), ("0.25 s", 4)])
def test_a_wait_is_over_in_the_first_tick_not_before_its_time(time: str, ticks: int) -> None:
    alone = Alone(f"{{watch: Wait, with: {{time: {time}}}, next: {{over: .x}}}}")

    assert [alone.tick() for _ in range(ticks)] == [None] * (ticks - 1) + ["x"]


@pytest.mark.parametrize(
    ("values", "outcome"),
    [
        ({}, "none"),
        ({"level": None}, "none"),
        ({"level": 2.0}, ("read", {"value": 2.0})),
    ],
)
def test_a_signal_is_read_at_once(context: Any, values: dict[str, Any], outcome: Any) -> None:
    assert Read("level").run(context(values)) == outcome  # type: ignore[arg-type]


def test_it_sleeps_while_nothing_happens(context: Any) -> None:
    ctx = context({"level": 1.0})

    waits: Any = next(Above("level", 2.0, older=0.5).run(ctx))  # type: ignore[arg-type]

    assert (waits.signals, waits.until) == (("level",), NEVER_NS)


def test_events_are_handed_on_with_their_value(context: Any) -> None:
    ctx = context({})
    ctx.events_of = {"word"}
    ctx.pending["word"] = [Stamped(None, 0), Stamped("go", 1)]

    with pytest.raises(StopIteration) as end:
        next(WaitFor("word").run(ctx))  # type: ignore[arg-type]

    assert end.value.value == ("there", {"value": "go"})
