"""From scans and poses as they arrive to the obstacles that all planners go by (R37, R38, R51)."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from engine.state import Stamped
from hw.geometry import Pose2
from hw.samples import PoseSigma, UserPose
from hw.scene.room import Point
from states.localization.estimates import PoseEstimate
from states.navigation.grid.scanned_obstacles import Obstacles
from states.subsystems import SUBSYSTEMS
from tests.scans import scan_of
from tests.states.navigation.grid.test_layers import HALL, PLANNERS, environment_of, least_distance

POST = (6.0, 4.0)
MS = 10**6


class Scanning:
    """The estimator of a site, and samples for it."""

    def __init__(self, planner: str = "exact") -> None:
        self.environment = environment_of(planner, HALL)
        self.estimator = self.environment.obstacle_estimator()
        self.ms = 0

    def robot(self, pose: Pose2, ms: float) -> None:
        self.estimator.update("base.pose", Stamped(pose, round(ms * MS)))

    def scan(self, pose: Pose2, ms: float, *posts: Point, sensor: str = "laser") -> None:
        """What a scanner would see from a pose, whoever knows of the pose."""
        scan = scan_of(*posts, sensor=pose, name=sensor)
        self.estimator.update("base.scan", Stamped(scan, round(ms * MS)))

    def user(self, place: Point, ms: float) -> None:
        pose = UserPose(Pose2(*place), 0.0)
        self.estimator.update("user.pose", Stamped(pose, round(ms * MS)))

    def see(self, pose: Pose2, *posts: Point, ms: float = 100.0) -> Obstacles:
        """Pose and scan of one instant, so long after the last."""
        self.ms += ms
        self.robot(pose, self.ms)
        self.scan(pose, self.ms, *posts)
        return self.estimator.value()

    def is_free(self, place: Point = POST) -> bool:
        seen = self.estimator.value()
        return all(self.environment.planner_among(name, seen).is_free(place) for name in SUBSYSTEMS)


@pytest.mark.requirement(37, 38, 51)
@pytest.mark.parametrize("planner", PLANNERS)
def test_what_a_scan_shows_is_in_the_way_of_every_subsystem(planner: str) -> None:
    scanning = Scanning(planner)
    environment = scanning.environment
    seen = scanning.see(Pose2(4.0, 4.0, 0.3), POST)

    for name in SUBSYSTEMS:
        kept = environment.navigation.named(name).inflation
        around, straight = (
            planner.plan((3.0, 4.0), (10.0, 4.0))
            for planner in (
                environment.planner_among(name, seen),
                environment.static_planners[name],
            )
        )
        assert kept + 0.1 <= least_distance(around, POST) <= kept + 0.4
        assert least_distance(straight, POST) < 0.05
        assert not environment.planner_among(name, seen).is_free(POST)


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_goal_in_what_was_seen_has_no_way(planner: str) -> None:
    scanning = Scanning(planner)
    seen = scanning.see(Pose2(4.0, 4.0), POST)
    for name in SUBSYSTEMS:
        assert scanning.environment.planner_among(name, seen).plan((3.0, 4.0), (5.9, 4.0)) is None


def test_all_planners_keep_off_the_same_obstacles_alike() -> None:
    """To two cells: one that obstacles are grown by, one in which costs are told."""
    chance = np.random.default_rng(5)
    places = chance.uniform((2.0, 1.5), (8.0, 6.5), (400, 2))
    seen = Scanning().see(Pose2(4.0, 4.0), (6.0, 4.0), (4.5, 6.0), (3.0, 2.0))
    planners = [environment_of(kind, HALL).planner_among("escape", seen) for kind in PLANNERS]
    free = [planner.are_free(places) for planner in planners]
    for one, other in itertools.combinations(free, 2):
        for place in places[one != other]:
            edge = abs(planners[0].clearance(tuple(place)) - 0.77)
            assert edge < 0.08
    assert free[0].any()
    assert not free[0].all()


def test_noise_within_a_cell_makes_no_planner_anew() -> None:
    scanning, chance = Scanning(), np.random.default_rng(0)
    seen, changes = scanning.see(Pose2(4.0, 4.0), POST), 0
    for _ in range(100):
        x, y = 4.0 + chance.normal(0.0, 0.01, 2)
        new = scanning.see(Pose2(x, y, chance.normal(0.0, 0.003)), POST, ms=40.0)
        changes += new is not seen
        seen = new
    assert seen
    assert changes <= 5


def test_what_left_is_free_again_and_the_planners_are_those_of_the_room() -> None:
    scanning, robot = Scanning(), Pose2(4.0, 4.0)
    scanning.see(robot, POST)
    assert not scanning.is_free()
    scanning.see(robot)
    seen = scanning.see(robot)
    assert scanning.is_free()
    for name in SUBSYSTEMS:
        planner = scanning.environment.planner_among(name, seen)
        assert planner is scanning.environment.static_planners[name]


def test_without_news_nothing_is_made_anew() -> None:
    scanning = Scanning()
    before = scanning.estimator.value()
    for _ in range(5):
        scanning.see(Pose2(4.0, 4.0))
        scanning.user((8.0, 4.0), scanning.ms)
    assert scanning.estimator.value() is before
    assert not before


def test_one_planner_for_all_subsystems_of_the_same_inflation() -> None:
    scanning = Scanning()
    seen = scanning.see(Pose2(4.0, 4.0), POST)
    chase, haptic, escape = (scanning.environment.planner_among(name, seen) for name in SUBSYSTEMS)
    assert chase is haptic
    assert chase is not escape


def test_obstacles_that_were_handed_out_do_not_change() -> None:
    scanning, robot = Scanning("theta_star"), Pose2(4.0, 4.0)
    first = scanning.see(robot, POST)
    for _ in range(3):
        scanning.see(robot)
    planner = scanning.environment.planner_among("chase", first)
    assert not planner.is_free(POST)
    assert scanning.is_free()


@pytest.mark.requirement(51)
def test_a_user_who_is_tracked_is_not_marked_and_one_who_is_lost_is() -> None:
    tracked, lost = Scanning(), Scanning()
    for scanning, ms in ((tracked, 900), (lost, 800)):
        scanning.user((6.0, 3.9), ms)
        scanning.see(Pose2(4.0, 4.0), POST, ms=1000.0)
    assert tracked.is_free()
    assert not lost.is_free()


def test_the_person_is_given_up_by_cells_as_soon_as_they_are_lost() -> None:
    scanning, robot = Scanning(), Pose2(4.0, 4.0)
    scanning.user(POST, 0.0)
    assert not scanning.see(robot, POST, ms=100.0)
    assert scanning.see(robot, POST, ms=100.0)


def test_a_scan_waits_for_a_pose_after_it_and_is_put_between_the_two_about_it() -> None:
    scanning, between = Scanning(), Pose2(4.0, 4.0, math.pi)
    scanning.robot(Pose2(3.5, 4.0, math.pi - 0.2), 0)
    scanning.scan(between, 50, POST)
    assert scanning.is_free()

    scanning.robot(Pose2(4.5, 4.0, 0.2 - math.pi), 100)

    seen = scanning.estimator.value()
    for box in seen.boxes:
        for x, y in box:
            assert math.dist((x, y), POST) < 0.4
    assert not scanning.is_free()


@pytest.mark.parametrize("pose_ms", [0.0, 30.0, 60.0])
def test_each_beam_is_put_where_the_robot_was_when_it_was_taken(pose_ms: float) -> None:
    """The robot drives on at 1.5 m/s and turns by 1 rad/s, though the last pose is of before."""
    scanning, beam_time = Scanning(), 0.06 / 719

    def at(ms: float) -> Pose2:
        return Pose2(4.0 + 0.0015 * ms, 4.0, 0.001 * ms)

    for ms in (-90.0, -45.0, pose_ms):
        scanning.robot(at(ms), 1000.0 + ms)
    seen = [scan_of(POST, sensor=at(i * 60.0 / 719)).ranges[i] for i in range(720)]
    scan = replace(scan_of(POST, sensor=at(0.0)), ranges=tuple(seen), beam_time=beam_time)
    scanning.estimator.update("base.scan", Stamped(scan, 1000 * MS))

    shown = scanning.estimator.value()
    assert shown
    rows, columns = np.divmod(shown.cells, shown.grid.columns)
    middle = [shown.grid.center(r, c) for r, c in zip(rows.tolist(), columns.tolist(), strict=True)]
    assert all(0.07 <= math.dist(place, POST) <= 0.32 for place in middle)


@pytest.mark.parametrize("late_s", [1.1, 0.02])
def test_a_scan_too_old_for_any_pose_or_older_than_the_last_is_left_out(late_s: float) -> None:
    scanning, now = Scanning(), 5000.0
    for n in range(50):
        scanning.robot(Pose2(4.0, 4.0), now - n * 100.0)
    if late_s < 1.0:
        scanning.scan(Pose2(4.0, 4.0), now)
    scanning.scan(Pose2(4.0, 4.0), now - late_s * 1e3, POST)
    assert scanning.is_free()


def test_without_a_scan_obstacles_do_not_age() -> None:
    scanning = Scanning()
    scanning.robot(Pose2(4.0, 4.0), 1000)
    assert scanning.estimator.stamp() is None
    scanning.scan(Pose2(4.0, 4.0), 2000, POST)  # it waits
    assert scanning.estimator.stamp() is None


def test_obstacles_are_of_the_newest_pose_until_a_scanner_falls_silent() -> None:
    scanning, robot = Scanning(), Pose2(4.0, 4.0)
    for ms in (0, 100):
        scanning.robot(robot, ms)
        for sensor in ("front", "rear"):
            scanning.scan(robot, ms, sensor=sensor)
    stamps = []
    for ms in range(150, 501, 50):  # the one in front falls silent
        scanning.robot(robot, ms)
        scanning.scan(robot, ms, sensor="rear")
        stamps.append(scanning.estimator.stamp())
    assert stamps == [ms * MS for ms in (150, 200, 250, 300, 350, 400, 100, 100)]


def test_poses_out_of_order_are_put_in_order() -> None:
    scanning = Scanning()
    scanning.user((6.0, 4.0), 90)
    scanning.user((9.0, 7.0), 20)
    scanning.robot(Pose2(4.0, 4.0), 100)
    scanning.robot(Pose2(1.0, 1.0), 0)
    scanning.scan(Pose2(4.0, 4.0), 100, POST)
    assert scanning.is_free()
    assert scanning.estimator.stamp() == 100 * MS


def test_walls_seen_from_a_pose_that_is_unsure_are_no_news() -> None:
    """The pose is 12 cm wrong, and says that it may be."""
    told, untold = Scanning(), Scanning()
    post = (12.1, 4.0)  # it stands 10 cm out of the wall
    for scanning, sigma in ((told, 0.05), (untold, 0.0)):
        estimate = PoseEstimate(Pose2(9.88, 4.0), PoseSigma(sigma, 0.0))
        scanning.estimator.update("base.localization", Stamped(estimate, 100 * MS))
        scanning.scan(Pose2(10.0, 4.0), 100, post)
    assert not told.estimator.value()
    assert untold.estimator.value()


def test_a_mislocated_robot_makes_few_boxes_of_all_that_it_sees() -> None:
    scanning = Scanning()
    chance = np.random.default_rng(2)
    posts = [tuple(place) for place in chance.uniform((1.5, 1.0), (8.5, 7.0), (40, 2))]
    seen = scanning.see(Pose2(5.0, 4.0), *posts)
    assert 5 < len(seen.boxes) <= 24
    rows, columns = np.divmod(seen.cells, seen.grid.columns)
    for x, y in (seen.grid.center(*cell) for cell in zip(rows, columns, strict=True)):
        assert any(b[0][0] <= x <= b[2][0] and b[0][1] <= y <= b[2][1] for b in seen.boxes)
