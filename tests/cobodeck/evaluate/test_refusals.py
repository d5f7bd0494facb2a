"""Why a request was not served is told by what ended the Haptic meant for it."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest

from cobodeck.evaluate.refusals import IN_TIME, TOO_NEAR, Unserved, failures, refused
from cobodeck.testing.testing import ChartTester
from engine.run.chart_run import ChartRun
from hw.geometry import Pose3

SECOND = 10**9
ASKED = {"chase/request": [("requested", {"deep": Pose3(1.0, 2.0, 1.5), "since": 7})]}
CHOOSING = {"haptic/serve/park": "parked"}
DRIVING = CHOOSING | {"haptic/serve/choose": "chosen"}
CLOSING = CHOOSING | {"haptic/serve/choose": "close"}
AGAIN = CHOOSING | {"haptic/serve/drive": ["no_path", "stuck"]}
REACHING = DRIVING | {"haptic/serve/drive": "arrived"}
RETREATED = REACHING | {"haptic/serve/retreat": "parked"}


def refusals(run: ChartRun, *spans: tuple[int, int]) -> Counter[str]:
    asked = [Unserved(*span, Pose3(1.0, 2.0, 1.5), None) for span in spans]
    return Counter(reason for _, reason in refused(run, asked))


@pytest.mark.parametrize(
    ("script", "reason"),
    [
        (CHOOSING | {"haptic/serve/choose": "deep_blocked"}, TOO_NEAR),
        (CHOOSING | {"haptic/serve/choose": "no_pose"}, "no Haptic pose"),
        (CHOOSING | {"haptic/serve/choose": "no_way"}, "Haptic poses cut off"),
        (CHOOSING | {"haptic/serve/choose": "out_of_reach"}, "DEEP out of reach"),
        (AGAIN | {"haptic/serve/choose": ["chosen", "no_way"]}, "Haptic poses cut off"),
        (AGAIN | {"haptic/serve/choose": ["chosen", "chosen"]}, "stuck on the path"),
        (DRIVING | {"haptic/serve/drive": "stuck"}, "stuck on the path"),
        (CLOSING | {"haptic/serve/drive_close": "no_path"}, "no path to the Haptic pose"),
        (DRIVING | {"haptic/serve/drive": "lost"}, "base or user lost"),
        (RETREATED | {"haptic/serve/reach": "no_solution"}, "DEEP out of reach"),
        (RETREATED | {"haptic/serve/reach": "blocked"}, "no free path for the arm"),
        ({"haptic/serve/park": "failed"}, "the arm did not get there"),
    ],
)
def test_the_reason_is_that_of_the_leaf_with_which_the_haptic_failed(
    sim: ChartTester, script: dict[str, Any], reason: str
) -> None:
    sim.start("cobodeck", script=ASKED | script)
    sim.wait(1)

    assert refusals(sim.run, (0, SECOND)) == {reason: 1}


def test_a_drive_that_takes_too_long_says_so(sim: ChartTester) -> None:
    sim.start("cobodeck", script=ASKED | DRIVING)
    sim.wait(31)

    assert refusals(sim.run, (0, 31 * SECOND)) == {"took too long": 1}


@pytest.mark.parametrize(
    ("guard", "reason"),
    [
        ({"haptic/fault": "there"}, "broken off by a fault"),
        ({"haptic/tracking": "lost"}, "base or user lost"),
    ],
)
def test_a_haptic_that_was_broken_off_says_by_what(
    sim: ChartTester, guard: dict[str, Any], reason: str
) -> None:
    sim.start("cobodeck", script=ASKED | DRIVING | guard)
    sim.wait(1)

    assert refusals(sim.run, (0, SECOND)) == {reason: 1}


def test_the_first_reason_counts_not_what_the_retreat_comes_to(sim: ChartTester) -> None:
    retreat = {"haptic/serve/reach": "no_solution", "haptic/serve/retreat": "failed"}
    sim.start("cobodeck", script=ASKED | REACHING | retreat)
    sim.wait(1)

    assert refusals(sim.run, (0, SECOND)) == {"DEEP out of reach": 1}


def test_a_haptic_that_was_let_go_has_not_failed(sim: ChartTester) -> None:
    sim.start("cobodeck", script=ASKED | DRIVING | {"haptic/release": "released"})
    sim.wait(1)

    assert failures(sim.run) == []
    assert refusals(sim.run, (0, SECOND)) == {IN_TIME: 1}


def test_each_request_has_its_own_reason_and_counts_once(sim: ChartTester) -> None:
    asked = ("requested", {"deep": Pose3(1.0, 2.0, 1.5), "since": 7})
    leaves = {
        "chase/request": asked,
        "haptic/serve/park": "parked",
        "haptic/serve/choose": "no_pose",
    }
    sim.start("cobodeck", script={leaf: [end] * 3 for leaf, end in leaves.items()})
    sim.wait(1)
    times = [time for time, _ in failures(sim.run)]

    assert len(times) == 3
    spans = [(times[0], times[1]), (times[2], SECOND), (SECOND, 2 * SECOND)]
    assert refusals(sim.run, *spans) == {"no Haptic pose": 2, IN_TIME: 1}
