"""The clock of another machine: offsets, ages, and stamps that are refused."""

import random

import pytest
from hypothesis import given, strategies as st

from hw.drivers import gates
from hw.drivers.clock_offsets import Envelope, PeerClock, RoundTrips, StampedClock, Stamps, set_by

MS = 1_000_000
SECOND = 1_000 * MS
THEIRS = 1_000_500 * MS
"""Their clock less ours."""


def delays(seed: int, count: int) -> list[int]:
    """Times on the way as over WiFi: 1.5 ms at least, often some more, now and then much more."""
    chance = random.Random(seed)
    rare = [80 * MS if chance.random() < 0.03 else 0 for _ in range(count)]
    return [round((1.5 + chance.expovariate(1 / 3.0)) * MS) + late for late in rare]


def settled(clock: PeerClock, begin: int = 0, way: int = MS) -> int:
    """Feed a clock until it is known; the instant after."""
    now = begin
    while now - begin <= gates.SETTLING_NS:
        now += 10 * MS
        clock.instant(now - way + THEIRS, now)
    return now


@pytest.mark.requirement(16)
def test_the_fastest_round_trip_is_within_half_its_time_of_the_truth() -> None:
    ways = delays(1, 200)
    trips, now = RoundTrips(), 0
    for there, back in zip(ways[::2], ways[1::2], strict=True):
        now += 90 * MS
        came = now + there + THEIRS
        trips.add(now, came, came + MS, now + there + MS + back)
        assert trips.best is not None
        assert abs(trips.best.ns + THEIRS) <= trips.best.error_ns
    assert abs(trips.best.ns + THEIRS) < MS


@pytest.mark.requirement(16)
def test_a_drift_of_a_clock_is_followed() -> None:
    trips = RoundTrips()
    for n in range(600):
        now, drift = n * SECOND, n * 50_000  # 50 ppm
        trips.add(now, now + MS + THEIRS + drift, now + MS + THEIRS + drift, now + 2 * MS)
    assert trips.best is not None
    assert abs(trips.best.ns + THEIRS + 599 * 50_000) < MS


def test_round_trips_that_cannot_be_are_left_out() -> None:
    trips = RoundTrips()
    trips.add(10, 5, 6, 9)
    trips.add(0, 9, 5, 20)
    assert trips.best is None


def test_a_clock_that_was_set_is_estimated_anew_at_once() -> None:
    trips = RoundTrips()
    for n in range(20):
        trips.add(n * SECOND, n * SECOND + MS, n * SECOND + MS, n * SECOND + 2 * MS)
    now = 20 * SECOND
    trips.add(now, now + MS + 8 * MS, now + MS + 8 * MS, now + 2 * MS)
    assert trips.best is not None
    assert trips.best.ns == -8 * MS


def test_the_least_of_ten_seconds_is_too_large_by_the_fastest_way() -> None:
    envelope, now = Envelope(), 0
    ways = delays(2, 1000)
    for way in ways:
        now += 11 * MS
        envelope.add_stamp(now - way + THEIRS, now)
    assert envelope.offset_ns is not None
    assert 0 <= envelope.offset_ns + THEIRS - min(ways[-900:]) < 0.2 * MS


def test_the_least_is_forgotten_after_the_window() -> None:
    envelope = Envelope()
    envelope.add_stamp(0, 1 * MS)
    for n in range(1, 1200):
        envelope.add_stamp(n * 10 * MS, n * 10 * MS + 4 * MS)
    assert envelope.offset_ns == 4 * MS


def test_one_stamp_far_ahead_is_no_new_least_and_many_are_a_clock_that_was_set() -> None:
    envelope, now = Envelope(), 0
    while now < SECOND:
        now += 10 * MS
        assert envelope.add_stamp(now - MS, now)
    assert not envelope.add_stamp(now + 50 * MS, now)
    assert envelope.offset_ns == MS
    begin = now
    while not envelope.add_stamp(now + 50 * MS, now):
        now += 10 * MS
    assert now - begin >= gates.SETTLING_NS
    assert envelope.offset_ns == -50 * MS


def test_ages_by_one_direction_have_the_least_way_added() -> None:
    clock = PeerClock(one_way_ns=2 * MS)
    now = settled(clock)
    at = clock.instant(now - 3 * MS + THEIRS, now)
    assert at is not None
    assert now - at == 4 * MS  # 2 ms more than the fastest, and the margin
    assert clock.age_ns == 4 * MS


def test_a_clock_counts_once_it_was_looked_at_for_a_while() -> None:
    clock = PeerClock()
    assert clock.instant(THEIRS, MS) is None
    assert not clock.known
    settled(clock, MS)
    assert clock.known


def test_who_answers_is_known_at_once() -> None:
    clock = PeerClock()
    clock.trips.add(0, MS + THEIRS, MS + THEIRS, 2 * MS)
    assert clock.instant(2 * MS + THEIRS, 3 * MS) == 2 * MS


def test_data_that_stays_old_is_a_queue_and_a_single_late_packet_is_none() -> None:
    clock = PeerClock()
    now = settled(clock)
    clock.instant(now - 400 * MS + THEIRS, now)
    assert not clock.backlogged
    now += 10 * MS
    clock.instant(now + THEIRS - MS, now)
    for _ in range(22):
        now += 10 * MS
        clock.instant(now - 400 * MS + THEIRS, now)
    assert clock.backlogged
    clock.reset()
    assert not clock.backlogged


@pytest.mark.parametrize(("ahead", "fits"), [(19, True), (21, False)])
def test_stamps_from_the_future_are_refused(ahead, fits) -> None:
    assert Stamps().admit(0, 100 * MS + ahead * MS, 100 * MS) is fits


def test_predicted_poses_may_be_fifty_milliseconds_ahead() -> None:
    assert Stamps(gates.PREDICTED_NS).admit(0, 49 * MS, 0)
    stamps = Stamps(gates.PREDICTED_NS)
    assert not stamps.admit(0, 51 * MS, 0)
    assert stamps.refused == "its stamp is 51.0 ms in the future"


def test_stamps_rise_and_many_that_do_not_are_another_clock() -> None:
    stamps = Stamps()
    assert stamps.admit(100, 100, 100)
    assert not stamps.admit(100, 100, 101)
    for _ in range(gates.TURNED_BACK - 1):
        assert not stamps.turned_back
        assert not stamps.admit(50, 50, 102)
    assert stamps.turned_back
    stamps.reset()
    assert stamps.admit(50, 50, 102)


def test_a_stamp_of_no_known_clock_is_refused() -> None:
    stamps = Stamps()
    assert not stamps.admit(1, None, 5)
    assert stamps.refused == "it does not fit to their clock"


WAYS = st.lists(st.integers(0, 300 * MS), min_size=1, max_size=60)


@pytest.mark.requirement(16)
@given(ways=st.lists(st.tuples(st.integers(0, 300 * MS), st.integers(0, 300 * MS)), min_size=1))
def test_whatever_the_ways_take_the_offset_is_as_near_as_it_says(ways) -> None:
    trips, now = RoundTrips(), 0
    for there, back in ways:
        came = now + there + THEIRS
        trips.add(now, came, came, now + there + back)
        now += there + back + 1
    assert trips.best is not None
    assert abs(trips.best.ns + THEIRS) <= trips.best.error_ns + 1


@pytest.mark.requirement(149)
@given(ways=WAYS)
def test_by_one_direction_no_age_is_longer_than_the_way_and_the_margin(ways) -> None:
    clock = PeerClock(one_way_ns=2 * MS)
    now = settled(clock, way=ways[0])
    for way in ways:
        now += 10 * MS
        at = clock.instant(now - way + THEIRS, now)
        if at is not None:
            assert 0 <= now - at <= way + 2 * MS


@pytest.mark.parametrize(
    ("step", "told"),
    [(-3_200 * MS, "was set back by 3.2 s"), (250 * MS, "was set forward by 250 ms")],
)
def test_how_far_a_clock_was_set_is_told(step, told) -> None:
    assert set_by(step) == told
    stamps = Stamps()
    assert stamps.admit(THEIRS, 0, 0)
    assert not stamps.admit(THEIRS + step + 10 * MS, None, 10 * MS)
    assert stamps.refused == f"their clock {told}"
    if step > 0:  # of a client that answers, the instant is known by the clock before
        assert not stamps.admit(THEIRS + step + 10 * MS, step + 10 * MS, 10 * MS)
        assert stamps.refused == f"their clock {told}"


class Sender:
    """Sends a stamp every 20 ms in order; its clock may be set. Knows when each was sent."""

    def __init__(self) -> None:
        self.clock = StampedClock()
        self.sent = self.received = self.count = 0
        self.theirs = THEIRS

    def send(self, way: int = MS) -> int | None:
        self.sent += 20 * MS
        self.received = max(self.received, self.sent + way)  # TCP keeps the order
        return self.clock.instant(self.sent + self.theirs, self.received)


STEPS = st.integers(200 * MS, 10_000 * MS) | st.integers(-10_000 * MS, -200 * MS)


@pytest.mark.requirement(16, 149)
@given(step=STEPS, ways=st.lists(st.integers(0, 60 * MS), min_size=65, max_size=65))
def test_of_a_clock_that_was_set_nothing_counts_until_it_was_looked_at_for_a_while(
    step, ways
) -> None:
    sender = Sender()
    for way in ways[:30]:
        at = sender.send(way)
        assert at is not None
        assert sender.sent <= at <= sender.received
    sender.theirs += step
    first, least = None, 10**18
    for way in ways[30:]:
        at = sender.send(way)
        first = sender.received if first is None else first
        least = min(least, sender.received - sender.sent)
        if at is None:
            assert sender.clock.set_by_ns == pytest.approx(step, abs=60 * MS)
            assert sender.received - first < gates.SETTLING_NS
        else:
            assert sender.received - first >= gates.SETTLING_NS
            assert at == sender.sent + least
            assert sender.clock.set_by_ns is None


@given(strange=st.integers(-(10**12), 10**12), ways=st.lists(st.integers(0, 40 * MS), max_size=20))
def test_one_strange_stamp_changes_no_other_unless_it_is_the_same(strange, ways) -> None:
    sender = Sender()
    for _ in range(30):
        sender.send()
    before = sender.sent + sender.theirs
    sender.clock.instant(before + strange, sender.received)
    for way in (MS, *ways):
        at = sender.send(way)
        if at is None:
            stamp = sender.sent + sender.theirs
            assert 0 <= before + strange - stamp <= gates.STEP_NS
            continue
        assert MS - gates.STEP_NS <= at - sender.sent <= MS


def test_a_buffer_that_is_repeated_again_and_again_is_no_clock_that_was_set() -> None:
    sender = Sender()
    for _ in range(30):
        sender.send()
    newest = sender.sent
    for n in range(1, 300):
        stamp = newest - 200 * MS + n % 20 * 10 * MS + sender.theirs
        at = sender.clock.instant(stamp, sender.received + n * 10 * MS)
        assert at is None or at <= newest + MS


def test_a_stamp_that_is_repeated_does_not_count_again() -> None:
    sender = Sender()
    assert sender.send() is not None
    for later in (0, MS, 100 * MS):
        stamp = sender.sent + sender.theirs
        assert sender.clock.instant(stamp, sender.received + later) is None
        assert sender.clock.instant(stamp - gates.STEP_NS, sender.received + later) is None
    assert sender.clock.set_by_ns is None


def test_two_sources_share_a_clock_that_is_set() -> None:
    clock, theirs = StampedClock(), THEIRS
    believed = []
    for n in range(200):
        now = n * 10 * MS
        theirs = THEIRS - (SECOND if n > 100 else 0)
        at = clock.instant(now + theirs, now + MS, "front" if n % 2 else "rear")
        if at is not None:
            assert at == now + MS
            believed.append(n)
    assert set(believed) == {*range(101), *range(152, 200)}  # from the second's first stamp on
