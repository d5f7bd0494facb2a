"""The distance field of a room or a map; shapely and plain counting are the references."""

import math

import numpy as np
import pytest
import shapely

from hw.geometry import Pose2
from hw.scene.room import Room
from states.maps.cells import room_map
from states.maps.field import REACH, distance_at, map_field, room_field
from states.maps.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyMap
from tests.states.localization.world import ROOM

SHIFT = 1e6


def moved(room, x, y):
    def shift(ring):
        return tuple((px + x, py + y) for px, py in ring)

    return Room(shift(room.outer), tuple(map(shift, room.walls)), tuple(map(shift, room.columns)))


def at(x, y, field):
    """`distance_at` a place of the map, for fields that are not turned."""
    corner = field.map_from_corner
    return distance_at(x - corner.x, y - corner.y, field.table)


@pytest.mark.parametrize(
    "room", [ROOM, Room(((0.0, 0.0), (9.0, 1.0), (7.0, 8.0), (3.0, 3.5)))], ids=["room", "skew"]
)
def test_distance_and_direction_in_a_drawn_room_are_exact(room):
    field = room_field(room)
    walls = shapely.MultiLineString([[s[:2], s[2:]] for s in room.segments])
    rng = np.random.default_rng(4)
    x_low, y_low, x_high, y_high = room.bounds
    for x, y in rng.uniform((x_low - 1.9, y_low - 1.9), (x_high + 1.9, y_high + 1.9), (2000, 2)):
        place = shapely.Point(x, y)
        expected = walls.distance(place)
        corner = field.map_from_corner
        distance, nx, ny = distance_at(x - corner.x, y - corner.y, field.table)
        assert distance == pytest.approx(min(expected, REACH), abs=1e-9)
        if 1e-6 < expected < REACH:
            ahead = shapely.Point(x + 1e-6 * nx, y + 1e-6 * ny)
            assert walls.distance(ahead) - expected == pytest.approx(1e-6, rel=1e-3)


def test_on_a_wall_the_direction_is_across_it():
    field = room_field(ROOM)
    x, y = -field.map_from_corner.x, 3.0 - field.map_from_corner.y
    distance, nx, ny = distance_at(x, y, field.table)
    assert (distance, abs(nx), ny) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    "place", [(-50.0, 0.0), (math.nan, 1.0), (math.inf, math.nan), (0.0, 1e300)]
)
def test_off_the_table_it_is_far_and_grows_nowhere(place):
    for field in (room_field(ROOM), map_field(room_map(ROOM.outer, ROOM.obstacles, 0.1))):
        assert distance_at(*place, field.table) == (REACH, 0.0, 0.0)


def test_on_a_map_it_is_the_distance_between_centres_of_cells():
    values = np.full((30, 40), FREE, np.int16)
    rng = np.random.default_rng(1)
    walls = rng.integers(0, (30, 40), (12, 2))
    values[walls[:, 0], walls[:, 1]] = OCCUPIED
    values[0, :5] = UNKNOWN
    field = map_field(OccupancyMap(values, 0.05, Pose2(0.0, 0.0)))
    for row, column in np.ndindex(30, 40):
        least = min(math.dist((row, column), wall) for wall in np.argwhere(values == OCCUPIED))
        found, _, _ = at((column + 0.5) * 0.05, (row + 0.5) * 0.05, field)
        assert found == pytest.approx(0.05 * least, abs=1e-12)
    assert field.sigma == 0.025


def test_between_centres_it_is_linear_and_the_direction_is_its_slope():
    values = np.full((20, 20), FREE, np.int16)
    values[:, 3] = OCCUPIED
    field = map_field(OccupancyMap(values, 0.1, Pose2(0.0, 0.0)))
    for x in np.linspace(0.36, 1.9, 50):
        distance, nx, ny = at(x, 0.77, field)
        assert (distance, nx, ny) == pytest.approx((x - 0.35, 1.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("size", [0.05, 0.25, 0.7])
def test_walls_in_the_outermost_cells_of_a_map_have_two_sides(size):
    """The same map with a broad border of unknown cells has the same distances, edge or not."""
    values = np.full((9, 12), FREE, np.int16)
    values[0], values[-1], values[:, 0], values[:, -1] = (OCCUPIED,) * 4
    border = math.ceil(2.0 * REACH / size) + 2
    wide = np.pad(values, border, constant_values=UNKNOWN)
    cropped = map_field(OccupancyMap(values, size, Pose2(0.0, 0.0)))
    whole = map_field(OccupancyMap(wide, size, Pose2(-border * size, -border * size)))
    low, high = -1.9, np.array([12.0, 9.0]) * size + 1.9
    for x, y in np.random.default_rng(5).uniform(low, high, (500, 2)):
        assert at(x, y, cropped) == pytest.approx(at(x, y, whole), abs=1e-9)
    distance, nx, ny = at(1.0 * size, 4.5 * size, cropped)
    assert (distance, nx, ny) == pytest.approx((0.5 * size, 1.0, 0.0))


def test_a_thick_wall_draws_to_its_face():
    values = np.full((20, 20), FREE, np.int16)
    values[:, :8] = OCCUPIED
    field = map_field(OccupancyMap(values, 0.1, Pose2(0.0, 0.0)))
    distance, nx, _ = at(0.35, 1.0, field)
    assert (distance, nx) == pytest.approx((0.4, -1.0))


@pytest.mark.parametrize(
    "make", [room_field, lambda r: map_field(room_map(r.outer, r.obstacles, 0.05))]
)
def test_a_map_a_thousand_kilometres_away_has_the_same_distances(make):
    here, there = make(ROOM), make(moved(ROOM, SHIFT, -SHIFT))
    points = np.random.default_rng(2).uniform(-3.0, 3.0, (200, 2))
    near = here.distances(Pose2(5.0, 5.0, 0.3), points)
    far = there.distances(Pose2(5.0 + SHIFT, 5.0 - SHIFT, 0.3), points)
    np.testing.assert_allclose(near, far, atol=1e-8)


def test_places_of_the_floor_are_free_and_all_over_the_room():
    field = room_field(ROOM)
    corner = field.map_from_corner
    places = [(x + corner.x, y + corner.y) for x, y in field.free]
    assert all(ROOM.is_free(*place) for place in places)
    assert len(places) * field.table.cell**2 == pytest.approx(ROOM.free_space.area, rel=0.02)
