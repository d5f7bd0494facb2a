"""The inertial sensor feels the body, not the wheels."""

from __future__ import annotations

import statistics
from dataclasses import replace

import pytest

from hw.geometry import STILL, Twist2
from hw.model.sensor_errors import ImuErrors, Slip
from hw.samples import ImuReading
from tests.hw.sim.driven import PERFECT, ROBOT, Driven, ticks

RATE = ROBOT.sensing.imu.rate
EXACT = ImuErrors(0.0, 0.0, 0.0, 0.0, 0.0)


def readings(imu: ImuErrors = EXACT, slip: Slip | None = None, **given) -> list[ImuReading]:
    run = Driven(replace(PERFECT, imu=imu, slip=slip), asked=["imu"], **given)
    return [reading for _, reading in run.values("base.imu")]


def test_at_rest_it_feels_gravity_alone() -> None:
    found = readings(command=lambda _: STILL)
    assert abs(len(found) - 59 / 30 * RATE) < 1.0
    assert set(found) == {ImuReading((0.0, 0.0, 0.0), (0.0, 0.0, 9.81))}


def test_accelerations_and_turns_are_those_of_the_motion() -> None:
    def command(now: int) -> Twist2:
        return Twist2(0.9, 0.0, 0.8) if now < 2_000_000_000 else Twist2(0.0)

    found = readings(command=command, instants=ticks(4.0))
    assert found[round(0.3 * RATE)].accelerations[0] == pytest.approx(
        1.0, abs=0.1
    )  # the limit of the base
    cruise = found[round(1.8 * RATE)]
    assert cruise.rates[2] == pytest.approx(0.8, abs=1e-6)
    assert cruise.accelerations[1] == pytest.approx(0.8 * 0.9, abs=0.02)  # towards the centre
    assert cruise.accelerations[0] == pytest.approx(0.0, abs=0.02)
    assert found[round(2.3 * RATE)].accelerations[0] < -0.8


@pytest.mark.requirement(28)
def test_it_feels_a_turn_that_the_floor_has_swallowed() -> None:
    slip = Slip(0.0, 0.0, 0.2, 0.0, 0.3, 0.0, 0.0)
    found = readings(slip=slip, command=lambda _: Twist2(0.0, 0.0, 1.0))
    assert found[-1].rates[2] == pytest.approx(0.8, abs=1e-3)


def test_noise_bias_and_walk_have_their_sizes() -> None:
    noisy = readings(ImuErrors(0.01, 0.0, 0.0, 0.2, 0.0), command=lambda _: STILL,
                     instants=ticks(20.0))  # fmt: skip
    assert statistics.stdev(r.rates[2] for r in noisy) == pytest.approx(0.01, rel=0.06)
    assert statistics.stdev(r.accelerations[0] for r in noisy) == pytest.approx(0.2, rel=0.06)
    biases = [
        readings(replace(EXACT, rate_bias=0.01), command=lambda _: STILL, seed=seed,
                 instants=ticks(0.2))[-1].rates
        for seed in range(40)
    ]  # fmt: skip
    values = [rate for rates in biases for rate in rates]
    assert statistics.stdev(values) == pytest.approx(0.01, rel=0.2)
    walked = [
        readings(replace(EXACT, rate_walk=0.01), command=lambda _: STILL, seed=seed,
                 instants=ticks(4.0))[-1].rates
        for seed in range(40)
    ]  # fmt: skip
    # the root of 3.8 s times as far as in a second
    values = [rate for rates in walked for rate in rates]
    assert statistics.stdev(values) == pytest.approx(0.0195, rel=0.25)


def test_the_walk_of_the_bias_goes_on_while_nobody_listens() -> None:
    imu = {"imu": ImuErrors(), "command": lambda _: STILL, "seed": 6}
    whole = readings(**imu)
    late = readings(**imu, heard_from=1_700_000_000)
    assert late == whole[-len(late) :]
    assert late != whole
