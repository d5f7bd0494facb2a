"""Late poses of the person: served slowly, then not at all, and never with a contact (R149)."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cobodeck.loop.loop import Loop
from cobodeck.run.build_run import stage
from cobodeck.run.simulation import RunResult, simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from hw.safety.cycle_record import COMMAND_LATE
from tests.repeats import fewer

REQUESTS = 3


def delayed(delay_ms: int) -> Setup:
    setup = open_setup(scene="study")
    plant = replace(setup.profile.plant, tracking_delay=delay_ms / 1e3)
    return replace(setup, profile=replace(setup.profile, plant=plant))


def result(delay_ms: int, requests: int) -> RunResult:
    return simulate(delayed(delay_ms), Options(requests=requests, duration_s=180.0 * requests))


@pytest.mark.slow
@pytest.mark.requirement(149)
@pytest.mark.parametrize("delay_ms", fewer([0, 20, 40, 67, 100]))
def test_up_to_a_tenth_of_a_second_all_is_served_without_a_contact(delay_ms: int) -> None:
    figures = result(delay_ms, REQUESTS).figures

    assert (figures["served"], figures["requests"]) == (REQUESTS, REQUESTS)
    assert figures["contacts"] == 0


@pytest.mark.slow
@pytest.mark.requirement(149)
def test_the_later_the_poses_the_slower_the_touch() -> None:
    responses = [result(ms, REQUESTS).figures["response_s"]["mean"] for ms in (0, 40, 100)]

    assert responses == sorted(responses)
    assert responses[-1] > responses[0] + 2.0


@pytest.mark.requirement(149)
@pytest.mark.parametrize("delay_ms", [140, 180])
def test_poses_that_are_too_late_leave_it_standing_and_it_says_why(delay_ms: int) -> None:
    loop: Loop = stage(delayed(delay_ms), Options(requests=1))
    loop.go(30 * 10**9)

    truth = loop.plant.truth
    assert truth is not None
    assert truth.distance_m == 0.0
    assert truth.contacts == ()
    assert set(loop.plant.parts["operator"].faults) == {"tracking of the user is lost"}


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("tick_hz", "slowed"), [(30, False), (14, True)])
def test_a_computer_that_is_too_slow_slows_the_robot_down_before_it_stops_it(
    tick_hz: int, slowed: bool
) -> None:
    """At 14 Hz a command is up to 71 ms old before the next one comes."""
    loop: Loop = stage(replace(open_setup(scene="study"), tick_hz=tick_hz), Options(requests=1))
    cycles = loop.plant.cycles
    assert cycles is not None
    reader, late, most = cycles.reader(), 0, 0.0
    while not loop.finished and loop.now_ns < 60 * 10**9:
        loop.tick()
        for cycle in reader.read_new():
            if COMMAND_LATE in cycle.reasons:
                late += 1
                most = max(most, cycle.admitted.speed / max(1e-9, cycle.command.speed))

    truth = loop.plant.truth
    assert truth is not None
    assert truth.contacts == ()
    assert truth.distance_m is not None
    assert truth.distance_m > 1.0
    assert (late > 0) is slowed
    assert most < 1.0
