"""Estimators that state their own stamp and what they need, constants, and what must be given."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from typing import Any

import pytest

from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Estimated, Measured, declare, roots
from engine.state import ALWAYS_NS, Context, Monitor, On, Run
from tests.engine.conftest import Bench

MS = 10**6
HZ = 30


class DeadReckoning:
    """A planar pose: fixes of a tracker, taken on by the way that odometry has counted since.

    Odometry is x, y, yaw in a frame of its own; a fix counts for the odometry nearest to its stamp.
    """

    def __init__(self) -> None:
        self.odometry: dict[int, tuple[float, float, float]] = {}
        self.fixes: dict[int, tuple[float, float, float]] = {}

    def update(self, signal: str, sample: Any) -> None:
        kept = self.odometry if signal == "odometry" else self.fixes
        kept[sample.stamp] = sample.value

    def value(self) -> tuple[float, float, float] | None:
        if not self.fixes or not self.odometry:
            return None
        fixed = max(self.fixes)
        then = self.odometry[min(self.odometry, key=lambda stamp: (abs(stamp - fixed), stamp))]
        return moved(self.fixes[fixed], then, self.odometry[max(self.odometry)])

    def stamp(self) -> int:
        return max(self.odometry)


def moved(
    fix: tuple[float, float, float],
    start: tuple[float, float, float],
    end: tuple[float, float, float],
) -> tuple[float, float, float]:
    """The fix, moved as the odometry from start to end."""
    turn = fix[2] - start[2]
    dx, dy = end[0] - start[0], end[1] - start[1]
    c, s = math.cos(turn), math.sin(turn)
    return fix[0] + c * dx - s * dy, fix[1] + s * dx + c * dy, end[2] + turn


class Echo:
    """The newest value, as it came."""

    def __init__(self) -> None:
        self.last: Any = None
        self.stamps: list[int] = []

    def update(self, signal: str, sample: Any) -> None:
        self.last = (signal, sample.value)
        self.stamps.append(sample.stamp)

    def value(self) -> Any:
        return self.last


class Table(Echo):
    """Knows a number before it has heard anything, and never ages while it has not."""

    def value(self) -> Any:
        return self.last or ("nobody", 7.0)

    def stamp(self) -> int | None:
        return max(self.stamps, default=None)


SIGNALS = declare(
    [
        Measured("odometry"),
        Measured("tracker"),
        Measured("room", constant=True),
        Measured("rules", constant=True),
        Estimated("pose", ("odometry", "tracker"), DeadReckoning),
        Estimated("table", ("tracker",), Table, needs=()),
        Estimated("echo of pose", ("pose",), Echo),
        Estimated("echo of table", ("table",), Echo),
        Estimated("early", ("odometry", "tracker"), Echo, needs=("odometry",)),
        Derived("distance", ("room", "pose"), lambda room, pose: math.dist(room, pose[:2])),
        Derived("law", ("room", "rules"), lambda room, rules: (room, rules)),
        Derived("counted", ("table", "room"), lambda table, room: (table, room)),
    ]
)


def circle(at_ns: int) -> tuple[float, float, float]:
    """Where a robot is that drives on a circle of 2 m with 1 m/s."""
    angle = 0.5 * at_ns * 1e-9
    return 2.0 * math.cos(angle), 2.0 * math.sin(angle), angle + 0.5 * math.pi


def deliveries(seed: int, seconds: int) -> dict[int, list[tuple[str, Any, int]]]:
    """What arrives before which tick: odometry at 30 Hz up to 6 ms late, and 1 Hz of a tracker.

    The tracker's fixes come up to 1.9 s late, so that some overtake others; the first comes late.
    """
    chance = random.Random(seed)
    found: dict[int, list[tuple[str, Any, int]]] = {}

    def deliver(name: str, value: Any, stamp: int, delay: int) -> None:
        tick = (stamp + delay) * HZ // 10**9 + 1
        found.setdefault(tick, []).append((name, value, stamp))

    for number in range(seconds * HZ):
        stamp = number * 10**9 // HZ - chance.randrange(6 * MS)
        x, y, yaw = circle(stamp)
        deliver("odometry", (x - 5.0, y + 1.0, yaw), stamp, 0)
    for number in range(seconds):
        stamp = number * 10**9 + chance.randrange(300 * MS)
        deliver("tracker", circle(stamp), stamp, chance.randrange(100 * MS, 1900 * MS))
    for some in found.values():
        chance.shuffle(some)
    return found


def test_a_fused_pose_is_as_fresh_as_its_prediction_and_silent_until_the_first_fix():
    arriving = deliveries(3, 40)
    first = min(tick for tick, some in arriving.items() if any(n == "tracker" for n, *_ in some))
    fixes = [
        stamp for _, some in sorted(arriving.items()) for n, _, stamp in some if n != "odometry"
    ]
    assert fixes != sorted(fixes)  # they overtake each other
    board = Board(SIGNALS, ["distance"])
    board.put("room", (0.0, 0.0), 0)
    for tick in range(1, 40 * HZ):
        now = tick * 10**9 // HZ
        for sample in arriving.get(tick, ()):
            board.put(*sample)
        board.begin(now)
        pose, distance = board.slots["pose"].read(), board.slots["distance"].read()
        if tick < first:
            assert pose is None
            assert distance is None
            continue
        assert pose is not None
        assert now - pose.stamp <= 40 * MS
        assert math.dist(pose.value[:2], circle(pose.stamp)[:2]) < 0.04
        assert distance is not None
        assert distance.stamp == pose.stamp


@pytest.mark.parametrize("seed", range(8))
def test_who_reads_when_changes_no_fused_value_and_no_stamp(seed):
    arriving, chance = deliveries(seed, 10), random.Random(seed)
    lazy, eager, wild = Board(SIGNALS), Board(SIGNALS, eager=True), Board(SIGNALS)
    for tick in range(1, 10 * HZ):
        for board in (lazy, eager, wild):
            if tick == 1:
                board.put("room", (0.0, 0.0), 0)
            for sample in arriving.get(tick, ()):
                board.put(*sample)
            board.begin(tick * 10**9 // HZ)
        for name in chance.sample(sorted(SIGNALS), chance.randrange(4)):
            wild.slots[name].read()
    for name in SIGNALS:
        assert lazy.slots[name].read() == eager.slots[name].read() == wild.slots[name].read()
    echoes = [board.slots["echo of pose"].estimator.stamps for board in (lazy, eager, wild)]
    assert echoes[0] == echoes[1] == echoes[2]
    assert len(echoes[0]) > 200


def test_without_a_stamp_of_its_own_an_estimate_is_as_old_as_its_rarest_input():
    signals = [
        Measured("odometry"),
        Measured("tracker"),
        Estimated("pose", ("odometry", "tracker"), lambda: Plain(DeadReckoning())),
    ]
    board = Board(declare(signals))
    board.put("tracker", (1.0, 1.0, 0.0), 10)
    board.put("odometry", (0.0, 0.0, 0.0), 900)
    board.begin(1000)
    assert board.slots["pose"].read().stamp == 10
    board.put("tracker", (1.0, 1.0, 0.0), 5)  # a late one makes it no older
    board.begin(2000)
    assert board.slots["pose"].read().stamp == 10


class Plain:
    """An estimator without its stamp."""

    def __init__(self, estimator: Any) -> None:
        self.update, self.value = estimator.update, estimator.value


def test_an_estimator_speaks_once_it_has_heard_what_it_needs():
    board = Board(SIGNALS, ["early"])
    board.put("tracker", 1.0, 5)
    board.begin(10)
    assert board.slots["early"].read() is None
    board.put("odometry", 2.0, 20)
    board.begin(30)
    assert board.slots["early"].read() == (("odometry", 2.0), 20)
    board.put("tracker", 3.0, 25)
    board.begin(40)
    assert board.slots["early"].read() == (("tracker", 3.0), 20)  # as old as what it needs


@pytest.mark.parametrize("eager", [True, False])
def test_an_estimator_that_needs_nothing_speaks_from_the_start_to_its_followers_too(eager):
    board = Board(SIGNALS, eager=eager)
    board.begin(10**12)
    assert board.slots["table"].read() == (("nobody", 7.0), ALWAYS_NS)
    assert board.slots["echo of table"].read().value == ("table", ("nobody", 7.0))
    board.put("tracker", 1.0, 20)
    board.begin(10**12)
    assert board.slots["table"].read() == (("tracker", 1.0), 20)
    assert board.slots["echo of table"].read() == (("table", ("tracker", 1.0)), 20)
    assert board.slots["echo of table"].estimator.stamps == [ALWAYS_NS, 20]


def test_constants_do_not_age_and_make_nothing_older():
    board = Board(SIGNALS)
    board.put("room", (0.0, 0.0), 0)
    board.put("rules", "none", 0)
    board.begin(0)
    board.put("tracker", (3.0, 4.0, 0.0), 7 * 10**9)
    board.put("odometry", (0.0, 0.0, 0.0), 8 * 10**9)
    board.begin(9 * 10**9)
    assert board.slots["distance"].read() == (5.0, 8 * 10**9)
    assert board.slots["law"].read() == (((0.0, 0.0), "none"), ALWAYS_NS)
    assert board.slots["counted"].read().stamp == 7 * 10**9
    assert board.slots["room"].read() == ((0.0, 0.0), ALWAYS_NS)


def test_a_constant_is_given_once():
    board = Board(SIGNALS)
    board.put("room", (0.0, 0.0), 0)
    board.begin(0)
    with pytest.raises(ValueError, match="constant 'room' is given once"):
        board.put("room", (1.0, 1.0), 1)


def test_a_reader_takes_a_constant_at_any_age_and_finds_it_to_be_of_now():
    class Reader(Monitor):
        """Ends when it sees all."""

        outcomes = ("seen",)
        reads = {"room": 0.1, "law": 0.1, "distance": 0.1}

        def run(self, ctx: Context) -> Run:
            while ctx.value("distance") is None:
                assert ctx.value("room") == (0.0, 0.0)
                assert ctx.value("law") == ((0.0, 0.0), "none")
                assert ctx.age("law") == 0.0
                assert ctx.age("distance") == math.inf
                yield On("distance")
            assert ctx.age("distance") == pytest.approx(0.05)
            return "seen"

    board = Board(SIGNALS)
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Reader, next: {seen: .x}}\n"
    bench = Bench(text, states=(Reader,), scripted=False, board=board)
    board.put("room", (0.0, 0.0), 0)
    board.put("rules", "none", 0)
    bench.tick(50)
    assert bench.run.outcome is None
    board.put("tracker", (3.0, 4.0, 0.0), bench.now - 10**9)
    board.put("odometry", (0.0, 0.0, 0.0), bench.now - 5 * 10**7)
    bench.tick()
    assert bench.run.outcome == "x"


def test_the_same_inputs_make_a_derived_value_younger_without_computing_it_again():
    calls: list[Any] = []

    def noted(value: Any) -> tuple[Any]:
        calls.append(value)
        return (value,)

    signals = [Measured("a"), Derived("b", ("a",), noted), Derived("c", ("b",), noted)]
    board = Board(declare(signals))
    same = (1.0, 2.0)
    for tick, value in enumerate((same, same, (1.0, 2.5), same)):
        board.put("a", value, tick)
        board.begin(tick)
        assert board.slots["c"].read() == (((value,),), tick)
    assert calls == [same, (same,), (1.0, 2.5), ((1.0, 2.5),), same, (same,)]


ROOTS: Mapping[str, set[str]] = {
    "odometry": {"odometry"},
    "pose": {"odometry", "tracker"},
    "echo of pose": {"odometry", "tracker"},
    "distance": {"odometry", "tracker", "room"},
    "early": {"odometry"},
    "table": set(),
    "counted": {"room"},
}


@pytest.mark.parametrize("name", ROOTS)
def test_what_must_be_given_for_a_signal_is_all_that_it_needs(name):
    assert roots(SIGNALS, [name]) == ROOTS[name]


def test_what_must_be_given_for_several_signals_is_the_union():
    assert roots(SIGNALS, []) == set()
    assert roots(SIGNALS, ["early", "counted"]) == {"odometry", "room"}


def test_an_estimator_cannot_need_what_it_does_not_rest_on():
    with pytest.raises(ValueError, match="'e' needs 'b', but rests on a"):
        declare([Measured("a"), Measured("b"), Estimated("e", ("a",), Echo, needs=("b",))])
