"""When samples of simulated sensors are taken, and which of them have arrived."""

from __future__ import annotations

from hypothesis import given, settings, strategies as st

from hw.sim.sensors.streams import FORGOTTEN_NS, Rhythm


@given(
    rate=st.floats(1.0, 200.0), lag=st.integers(0, 300_000_000), late=st.integers(0, 20 * 10**9),
)  # fmt: skip
@settings(deadline=None)
def test_a_first_call_late_in_a_run_has_the_samples_of_the_last_second(
    rate: float, lag: int, late: int
) -> None:
    """Those that arrived within it; before `next_ns` nothing more does."""
    rhythm = Rhythm(rate, 1, "x", lag)
    all_ = [(n, rhythm.stamp(n)) for n in range(round(21 * rate))]

    found = rhythm.due(late)

    assert found == [(n, at) for n, at in all_ if late - FORGOTTEN_NS <= at + lag <= late]
    assert rhythm.due(late) == rhythm.due(rhythm.next_ns - 1) == []
    assert len(rhythm.due(rhythm.next_ns)) == 1
