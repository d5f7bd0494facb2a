"""Who drives the base of a run: the multiplexer between the states and the base."""

import math

import pytest
from states.navigation.wheels import Wheels

from hw.geometry import STILL, Twist2

TICK = 33_333_333
FAST, SLOW, BACK = Twist2(1.0, 0.5, 0.1), Twist2(0.2), Twist2(-0.5)


class Base:
    """Remembers what it was told, None for a stop."""

    def __init__(self):
        self.told = []
        self.granted = []
        self.mode = "omni"

    def drive(self, command):
        self.told.append(command)

    def stop(self):
        self.told.append(None)

    def grant(self, pose):
        self.granted.append(pose)


class Rig:
    """Wheels, ticked; `offers` are made in each tick, in order."""

    def __init__(self):
        self.base = Base()
        self.wheels = Wheels(self.base)
        self.n = 0

    def tick(self, *offers, count=1):
        for _ in range(count):
            self.wheels.begin(self.n * TICK)
            for source, twist in offers:
                self.wheels.drive(twist, source)
            self.wheels.pass_on()
            self.n += 1
        return self.base.told[-1]


@pytest.mark.requirement(41, 71)
@pytest.mark.parametrize("last", ["escape", "haptic", "chase", "own"])
def test_escape_drives_in_the_tick_in_which_it_speaks_whoever_speaks_last(last):
    rig = Rig()
    rig.tick(("chase", SLOW), ("haptic", BACK), count=3)
    offers = {"chase": SLOW, "haptic": BACK, "escape": FAST, "own": SLOW}
    words = [*((s, t) for s, t in offers.items() if s != last), (last, offers[last])]
    assert rig.tick(*words) == FAST
    assert rig.wheels.selected.source == "escape"


@pytest.mark.requirement(42)
def test_after_a_release_the_next_source_drives_in_the_same_tick():
    rig = Rig()
    rig.tick(("escape", FAST), ("chase", SLOW))
    rig.wheels.release("escape")
    assert rig.tick() == SLOW


@pytest.mark.requirement(42)
def test_a_source_that_falls_silent_is_a_stop_after_its_time_out():
    rig = Rig()
    rig.tick(("chase", FAST))
    rig.tick(count=15)
    assert rig.base.told == [FAST]
    rig.tick()
    assert rig.base.told == [FAST, None]
    assert rig.wheels.selected == (STILL, None, None)


@pytest.mark.requirement(41, 149)
def test_an_offer_is_handed_over_once_so_that_the_base_sees_how_old_it_is():
    rig = Rig()
    rig.tick(("chase", FAST))
    rig.tick(count=5)
    rig.tick(("chase", FAST))
    assert rig.base.told == [FAST, FAST]


@pytest.mark.requirement(42)
def test_nobody_is_a_stop_in_every_tick():
    rig = Rig()
    rig.tick(count=3)
    assert rig.base.told == [None] * 3


@pytest.mark.requirement(42, 71)
def test_what_the_engine_calls_between_two_users_forgets_all_offers():
    rig = Rig()
    rig.tick(("haptic", FAST), ("chase", SLOW))
    rig.wheels.stop()
    assert rig.tick() is None
    assert rig.tick(("chase", SLOW)) == SLOW


@pytest.mark.requirement(41, 48)
def test_while_the_stop_line_is_pulled_nobody_drives():
    rig = Rig()
    rig.tick(("escape", FAST))
    rig.wheels.lock(pulled=True, now_ns=TICK)
    assert rig.tick(("escape", FAST)) is None
    assert rig.wheels.selected.lock == "stop"
    rig.wheels.lock(pulled=False, now_ns=2 * TICK)
    assert rig.tick(("escape", FAST)) == FAST


def test_a_source_that_is_not_known_or_a_velocity_that_is_no_number_is_refused():
    rig = Rig()
    with pytest.raises(KeyError):
        rig.wheels.drive(FAST, "pad")
    with pytest.raises(ValueError, match="velocity"):
        rig.wheels.drive(Twist2(math.nan), "chase")
    assert rig.tick() is None


def test_states_of_ones_own_drive_as_the_weakest_source_and_see_the_rest_of_the_base():
    rig = Rig()
    rig.wheels.begin(0)
    rig.wheels.drive(FAST)
    rig.wheels.pass_on()
    assert rig.wheels.selected.source == "own"
    rig.wheels.grant(None)
    assert (rig.wheels.mode, rig.base.granted) == ("omni", [None])
    with pytest.raises(AttributeError):
        _ = rig.wheels.wings
