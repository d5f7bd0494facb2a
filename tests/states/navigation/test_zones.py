"""All planners keep out of zones, and drive slowly where a zone says so (R34, R35)."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from hw.geometry import STILL, Pose2
from hw.scene.zones import SpeedZone, Zones
from states.environment.environment import Environment
from states.navigation.planners import driver_of
from states.subsystems import SUBSYSTEMS
from tests.states.navigation.grid.test_layers import HALL, PLANNERS, environment_of, least_distance

BOX = ((5.0, 2.5), (7.0, 2.5), (7.0, 5.5), (5.0, 5.5))


def zoned(planner: str, zones: Zones, **changes: object) -> Environment:
    return replace(environment_of(planner, HALL, **changes), zones=zones)


@pytest.mark.requirement(34, 35)
@pytest.mark.parametrize("planner", PLANNERS)
def test_every_subsystem_keeps_off_a_keepout_as_off_a_wall(planner: str) -> None:
    environment = zoned(planner, Zones(keepout=(BOX,)))
    for name in SUBSYSTEMS:
        kept, own = environment.navigation.named(name).inflation, environment.static_planners[name]
        assert not own.is_free((6.0, 4.0))
        assert not own.is_free((5.0 - kept + 0.1, 4.0))
        assert own.is_free((5.0 - kept - 0.1, 4.0))
        way = own.plan((2.0, 4.0), (10.0, 4.0))
        for corner in BOX:
            assert least_distance(way, corner) >= kept - 0.05
        assert own.plan((2.0, 4.0), (6.0, 4.0)) is None


@pytest.mark.parametrize("local_planner", ["profile", "teb"])
@pytest.mark.few(1)
def test_in_a_speed_zone_no_drive_is_faster_and_it_is_braked_for_before(
    local_planner: str,
) -> None:
    zones = Zones(speed=(SpeedZone(BOX, 0.5),))
    environment = zoned("exact", zones, local_planner=local_planner)
    driver = driver_of(environment, "chase", environment.static_planners["chase"])
    driver.go_to(Pose2(10.5, 4.0))
    pose, twist, fastest, hardest = Pose2(1.5, 4.0), STILL, {True: 0.0, False: 0.0}, 0.0
    for _ in range(900):
        new = driver.command(pose, twist, None, 1.0 / 30.0)
        yaw = pose.yaw + 0.5 * (new.wz + twist.wz) / 30.0
        before, after = twist.rotated(pose.yaw), new.rotated(yaw)
        hardest = max(hardest, 30.0 * math.hypot(after.vx - before.vx, after.vy - before.vy))
        x = pose.x + 0.5 * (before.vx + after.vx) / 30.0
        pose, twist = Pose2(x, pose.y + 0.5 * (before.vy + after.vy) / 30.0, yaw), new
        within = 5.0 <= pose.x <= 7.0
        fastest[within] = max(fastest[within], twist.speed)
        if driver.status == "arrived":
            break
    assert driver.status == "arrived"
    assert fastest[True] <= 0.5 + 0.02
    assert fastest[False] > 1.2
    assert hardest <= environment.limits.base_acceleration * 1.1
