import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import distance_transform_edt

from hw.geometry import Pose2
from states.maps.cells import Grid, fill_rings, grid_over, room_map
from states.maps.distance import distances
from states.maps.occupancy import OccupancyMap
from states.navigation.grid.costmap import Costmap, StaticLayer, StaticValues, sample
from states.navigation.grid.inflation import (
    FREE,
    INSCRIBED,
    LETHAL,
    NO_INFORMATION,
    Inflation,
    inflate,
)
from states.navigation.grid.scanned_obstacles import Obstacles
from tests.repeats import examples

OUTER = ((0.0, 0.0), (11.5, 0.0), (11.5, 10.1), (0.0, 10.1))
OBSTACLES = (
    ((6.65, 0.0), (6.85, 0.0), (6.85, 2.58), (6.65, 2.58)),
    ((6.65, 7.72), (6.85, 7.72), (6.85, 10.1), (6.65, 10.1)),
    ((6.6, 4.9), (6.9, 4.9), (6.9, 5.4), (6.6, 5.4)),
)
SQUARE = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))


def map_of(values, resolution=1.0, corner=None):
    return OccupancyMap(np.array(values, np.int16), resolution, corner or Pose2(0.0, 0.0))


def empty(grid):
    return StaticLayer(grid, np.zeros((grid.rows, grid.columns), np.uint8))


# distance


@settings(deadline=None, max_examples=examples(150))
@given(hnp.arrays(np.bool_, hnp.array_shapes(min_dims=2, max_dims=2, max_side=25)))
def test_distances_are_those_of_scipy_to_the_last_bit(occupied):
    expected = distance_transform_edt(~occupied) if occupied.any() else math.inf
    assert np.array_equal(distances(occupied, 1.0), np.broadcast_to(expected, occupied.shape))


def test_distances_far_apart_are_exact():
    occupied = np.zeros((3, 3000), np.bool_)
    occupied[0, 0] = True
    assert distances(occupied, 0.05)[2, 2999] == math.hypot(2, 2999) * 0.05


# inflation


def costmap_2d_cost(metres, inflation):
    if metres == 0.0:
        return LETHAL
    if metres <= inflation.inscribed_radius:
        return INSCRIBED
    return int(
        252 * math.exp(-inflation.cost_scaling_factor * (metres - inflation.inscribed_radius))
    )


inflations = st.builds(
    Inflation,
    st.floats(0.05, 2.0),
    st.floats(0.0, 0.8),
    st.floats(0.5, 20.0),
    st.booleans(),
)


@pytest.mark.requirement(34)
@settings(deadline=None, max_examples=60)
@given(
    costs=hnp.arrays(np.uint8, (9, 12), elements=st.sampled_from([0, 0, 0, 0, 50, 253, 254, 255])),
    inflation=inflations,
    resolution=st.sampled_from([0.05, 0.1, 0.25]),
)
def test_inflation_gives_costmap_2ds_values(costs, inflation, resolution):
    found = costs.copy()
    inflate(found, distances(costs == LETHAL, resolution), *inflation.values(resolution))
    lethal = np.argwhere(costs == LETHAL)
    cells = math.ceil(inflation.inflation_radius / resolution - 1e-9)  # rounding is no cell
    for row, column in np.ndindex(costs.shape):
        old = int(costs[row, column])
        near = [math.hypot(row - r, column - c) for r, c in lethal]
        expected = old
        if near and min(near) <= cells:
            cost = costmap_2d_cost(min(near) * resolution, inflation)
            over = cost > 0 if inflation.inflate_unknown else cost >= INSCRIBED
            if old != NO_INFORMATION:
                expected = max(old, cost)
            elif over:
                expected = cost
        assert found[row, column] == expected


@pytest.mark.parametrize(("factor", "at_the_edge"), [(3.0, 49), (10.0, 1), (10.3, 0)])
def test_a_steep_factor_ends_the_inflation_before_its_radius(factor, at_the_edge):
    costs = np.zeros((1, 2), np.uint8)
    inflate(costs, np.array([[1.0, 1.01]]), *Inflation(1.0, 0.455, factor).values(0.1))
    assert costs[0].tolist() == [at_the_edge, FREE]


# cells


def test_cells_are_found_from_places_and_back():
    grid = Grid(0.05, 20, 30, -1.0, 2.0)
    for cell in ((0, 0), (19, 29), (7, 3)):
        assert grid.cell(*grid.center(*cell)) == cell
    assert grid.cell(-1.01, 2.5) is None
    assert grid.cell(0.5, 2.5) is None
    assert grid.cell(math.nan, 2.5) is None


def test_a_ring_fills_the_cells_whose_centre_it_holds():
    mask = fill_rings(Grid(0.5, 6, 6), [SQUARE])
    assert np.argwhere(mask).tolist() == [[2, 2], [2, 3], [3, 2], [3, 3]]


def test_a_grid_over_rings_covers_them_exactly():
    assert grid_over([OUTER], 0.05, 0.3) == Grid(0.05, 214, 242, -0.3, -0.3)


def test_walls_thinner_than_a_cell_are_not_lost():
    thin = ((5.0, 2.0), (5.01, 2.0), (5.01, 8.0), (5.0, 8.0))
    column = room_map(OUTER, (thin,), 0.1).values[:, 53]
    assert (column[24:82] == 100).all()


def test_another_grid_is_sampled_at_cell_centres_under_any_pose():
    costs = np.array([[1, 2], [3, 4]], np.uint8)
    found = sample(costs, 1.0, Pose2(0.0, 2.0, -math.pi / 2), Grid(1.0, 3, 2))
    assert found.tolist() == [[2, 4], [1, 3], [255, 255]]


# static layer


def test_map_values_become_costs_as_costmap_2d_has_it():
    map_ = map_of([[-1, 0, 50, 99, 100]])
    assert StaticValues().costs(map_).tolist() == [[255, 0, 0, 0, 254]]
    assert StaticValues(track_unknown_space=False).costs(map_).tolist() == [[0, 0, 0, 0, 254]]
    graded = StaticValues(trinary_costmap=False)
    assert graded.costs(map_).tolist() == [[255, 0, 127, 251, 254]]


def test_with_another_value_for_unknown_the_maps_unknown_is_lethal():
    values = StaticValues(True, 94, 1, False)  # as a maker ships it
    assert values.costs(map_of([[-1, 0, 1, 47, 94]])).tolist() == [[254, 0, 255, 127, 254]]


@pytest.mark.requirement(121)
@pytest.mark.parametrize(("resolution", "free"), [(0.05, 62.3), (0.025, 62.2)])
def test_plan_a_keeps_62_square_metres_after_inflation_by_one_metre(resolution, free):
    map_ = room_map(OUTER, OBSTACLES, resolution)
    assert map_.area() == pytest.approx(115.0, abs=0.1)
    ground = StaticLayer.of(map_, grid_over([OUTER], resolution, 0.3))
    costmap = Costmap(ground, Inflation(1.0, 0.455, 3.0))
    assert np.count_nonzero(costmap.costs == FREE) * resolution**2 == pytest.approx(free, abs=0.1)


@pytest.mark.requirement(35, 120)
def test_every_subsystem_has_its_own_values():
    ground = StaticLayer.of(room_map(OUTER, OBSTACLES, 0.1), grid_over([OUTER], 0.1, 0.3))
    chase = Costmap(ground, Inflation(1.0, 0.455, 3.0))
    before = chase.costs.tobytes()
    escape = Costmap(ground, Inflation(0.77, 0.455, 3.0))
    assert (escape.costs == FREE).sum() > (chase.costs == FREE).sum()
    assert chase.costs.tobytes() == before


# obstacles


@pytest.mark.requirement(37, 52)
def test_obstacles_are_inflated_and_the_higher_cost_counts():
    grid = Grid(0.05, 100, 100)
    ground = StaticLayer(grid, np.zeros((100, 100), np.uint8))
    ground.costs[50, 10] = LETHAL
    costmap = Costmap(ground, Inflation(1.0, 0.455, 3.0))
    seen = Obstacles(grid, np.array([50 * 100 + 60]), 1.0)
    both = ground.costs.copy()
    both[50, 60] = LETHAL
    assert np.array_equal(
        costmap.with_obstacles(seen), Costmap(StaticLayer(grid, both), costmap.inflation).costs
    )
    assert costmap.costs[50, 60] == FREE
    nothing = Obstacles(grid, np.empty(0, np.int64), 1.0)
    assert np.array_equal(costmap.with_obstacles(nothing), costmap.costs)


@pytest.mark.requirement(38)
@pytest.mark.parametrize("cell", [(0, 0), (99, 0), (99, 119), (0, 119), (42, 7)])
def test_an_obstacle_at_the_edge_of_the_map_counts_within_it(cell):
    grid = Grid(0.05, 100, 120, -1.0, 2.0)
    ground = StaticLayer(grid, np.zeros((100, 120), np.uint8))
    costs = Costmap(ground, Inflation(0.5, 0.31, 3.0)).with_obstacles(
        Obstacles(grid, np.array([cell[0] * 120 + cell[1]]), 0.5)
    )
    for row, column in np.ndindex(100, 120):
        away = 0.05 * math.hypot(row - cell[0], column - cell[1])
        assert (costs[row, column] >= INSCRIBED) == (away <= 0.31)


@pytest.mark.requirement(35, 38)
def test_obstacles_of_fine_cells_count_on_coarse_ones():
    fine, coarse = Grid(0.05, 100, 100, 1.0, -1.0), Grid(0.25, 20, 20, 1.0, -1.0)
    seen = Obstacles(fine, np.array([50 * 100 + 60]), 0.5)
    ground = StaticLayer(coarse, np.zeros((20, 20), np.uint8))
    costs = Costmap(ground, Inflation(0.0, 0.0)).with_obstacles(seen)
    assert np.argwhere(costs == LETHAL).tolist() == [[10, 12]]


def test_keepouts_are_kept_off_like_walls():
    nothing = map_of(np.zeros((8, 8)), 0.5)
    costmap = Costmap(StaticLayer.of(nothing, Grid(0.5, 8, 8), (SQUARE,)), Inflation(0.6, 0.5))
    assert [costmap.costs[2, column] for column in (2, 4, 6)] == [LETHAL, INSCRIBED, FREE]


def test_a_turned_map_is_put_into_the_costmaps_cells():
    map_ = map_of([[100, 0, 0]], 1.0, Pose2(1.0, 0.0, math.pi / 2))
    costmap = Costmap(StaticLayer.of(map_, Grid(1.0, 3, 1)), Inflation(0.0, 0.0))
    assert costmap.costs[:, 0].tolist() == [LETHAL, FREE, FREE]
