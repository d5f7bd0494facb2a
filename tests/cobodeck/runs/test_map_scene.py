"""A map as map_server writes it is a scene: a room, a start, planners, a drive across it."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from behaviors.profile.profile import load_profile
from cobodeck.setup.open_scene import EXACT_CORNERS, RunPlace, environment_at, open_place
from cobodeck.terminal.console import Problem
from hw.geometry import STILL, Pose2
from hw.model.robot import load_robot
from hw.scene.room import Room
from hw.scene.scene import load_scene
from states.environment.environment import Environment
from states.maps.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyMap, save_map
from states.maps.rooms import outlines, room_of, start_in, tidied
from states.navigation.local.profile_planner import ProfilePlanner
from states.navigation.planner_interfaces import Limits, Tolerance

MAPS = Path(__file__).parents[4] / "shared" / "data" / "maps"
REAL = ("ipa-apartment", "ipa-kitchen", "utexas_gdc_1s", "lse_arena")
KEPT = {"lse_arena": 0.3, "ipa-kitchen": 0.5}
"""Where a robot of 0.77 m finds next to no floor, a smaller one drives, m."""
SIZE = 0.05


def drawn(*rows: str, resolution: float = SIZE, corner: Pose2 | None = None) -> OccupancyMap:
    """A map from text, the top row first: `.` free, `#` occupied, `?` unknown."""
    meaning = {".": FREE, "#": OCCUPIED, "?": UNKNOWN}
    values = np.array([[meaning[sign] for sign in row] for row in rows[::-1]], np.int16)
    return OccupancyMap(values, resolution, corner or Pose2(0.0, 0.0))


def test_specks_are_dropped_and_what_cannot_be_reached_is_unknown() -> None:
    map_ = drawn("##########", "#......#.#", "#.#..?.###", "#....????#", "##########")
    values = tidied(map_).values
    assert (values[1:4, 1:5] == FREE).all()
    assert values[3, 8] == UNKNOWN
    assert (values[1, 5:9] == UNKNOWN).all()
    assert tidied(map_).resolution == map_.resolution


def test_a_map_without_a_free_cell_is_refused() -> None:
    with pytest.raises(ValueError, match="no cell of the map is free"):
        tidied(drawn("##", "#?"))


def test_a_room_drawn_on_cells_comes_back_as_it_was() -> None:
    """Walls on the sides of cells, corners of 90 degrees: exactly, turned and moved as the map."""
    rows = ["." * 60] * 40
    rows[10:20] = ["." * 20 + "#" * 10 + "." * 30] * 10
    corner = Pose2(3.0, -2.0, 0.7)
    room = room_of(tidied(drawn(*rows, corner=corner)))
    whole = [(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)]
    box = [(1.0, 1.0), (1.5, 1.0), (1.5, 1.5), (1.0, 1.5)]
    expected = shapely.Polygon(
        [corner.transform(*c) for c in whole], [[corner.transform(*c) for c in box]]
    )
    assert shapely.symmetric_difference(room.free_space, expected).area < 1e-9
    assert len(room.segments) == 8


@pytest.mark.parametrize("angle", [0.1, 0.4, math.pi / 4, 1.2])
def test_a_slanting_wall_becomes_one_straight_line(angle: float) -> None:
    grid = (np.arange(200) + 0.5) * SIZE
    x, y = np.meshgrid(grid, grid)
    c, s = math.cos(angle), math.sin(angle)
    u, v = c * (x - 5.0) + s * (y - 5.0), -s * (x - 5.0) + c * (y - 5.0)
    free = (abs(u) < 4.0) & (abs(v) < 2.5)
    room = room_of(OccupancyMap(np.where(free, FREE, OCCUPIED).astype(np.int16), SIZE, Pose2(0, 0)))
    assert len(room.segments) <= 12
    assert room.free_space.area == pytest.approx(40.0, rel=0.01)
    corners = [(5.0 + c * a - s * b, 5.0 + s * a + c * b) for a, b in
               ((-4, -2.5), (4, -2.5), (4, 2.5), (-4, 2.5))]  # fmt: skip
    true = shapely.LinearRing(corners)
    assert shapely.hausdorff_distance(shapely.LinearRing(room.outer), true, 0.01) < SIZE


def test_cells_that_meet_at_a_corner_are_not_joined() -> None:
    rings = outlines(np.array([[True, False], [False, True]]))
    assert [len(ring) for ring in rings] == [4, 4]


def test_the_outline_of_any_cells_stays_within_a_cell() -> None:
    chance = np.random.default_rng(1)
    for _ in range(20):
        values = np.where(chance.random((40, 40)) < 0.25, OCCUPIED, FREE).astype(np.int16)
        map_ = tidied(OccupancyMap(values, 1.0, Pose2(0.0, 0.0)))
        room, free = room_of(map_), map_.values == FREE
        lines = shapely.MultiLineString([(*ring, ring[0]) for ring in outlines(free)])
        sides = shapely.union_all([shapely.LinearRing(r) for r in (room.outer, *room.walls)])
        for place in shapely.points(shapely.get_coordinates(sides)):
            assert shapely.distance(place, lines) <= 1.0 + 1e-9
        assert shapely.Polygon(room.outer).is_valid


def test_the_start_is_open_and_leaves_the_most_open_place_to_people() -> None:
    rows = ["." * 160] * 100
    rows[40:60] = ["." * 60 + "#" * 10 + "." * 90] * 20
    map_ = tidied(drawn(*rows))
    start, room = start_in(map_), room_of(map_)
    middle = room.largest_free_disc
    assert math.dist((start.x, start.y), (middle.x, middle.y)) >= 2.9
    best = max(
        room.clearance(x, y)
        for x in np.arange(0.05, 8.0, 0.1)
        for y in np.arange(0.05, 5.0, 0.1)
        if math.dist((x, y), (middle.x, middle.y)) >= 3.1
    )
    assert room.clearance(start.x, start.y) == pytest.approx(best, abs=0.1)


def test_where_there_is_no_other_open_place_the_robot_starts_in_the_most_open_one() -> None:
    start = start_in(tidied(drawn(*["." * 60] * 40)))
    assert (start.x, start.y) == pytest.approx((1.5, 1.0), abs=0.55)


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    file = tmp_path / "hall.yaml"
    save_map(drawn(*(["." * 160] * 120)), file)
    return file


def test_a_map_file_is_a_scene_with_a_start_or_one_that_is_given(hall: Path) -> None:
    place = open_place(str(hall))
    assert place.map is not None
    assert place.scene.name == "hall"
    start = place.scene.robot_start
    assert place.scene.room.clearance(start.x, start.y) > 1.0
    given = open_place(f"{hall}@1.5,2.5,0.7").scene
    assert given.robot_start == Pose2(1.5, 2.5, 0.7)
    assert given.user is None
    for wrong in ("@9,2", "@1", "@a,b", "@nan,1"):
        with pytest.raises(Problem):
            open_place(f"{hall}{wrong}")
    assert open_place("lab_a") == RunPlace(load_scene("lab_a"))


def environment_of(
    place: RunPlace, kept: float | None = None, planner: str = "exact"
) -> Environment:
    environment = environment_at(place, load_profile("tuned"), load_robot("rbkairos_ur10"))
    chase = replace(environment.navigation.chase, planner=planner)
    if kept is not None:
        chase = replace(chase, inflation=kept)
    return replace(environment, navigation=replace(environment.navigation, chase=chase))


def test_among_too_many_corners_theta_star_plans_and_it_is_told() -> None:
    scene = load_scene("lab_a")
    few = RunPlace(scene)
    boxes = tuple(
        ((x, y), (x + 0.01, y), (x + 0.01, y + 0.01), (x, y + 0.01))
        for x, y in ((0.3 + 0.02 * (i % 300), 8.0 + 0.02 * (i // 300)) for i in range(400))
    )
    many = RunPlace(replace(scene, room=Room(scene.room.outer, walls=boxes)))
    assert len(many.scene.room.segments) > EXACT_CORNERS
    profile, robot = load_profile("tuned"), load_robot("rbkairos_ur10")
    assert environment_at(few, profile, robot).navigation.escape.planner == "exact"
    assert environment_at(many, profile, robot).navigation.escape.planner == "theta_star"
    assert not few.remarks
    assert "theta_star" in many.remarks[0]


def places_for(environment: Environment, count: int) -> list[tuple[float, float]]:
    """Free places that can be reached from the start."""
    chance, planner = random.Random(0), environment.static_planners["chase"]
    x_low, y_low, x_high, y_high = environment.room.bounds
    assert environment.map is not None
    start = start_in(environment.map)
    found: list[tuple[float, float]] = []
    for _ in range(20_000):
        place = chance.uniform(x_low, x_high), chance.uniform(y_low, y_high)
        if planner.is_free(place) and planner.plan((start.x, start.y), place) is not None:
            found.append(place)
        if len(found) == count:
            break
    return found


@pytest.mark.parametrize("name", REAL)
def test_a_drive_across_a_real_map(name: str) -> None:
    if not MAPS.exists():
        pytest.skip("no ../shared/data/maps")
    place = open_place(str(MAPS / f"{name}.yaml"))
    environment = environment_of(place, KEPT.get(name))
    start = place.scene.robot_start
    planner = environment.static_planners["chase"]
    goals = places_for(environment, 40)
    far = max(goals, key=lambda goal: planner.plan((start.x, start.y), goal).length)  # type: ignore[union-attr]
    driver = ProfilePlanner(planner, Limits(), Tolerance())
    driver.go_to(Pose2(*far, 0.0))
    pose, twist = start, STILL
    kept = environment.navigation.chase.inflation
    for _ in range(3000):
        twist = driver.command(pose, twist, None, 0.05)
        moved = twist.rotated(pose.yaw + 0.5 * twist.wz * 0.05)
        pose = Pose2(pose.x + 0.05 * moved.vx, pose.y + 0.05 * moved.vy, pose.yaw + 0.05 * twist.wz)
        assert environment.room.clearance(pose.x, pose.y) >= kept - 0.03
        if driver.status == "arrived":
            break
    assert driver.status == "arrived"


@pytest.mark.parametrize("name", REAL)
@pytest.mark.few(2)
def test_planners_find_the_same_ways_on_a_real_map(name: str) -> None:
    if not MAPS.exists():
        pytest.skip("no ../shared/data/maps")
    place = open_place(str(MAPS / f"{name}.yaml"))
    kept = KEPT.get(name)
    exact, cells = (environment_of(place, kept, kind).static_planners["chase"]
                    for kind in ("exact", "theta_star"))  # fmt: skip
    start = (place.scene.robot_start.x, place.scene.robot_start.y)
    for goal in places_for(environment_of(place, kept), 6):
        one, other = exact.plan(start, goal), cells.plan(start, goal)
        assert one is not None
        if other is not None:  # a place at the edge is free for one of them only
            assert other.length == pytest.approx(one.length, rel=0.05, abs=0.1)
