"""Stand-ins answer as their parts do, and nothing by which something moves gets through them."""

from __future__ import annotations

from typing import Any, NamedTuple

import pytest

from cobodeck.run.stand_in import Answers, Overheard, StandIn
from hw.geometry import Pose2


class Motion:
    """A motion under way, as some drivers hand it out."""

    def __init__(self) -> None:
        self.cancelled = False

    def cancel(self) -> None:
        self.cancelled = True


class Goal(NamedTuple):
    pose: Pose2
    motion: Motion


class Arm:
    signals = ()

    def __init__(self) -> None:
        self.motion, self.speed, self.broken = Motion(), 0.5, False

    def move(self, to: float) -> Motion:
        return self.motion

    def goal(self) -> Goal:
        return Goal(Pose2(1.0, 2.0), self.motion)

    def pose(self) -> Pose2:
        if self.broken:
            raise ConnectionError("unplugged")
        return Pose2(1.0, 2.0, self.speed)

    def stop(self) -> None:
        pass


@pytest.fixture
def both() -> tuple[Arm, Any, Any]:
    """A part, as its run has it, and as a shadow has it."""
    answers: Answers = {}
    arm = Arm()
    return arm, Overheard("arm", arm, answers), StandIn("arm", (), answers)


def test_a_stand_in_answers_as_the_part_last_has(both: tuple[Arm, Any, Any]) -> None:
    arm, real, shadow = both
    assert shadow.pose() is None

    assert real.pose() == shadow.pose() == Pose2(1.0, 2.0, 0.5)
    arm.speed = 0.7
    assert shadow.pose() == Pose2(1.0, 2.0, 0.5)
    assert real.speed == shadow.speed == 0.7


def test_it_raises_as_the_part_has(both: tuple[Arm, Any, Any]) -> None:
    arm, real, shadow = both
    arm.broken = True
    with pytest.raises(ConnectionError):
        real.pose()
    with pytest.raises(ConnectionError, match="unplugged"):
        shadow.pose()
    arm.broken = False
    assert real.pose() == shadow.pose()


def test_nothing_that_moves_something_gets_through(both: tuple[Arm, Any, Any]) -> None:
    arm, real, shadow = both
    assert real.move(1.0) is real.motion is real.goal().motion is arm.motion

    assert shadow.move(2.0) is None
    assert shadow.goal() is None
    assert not isinstance(shadow.motion, Motion)
    shadow.speed = 9.0
    shadow.stop()
    assert (arm.speed, arm.motion.cancelled) == (0.5, False)


def test_what_was_handed_out_before_is_not_kept(both: tuple[Arm, Any, Any]) -> None:
    arm, real, shadow = both
    real.pose()
    arm.pose = lambda: arm.motion  # type: ignore[method-assign, assignment, return-value]
    real.pose()
    assert shadow.pose() is None
