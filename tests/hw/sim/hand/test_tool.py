"""Simulated fingers move evenly; a simulated sensor has an end of its scale."""

import pytest
from hypothesis import given, strategies as st

from hw.model.prop import GripperModel, WrenchModel
from hw.samples import WrenchReading
from hw.sim.hand.tool import SimGripper, SimWrench

MODEL = GripperModel(opening=0.085, speed=0.15, held=0.05)
openings = st.floats(0.0, MODEL.opening)
spans = st.integers(1, 200_000_000)


@pytest.mark.requirement(150)
@given(st.lists(st.tuples(openings, st.lists(spans, max_size=5)), max_size=6))
def test_fingers_are_never_faster_than_they_can_be_nor_squeeze_what_they_hold(moves):
    gripper, now = SimGripper(MODEL), 0
    for goal, steps in moves:
        gripper.open_to(goal)
        for span in steps:
            before, now = gripper.state.opening, now + span
            gripper.advance(now)
            after = gripper.state
            assert abs(after.opening - before) <= MODEL.speed * span * 1e-9 + 1e-12
            assert after.opening >= MODEL.held
            assert after.holding == (after.opening == MODEL.held)


@pytest.mark.requirement(150)
def test_what_is_more_than_the_full_scale_reads_as_the_full_scale():
    sensor = SimWrench(WrenchModel(force=300.0, torque=30.0))
    sensor.press(WrenchReading((500.0, -900.0, 1.0), (0.0, 31.0, -2.0)))
    (sample,) = sensor.samples(1)
    assert sample.value == WrenchReading((300.0, -300.0, 1.0), (0.0, 30.0, -2.0))
