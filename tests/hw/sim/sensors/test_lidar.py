"""Scanners of the simulated robot: rates, arrival, smear, and streams of their own."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from hw.geometry import STILL, Pose2, Twist2
from hw.model.sensor_errors import LidarErrors, SensorErrors
from hw.samples import Scan
from tests.hw.sim.driven import CORNER, PERFECT, ROBOT, Driven, ticks

LIDARS = ROBOT.sensing.lidars
NOISY = replace(PERFECT, lidar=LidarErrors())


def scans(run: Driven, name: str = "front_laser") -> list[tuple[int, Scan]]:
    return [(stamp, scan) for stamp, scan in run.values("base.scan") if scan.sensor == name]


def hits(run: Driven, stamp: int, scan: Scan, pose: Pose2) -> list[tuple[float, float]]:
    """End points of all beams in the map, as if all were taken at this pose."""
    sensor = pose @ LIDARS[scan.sensor].mount.flat
    return [
        sensor.transform(r * math.cos(a), r * math.sin(a))
        for n, r in enumerate(scan.ranges)
        if r < math.inf
        for a in [scan.start + n * scan.step]
    ]


def to_wall(point: tuple[float, float]) -> float:
    """Distance to the wall of the hall, a square of 14 m, or to the person in its corner."""
    wall = min(abs(c - side) for c in point for side in (0.0, 14.0))
    return min(wall, abs(math.dist(point, (CORNER.x, CORNER.y)) - 0.5))


@pytest.mark.requirement(25)
def test_scans_come_at_the_rate_of_the_robot_file_once_their_last_beam_is_back() -> None:
    run = Driven(replace(PERFECT, lidar=LidarErrors(delay=0.01)), instants=ticks(4.0, 100.0))
    phases = set()
    for name, model in LIDARS.items():
        stamps = [stamp for stamp, _ in scans(run, name)]
        assert len(stamps) in (49, 50)
        assert all(abs(b - a - 80_000_000) <= 1 for a, b in pairwise(stamps))
        phases.add(stamps[0] % 80_000_000)
        sweep = round((model.beams - 1) * model.beam_time * 1e9)
        for arrived, stamp, scan in run.got["base.scan"]:
            assert 0 <= arrived - stamp - sweep - 10_000_000 < 10_000_000
            assert scan.beam_time == pytest.approx(60e-3 / 540)
    assert len(phases) == 2


@pytest.mark.requirement(23)
def test_a_standing_robot_sees_walls_and_the_person_where_they_are() -> None:
    run = Driven(command=lambda _: STILL, instants=ticks(0.5))
    pose = run.world.base.pose
    for stamp, scan in run.values("base.scan"):
        found = hits(run, stamp, scan, pose)
        assert len(found) == 541
        assert max(map(to_wall, found)) < 1e-3
    near = [p for p in found if math.dist(p, (CORNER.x, CORNER.y)) < 0.502]
    assert near


@pytest.mark.requirement(25)
def test_a_turn_smears_a_scan_and_knowing_the_way_of_the_base_undoes_it() -> None:
    """One pose for all beams is off by the motion of 60 ms; the pose of each beam is not."""
    run = Driven(command=lambda _: Twist2(1.2, 0.3, 1.2), instants=ticks(3.0, 500.0))
    stamp, scan = scans(run)[-1]
    truth = dict(run.truth)
    period = 2_000_000

    def pose_at(time: int) -> Pose2:
        before = time // period * period
        return truth[before].between(truth[before + period], (time - before) / period)

    smeared = max(map(to_wall, hits(run, stamp, scan, pose_at(stamp))))
    assert smeared > 0.05
    for n, r in enumerate(scan.ranges):
        sensor = pose_at(stamp + round(n * scan.beam_time * 1e9)) @ LIDARS[scan.sensor].mount.flat
        angle = scan.start + n * scan.step
        assert to_wall(sensor.transform(r * math.cos(angle), r * math.sin(angle))) < 2e-3


def test_a_walking_person_is_where_they_are_at_each_beam() -> None:
    def walk(now: int) -> Pose2:
        return Pose2(4.0 + 1.5e-9 * now, 9.0, 0.0)

    run = Driven(command=lambda _: STILL, walk=walk, instants=ticks(2.0))
    pose, seen = run.world.base.pose, 0
    for stamp, scan in run.values("base.scan"):
        sensor = pose @ LIDARS[scan.sensor].mount.flat
        for n, r in enumerate(scan.ranges):
            body = walk(stamp + round(n * scan.beam_time * 1e9))
            angle = scan.start + n * scan.step
            x, y = sensor.transform(r * math.cos(angle), r * math.sin(angle))
            if min(x, y, 14.0 - x, 14.0 - y) > 0.01:
                assert math.dist((x, y), (body.x, body.y)) == pytest.approx(0.5, abs=2e-3)
                seen += 1
    assert seen > 100


@pytest.mark.requirement(67)
def test_scans_do_not_hang_on_how_the_world_is_cut_or_who_else_is_asked() -> None:
    first = Driven(NOISY, seed=4, command=lambda _: STILL)
    assert Driven(NOISY, seed=4, command=lambda _: STILL).got == first.got
    other = Driven(NOISY, seed=4, command=lambda _: STILL, asked=["lidar"])
    assert other.values("base.scan") == first.values("base.scan")
    finer = Driven(NOISY, seed=4, command=lambda _: STILL, instants=ticks(2.0, 71.0))
    n = len(first.values("base.scan")) - 2
    assert finer.values("base.scan")[:n] == first.values("base.scan")[:n]
    # who begins to listen later hears the same as who listened from the start
    late = Driven(NOISY, seed=4, command=lambda _: STILL, heard_from=1_500_000_000).values(
        "base.scan"
    )
    assert late == first.values("base.scan")[-len(late) :]
    assert 0 < len(late) < len(first.values("base.scan"))
    assert Driven(NOISY, seed=5, command=lambda _: STILL).got != first.got


def test_noise_of_the_two_scanners_and_of_two_scans_is_not_the_same() -> None:
    run = Driven(SensorErrors(LidarErrors(0.02, 0.0), slip=None), command=lambda _: STILL)
    (_, a), (_, b) = scans(run)[:2]
    exact = scans(Driven(command=lambda _: STILL))[0][1]
    errors = [[r - e for r, e in zip(x.ranges, exact.ranges, strict=True)] for x in (a, b)]
    mean = sum(x * y for x, y in zip(*errors, strict=True)) / 541
    assert abs(mean) < 0.2 * 0.02**2
    assert math.sqrt(sum(x * x for x in errors[0]) / 541) == pytest.approx(0.02, rel=0.15)


def test_a_scanner_that_is_not_where_the_file_says_scans_from_where_it_is():
    off = Pose2(0.05, -0.03, 0.04)
    run = Driven(replace(PERFECT, mount_error={"front_laser": off}), command=lambda _: STILL)
    base, at = Pose2(7.0, 7.0, -0.785), LIDARS["front_laser"].mount.flat
    sensor = base @ Pose2(at.x + off.x, at.y + off.y, at.yaw + off.yaw)

    for name, scan in [(scan.sensor, scan) for _, scan in run.values("base.scan")][:4]:
        here = base @ LIDARS[name].mount.flat if name != "front_laser" else sensor
        seen = [
            here.transform(r * math.cos(a), r * math.sin(a))
            for n, r in enumerate(scan.ranges)
            if r < math.inf
            for a in [scan.start + n * scan.step]
        ]
        assert max(map(to_wall, seen)) < 1e-3
