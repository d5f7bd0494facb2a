"""How much of a floor is left, what is closed, and where a touch is impossible (paper 5.1)."""

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage

from hw.geometry import Pose2
from hw.scene.room import Room
from hw.scene.scene import load_scene
from states.floors.floor_cells import MapFloor
from states.floors.floor_plan import RoomFloor
from states.floors.usable_space import (
    Passage,
    measure,
    room_ahead,
    shortcoming,
    smallest_square,
    without_haptic_pose,
)
from states.maps.cells import room_map
from states.maps.occupancy import OccupancyMap, load_map

DATA = Path(__file__).resolve().parents[4] / "shared/data/maps"
AREA = 115.0
ANGLES = (0, 30, -30, 60, -60, 90, -90)
HAPTIC = [(0.85 + math.cos(math.radians(a)), math.sin(math.radians(a))) for a in ANGLES]


def box(x, y, width, height):
    return ((x, y), (x + width, y), (x + width, y + height), (x, y + height))


def turned(ring, yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    return tuple((c * x - s * y, s * x + c * y) for x, y in ring)


def circle(radius, parts=720):
    steps = [math.tau * i / parts for i in range(parts)]
    return tuple((radius * math.cos(a), radius * math.sin(a)) for a in steps)


COLUMN = box(-0.15, -0.25, 0.30, 0.50)
SQUARE_SIDE = math.sqrt(AREA)


def gap_room(width):
    """Two halves joined by one passage between walls 0.2 m thick."""
    below, above = 4.0 - 0.5 * width, 4.0 - 0.5 * width
    walls = (box(5.0, 0.0, 0.2, below), box(5.0, 8.0 - above, 0.2, above))
    return Room(box(0.0, 0.0, 10.0, 8.0), walls=walls)


@pytest.mark.requirement(118)
def test_a_column_takes_its_sides_and_twice_the_inflation_with_square_corners():
    around = box(-5.0, -5.0, 10.0, 10.0)
    with_column = RoomFloor(Room(around, columns=(COLUMN,)), "square")
    without = RoomFloor(Room(around), "square")

    removed = without.usable_m2(0.77) - with_column.usable_m2(0.77)

    assert removed == pytest.approx(1.84 * 2.04, abs=1e-4)
    assert removed == pytest.approx(3.7536, abs=1e-4)


def test_round_corners_take_less_by_what_the_arcs_cut_off():
    around = box(-5.0, -5.0, 10.0, 10.0)
    with_column = RoomFloor(Room(around, columns=(COLUMN,)))

    removed = RoomFloor(Room(around)).usable_m2(0.77) - with_column.usable_m2(0.77)

    assert removed == pytest.approx(3.7536 - (4.0 - math.pi) * 0.77**2, abs=1e-4)


@pytest.mark.requirement(119)
@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.0])
@pytest.mark.parametrize(("width", "opened"), [(1.53, False), (1.56, True)])
def test_a_passage_must_be_wider_than_twice_the_inflation(width, opened, yaw):
    straight = gap_room(width)
    walls = tuple(turned(wall, yaw) for wall in straight.walls)
    floor = RoomFloor(Room(turned(straight.outer, yaw), walls=walls))

    space = measure(floor, 0.77)

    assert len(space.pieces) == (1 if opened else 2)
    if opened:
        assert space.closed == ()
        return
    (passage,) = space.closed
    assert passage.width == pytest.approx(width, abs=1e-9)
    assert passage.middle == pytest.approx(turned([(5.1, 4.0)], yaw)[0], abs=1e-6)


@pytest.mark.requirement(119)
def test_a_passage_of_exactly_twice_the_inflation_is_open_as_for_the_planners():
    assert measure(RoomFloor(gap_room(1.54)), 0.77).closed == ()


@pytest.mark.requirement(120, 121)
@pytest.mark.parametrize("scene", ["lab_a", "lab_b"])
def test_the_papers_room_keeps_62_of_115_square_metres(scene):
    space = measure(RoomFloor(load_scene(scene).room), 1.0)

    assert space.free_m2 == pytest.approx(115.0, abs=1.0)
    assert space.usable_m2 == pytest.approx(62.0, abs=1.0)
    assert space.share == pytest.approx(0.54, abs=0.005)
    assert len(space.pieces) == 1


@pytest.mark.requirement(120)
@pytest.mark.parametrize(("inflation", "widths"), [(0.77, []), (1.0, [1.8])])
def test_in_the_harder_room_only_escape_passes_the_south_gap(inflation, widths):
    closed = measure(RoomFloor(load_scene("lab_b").room), inflation).closed

    assert [passage.width for passage in closed] == pytest.approx(widths)


@pytest.mark.requirement(122)
def test_a_round_room_with_a_column_keeps_74_square_metres():
    radius = math.sqrt(AREA / math.pi)
    floor = RoomFloor(Room(circle(radius), columns=(COLUMN,)), "square")

    assert floor.usable_m2(1.0) == pytest.approx(74.0, abs=1.0)
    assert measure(floor, 1.0).closed == ()


@pytest.mark.requirement(123)
def test_a_square_room_with_a_column_keeps_71_square_metres():
    half = 0.5 * SQUARE_SIDE
    floor = RoomFloor(Room(box(-half, -half, SQUARE_SIDE, SQUARE_SIDE), columns=(COLUMN,)))

    assert floor.usable_m2(1.0) == pytest.approx(71.0, abs=1.0)


@pytest.mark.requirement(124)
@pytest.mark.parametrize("yaw", [0.0, 0.2, 2.0])
def test_six_metres_square_are_enough_for_all_behaviours_and_five_are_not(yaw):
    large = RoomFloor(Room(turned(box(0.0, 0.0, 6.0, 6.0), yaw)))
    small = RoomFloor(Room(turned(box(0.0, 0.0, 5.0, 5.0), yaw)))

    assert shortcoming(large, 1.0) is None
    assert "an empty square room needs 6 x 6 m" in shortcoming(small, 1.0)
    assert smallest_square(1.0) == 6.0


@pytest.mark.requirement(124)
def test_a_column_in_the_only_corner_of_the_quarter_makes_a_room_too_small():
    outer = box(0.0, 0.0, 6.0, 6.0)

    assert shortcoming(RoomFloor(Room(outer, columns=(box(2.9, 2.9, 0.2, 0.2),))), 1.0)


@pytest.mark.requirement(124)
@pytest.mark.parametrize("cells", [False, True])
@pytest.mark.few(1)
def test_of_a_room_that_is_too_small_the_largest_quarter_and_what_stands_in_it_are_told(cells):
    outer, columns = box(0.0, 0.0, 9.0, 7.0), (box(4.45, 3.2, 0.3, 0.4),)
    floor = (
        MapFloor(room_map(outer, columns, 0.05))
        if cells
        else RoomFloor(Room(outer, columns=columns))
    )

    told = shortcoming(floor, 1.0)
    size = float(re.search(r"the largest is of ([0-9.]+) m", told)[1])
    assert floor.quarter(1.0, size - 0.1) is not None
    assert floor.quarter(1.0, size + 0.15) is None
    assert "an obstacle of 0.3 x 0.4 m at (4.6, 3.4)" in told
    assert shortcoming(floor, 1.0, size - 0.1) is None


@settings(max_examples=20)
@given(st.floats(0.5, 2.8), st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_a_quarter_that_is_found_keeps_off_walls(radius, x, y):
    room = Room(box(0.0, 0.0, 6.0, 6.0), columns=(box(x + 1.0, y + 1.0, 0.3, 0.5),))
    found = RoomFloor(room).quarter(1.0, radius)
    if found is not None:
        assert min(room.clearance(*corner) for corner in found.corners().tolist()) > 1.0 - 0.03


@pytest.mark.requirement(124)
def test_a_map_is_large_enough_when_its_room_is():
    for side, enough in ((6.0, True), (5.0, False)):
        floor = MapFloor(room_map(box(0.0, 0.0, side, side), (), 0.05))

        assert (shortcoming(floor, 1.0) is None) == enough


def test_niches_and_corners_are_no_passages():
    niche = ((0, 0), (8, 0), (8, 3), (9, 3), (9, 4), (8, 4), (8, 8), (0, 8))

    assert measure(RoomFloor(Room(niche)), 0.77).closed == ()


def test_a_column_near_a_wall_closes_a_way_although_the_rest_stays_in_one_piece():
    room = Room(box(0.0, 0.0, 8.0, 8.0), columns=(box(3.8, 1.2, 0.4, 0.4),))

    space = measure(RoomFloor(room), 0.77)

    assert len(space.pieces) == 1
    assert [passage.width for passage in space.closed] == pytest.approx([1.2])


def test_a_corridor_is_one_passage_however_its_walls_are_cut_into_sides():
    bends = [(x, 3.5) for x in (3.0, 3.7, 5.0, 6.0)]
    lower = ((3.0, 0.0), (6.0, 0.0), *reversed(bends))
    room = Room(box(0.0, 0.0, 9.0, 8.0), walls=(lower, box(3.0, 4.5, 3.0, 3.5)))

    space = measure(RoomFloor(room), 0.77)

    assert [passage.width for passage in space.closed] == pytest.approx([1.0])


def test_a_row_of_columns_closes_a_passage_between_each_pair():
    columns = tuple(box(4.0, y, 0.4, 0.4) for y in (1.0, 2.4, 3.8, 5.2))
    room = Room(box(0.0, 0.0, 8.0, 6.6), columns=columns)

    widths = [passage.width for passage in measure(RoomFloor(room), 0.77).closed]

    assert widths == pytest.approx([1.0] * 5)


def test_square_corners_close_what_passes_between_two_corners():
    columns = (box(3.0, 0.0, 1.0, 3.4), box(5.2, 4.6, 1.0, 3.4))
    room = Room(box(0.0, 0.0, 9.0, 8.0), walls=columns)

    assert math.dist((4.0, 3.4), (5.2, 4.6)) > 1.54
    assert measure(RoomFloor(room), 0.77).closed == ()
    assert len(measure(RoomFloor(room, "square"), 0.77).closed) == 1


@st.composite
def cluttered_rooms(draw):
    """A room with up to six boxes on a 10 cm raster, so that cells fit exactly."""
    tenth = st.integers(0, 70)
    size = st.integers(2, 20)
    columns = tuple(
        box(draw(tenth) / 10, draw(tenth) / 10, draw(size) / 10, draw(size) / 10)
        for _ in range(draw(st.integers(0, 6)))
    )
    return Room(box(0.0, 0.0, 8.0, 7.0), columns=columns)


@given(cluttered_rooms(), st.sampled_from([0.33, 0.52, 0.77]))
@settings(deadline=None, max_examples=60)
def test_places_that_are_joined_on_the_floor_are_apart_only_behind_a_closed_passage(
    room, inflation
):
    floor = RoomFloor(room)
    space = measure(floor, inflation)
    parts = list(getattr(floor.room.free_space, "geoms", [floor.room.free_space]))
    pieces = [p.intersection(floor.usable(inflation)) for p in parts]
    several = [p for p in pieces if len([g for g in getattr(p, "geoms", [p]) if g.area > 0.1]) > 1]

    assert not several or space.closed
    for passage in space.closed:
        assert passage.width < 2.0 * inflation
        assert not floor.usable(inflation).intersects(_point(passage))


@given(cluttered_rooms(), st.sampled_from([0.33, 0.77]))
@settings(deadline=None, max_examples=40)
def test_a_closed_passage_is_open_for_half_its_width(room, inflation):
    floor = RoomFloor(room)
    for passage in measure(floor, inflation).closed:
        assert floor.usable(0.5 * passage.width - 1e-3).intersects(_point(passage))


def _point(passage):
    from shapely.geometry import Point

    return Point(passage.middle)


@given(cluttered_rooms(), st.sampled_from([0.35, 0.75]))
@settings(deadline=None, max_examples=30)
def test_cells_and_polygons_agree_on_areas(room, inflation):
    exact = RoomFloor(room)
    cells = MapFloor(room_map(room.outer, room.obstacles, 0.05))
    edge = exact.usable(inflation).length

    assert cells.free_m2 == pytest.approx(exact.free_m2, abs=1e-6)
    assert cells.usable_m2(inflation) == pytest.approx(
        exact.usable_m2(inflation), abs=0.05 + 0.025 * edge
    )


@pytest.mark.requirement(121)
def test_the_papers_room_as_a_map_keeps_the_same_area():
    room = load_scene("lab_a").room

    space = measure(MapFloor(room_map(room.outer, room.obstacles, 0.05)), 1.0)

    assert space.free_m2 == pytest.approx(115.0, abs=0.5)
    assert space.usable_m2 == pytest.approx(62.0, abs=0.5)
    assert len(space.pieces) == 1


@pytest.mark.requirement(119)
@pytest.mark.parametrize(("width", "opened"), [(1.5, False), (1.6, True)])
def test_cells_close_the_passage_that_polygons_close(width, opened):
    room = gap_room(width)
    space = measure(MapFloor(room_map(room.outer, room.obstacles, 0.05)), 0.77)

    assert len(space.pieces) == (1 if opened else 2)
    assert len(space.closed) == (0 if opened else 1)
    for passage in space.closed:
        assert passage.width == pytest.approx(width, abs=0.051)
        assert passage.middle == pytest.approx((5.1, 4.0), abs=0.15)


def test_pieces_of_a_real_map_hang_together_over_the_passages_that_are_told():
    if not DATA.is_dir():
        pytest.skip("the shared maps are not here")
    floor = MapFloor(load_map(DATA / "ipa-apartment.yaml"))

    space = measure(floor, 1.0)

    labels, count = ndimage.label(floor.free, structure=np.ones((3, 3)))
    holds = {labels[floor.map.cell(*passage.middle)] for passage in space.closed}
    assert len(space.pieces) > 3
    assert 0 not in holds
    assert len(space.closed) == len(space.pieces) - 1
    assert count >= 1


def test_unknown_cells_are_neither_free_nor_walls():
    values = np.full((40, 40), -1, np.int16)
    values[:, :20] = 0
    floor = MapFloor(OccupancyMap(values, 0.05, Pose2(0.0, 0.0)))

    assert floor.free_m2 == pytest.approx(2.0)
    assert floor.usable_m2(0.5) == pytest.approx(2.0)
    assert not floor.is_clear(np.array([1.5]), np.array([1.0]), 0.1).any()


def test_places_on_a_turned_map_are_found():
    values = np.full((20, 40), 100, np.int16)
    values[5:15, 5:35] = 0
    corner = Pose2(3.0, -1.0, 0.7)
    floor = MapFloor(OccupancyMap(values, 0.1, corner))
    inside, outside = corner.transform(2.0, 1.0), corner.transform(0.2, 1.0)

    clear = floor.is_clear(*np.array([inside, outside]).T, 0.3)

    assert clear.tolist() == [True, False]
    x_low, y_low, x_high, y_high = floor.bounds
    assert x_low < inside[0] < x_high
    assert y_low < inside[1] < y_high


@pytest.mark.requirement(126)
@pytest.mark.parametrize(("distance", "possible"), [(2.40, True), (2.30, False)])
def test_a_user_who_faces_a_wall_needs_room_for_a_pose(distance, possible):
    """With the poses at 0, 30 and 60 degrees, as the paper reckons."""
    floor = RoomFloor(Room(box(0.0, 0.0, 10.0, 10.0)))
    x, y = np.array([10.0 - distance]), np.array([5.0])

    free = [floor.is_clear(x + dx, y + dy, 1.0)[0] for dx, dy in HAPTIC[:5]]

    assert any(free) == possible


@pytest.mark.requirement(126)
def test_the_room_needed_ahead_counts_pose_inflation_and_tolerance():
    at_60_degrees = HAPTIC[3]

    assert room_ahead(at_60_degrees, 1.0, 0.2) == pytest.approx(2.55)


@pytest.mark.requirement(126)
def test_in_the_middle_of_a_hall_every_user_pose_has_a_haptic_pose_and_in_a_closet_none():
    hall = without_haptic_pose(RoomFloor(Room(box(0.0, 0.0, 12.0, 12.0))), HAPTIC, 1.0)
    closet = without_haptic_pose(RoomFloor(Room(box(0.0, 0.0, 2.0, 2.0))), HAPTIC, 1.0)
    near_middle = np.hypot(hall.x - 6.0, hall.y - 6.0) < 2.0

    assert (hall.share[near_middle] == 0.0).all()
    assert 0.0 < hall.overall < 0.2
    assert closet.overall == 1.0


def test_the_share_without_a_haptic_pose_is_that_of_a_count_one_by_one():
    room = load_scene("lab_b").room
    found = without_haptic_pose(RoomFloor(room), HAPTIC, 1.0, step=1.5, headings=8)

    for x, y, share in zip(found.x, found.y, found.share, strict=True):
        assert room.clearance(x, y) > 0.499
        missing = 0
        for heading, user in itertools.product(np.arange(8) * math.tau / 8, [(x, y)]):
            poses = (Pose2(*user, float(heading)).transform(*pose) for pose in HAPTIC)
            missing += not any(room.clearance(*pose) >= 1.0 for pose in poses)
        assert share == pytest.approx(missing / 8)


def test_a_floor_without_room_has_nothing_left():
    full = RoomFloor(Room(box(0.0, 0.0, 3.0, 3.0), walls=(box(-1.0, -1.0, 5.0, 5.0),)))
    tiny = RoomFloor(Room(box(0.0, 0.0, 0.5, 0.5)))

    for floor in (full, tiny):
        space = measure(floor, 1.0)
        assert (space.usable_m2, space.pieces, space.closed) == (0.0, (), ())
        assert shortcoming(floor, 1.0) is not None
        assert without_haptic_pose(floor, HAPTIC, 1.0).overall is None
    assert measure(full, 1.0).share is None
    occupied = MapFloor(OccupancyMap(np.full((9, 9), 100, np.int16), 0.05, Pose2(0.0, 0.0)))
    assert measure(occupied, 1.0).pieces == ()
    assert shortcoming(occupied, 1.0) is not None


@pytest.mark.parametrize("inflation", [0.0, -1.0, math.nan, math.inf])
def test_an_inflation_must_be_a_number_above_zero(inflation):
    with pytest.raises(ValueError, match="must be above 0"):
        measure(RoomFloor(Room(box(0.0, 0.0, 5.0, 5.0))), inflation)


def test_the_middle_of_a_passage_lies_between_its_ends():
    assert Passage((1.0, 2.0), (3.0, 2.0), 2.0).middle == (2.0, 2.0)
