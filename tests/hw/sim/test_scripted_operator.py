"""The operator of a simulation resets what nobody else has stopped."""

from __future__ import annotations

import pytest

from hw.safety import StopLatch
from hw.sim.sensors import ScriptedOperator

S = 1_000_000_000


@pytest.mark.parametrize("away", [True, False])
def test_a_stop_stays_while_somebody_else_is_the_operator(away: bool) -> None:
    line = StopLatch(lambda: True)
    operator = ScriptedOperator(line)
    line.pull("stop by Ada")
    operator.away = away

    for at_s in range(4):
        operator.step(at_s * S)

    assert (line.reason == "stop by Ada") is away
    assert len(operator.samples(4 * S)) == (not away)


def test_a_stop_in_the_moment_of_a_reset_holds() -> None:
    def release() -> bool:
        operator.away = True
        line.pull("stop by Ada")
        return True

    line = StopLatch(release)
    operator = ScriptedOperator(line)
    line.pull("bumper")
    for at_s in range(3):
        operator.step(at_s * S)

    assert line.reason is not None
    assert operator.samples(3 * S) == []


def test_back_again_the_operator_acknowledges_what_was_reported() -> None:
    line = StopLatch(lambda: True)
    operator = ScriptedOperator(line)
    operator.away = True
    line.pull("stop by Ada")
    operator.report("stop by Ada")
    operator.step(0)

    assert line.reset()
    operator.away = False
    for at_s in range(1, 4):
        operator.step(at_s * S)

    assert [sample.name for sample in operator.samples(4 * S)] == ["operator.acknowledge"]
