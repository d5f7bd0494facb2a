"""Trackers of the VR system: coverage, occlusion, borders, drop-outs and jumps."""

from __future__ import annotations

import math
import statistics
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hw.geometry import STILL, Pose2, Pose3, Twist2, wrap
from hw.model.sensor_errors import ViveErrors
from hw.samples import UserPose
from hw.scene.objects import Body
from hw.scene.room import Room
from hw.sim.sensors.coverage import NOTHING, Column, Coverage, count_seeing, within
from hw.sim.sensors.scanned_shapes import Shapes
from hw.sim.sensors.vive import Device
from tests.hw.sim.driven import CORNER, HALL, PERFECT, ROBOT, Driven, ticks

EXACT = ViveErrors(
    noise=0.0, turn_noise=0.0, edge_bias=0.0, lost_for=0.0, jump=(0.0, 0.0), delay=0.0
)
SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
TRACKERS = ["rover_trackers"]


def driven(vive: ViveErrors = EXACT, **given) -> Driven:
    return Driven(replace(PERFECT, vive=vive), **{"asked": TRACKERS, **given})


def readings(run: Driven, name: str = "front_tracker") -> list[tuple[int, Pose3]]:
    found = run.values("rover.tracker")
    return [(stamp, value.pose) for stamp, value in found if value.tracker == name]


@pytest.mark.requirement(8, 25)
def test_both_trackers_say_where_they_are_at_their_own_rate() -> None:
    run = driven(instants=ticks(1.0, 900.0))
    truth = dict(run.truth)
    stamps = sorted(truth)
    for name, model in ROBOT.sensing.trackers.items():
        found = readings(run, name)
        period = 1e9 / model.rate
        assert all(abs(b - a - period) <= 1 for (a, _), (b, _) in pairwise(found))
        assert abs(len(found) - model.rate) <= 1
        for stamp, pose in found[:-1]:
            after = stamps[np.searchsorted(stamps, stamp)]
            expected = truth[after] @ model.mount.flat
            assert math.dist((pose.x, pose.y), (expected.x, expected.y)) < 3e-3
            assert abs(wrap(pose.yaw - expected.yaw)) < 2e-3
            assert pose.z == pytest.approx(model.mount.z)
    phases = {readings(run, name)[0][0] for name in ROBOT.sensing.trackers}
    assert len(phases) == 2


def test_noise_is_white_and_of_its_size() -> None:
    vive = replace(EXACT, noise=0.002, turn_noise=0.004)
    run = driven(vive, command=lambda _: STILL, instants=ticks(20.0))
    exact = readings(driven(command=lambda _: STILL))[0][1]
    poses = [pose for _, pose in readings(run)]
    for axis in "xyz":
        errors = [getattr(pose, axis) - getattr(exact, axis) for pose in poses]
        assert statistics.stdev(errors) == pytest.approx(0.002, rel=0.1)
        assert abs(statistics.fmean(errors)) < 2e-4
    turns = [(exact.inverse() @ pose) for pose in poses]
    for axis in ("qx", "qy", "qz"):
        assert statistics.stdev(2.0 * getattr(t, axis) for t in turns) == pytest.approx(
            0.004, rel=0.1
        )
    assert all(abs(math.hypot(p.qx, p.qy, p.qz, p.qw) - 1.0) < 1e-12 for p in poses)


@pytest.mark.requirement(67)
def test_trackers_have_streams_of_their_own() -> None:
    vive, stand = ViveErrors(), {"command": lambda _: STILL, "seed": 3}
    first = driven(vive, **stand)
    assert driven(vive, **stand).got == first.got
    with_all = driven(vive, asked=["lidar", "odometry", "imu", *TRACKERS], **stand)
    assert with_all.values("rover.tracker") == first.values("rover.tracker")
    finer = driven(vive, instants=ticks(2.0, 77.0), **stand).values("rover.tracker")
    n = min(len(finer), len(first.values("rover.tracker")))
    assert n > 100
    assert finer[:n] == first.values("rover.tracker")[:n]


# coverage


def coverage(stations: int = 2, bodies: tuple[Body, ...] = (), **room) -> Coverage:
    place = Room(SQUARE, **room)
    return Coverage(place, Shapes(place, bodies), replace(EXACT, stations=stations))


@pytest.mark.requirement(6, 32)
def test_nothing_is_seen_outside_the_tracked_area() -> None:
    area = ((1.0, 1.0), (6.0, 1.0), (6.0, 9.0), (1.0, 9.0))
    found = coverage(tracked_area=area)
    assert found.visibility(5.9, 5.0, 1.0, 0) == (True, pytest.approx(0.1))
    assert found.visibility(6.1, 5.0, 1.0, 0) == (False, pytest.approx(0.1))
    assert found.visibility(3.0, 4.0, 1.0, 0) == (True, pytest.approx(2.0))
    # without an area everything is inside, far from any border
    assert coverage().visibility(9.9, 5.0, 1.0, 0) == (True, math.inf)


@pytest.mark.requirement(31)
def test_walls_and_bodies_hide_a_device() -> None:
    wall = (((4.0, 0.0), (4.2, 0.0), (4.2, 8.0), (4.0, 8.0)),)
    assert coverage(4).visibility(5.0, 5.0, 0.45, 0)[0]
    assert not coverage(3, walls=wall).visibility(5.0, 5.0, 0.45, 0)[0]
    assert coverage(2, walls=wall).visibility(5.0, 5.0, 0.45, 0)[0]
    body = Body(0.5, 1.8, lambda _: (4.3, 4.3))
    assert not coverage(4, (body,)).visibility(5.0, 5.0, 0.45, 0)[0]
    assert coverage(3, (body,)).visibility(5.0, 5.0, 0.45, 0)[0]
    # seen over a body that is low, or gone, and by one who is in the middle of it
    assert coverage(4, (body._replace(height=0.5),)).visibility(5.0, 5.0, 0.45, 0)[0]
    assert coverage(4, (body._replace(at=lambda _: None),)).visibility(5.0, 5.0, 0.45, 0)[0]
    assert coverage(4, (body,)).visibility(4.3, 4.3, 1.0, 0)[0]
    walker = coverage(4, (body._replace(at=lambda now: (4.3, 4.3 - 1e-9 * now)),))
    assert not walker.visibility(5.0, 5.0, 0.45, 0)[0]
    assert walker.visibility(5.0, 5.0, 0.45, 2_000_000_000)[0]


@pytest.mark.requirement(31)
def test_the_arm_seldom_hides_both_trackers_at_once() -> None:
    """Beside the person and an arm that stands on the rover; anywhere, any way round."""
    rng, place = np.random.default_rng(5), Room(SQUARE)
    stations = np.array([(x, y, 2.5) for x in (0.0, 10.0) for y in (0.0, 10.0)])
    walls, lost = np.array(place.segments), [0, 0, 0]
    for _ in range(2000):
        base = Pose2(*rng.uniform(1.0, 9.0, 2), rng.uniform(-3.1, 3.1))
        angle = rng.uniform(-math.pi, math.pi)
        person = base @ Pose2(1.5 * math.cos(angle), 1.5 * math.sin(angle))
        bodies = np.array([(person.x, person.y, 0.5, 1.8)])
        arm = Column(base.x, base.y, 0.2, 1.1)
        hidden = []
        for model in ROBOT.sensing.trackers.values():
            x, y = base.transform(model.mount.x, model.mount.y)
            hidden.append(count_seeing(x, y, model.mount.z, stations, walls, bodies, arm) < 3)
        lost[0] += hidden[0]
        lost[1] += hidden[1]
        lost[2] += all(hidden)
    assert min(lost[:2]) > 20
    assert lost[2] < 0.2 * min(lost[:2])


def test_distance_to_the_border_is_that_of_shapely() -> None:
    from shapely import LinearRing, Point, Polygon

    ring = [(0.0, 0.0), (5.0, 1.0), (6.0, 4.0), (2.0, 3.0), (1.0, 6.0)]
    sides = np.array([(*a, *b) for a, b in zip(ring, ring[1:] + ring[:1], strict=True)])
    for x, y in np.random.default_rng(2).uniform(-1.0, 7.0, (200, 2)):
        inside, distance = within(x, y, sides)
        assert inside == Polygon(ring).contains(Point(x, y))
        assert distance == pytest.approx(LinearRing(ring).distance(Point(x, y)))


# faults


@pytest.mark.requirement(32)
def test_the_border_of_the_area_bends_places() -> None:
    device = Device(replace(EXACT, edge_bias=0.06, edge=0.7), 3, "x")
    assert math.hypot(*device.bias(0.0)) == pytest.approx(0.06)
    assert math.hypot(*device.bias(0.35)) == pytest.approx(0.03)
    assert device.bias(0.7) == (0.0, 0.0)
    assert device.bias(math.inf) == (0.0, 0.0)


def device_at(vive: ViveErrors, instants: list[int], seed: int = 1) -> list[bool]:
    device = Device(vive, seed, "x")
    return [device.seen(now, covered=True, alone=True) for now in instants]


def test_devices_are_lost_now_and_then_for_a_while() -> None:
    vive = replace(EXACT, lost_every=10.0, lost_for=1.0)
    seen = device_at(vive, ticks(600.0, 100.0))
    gaps = sum(before and not now for before, now in pairwise(seen))
    assert 55 <= gaps <= 61
    assert 0.03 < 1.0 - sum(seen) / len(seen) < 0.07
    # whoever looks more seldom finds the same
    assert device_at(vive, ticks(600.0, 25.0)) == seen[::4]
    assert device_at(vive, ticks(600.0, 100.0), seed=2) != seen


def test_a_device_that_is_found_again_alone_is_off_by_a_constant_of_its_own() -> None:
    vive = ViveErrors(lost_for=0.0)
    device, offs = Device(vive, 1, "x"), []
    for n in range(300):
        now = n * 100_000_000
        device.seen(now, covered=n % 10 > 2, alone=n > 100)
        offs.append((device.tracked, device.off))
    assert {off for tracked, off in offs[:100]} == {Pose2(0.0, 0.0)}
    jumps = {(off.x, off.y, off.yaw): math.hypot(off.x, off.y) for _, off in offs[110:]}
    assert len(jumps) == 20
    assert all(0.015 <= length <= 0.047 for length in jumps.values())
    assert all(math.radians(1.3) <= abs(yaw) <= math.radians(1.8) for _, _, yaw in jumps)
    assert {yaw > 0.0 for _, _, yaw in jumps} == {True, False}
    device.seen(30_000_000_000, covered=False, alone=True)
    device.seen(30_100_000_000, covered=True, alone=False)
    assert device.off == Pose2(0.0, 0.0)  # what it was off by ended with the loss
    for n in range(110, 300):
        if n % 10 != 3:
            assert offs[n][1] == offs[n - 1][1]


@pytest.mark.requirement(8)
def test_a_tracker_comes_back_without_a_jump_while_the_other_is_in_view() -> None:
    vive = ViveErrors(noise=0.0, turn_noise=0.0, lost_every=2.0, lost_for=0.5)
    run = driven(vive, command=lambda _: STILL, instants=ticks(30.0))
    both = [readings(run, name) for name in ROBOT.sensing.trackers]
    for found in both:
        assert any(b - a > 100_000_000 for (a, _), (b, _) in pairwise(found))
    # both were lost at once at times, and then one is off; if not, none is
    offs = [{(round(p.x, 6), round(p.y, 6)) for _, p in found} for found in both]
    stamps = [{stamp // 20_000_000 for stamp, _ in found} for found in both]
    both_lost = set(range(1500)) - stamps[0] - stamps[1]
    assert (len(offs[0]) > 1 or len(offs[1]) > 1) == bool(both_lost - {0})


# the person


def user_poses(run: Driven) -> list[tuple[int, UserPose]]:
    return run.values("user.pose")


@pytest.mark.requirement(6, 13)
def test_the_person_is_tracked_everywhere_or_in_the_area_alone() -> None:
    area = ((4.0, 0.0), (14.0, 0.0), (14.0, 14.0), (4.0, 14.0))
    scene = replace(HALL, room=replace(HALL.room, tracked_area=area))

    def walk(now: int) -> Pose2:
        return Pose2(2.0 + 1.0e-9 * now, 3.0, 0.0)

    def lost(everywhere: bool) -> list[UserPose]:
        vive = ViveErrors(lost_for=0.0, delay=0.0)
        there = replace(scene, tracking="everywhere" if everywhere else "area")
        run = driven(vive, scene=there, walk=walk, command=lambda _: STILL, instants=ticks(5.0))
        return [pose for _, pose in user_poses(run)]

    assert len(lost(True)) == 150
    seen = lost(False)
    assert 80 <= len(seen) <= 90
    # whoever comes back from outside is off by a jump, and by the bias of the border before
    off = [math.dist((pose.body.x, pose.body.y), (pose.body.x, 3.0)) for pose in seen]
    assert 0.0 < max(off) < 0.12
    assert statistics.stdev(pose.body.y for pose in seen[-30:]) < 0.003


def test_a_restart_of_the_tracking_moves_person_and_request_together() -> None:
    restart = Pose2(0.1, -0.2, math.radians(0.9))
    run = driven(replace(EXACT, restart=restart), command=lambda _: STILL)
    told = user_poses(run)[-1][1].body
    back = restart @ told
    assert math.dist((back.x, back.y), (CORNER.x, CORNER.y)) < 1e-9
    assert wrap(back.yaw - CORNER.yaw) == pytest.approx(0.0, abs=1e-9)
    deep = Pose3.from_yaw(12.5, 1.0, 1.2, 0.3)
    run.person.ask(deep)
    now = run.truth[-1][0] + 30_000_000
    run.person.push(now, UserPose(CORNER, 0.0))
    run.world.advance(now)
    request = run.world.parts["vr"].samples(now)[-1].value
    # the person and the place they reach for keep their distance
    assert request.flat().distance_to(told) == pytest.approx(deep.flat().distance_to(CORNER))
    assert (told.inverse() @ request.flat()).y == pytest.approx((CORNER.inverse() @ deep.flat()).y)
    # and so does the robot in the frame of tracking
    tracker = readings(run)[-1][1].flat()
    truth = run.world.base.pose @ ROBOT.sensing.trackers["front_tracker"].mount.flat
    assert tracker.distance_to(told) == pytest.approx(truth.distance_to(CORNER), abs=1e-9)
    assert wrap((restart @ tracker).yaw - truth.yaw) == pytest.approx(0.0, abs=1e-9)


def test_what_tracking_had_of_the_person_is_known_to_the_truth() -> None:
    vive = ViveErrors(lost_every=2.0, lost_for=1.0, by_headset=0.0, delay=0.0)
    run = driven(vive, command=lambda _: STILL, instants=ticks(10.0))
    stamps = [stamp for stamp, _ in user_poses(run)]
    assert len(stamps) < 295
    assert list(dict.fromkeys(run.seen)) == stamps


@pytest.mark.requirement(13)
def test_while_their_own_tracker_is_lost_the_person_is_told_by_the_headset() -> None:
    lost = replace(EXACT, lost_every=2.0, lost_for=1.0)
    without = driven(replace(lost, by_headset=0.0), command=lambda _: STILL, instants=ticks(20.0))
    run = driven(replace(lost, by_headset=0.05), command=lambda _: STILL, instants=ticks(20.0))
    told = dict(user_poses(without))
    meanwhile = [pose.body for stamp, pose in user_poses(run) if stamp not in told]
    true = run.world.person.body
    assert meanwhile
    off = {round(body.distance_to(true), 9) for body in meanwhile}
    assert 1 < len(off) <= 10  # as long as they lean alike
    assert 0.0 < max(off) <= 0.05
    assert all(pose == told[stamp] for stamp, pose in user_poses(run) if stamp in told)


def test_drives_do_not_change_with_who_is_asked() -> None:
    ends = [
        driven(ViveErrors(), asked=asked, command=lambda _: Twist2(0.7, 0.2, 0.5)).truth
        for asked in ([], TRACKERS, ["lidar", "imu"])
    ]
    assert ends[0] == ends[1] == ends[2]


@pytest.mark.parametrize("column", [NOTHING, Column(2.0, 0.0, 0.5, 0.4)])
def test_a_low_or_missing_column_hides_nothing(column: Column) -> None:
    stations = np.array([(5.0, 0.0, 2.5)])
    assert count_seeing(0.0, 0.0, 0.45, stations, np.empty((0, 4)), np.empty((0, 4)), column) == 1
    tall = Column(2.0, 0.0, 0.5, 1.3)
    assert count_seeing(0.0, 0.0, 0.45, stations, np.empty((0, 4)), np.empty((0, 4)), tall) == 0


def test_a_gap_does_not_end_where_the_next_slot_begins() -> None:
    """Whoever is lost just before a slot ends is so just after: gaps reach into the next one."""
    device, across = Device(replace(EXACT, lost_every=1.0, lost_for=0.9), 1, "x"), 0
    for slot in range(1, 200):
        border = slot * 10**9
        before, after = (
            device.seen(border + off, covered=True, alone=False) for off in (-1000, 1000)
        )
        assert before == after, slot
        across += not before
    assert across > 20


def test_a_tracker_that_is_not_where_the_file_says_is_seen_where_it_is():
    off = Pose2(0.05, -0.03, 0.04)
    sure = replace(ViveErrors(), noise=0.0, turn_noise=0.0, edge_bias=0.0, lost_for=0.0)
    errors = replace(PERFECT, vive=sure)
    still = {"asked": ["rover_trackers"], "command": lambda _: Twist2(0.0)}
    right, wrong = (
        Driven(replace(errors, mount_error=by), **still)
        for by in ({}, dict.fromkeys(ROBOT.sensing.trackers, off))
    )

    pairs = list(zip(right.values("rover.tracker"), wrong.values("rover.tracker"), strict=True))
    assert pairs
    base = Pose2(7.0, 7.0, -0.785)
    x, y = Pose2(0.0, 0.0, base.yaw).transform(off.x, off.y)
    for (_, before), (_, after) in pairs:
        shift = after.pose.x - before.pose.x, after.pose.y - before.pose.y
        assert shift == pytest.approx((x, y), abs=1e-9)
        assert after.pose.yaw - before.pose.yaw == pytest.approx(off.yaw, abs=1e-9)
