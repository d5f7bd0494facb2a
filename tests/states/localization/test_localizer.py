"""One estimate from all sensors: right, honest, and open about what it does not know."""

import dataclasses
import math

import numpy as np
import pytest

from hw.geometry import Pose2, Twist2, wrap
from hw.model.sensing import Sensing
from hw.model.tracking import Tracking
from hw.samples import ImuReading, Odometry, Scan, TrackerPose
from states.localization.localizer import Localizer
from states.localization.matching.localizer_values import LocalizerValues
from states.maps.cells import room_map
from states.maps.field import map_field, room_field
from states.maps.occupancy import OccupancyMap
from tests.repeats import fewer
from tests.states.localization.world import (
    ROOM,
    STOPS,
    Drive,
    World,
    random_drive,
    sensing,
    standing,
)

S = 1_000_000_000
FIELD = room_field(ROOM)
ALL = ("base.odometry", "base.imu", "base.scan", "rover.tracker")
NO_TRACKERS = ALL[:3]
WHEELS_AND_SCANS = ("base.odometry", "base.scan")


def localizer(world, start, seed=0, field=FIELD, **values):
    tracking = Tracking.of(world.sensing)
    return Localizer(field, world.sensing, tracking, start, seed, LocalizerValues(**values))


class Run:
    """What a localizer says after every sample of some name, beside the truth at its instant."""

    def __init__(
        self, world, start, names=NO_TRACKERS, *, change=None, at="base.odometry", **about
    ):
        self.found = found = localizer(world, start, **about)
        rows, self.statuses, self.times = [], [], []
        for sample in world.samples(*names):
            sample = sample if change is None else change(sample)
            if sample is None:
                continue
            found.update(*sample)
            if sample.name != at:
                continue
            self.statuses.append(found.status)
            self.times.append(sample.stamp_ns * 1e-9)
            rows.append((math.nan,) * 5)
            pose = found.pose
            if pose is not None:
                true = world.drive.pose(found.stamp_ns * 1e-9)
                off = np.array([pose.x - true.x, pose.y - true.y, wrap(pose.yaw - true.yaw)])
                nees = off @ np.linalg.solve(found.covariance, off)
                sigma = found.sigma
                rows[-1] = (math.hypot(*off[:2]), abs(off[2]), nees, sigma.position, sigma.yaw)
        self.times = np.array(self.times)
        self.off, self.turned, self.nees, self.sigma, self.sigma_yaw = np.array(rows).T

    def rmse(self, since=0.5):
        return math.sqrt(np.mean(self.off[self.times >= since] ** 2))

    def worst(self, since=0.5):
        return self.off[self.times >= since].max()

    def lost_for(self, since, bound=0.1):
        """Until the error is below the bound for good, s."""
        bad = self.times[~(self.off < bound)]
        return max(0.0, bad[-1] - since) if len(bad) else 0.0


def run(seed, seconds, names=NO_TRACKERS, about=None, **more):
    world = World(random_drive(seed, seconds, stand=1.0), seed, **(about or {}))
    return Run(world, more.pop("start", world.drive.pose(0.0)), names, seed=seed, **more)


# following


def test_a_drive_is_followed_to_a_centimetre_and_the_covariance_is_no_boast():
    followed = run(40, 15.0)
    assert followed.rmse() < 0.01
    assert followed.worst() < 0.03
    assert np.mean(followed.nees[25:]) < 3.0
    assert set(followed.statuses[25:]) <= {"tracking", "resting"}


@pytest.mark.slow
@pytest.mark.parametrize("seed", fewer(range(40, 48)))
def test_minutes_with_trackers_in_half_of_the_room(seed):
    followed = run(seed, 60.0, ALL)
    assert followed.rmse() < 0.01
    steps = np.abs(np.diff(followed.off[25:]))
    assert steps.max() < 0.02
    assert np.mean(followed.nees[25:]) < 3.0


def test_jumps_and_the_edge_of_the_tracked_area_do_not_show():
    with_trackers, without = run(41, 20.0, ALL), run(41, 20.0)
    assert with_trackers.found.counts["trackers"] > 20
    assert with_trackers.worst() < without.worst() + 0.01


def test_on_a_scanned_map_the_error_is_within_half_a_cell_and_so_is_sigma():
    followed = run(42, 10.0, field=map_field(room_map(ROOM.outer, ROOM.obstacles, 0.05)))
    assert followed.rmse() < 0.025
    assert followed.sigma[50:].min() > 0.02


def test_the_pose_is_as_fresh_as_the_newest_wheel_sample():
    world = World(random_drive(40, 3.0), 40)
    found = localizer(world, world.drive.pose(0.0))
    for sample in world.samples(*NO_TRACKERS):
        found.update(*sample)
        if sample.name == "base.odometry":
            assert found.stamp_ns == sample.stamp_ns


def test_the_same_samples_give_the_same_bits():
    one, two = (run(43, 3.0, ALL) for _ in range(2))
    assert one.off.tobytes() == two.off.tobytes()
    assert one.sigma.tobytes() == two.sigma.tobytes()


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_map_far_away_is_as_good_as_one_here(turn):
    by = Pose2(1e6, -1e6, turn)
    drawn = room_map(ROOM.outer, ROOM.obstacles, 0.05)
    far = OccupancyMap(drawn.values, 0.05, by @ drawn.map_from_corner)
    world = World(random_drive(44, 2.0), 44)
    here = localizer(world, world.drive.pose(0.0), field=map_field(drawn))
    there = localizer(world, by @ world.drive.pose(0.0), field=map_field(far))
    for sample in world.samples(*NO_TRACKERS):
        here.update(*sample)
        there.update(*sample)
    assert (by.inverse() @ there.pose).distance_to(here.pose) < 1e-3


# standing


def test_a_standing_base_is_known_to_a_centimetre_and_left_alone():
    errors, turned = [], []
    for seed in range(12):
        x, y = STOPS[seed % len(STOPS)]
        world = World(standing(Pose2(x, y, 0.5 * seed - 3.0), 3.0), seed)
        stood = Run(world, world.drive.pose(0.0), seed=seed)
        errors.append(stood.off[-1])
        turned.append(stood.turned[-1])
        assert stood.statuses[-1] == "resting"
        assert stood.found.counts["skipped"] > 3 * stood.found.counts["matched"]
    assert np.quantile(errors, 0.95) < 0.01
    assert np.quantile(turned, 0.95) < 0.005


def test_at_rest_the_pose_is_the_same_object_and_gets_no_older():
    world = World(standing(Pose2(5.0, 3.0, 0.3), 2.5), 1)
    found = localizer(world, Pose2(5.0, 3.0, 0.3))
    poses, sigmas = [], set()
    for sample in world.samples(*NO_TRACKERS):
        found.update(*sample)
        if found.status == "resting" and sample.name == "base.odometry":
            poses.append(found.pose)
            sigmas.add(found.sigma)
            assert found.stamp_ns == sample.stamp_ns
    assert len(poses) > 50
    assert all(pose is poses[0] for pose in poses)
    assert len(sigmas) == 1


# where it is not told, or told wrongly


@pytest.mark.requirement(27)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.few(4)
def test_two_metres_and_a_radian_off_at_the_start(seed):
    world = World(random_drive(seed, 2.5, stand=0.5), seed)
    true, angle = world.drive.pose(0.0), 0.5 * seed
    off = Pose2(2.0 * math.cos(angle), 2.0 * math.sin(angle), (-1.0) ** seed)
    start = Pose2(true.x + off.x, true.y + off.y, true.yaw + off.yaw)
    assert Run(world, start, seed=seed).lost_for(0.0) < 1.5


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.few(2)
def test_without_a_start_it_is_found_on_the_whole_floor(seed):
    found = run(seed, 2.5, start=None)
    assert found.lost_for(0.0) < 2.0
    assert found.statuses[0] == "starting"


class Carried(World):
    """Its base is taken elsewhere at 3 s; neither wheels nor gyroscope feel it."""

    AT = 3_000_000_000

    def __init__(self, seed, seconds=9.0):
        first, second = (random_drive(seed + k, seconds, 1.0, start=k // 100) for k in (0, 300))
        at = first.times < self.AT * 1e-9
        rows = (np.where(at, a, b) for a, b in zip(first_of(first), first_of(second), strict=True))
        super().__init__(Drive(first.times, *rows), seed)
        self.ways = first, second

    def _of_both(self, sense):
        found = []
        for drive in self.ways:
            self.drive, kept = drive, self.drive
            found.append(sense(self))
            self.drive = kept
        before, after = found
        return (
            [one for one in before if one[0] < self.AT],
            [one for one in after if one[0] >= self.AT],
        )

    def odometry(self):
        before, after = self._of_both(World.odometry)
        on = before[-1][1].pose @ after[0][1].pose.inverse()
        return before + [(stamp, Odometry(on @ value.pose, value.twist)) for stamp, value in after]

    def imu(self):
        before, after = self._of_both(World.imu)
        return before + after


def first_of(drive):
    return drive.x, drive.y, drive.yaw


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.few(1)
def test_a_base_that_was_carried_elsewhere_is_found_again(seed):
    world = Carried(seed)
    followed = Run(world, world.ways[0].pose(0.0), seed=seed)
    assert followed.lost_for(3.0) < 5.0
    assert "doubtful" in followed.statuses


# what stands about


def test_sixty_per_cent_of_the_beams_on_unknown_objects():
    followed = run(45, 15.0, about={"blocked": 0.6})
    assert followed.rmse() < 0.05
    assert followed.worst() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("seed", fewer(range(50, 58)))
def test_sixty_per_cent_of_the_beams_on_unknown_objects_for_longer(seed):
    followed = run(seed, 30.0, about={"blocked": 0.6})
    assert followed.rmse() < 0.1


def test_forty_posts_that_no_map_shows():
    drive = random_drive(46, 12.0, stand=1.0)
    rng, posts = np.random.default_rng(46), []
    while len(posts) < 40:
        x, y, radius = rng.uniform((0.3, 0.3, 0.1), (11.7, 9.7, 0.35))
        if np.hypot(drive.x - x, drive.y - y).min() > radius + 0.7:
            posts.append((x, y, radius))
    followed = Run(World(drive, 46, discs=tuple(posts)), drive.pose(0.0))
    assert followed.worst() < 0.05


# sensors that fail


def replaced(sample, pose):
    return sample._replace(value=Odometry(pose, Twist2(0.0)))


def dead(sample):
    return replaced(sample, Pose2(0.0, 0.0)) if sample.name == "base.odometry" else sample


def doubled(sample):
    if sample.name != "base.odometry":
        return sample
    pose = sample.value.pose
    return replaced(sample, Pose2(2.0 * pose.x, 2.0 * pose.y, pose.yaw))


def mirrored(sample):
    if sample.name != "base.odometry":
        return sample
    pose = sample.value.pose
    return replaced(sample, Pose2(pose.x, -pose.y, -pose.yaw))


@pytest.mark.requirement(28)
@pytest.mark.parametrize("fault", [dead, doubled, mirrored])
@pytest.mark.parametrize("names", [NO_TRACKERS, WHEELS_AND_SCANS], ids=["gyroscope", "none"])
@pytest.mark.few(2)
def test_wheels_that_are_wrong_are_reported_and_the_base_is_not_lost(fault, names):
    followed = run(47, 12.0, names, change=fault)
    at = followed.statuses.index("odometry wrong")
    moved = followed.times[at] - 1.0  # it stands for the first second
    assert moved < 2.5
    assert followed.worst(since=followed.times[at] + 1.0) < 0.1


@pytest.mark.requirement(28)
def test_wheels_that_fall_silent_are_reported_and_scans_go_on():
    def gone(sample):
        late = sample.name == "base.odometry" and sample.stamp_ns > 3_000_000_000
        return None if late else sample

    followed = run(47, 10.0, change=gone, at="base.scan")
    silent = followed.times > 3.5
    assert {status for status, late in zip(followed.statuses, silent, strict=True) if late} == {
        "odometry missing"
    }
    assert followed.worst(since=3.5) < 0.03


def test_without_scans_sigma_grows_and_trackers_bound_the_error():
    alone = run(48, 15.0, ("base.odometry", "base.imu"))
    assert alone.sigma[-1] > alone.sigma[60]
    tracked = run(48, 15.0, ("base.odometry", "base.imu", "rover.tracker"), about={"covered": 99.0})
    assert tracked.worst() < 0.12
    assert tracked.statuses[-1] == "tracking"


@pytest.mark.requirement(31)
@pytest.mark.slow
def test_one_tracker_lost_does_not_double_the_error():
    names = ("base.odometry", "base.imu", "rover.tracker")
    both, one = (
        [
            run(seed, 20.0, names, about={"covered": 99.0, "lost_trackers": lost}).rmse()
            for seed in range(4)
        ]
        for lost in ((), ("rear_tracker",))
    )
    assert np.mean(one) < 2.0 * np.mean(both)
    with_scans = run(3, 10.0, ALL, about={"lost_trackers": ("rear_tracker",)})
    assert with_scans.rmse() < 0.01


@pytest.mark.requirement(30)
def test_trackers_are_asked_once_a_second_and_ten_times_while_turning():
    mounts = sensing().trackers
    for rate, expected in ((0.0, 10), (0.5, 100)):
        found = Localizer(FIELD, sensing(), Tracking.of(sensing()), Pose2(5.0, 5.0))
        for k in range(900):
            stamp, yaw = k * 11_111_111, wrap(rate * k / 90.0)
            base = Pose2(5.0, 5.0, yaw)
            found.update("base.odometry", stamp, Odometry(Pose2(0.0, 0.0, yaw), Twist2(0.0)))
            for name, model in mounts.items():
                seen = Pose2(5.0, 5.0, yaw) @ model.mount.flat
                pose = type(model.mount.pose).from_yaw(seen.x, seen.y, model.mount.z, seen.yaw)
                found.update("rover.tracker", stamp, TrackerPose(name, pose))
        assert found.counts["trackers"] == pytest.approx(expected, abs=0.1 * expected + 1)
        assert found.pose.distance_to(base) < 0.01


@pytest.mark.parametrize("broken", [math.nan, math.inf, -math.inf, 1.8e308])
def test_what_is_no_number_is_left_out(broken):
    world = World(standing(Pose2(5.0, 3.0), 1.5), 2)
    found = localizer(world, Pose2(5.0, 3.0))
    for k, sample in enumerate(world.samples(*NO_TRACKERS)):
        found.update(*sample)
        if k % 7:
            continue
        before, stamp = (found.pose, found.stamp_ns, found.status), sample.stamp_ns + 1
        found.update("base.odometry", stamp, Odometry(Pose2(broken, 0.0), Twist2(0.0)))
        found.update("base.imu", stamp, ImuReading((0.0, 0.0, broken), (0.0, 0.0, 0.0)))
        assert (found.pose, found.stamp_ns, found.status) == before
        found.update("base.scan", stamp, Scan("front_laser", 0.0, 0.1, (broken,) * 50))
    assert found.pose.distance_to(Pose2(5.0, 3.0)) < 0.02
    assert math.isfinite(found.sigma.position)


def test_a_base_that_sees_nothing_it_knows_is_lost_and_found_when_it_sees_again():
    world = World(random_drive(49, 7.0, 0.5), 49)
    found = localizer(world, world.drive.pose(0.0))
    rng, statuses = np.random.default_rng(0), {}
    for sample in world.samples(*NO_TRACKERS):
        time = sample.stamp_ns * 1e-9
        if sample.name == "base.scan" and 1.0 < time < 5.0:
            crowded = tuple(rng.uniform(0.3, 0.6, 181).tolist())
            sample = sample._replace(value=dataclasses.replace(sample.value, ranges=crowded))
        found.update(*sample)
        statuses[time] = found.status
        unknown = found.status in ("lost", "ambiguous")
        assert (found.pose is None) == unknown
        assert (found.sigma.position == math.inf) == unknown
    assert any(status == "lost" for time, status in statuses.items() if 3.0 < time < 4.0)
    assert found.status == "tracking"
    assert found.pose.distance_to(world.drive.pose(found.stamp_ns * 1e-9)) < 0.03


def test_a_scan_of_nothing_corrects_nothing():
    found = Localizer(FIELD, sensing(), Tracking.of(sensing()), Pose2(5.0, 3.0))
    for k in range(200):
        found.update("base.odometry", k * 20_000_000, Odometry(Pose2(0.0, 0.0), Twist2(0.0)))
        found.update("base.scan", k * 20_000_000, Scan("front_laser", 0.0, 0.01, (math.inf,) * 181))
    assert found.pose.distance_to(Pose2(5.0, 3.0)) < 0.01
    assert found.sigma.position > 0.5
    assert found.status == "starting"


def test_before_the_first_sample_nothing_is_known():
    found = Localizer(FIELD, Sensing(), Tracking())
    assert found.pose is None
    assert found.stamp_ns is None
    assert found.sigma.position == math.inf


@pytest.mark.parametrize("seed", [63, 64])
def test_after_a_gap_scans_wait_for_wheels_that_come_late(seed):
    """Nothing for 5 s, then a scan 0.2 s before the wheels that know the way through the gap."""
    world = World(random_drive(seed, 14.0), seed)
    late, gap = 200_000_000, (4_000_000_000, 9_000_000_000)
    samples = []
    for one in world.samples(*WHEELS_AND_SCANS):
        if not gap[0] < one.stamp_ns < gap[1]:
            wheels = one.name == "base.odometry"
            samples.append(one._replace(stamp_ns=one.stamp_ns + late) if wheels else one)
    samples.sort(key=lambda one: one.stamp_ns)
    sparse = [one for k, one in enumerate(samples) if one.name == "base.odometry" or k % 5 == 0]
    found, off = localizer(world, world.drive.pose(0.0)), []
    for sample in sparse:
        found.update(*sample)
        if sample.name == "base.scan" and sample.stamp_ns > gap[1] + 1_000_000_000:
            off.append(found.pose.distance_to(world.drive.pose(found.stamp_ns * 1e-9)))
    assert max(off) < 0.1


def test_scans_that_are_rare_and_before_their_wheels_are_matched():
    world = World(random_drive(65, 30.0), 65)
    found = localizer(world, world.drive.pose(0.0))
    scans = [one for one in world.samples("base.scan") if one.value.sensor == "front_laser"][::12]
    wheels = dict(world.odometry())
    late = sorted(wheels)
    samples = list(scans)
    for scan in scans:
        at = min(late, key=lambda stamp: abs(stamp - scan.stamp_ns))
        samples.append(scan._replace(name="base.odometry", stamp_ns=at + S // 5, value=wheels[at]))
    for sample in sorted(samples, key=lambda one: one.stamp_ns):
        found.update(*sample)
    assert found.counts["matched"] > 0.5 * len(scans)
    assert found.status == "tracking"
