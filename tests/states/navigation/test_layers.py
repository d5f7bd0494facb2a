"""Each subsystem's costmaps and planner: from the room, a scanned map, laser scans (R34-R38)."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from behaviors.profile import load_profile
from engine.state import Sample
from hw.geometry import Pose2
from hw.robot import load_robot
from hw.room import Disc, Point, Room
from hw.samples import UserPose
from states.navigation.inflation import LETHAL
from states.navigation.layers import map_of
from states.navigation.local_planner import GlobalPlanner
from states.site import SUBSYSTEMS, Site, SubsystemName
from tests.scans import scan_of

HALL = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0)))
WALLS = (((5.8, 0.0), (6.2, 0.0), (6.2, 4.0), (5.8, 4.0)),)
DIVIDED = Room(outer=HALL.outer, walls=WALLS)
PLANNERS = ("exact", "theta_star", "navfn")
ON_CELLS = PLANNERS[1:]
POST = (6.0, 4.0)


def site_of(planner: str, room: Room = DIVIDED, **changes: Any) -> Site:
    """A site all of whose subsystems plan so."""
    profile = load_profile("tuned")
    navigation = profile.navigation
    for name in SUBSYSTEMS:
        subsystem = replace(navigation.named(name), planner=planner, **changes)
        navigation = replace(navigation, **{name: subsystem})
    return replace(profile, navigation=navigation).site(room, load_robot("rbkairos_ur10"))


def least_distance(path: Any, place: tuple[float, float]) -> float:
    assert path is not None
    points = np.array(path.points)
    steps = np.linspace(0.0, 1.0, 200)[:, None]
    along = [a + steps * (b - a) for a, b in itertools.pairwise(points)]
    return float(np.hypot(*(np.concatenate(along) - place).T).min())


@pytest.mark.requirement(34, 35, 38)
@pytest.mark.parametrize("name", PLANNERS)
def test_every_choice_answers_all_that_a_tick_asks(name: str) -> None:
    planner: GlobalPlanner = site_of(name).static_planners["chase"]
    here, there, user = (2.0, 2.0), (10.0, 2.0), Disc(6.0, 6.0, 1.2)

    way = planner.plan(here, there)
    assert way is not None
    exact = site_of("exact").static_planners["chase"].plan(here, there)
    assert exact is not None
    assert exact.length - 0.05 <= way.length <= 1.08 * exact.length
    assert planner.plan(here, there, user) is None  # they stand in the only gap
    assert planner.plan(here, (6.0, 2.0)) is None
    assert [planner.is_free(place) for place in (here, (6.0, 2.0), (0.5, 4.0))] == [True, 0, 0]
    assert planner.are_free(np.array([here, (6.0, 2.0), (0.5, 4.0)])).tolist() == [True, 0, 0]
    assert planner.clearance((3.0, 3.0)) == pytest.approx(2.8, abs=0.05)
    out = planner.nearest_free((0.6, 4.0))
    assert out == pytest.approx((1.0, 4.0), abs=0.08)
    assert planner.allows((2.0, 2.0), (4.0, 3.0))
    assert not planner.allows((2.0, 2.0), (5.5, 2.0))
    assert planner.allows((0.6, 4.0), (1.5, 4.0))


@pytest.mark.requirement(35, 120)
@pytest.mark.parametrize("planner", ON_CELLS)
def test_every_subsystem_plans_on_its_own_costmap_with_its_own_inflation(planner: str) -> None:
    site = site_of(planner)
    maps = site.static_costmaps

    assert len({id(found) for found in (*maps.values(), *site.static_planners.values())}) == 6
    assert [maps[name].whole.inflation.inscribed_radius for name in SUBSYSTEMS] == [1.0, 1.0, 0.77]
    near = (0.9, 4.0)
    assert [site.static_planners[name].is_free(near) for name in SUBSYSTEMS] == [False, False, True]


@pytest.mark.requirement(34)
def test_costs_beyond_the_inflation_keep_navfn_off_the_walls() -> None:
    values = load_profile("tuned").navigation.chase.costmap
    wide = replace(values, inflation_radius=1.8, cost_scaling_factor=2.0)
    plain, soft = (site_of("navfn", costmap=c).static_planners["chase"] for c in (values, wide))
    ways = [planner.plan((2.0, 1.2), (10.0, 1.2)) for planner in (plain, soft)]

    tops = [least_distance(way, (6.0, 4.0)) for way in ways]
    assert tops[0] == pytest.approx(1.0, abs=0.1)
    assert tops[1] > 1.15


@pytest.mark.requirement(34, 36)
@pytest.mark.parametrize("planner", ON_CELLS)
def test_a_scanned_map_takes_the_place_of_the_room(planner: str) -> None:
    drawn = map_of(HALL, 0.05)
    values = drawn.values.copy()
    values[120:140, 120:140] = 100  # a box of 1 m that nobody drew, about (5.7, 5.7)
    values.setflags(write=False)
    site = replace(site_of(planner, HALL), map=replace(drawn, values=values))

    way = site.static_planners["chase"].plan((2.0, 5.7), (10.0, 5.7))

    assert way is not None
    assert least_distance(way, (6.2, 6.2)) > 1.3
    assert site_of(planner, HALL).static_planners["chase"].is_free((6.2, 6.2))


class Scanning:
    """The estimator of one subsystem, and samples for it."""

    def __init__(self, planner: str = "theta_star", name: SubsystemName = "chase") -> None:
        self.site = site_of(planner, HALL)
        self.kind = planner
        self.estimator = self.site.costmap_estimator(name)

    def robot(self, pose: Pose2, stamp_ns: int) -> None:
        self.estimator.update("base.pose", Sample(pose, stamp_ns))

    def scan(self, pose: Pose2, stamp_ns: int, post: Point = POST, sensor: str = "laser") -> None:
        """What a scanner would see from a pose, whoever knows of the pose."""
        scan = scan_of(post, sensor=pose, name=sensor)
        self.estimator.update("base.scan", Sample(scan, stamp_ns))

    def user(self, place: Point, stamp_ns: int) -> None:
        pose = UserPose(Pose2(*place), 0.0)
        self.estimator.update("user.pose", Sample(pose, stamp_ns))

    def see(self, pose: Pose2, stamp_ns: int, post: Point = POST) -> None:
        """Pose and scan of the same instant."""
        self.robot(pose, stamp_ns)
        self.scan(pose, stamp_ns, post)

    def is_free(self, place: Point = POST) -> bool:
        return self.estimator.value().planner(self.kind).is_free(place)


@pytest.mark.requirement(37, 38, 51)
@pytest.mark.parametrize("planner", ON_CELLS)
def test_a_scan_blocks_the_way(planner: str) -> None:
    scanning = Scanning(planner)
    before = scanning.estimator.value()

    scanning.see(Pose2(4.0, 4.0, 0.3), 10**9)

    after = scanning.estimator.value()
    assert after.whole.cost(*POST) < LETHAL
    assert after.local is not None
    assert after.local.cost(5.81, 4.0) == LETHAL
    ways = [maps.planner(planner).plan((4.0, 4.0), (10.0, 4.0)) for maps in (after, before)]
    assert least_distance(ways[0], (5.8, 4.0)) > 0.95
    assert least_distance(ways[1], (5.8, 4.0)) < 0.05


@pytest.mark.requirement(37)
def test_the_window_rolls_with_the_robot_and_what_left_is_free_again() -> None:
    scanning = Scanning()
    for n, x in enumerate((4.0, 4.5)):
        scanning.see(Pose2(x, 4.0, 0.0), n * 10**8)
        local = scanning.estimator.value().local
        assert local is not None
        middle = (local.grid.x + 2.5, local.grid.y + 2.5)
        assert middle == pytest.approx((x, 4.0), abs=0.026)
    assert not scanning.is_free()

    scanning.see(Pose2(4.5, 4.0, 0.0), 3 * 10**8, post=(50.0, 50.0))

    assert scanning.is_free()


def test_costmaps_that_were_handed_out_do_not_change() -> None:
    scanning = Scanning()
    scanning.see(Pose2(4.0, 4.0), 0)
    first = scanning.estimator.value()

    scanning.see(Pose2(4.0, 4.0), 10**8, post=(50.0, 50.0))

    assert not first.planner("theta_star").is_free(POST)
    assert scanning.is_free()


def test_a_pose_alone_leaves_the_costmaps_as_they_are() -> None:
    scanning = Scanning()
    assert scanning.estimator.value() is scanning.site.static_costmaps["chase"]
    scanning.see(Pose2(4.0, 4.0), 0)
    after = scanning.estimator.value()

    scanning.robot(Pose2(4.1, 4.0), 10**8)
    scanning.user((8.0, 4.0), 10**8)

    assert scanning.estimator.value() is after


@pytest.mark.requirement(51)
def test_a_user_who_is_tracked_is_not_marked_and_one_who_is_lost_is() -> None:
    tracked, lost = Scanning(), Scanning()
    for scanning, stamp in ((tracked, 900), (lost, 800)):
        scanning.user((6.0, 3.9), stamp * 10**6)
        scanning.see(Pose2(4.0, 4.0), 10**9)

    assert tracked.is_free()
    assert not lost.is_free()


def test_a_scan_waits_for_a_pose_after_it_and_is_put_between_the_two_about_it() -> None:
    scanning, between = Scanning(), Pose2(4.0, 4.0, math.pi)
    scanning.robot(Pose2(3.5, 4.0, math.pi - 0.2), 0)
    scanning.scan(between, 50 * 10**6)
    assert scanning.is_free()

    scanning.robot(Pose2(4.5, 4.0, 0.2 - math.pi), 100 * 10**6)

    local = scanning.estimator.value().local
    assert local is not None
    assert local.cost(5.81, 4.0) == LETHAL
    assert local.cost(5.7, 4.0) < LETHAL
    assert local.cost(5.7, 4.35) < LETHAL


@pytest.mark.parametrize("late_s", [1.1, 0.02])
def test_a_scan_too_old_for_any_pose_or_older_than_the_last_is_left_out(late_s: float) -> None:
    scanning, now = Scanning(), 5 * 10**9
    for n in range(50):
        scanning.robot(Pose2(4.0, 4.0), now - n * 10**8)
    if late_s < 1.0:
        scanning.scan(Pose2(4.0, 4.0), now, post=(50.0, 50.0))
    scanning.scan(Pose2(4.0, 4.0), now - round(late_s * 1e9))

    assert scanning.is_free()


def test_without_a_scan_costmaps_do_not_age() -> None:
    scanning = Scanning()
    scanning.robot(Pose2(4.0, 4.0), 10**9)
    assert scanning.estimator.stamp() is None
    scanning.scan(Pose2(4.0, 4.0), 2 * 10**9)  # it waits
    assert scanning.estimator.stamp() is None


def test_costmaps_are_of_the_newest_pose_until_a_scanner_falls_silent() -> None:
    scanning, robot = Scanning(), Pose2(4.0, 4.0)
    for ms in (0, 100):
        scanning.robot(robot, ms * 10**6)
        for sensor in ("front", "rear"):
            scanning.scan(robot, ms * 10**6, sensor=sensor)
    stamps = []
    for ms in range(150, 501, 50):  # the one in front falls silent
        scanning.robot(robot, ms * 10**6)
        scanning.scan(robot, ms * 10**6, sensor="rear")
        stamps.append(scanning.estimator.stamp())

    assert stamps == [ms * 10**6 for ms in (150, 200, 250, 300, 350, 400, 100, 100)]


def test_poses_out_of_order_are_put_in_order() -> None:
    scanning = Scanning()
    scanning.user((6.0, 4.0), 90 * 10**6)
    scanning.user((9.0, 7.0), 20 * 10**6)
    scanning.robot(Pose2(4.0, 4.0), 100 * 10**6)
    scanning.robot(Pose2(1.0, 1.0), 0)
    scanning.scan(Pose2(4.0, 4.0), 100 * 10**6)

    local = scanning.estimator.value().local
    assert local is not None
    assert local.grid.x == pytest.approx(1.5, abs=0.026)
    assert scanning.is_free()
    assert scanning.estimator.stamp() == 100 * 10**6
