import math
from dataclasses import dataclass

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import STILL, Twist2
from hw.safety.multiplexer import Lock, Multiplexer, Selected, VelocitySource
from tests.repeats import examples

SECOND = 1_000_000_000
FAST, SLOW = Twist2(1.0, 0.5, 0.1), Twist2(0.2)


def test_the_first_source_drives_alone():
    mux = Multiplexer()
    mux.offer("chase", FAST)
    assert mux.select(0) == Selected(FAST, "chase", None)


def test_nobody_drives_is_a_zero():
    assert Multiplexer().select(0) == Selected(STILL, None, None)


@pytest.mark.requirement(41, 71)
def test_escape_goes_before_haptic_before_chase_whoever_came_last():
    mux = Multiplexer()
    for name in ("escape", "haptic", "chase"):
        mux.offer(name, Twist2(len(name)))
    assert mux.select(0).source == "escape"
    mux.release("escape")
    assert mux.select(0).source == "haptic"
    mux.release("haptic")
    assert mux.select(0).source == "chase"


@pytest.mark.requirement(71)
def test_a_higher_source_need_not_wait_for_a_lower_one_that_goes_on_sending():
    mux = Multiplexer()
    mux.offer("chase", FAST)
    mux.offer("escape", SLOW)
    mux.offer("chase", FAST)
    assert mux.select(2) == Selected(SLOW, "escape", None)


@pytest.mark.requirement(42)
def test_after_a_release_the_lower_source_drives_without_delay():
    mux = Multiplexer()
    mux.offer("chase", FAST)
    mux.offer("escape", SLOW)
    mux.release("escape")
    assert mux.select(0) == Selected(FAST, "chase", None)


@pytest.mark.requirement(42)
def test_a_stale_command_times_out_to_zero():
    mux = Multiplexer()
    mux.offer("chase", FAST)
    assert mux.select(1).twist == FAST
    assert mux.select(SECOND // 2 + 1).twist == FAST
    assert mux.select(SECOND // 2 + 2) == Selected(STILL, None, None)


def test_after_a_leap_back_in_time_what_was_said_before_it_counts_no_more():
    mux = Multiplexer(locks=(Lock("observer", 255, 0.5),))
    mux.switch("observer", False, 5 * SECOND)
    mux.offer("chase", FAST)
    assert mux.select(5 * SECOND).source == "chase"
    assert mux.select(SECOND) == Selected(STILL, None, "observer")
    mux.switch("observer", False, SECOND)
    assert mux.select(SECOND) == Selected(STILL, None, None)
    mux.offer("chase", FAST)
    assert mux.select(SECOND).source == "chase"


def test_a_release_twice_or_before_any_offer_is_harmless():
    mux = Multiplexer()
    mux.release("haptic")
    mux.release("haptic")
    assert mux.select(0).source is None


def test_a_lock_sends_zero_and_says_its_name():
    mux = Multiplexer()
    mux.offer("escape", FAST)
    mux.switch("stop", True, 0)
    assert mux.select(0) == Selected(STILL, None, "stop")
    mux.switch("stop", False, 1)
    assert mux.select(1) == Selected(FAST, "escape", None)


def test_a_lock_keeps_off_only_lower_priorities():
    mux = Multiplexer(locks=(Lock("hold", 80),))
    mux.switch("hold", True, 0)
    mux.offer("chase", FAST)
    assert mux.select(0) == Selected(STILL, None, "hold")
    mux.offer("haptic", SLOW)
    assert mux.select(0) == Selected(SLOW, "haptic", "hold")


def test_a_lock_with_a_time_out_is_on_until_heard_of_and_when_it_falls_silent():
    mux = Multiplexer(locks=(Lock("observer", 255, 0.5),))
    mux.offer("escape", FAST)
    assert mux.select(0).lock == "observer"
    mux.switch("observer", False, 0)
    assert mux.select(0).source == "escape"
    mux.offer("escape", FAST)
    assert mux.select(SECOND // 2 + 1).lock == "observer"


def test_of_equal_priorities_the_source_named_first_wins():
    mux = Multiplexer((VelocitySource("left", 5), VelocitySource("right", 5)))
    mux.offer("right", FAST)
    mux.offer("left", SLOW)
    assert mux.select(0).source == "left"


@pytest.mark.parametrize(
    "twist", [Twist2(math.nan), Twist2(0.0, math.inf), Twist2(0.0, 0.0, math.nan)]
)
def test_a_velocity_that_is_no_number_is_refused_and_the_last_one_holds(twist):
    mux = Multiplexer()
    mux.offer("chase", SLOW)
    with pytest.raises(ValueError, match="velocity"):
        mux.offer("chase", twist)
    assert mux.select(1).twist == SLOW


def test_names_that_were_not_declared_are_refused():
    mux = Multiplexer()
    with pytest.raises(KeyError):
        mux.offer("pad", FAST)
    with pytest.raises(KeyError):
        mux.release("pad")
    with pytest.raises(KeyError):
        mux.switch("pad", True, 0)


@pytest.mark.parametrize(
    ("sources", "locks", "message"),
    [
        ((VelocitySource("a", 1, 0.0),), (), "never times out"),
        ((VelocitySource("a", 0),), (), "1 to 255"),
        ((VelocitySource("a", 256),), (), "1 to 255"),
        ((VelocitySource("a", 1), VelocitySource("a", 2)), (), "stands twice"),
        ((), (Lock("a", 1), Lock("a", 1)), "stands twice"),
        ((), (Lock("a", 1, -1.0),), "0 or more"),
        ((VelocitySource("a", 1, math.nan),), (), "0 or more"),
    ],
)
def test_declarations_that_make_no_sense_are_refused(sources, locks, message):
    with pytest.raises(ValueError, match=message):
        Multiplexer(sources, locks)


@dataclass(frozen=True)
class Event:
    kind: str
    name: str
    value: float
    pause_ns: int


SOURCES = (
    VelocitySource("escape", 90, 0.3),
    VelocitySource("haptic", 80),
    VelocitySource("chase", 70, 1.0),
)
LOCKS = (Lock("stop", 255), Lock("observer", 85, 0.4))
pauses = st.sampled_from([0, 1, SECOND // 10, 3 * SECOND // 10, SECOND // 2, SECOND])
names, locks = st.sampled_from(["escape", "haptic", "chase"]), st.sampled_from(["stop", "observer"])
events = st.one_of(
    st.builds(Event, st.sampled_from(["offer", "release"]), names, st.floats(-3, 3), pauses),
    st.builds(Event, st.sampled_from(["on", "off"]), locks, st.just(0.0), pauses),
)


def expected_selection(log, now):
    """What the rules say, from the whole history and nothing else."""

    def last(name):
        return next(((e, t) for e, t in reversed(log) if e.name == name), (None, 0))

    floors = [0]
    stop, _ = last("stop")
    if stop is not None and stop.kind == "on":
        floors.append(255)
    observer, heard = last("observer")
    if observer is None or now - heard > 4 * SECOND // 10 or observer.kind == "on":
        floors.append(85)
    for name, priority, limit in (("escape", 90, 3), ("haptic", 80, 5), ("chase", 70, 10)):
        event, at = last(name)
        fresh = event is not None and event.kind == "offer" and now - at <= limit * SECOND // 10
        if fresh and priority >= max(floors):
            return name, event.value
    return None, 0.0


@pytest.mark.requirement(41, 42)
@settings(deadline=None, max_examples=examples(300))
@given(st.lists(events, max_size=25))
def test_in_every_interleaving_exactly_the_source_by_the_rules_drives(history):
    mux, log, now = Multiplexer(SOURCES, LOCKS), [], 0
    for event in history:
        now += event.pause_ns
        log.append((event, now))
        if event.kind == "offer":
            mux.offer(event.name, Twist2(event.value))
        elif event.kind == "release":
            mux.release(event.name)
        else:
            mux.switch(event.name, event.kind == "on", now)
        selected = mux.select(now)
        name, speed = expected_selection(log, now)
        assert (selected.source, selected.twist) == (name, Twist2(speed))
        assert mux.select(now) == selected
