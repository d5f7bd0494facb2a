"""From request to prop through all four behaviours, at every height that the paper names."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from behaviors.profile.profile import load_profile
from cobodeck.testing.testing import ChartTester
from tests.repeats import SHORT

PLACES = [
    (10.05, 8.54, -2.554), (1.2, 4.39, -0.098), (4.25, 5.22, 3.082), (4.86, 0.92, 1.414),
    (4.74, 8.22, -2.027), (10.04, 4.89, -3.036), (8.34, 1.69, -0.042),
]  # fmt: skip
"""Where the person of the evaluation stands."""


def person(requests: int) -> str:
    """Asks for touches 0.5 to 1.5 m high, at one place after the other, as in the evaluation."""
    rng = random.Random(11)
    lines = ["user: heights", "about: Asks high and low.", "repeat: false", "speed: 1.5"]
    lines += ["start: {x: 8.34, y: 1.69, yaw: -0.042}", "steps:"]
    for k in range(requests):
        x, y, yaw = PLACES[k % len(PLACES)]
        lines += [
            f"  - walk: {{x: {x}, y: {y}, yaw: {yaw}}}",
            "  - stand: 10",
            f"  - request: {{hold: 30, ahead: 0.85, height: {rng.uniform(0.5, 1.5):.3f}}}",
            "  - stand: 5",
        ]
    return "\n".join(lines) + "\n"


def reaching_times(sim: ChartTester) -> list[float]:
    """From the arrival of the rover to the prop at the DEEP, s."""
    times, begin = [], 0
    for record in sim.run.trace:
        if record.subject == "haptic/serve/reach" and record.kind == "enter":
            begin = record.time
        if record.subject == "haptic/serve/hold" and record.kind == "enter":
            times.append((record.time - begin) * 1e-9)
    return times


@pytest.mark.requirement(44, 47, 79, 80, 142, 143)
@pytest.mark.parametrize("count", [4, pytest.param(25 if SHORT else 300, marks=pytest.mark.slow)])
@pytest.mark.parametrize("profile", ["paper", "tuned"])
def test_every_request_is_served_to_5_mm_in_the_time_of_the_profile(
    sim: ChartTester, tmp_path: Path, profile: str, count: int
) -> None:
    file = tmp_path / "heights.yaml"
    file.write_text(person(count))
    chart = load_profile(profile).chart
    sim.start(chart, scene="study", user=str(file), profile=profile)

    sim.wait(60.0 * count)

    assert sim.metrics is not None
    figures = sim.metrics()
    assert (figures["requests"], figures["served"]) == (count, count)
    assert figures["prop_error_m"]["max"] <= 0.005
    assert figures["prop_error_rad"]["max"] <= 0.01
    times = reaching_times(sim)
    assert len(times) == count
    if profile == "paper":
        assert 3.2 <= np.mean(times) <= 5.3
    else:
        assert np.median(times) <= 2.3
        assert np.percentile(times, 95) <= 3.5
