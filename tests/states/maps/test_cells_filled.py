"""Rings on cells; shapely at each centre, and the sides of each cell, are the references."""

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings, strategies as st

from hw.scene.room import Room
from states.maps.cells import Grid, fill_rings
from states.maps.field import room_field
from tests.repeats import examples
from tests.states.localization.world import ROOM


@settings(max_examples=examples(80), deadline=None)
@given(seed=st.integers(0, 1_000), count=st.integers(1, 5))
def test_a_cell_is_filled_if_its_centre_is_inside_the_first_ring_and_no_other(seed, count):
    """Stars with corners on and off the centres of cells, beyond the grid and over each other."""
    rng = np.random.default_rng(seed)
    rings = []
    for _ in range(count):
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 9))
        radii = rng.uniform(1.0, 9.0, 9)
        place = rng.uniform(0.0, 8.0, 2)
        ring = place + np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))
        rings.append([(float(x), float(y)) for x, y in ring])
    grid = Grid(0.37, 25, 19, -0.5, -0.7)
    areas = [shapely.make_valid(shapely.Polygon(ring)) for ring in rings]
    xs, ys = grid.centers()
    places = shapely.points(*np.meshgrid(xs, ys))
    wanted = shapely.contains(areas[0], places)
    for area in areas[1:]:
        wanted &= ~shapely.contains(area, places)
    assert np.array_equal(fill_rings(grid, rings), wanted)


@pytest.mark.parametrize("scale", [1.0, 0.35])
def test_a_cell_of_a_room_lists_the_sides_that_can_be_nearest_to_it(scale):
    shrunk = [
        tuple((scale * x, scale * y) for x, y in ring) for ring in (ROOM.outer, *ROOM.obstacles)
    ]
    table = room_field(Room(shrunk[0], tuple(shrunk[1:]))).table
    half = 0.5 * np.sqrt(2.0) * table.cell
    lines = [shapely.LineString([s[:2], s[:2] + s[4] * s[2:4]]) for s in table.sides]
    for cell in np.random.default_rng(3).integers(0, table.rows * table.columns, 400):
        row, column = divmod(int(cell), table.columns)
        centre = shapely.Point((column + 0.5) * table.cell, (row + 0.5) * table.cell)
        own = shapely.distance(lines, centre)
        limit = min(table.reach + half, own.min() + 2.0 * half)
        listed = table.listed[table.first[cell] : table.first[cell + 1]]
        sure = np.abs(own - limit) > 1e-8
        assert set(listed[sure[listed]].tolist()) == set(np.flatnonzero(sure & (own <= limit)))


@given(*[st.floats(-0.15, 0.15) | st.floats(0.85, 1.15)] * 2)
@example(0.45, -0.03)
@example(-0.03, 0.45)
def test_a_place_beyond_any_side_of_a_grid_is_in_none_of_its_cells(across, up):
    grid = Grid(0.1, 10, 10, x=-0.5, y=2.0)

    cell = grid.cell(-0.5 + across, 2.0 + up)

    if cell is None:
        assert not (1e-9 < across < 1.0 - 1e-9 and 1e-9 < up < 1.0 - 1e-9)
    else:
        x, y = grid.center(*cell)
        assert abs(x + 0.5 - across) <= 0.05 + 1e-9
        assert abs(y - 2.0 - up) <= 0.05 + 1e-9
