"""Heartbeats of the links that must be heard while the wheels may turn."""

import pytest

from hw.drivers.chain.watchdogs import Heartbeat

MS = 1_000_000
SECOND = 1000 * MS


@pytest.fixture
def beat():
    made = Heartbeat("the link", 100 * MS)
    made.beat(SECOND, SECOND)
    return made


def test_a_heartbeat_stamped_ahead_is_heard_no_longer_than_one_of_now(beat):
    beat.beat(2 * SECOND, SECOND + 50 * MS)
    assert beat.lost(SECOND + 150 * MS) is None
    assert beat.lost(SECOND + 151 * MS) == "the link is silent"


def test_an_older_heartbeat_neither_renews_nor_clears_a_fault(beat):
    beat.beat(SECOND + 50 * MS, SECOND + 50 * MS, "it has a fault")
    beat.beat(SECOND + 40 * MS, SECOND + 60 * MS)
    assert beat.lost(SECOND + 60 * MS) == "it has a fault"
    assert beat.heard_ns == SECOND + 50 * MS


def test_a_link_that_was_never_well_is_awaited_and_cannot_be_lost():
    made = Heartbeat("the link", 100 * MS)
    made.beat(0, 0, "it is switched off")
    assert made.lost(10 * SECOND) is None
