"""What is left of the risk of waiting beside a user, as `doctor --scene` tells it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.checks.waiting_places import WaitingReport, waiting_report
from hw.model.robot import load_robot
from hw.scene.room import Room

ROOM = Room(outer=((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)))
CLOSET = Room(outer=((0.0, 0.0), (2.2, 0.0), (2.2, 2.2), (0.0, 2.2)))


def report(room: Room, risk: float) -> WaitingReport:
    profile, robot = load_profile("tuned"), load_robot("rbkairos_ur10")
    chase = replace(profile.settings.chase, risk=risk, cell=0.2)
    found = waiting_report(profile.environment(room, robot), replace(profile.settings, chase=chase))
    assert found is not None
    return found


def test_the_more_the_risk_counts_the_less_is_left_of_it() -> None:
    careless, careful = report(ROOM, 0.0), report(ROOM, 100.0)

    assert 0.0 <= careful.mean < careless.mean
    assert careful.worst <= careless.worst
    assert careless.nowhere == careful.nowhere == pytest.approx(0.0)
    assert ROOM.is_free(*careful.place)


def test_where_no_chase_pose_is_free_it_says_so() -> None:
    assert report(CLOSET, 10.0).nowhere == 1.0
