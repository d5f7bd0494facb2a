"""The simulated virtual world tells when a person who is shown the robot is ready."""

from __future__ import annotations

import pytest

from hw.geometry import Pose2
from hw.people.live import LivePerson
from hw.samples import UserPose
from hw.sim.sensors.devices import SimVr

HZ = 30


class Watched:
    """A person who is pushed from place to place, and what the virtual world tells of them."""

    def __init__(self) -> None:
        self.person = LivePerson(Pose2(5.0, 5.0))
        self.vr = SimVr(self.person)
        self._tick = 0

    def walk(self, seconds: float, speed: float) -> int:
        """Walk on; returns how often they were ready meanwhile."""
        ready = 0
        for _ in range(round(seconds * HZ)):
            self._tick += 1
            now = self._tick * 10**9 // HZ
            x = self.person.body.x + speed / HZ
            self.person.push(now, UserPose(Pose2(x, 5.0), 0.0))
            self.person.step(now, Pose2(0.0, 0.0), self.vr.shown)
            self.vr.step(now)
            ready += sum(sample.name == "vr.restart" for sample in self.vr.samples(now))
        return ready


@pytest.mark.requirement(114, 115)
def test_who_stands_while_the_robot_is_shown_is_ready_and_says_so_again_and_again() -> None:
    """Every half second, also after walking on: what came before Inform began would be lost."""
    seen = Watched()
    assert seen.walk(2.0, 0.0) == 0
    seen.vr.inform(True)
    assert seen.walk(0.45, 0.0) == 0
    assert seen.walk(4.0, 0.0) == 8
    for _ in range(3):
        assert seen.walk(1.0, 0.8) == 0
        assert seen.walk(0.45, 0.0) == 0
        assert seen.walk(2.0, 0.0) == 4
    seen.vr.inform(False)
    assert seen.walk(2.0, 0.8) + seen.walk(2.0, 0.0) == 0
