"""A drive that begins before the base has a pose waits for the first one, and not for ever."""

from __future__ import annotations

from typing import Any

import pytest

from hw.geometry import Pose2
from states.navigation.states import FIRST_POSE_S, first_pose

SECOND = 1_000_000_000


def waited_until(ctx: Any, take_step: Any, known_s: float, lost_s: float) -> float | None:
    """When the wait ends, s; None: it still goes on after a minute."""
    run = first_pose(ctx)
    for tick in range(60 * 30):
        ctx.now = tick * SECOND // 30
        known = known_s <= ctx.now / SECOND < lost_s
        ctx.values["base.pose"] = Pose2(1.0, 2.0) if known else None
        if take_step(run) is None and run.gi_frame is None:
            return float(ctx.now / SECOND)
    return None


@pytest.mark.parametrize(("known_s", "waits"), [(0.0, 0.0), (0.5, 0.5), (9.0, FIRST_POSE_S)])
def test_the_wait_ends_with_the_first_pose_or_after_a_while(
    context: Any, take_step: Any, known_s: float, waits: float
) -> None:
    found = waited_until(context({}), take_step, known_s, 1e9)

    assert found == pytest.approx(waits, abs=0.05)


def test_a_pose_that_has_been_known_is_not_waited_for(context: Any, take_step: Any) -> None:
    ctx = context({"base.pose": Pose2(1.0, 2.0)})
    ctx.ages["base.pose"] = 5.0

    run = first_pose(ctx)
    assert take_step(run) is None
    assert run.gi_frame is None
