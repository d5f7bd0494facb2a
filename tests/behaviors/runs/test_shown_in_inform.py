"""In which state of the charts the robot is shown to the user (R11, R18)."""

from __future__ import annotations

import pytest

from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup

TICK_S = 1.0 / 30.0


@pytest.mark.requirement(11)
@pytest.mark.requirement(18)
def test_the_paper_shows_robot_and_sign_in_inform_only() -> None:
    setup = open_setup(None, "lab_b", "paper")
    found = simulate(setup, Options("random:cutter", duration_s=30.0, seed=0)).figures

    assert found["informs"] > 5
    assert found["signs"] == found["informs"]
    # hidden with the next step of the world
    assert found["shown_outside_inform_s"] <= found["signs"] * TICK_S + 1e-6
