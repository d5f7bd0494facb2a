import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import distance_transform_edt

from hw.geometry import Pose2
from hw.room import Disc
from hw.samples import Scan
from states.maps.cells import Grid, fill_rings, grid_over, room_map
from states.maps.distance import distances, squared_distances
from states.maps.occupancy import OccupancyMap
from states.navigation.costmap import Costmap, SpeedZone, StaticValues, both, sample, with_maximum
from states.navigation.inflation import FREE, INSCRIBED, LETHAL, NO_INFORMATION, Inflation, inflate
from states.navigation.obstacles import ObstacleLayer, ObstacleValues

OUTER = ((0.0, 0.0), (11.5, 0.0), (11.5, 10.1), (0.0, 10.1))
OBSTACLES = (
    ((6.65, 0.0), (6.85, 0.0), (6.85, 2.58), (6.65, 2.58)),
    ((6.65, 7.72), (6.85, 7.72), (6.85, 10.1), (6.65, 10.1)),
    ((6.6, 4.9), (6.9, 4.9), (6.9, 5.4), (6.6, 5.4)),
)
SQUARE = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))


def map_of(values, resolution=1.0, corner=None):
    return OccupancyMap(np.array(values, np.int16), resolution, corner or Pose2(0.0, 0.0))


def scan_of(ranges, start=0.0, step=0.1):
    return Scan("front", start, step, tuple(ranges))


# distance


@settings(deadline=None, max_examples=150)
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
    squared = squared_distances(costs == LETHAL)
    table = inflation.table(resolution)
    found = inflate(costs, squared, table, inflation.inflate_unknown)
    lethal = np.argwhere(costs == LETHAL)
    cells = math.ceil(inflation.inflation_radius / resolution)
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
    inflation = Inflation(1.0, 0.455, factor)
    assert inflation.cost(1.0) == at_the_edge
    assert inflation.cost(1.0 + 1e-9) == FREE


def test_the_analytic_cost_is_that_of_the_table_at_whole_cells():
    inflation = Inflation(1.0, 0.455, 3.0)
    table = inflation.table(0.05)
    for squared in range(len(table)):
        metres = math.sqrt(squared) * 0.05
        if metres <= inflation.inflation_radius:
            assert inflation.cost(metres) == table[squared]


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
    costmap = Costmap(grid_over([OUTER], resolution, 0.3), Inflation(1.0, 0.455, 3.0), static=map_)
    assert np.count_nonzero(costmap.costs == FREE) * resolution**2 == pytest.approx(free, abs=0.1)


@pytest.mark.requirement(35, 120)
def test_every_subsystem_has_its_own_values():
    map_ = room_map(OUTER, OBSTACLES, 0.1)
    grid = grid_over([OUTER], 0.1, 0.3)
    chase = Costmap(grid, Inflation(1.0, 0.455, 3.0), static=map_)
    before = chase.costs.tobytes()
    escape = Costmap(grid, Inflation(0.77, 0.455, 3.0), static=map_)
    assert (escape.costs == FREE).sum() > (chase.costs == FREE).sum()
    assert chase.costs.tobytes() == before


# obstacle layer


@pytest.mark.requirement(37, 51)
def test_an_end_point_is_marked_and_the_way_to_it_cleared():
    layer = ObstacleLayer(Grid(0.1, 20, 20))
    layer.see(Pose2(0.55, 1.05), scan_of([1.0]), 0)
    assert layer.costs[10, 15] == LETHAL
    assert (layer.costs[10, 5:15] == FREE).all()
    assert np.count_nonzero(layer.costs != NO_INFORMATION) == 11


@pytest.mark.requirement(37, 51)
def test_an_obstacle_that_left_is_cleared_by_the_next_scan():
    layer = ObstacleLayer(Grid(0.1, 20, 20))
    layer.see(Pose2(0.55, 1.05), scan_of([0.5]), 0)
    layer.see(Pose2(0.55, 1.05), scan_of([1.0]), 1)
    assert layer.costs[10, 10] == FREE


def test_a_beam_without_return_clears_as_far_as_rays_are_traced():
    layer = ObstacleLayer(Grid(0.1, 20, 60), ObstacleValues(raytrace_range=3.0))
    layer.see(Pose2(0.55, 1.05), scan_of([2.0]), 0)
    layer.see(Pose2(0.55, 1.05), scan_of([math.inf]), 1)
    assert not (layer.costs == LETHAL).any()
    assert (layer.costs[10, 5:35] == FREE).all()
    assert layer.costs[10, 36] == NO_INFORMATION


def test_a_beam_without_return_clears_nothing_where_that_is_not_wanted():
    layer = ObstacleLayer(Grid(0.1, 20, 60), ObstacleValues(inf_clears=False))
    layer.see(Pose2(0.55, 1.05), scan_of([math.inf]), 0)
    assert (layer.costs == NO_INFORMATION).all()


@pytest.mark.parametrize("reading", [math.nan, 0.0, -1.0, -math.inf])
def test_readings_that_are_none_change_nothing(reading):
    layer = ObstacleLayer(Grid(0.1, 20, 20))
    layer.see(Pose2(0.55, 1.05), scan_of([reading]), 0)
    assert (layer.costs == NO_INFORMATION).all()


def test_end_points_beyond_the_obstacle_range_are_not_marked_but_clear():
    layer = ObstacleLayer(Grid(0.1, 20, 60), ObstacleValues(obstacle_range=1.0))
    layer.see(Pose2(0.55, 1.05), scan_of([2.0]), 0)
    assert not (layer.costs == LETHAL).any()
    assert (layer.costs[10, 5:25] == FREE).all()


def test_marks_that_no_beam_refreshes_are_dropped_after_their_lifetime():
    layer = ObstacleLayer(Grid(0.1, 20, 20), ObstacleValues(mark_lifetime=10.0))
    layer.see(Pose2(0.55, 1.05), scan_of([1.0]), 0)
    layer.forget(10_000_000_000)
    assert layer.costs[10, 15] == LETHAL
    layer.forget(10_000_000_001)
    assert layer.costs[10, 15] == NO_INFORMATION


def test_end_points_on_the_user_are_left_to_whoever_knows_the_user():
    layer = ObstacleLayer(Grid(0.1, 20, 20))
    layer.see(Pose2(0.55, 1.05), scan_of([1.0]), 0, ignore=Disc(1.8, 1.05, 0.5))
    assert not (layer.costs == LETHAL).any()
    assert (layer.costs[10, 5:15] == FREE).all()


def test_the_robot_itself_is_no_obstacle():
    layer = ObstacleLayer(Grid(0.5, 6, 6))
    layer.see(Pose2(0.3, 1.3), scan_of([1.0]), 0)
    layer.free_footprint(SQUARE)
    assert (layer.costs[2:4, 2:4] == FREE).all()


@settings(deadline=None, max_examples=50)
@given(x=st.floats(-50, 50), y=st.floats(-50, 50), angle=st.floats(-3, 3), far=st.floats(0.1, 40.0))
def test_a_beam_changes_only_cells_near_its_line_wherever_it_goes(x, y, angle, far):
    layer = ObstacleLayer(Grid(0.1, 30, 30), ObstacleValues(50.0, 50.0))
    layer.see(Pose2(x, y, angle), scan_of([far]), 0)
    for row, column in np.argwhere(layer.costs != NO_INFORMATION):
        px, py = layer.grid.center(row, column)
        across = (py - y) * math.cos(angle) - (px - x) * math.sin(angle)
        assert abs(across) < 0.2


@pytest.mark.requirement(37)
def test_a_rolling_window_keeps_what_it_saw_in_its_place():
    layer = ObstacleLayer(Grid(0.1, 50, 50), rolling=True)
    layer.see(Pose2(0.05, 0.05), scan_of([1.0]), 0)
    mark = layer.grid.center(*np.argwhere(layer.costs == LETHAL)[0])
    layer.see(Pose2(1.0, -1.0), scan_of([math.nan]), 1)
    assert layer.grid.cell(*mark) is not None
    assert layer.costs[layer.grid.cell(*mark)] == LETHAL
    middle = layer.grid.center(25, 25)
    assert middle == pytest.approx((1.0, -1.0), abs=0.11)
    layer.see(Pose2(30.0, 0.0), scan_of([math.nan]), 2)
    assert (layer.costs == NO_INFORMATION).all()


# all layers


def test_the_higher_cost_wins_where_a_layer_knows_one():
    master = np.array([255, 255, 0, 100, 254], np.uint8)
    layer = np.array([255, 0, 254, 50, 0], np.uint8)
    assert with_maximum(master, layer).tolist() == [255, 0, 254, 100, 254]


@pytest.mark.requirement(37, 52)
def test_what_a_scan_shows_is_inflated():
    layer = ObstacleLayer(Grid(0.05, 100, 100), rolling=True)
    layer.see(Pose2(3.0, 3.0), scan_of([1.5]), 0)
    local = Costmap(layer.grid, Inflation(1.0, 0.455, 3.0), obstacles=layer.costs)
    assert local.cost(4.5, 3.0) >= INSCRIBED
    assert 0 < local.cost(3.7, 3.0) < INSCRIBED
    assert local.cost(3.4, 3.0) == FREE


@pytest.mark.requirement(38)
def test_an_obstacle_in_either_costmap_blocks():
    map_ = room_map(OUTER, OBSTACLES, 0.05)
    whole = Costmap(grid_over([OUTER], 0.05, 0.3), Inflation(1.0, 0.455, 3.0), static=map_)
    layer = ObstacleLayer(Grid(0.05, 100, 100), rolling=True)
    layer.see(Pose2(3.0, 5.0), scan_of([1.0]), 0)
    local = Costmap(layer.grid, Inflation(1.0, 0.455, 3.0), obstacles=layer.costs)
    costs = both(whole, local)
    for x, y in ((4.0, 5.0), (6.75, 5.1)):
        assert costs[whole.grid.cell(x, y)] >= INSCRIBED
    assert costs[whole.grid.cell(1.5, 8.5)] == FREE


@pytest.mark.requirement(37, 38)
@pytest.mark.parametrize("corner", [(-2.0, -2.0), (4.0, 1.0), (2.0, 3.0), (9.0, 9.0), (-9.0, 0.0)])
def test_a_window_over_the_edge_of_the_map_counts_within_it(corner):
    whole = Costmap(Grid(0.5, 10, 12, 1.0, -1.0), Inflation(0.0, 0.0))
    window = Grid(0.5, 6, 6, *corner)
    marks = np.full((6, 6), FREE, np.uint8)
    marks[0, 0] = marks[3, 4] = LETHAL
    costs = both(whole, Costmap(window, Inflation(0.0, 0.0), obstacles=marks))
    for row, column in np.ndindex(10, 12):
        at = window.cell(*whole.grid.center(row, column))
        assert costs[row, column] == (FREE if at is None else marks[at])
    assert not whole.costs.any()


def test_the_user_costs_what_the_distance_says_without_any_cells():
    costmap = Costmap(Grid(1.0, 10, 10), Inflation(1.0, 0.455, 3.0))
    user = Disc(5.0, 5.0, 0.5)
    assert costmap.cost(5.2, 5.0, user) == LETHAL
    assert costmap.cost(5.9, 5.0, user) == INSCRIBED
    assert costmap.cost(6.49, 5.0, user) > FREE
    assert costmap.cost(6.51, 5.0, user) == FREE
    assert costmap.cost(5.2, 5.0) == FREE


def test_places_outside_the_map_are_unknown():
    costmap = Costmap(Grid(1.0, 10, 10), Inflation())
    assert costmap.cost(-1.0, 5.0) == NO_INFORMATION
    assert costmap.cost(math.nan, 5.0) == NO_INFORMATION


def test_keepouts_are_lethal_and_not_inflated():
    costmap = Costmap(Grid(0.5, 8, 8), Inflation(1.0), keepouts=(SQUARE,))
    assert costmap.cost(1.5, 1.5) == LETHAL
    assert costmap.cost(2.25, 1.5) == FREE


def test_the_slowest_of_all_speed_zones_counts():
    zones = (SpeedZone(SQUARE, 0.8), SpeedZone(((0, 0), (4, 0), (4, 1.5), (0, 1.5)), 0.5))
    costmap = Costmap(Grid(0.5, 8, 8), Inflation(), speed_zones=zones)
    assert costmap.speed_limit(1.5, 1.2) == 0.5
    assert costmap.speed_limit(1.5, 1.8) == 0.8
    assert costmap.speed_limit(3.0, 3.0) == math.inf


def test_a_turned_map_is_put_into_the_costmaps_cells():
    map_ = map_of([[100, 0, 0]], 1.0, Pose2(1.0, 0.0, math.pi / 2))
    costmap = Costmap(Grid(1.0, 3, 1), Inflation(0.0, 0.0), static=map_)
    assert costmap.costs[:, 0].tolist() == [LETHAL, FREE, FREE]
