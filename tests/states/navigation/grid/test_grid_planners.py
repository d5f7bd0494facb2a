import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings, strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.scene.room import Disc
from states.maps.cells import Grid
from states.navigation.exact.visibility import ExactPlanner
from states.navigation.grid.grid_planners import NavfnPlanner, ThetaStarPlanner
from states.navigation.grid.inflation import LETHAL, NO_INFORMATION
from states.navigation.grid.navfn import crossing_costs, potential_from
from states.navigation.grid.theta_star import line_is_free
from states.navigation.planner_interfaces import Limits, Tolerance
from states.navigation.planners import GLOBAL_PLANNERS, LOCAL_PLANNERS
from tests.repeats import examples

OUTER = ((0.0, 0.0), (11.5, 0.0), (11.5, 10.1), (0.0, 10.1))
OBSTACLES = (
    ((6.65, 0.0), (6.85, 0.0), (6.85, 2.58), (6.65, 2.58)),
    ((6.65, 7.72), (6.85, 7.72), (6.85, 10.1), (6.65, 10.1)),
    ((6.6, 4.9), (6.9, 4.9), (6.9, 5.4), (6.6, 5.4)),
)
LAB = {
    name: make(OUTER, OBSTACLES, inflation_radius=0.77) for name, make in GLOBAL_PLANNERS.items()
}
USER = Disc(3.5, 5.0, 1.27)
names = pytest.mark.parametrize("name", list(GLOBAL_PLANNERS))
on_grids = pytest.mark.parametrize("planner", [ThetaStarPlanner, NavfnPlanner])

worlds = hnp.arrays(np.bool_, (12, 14), elements=st.sampled_from([True, True, True, False]))
spots = st.tuples(st.floats(0.01, 13.99), st.floats(0.01, 11.99))


def costs_of(free):
    return np.where(free, 0, LETHAL).astype(np.uint8)


def bordered(free):
    inner = free.copy()
    inner[[0, -1], :] = inner[:, [0, -1]] = False
    return inner


def cells_on(start, end):
    """Cells that a line passes through the inside of, by dense sampling."""
    steps = np.linspace(0.0, 1.0, 4001)
    xs = start[0] + steps * (end[0] - start[0])
    ys = start[1] + steps * (end[1] - start[1])
    off_edges = (np.abs(xs - np.rint(xs)) > 1e-6) & (np.abs(ys - np.rint(ys)) > 1e-6)
    return np.floor(ys[off_edges]).astype(int), np.floor(xs[off_edges]).astype(int)


def eight_neighbour_lengths(free, start):
    """scipy's Dijkstra over cell centres; diagonals only between two free cells."""
    rows, columns = free.shape
    node = np.arange(rows * columns).reshape(rows, columns)
    heads, tails, weights = [], [], []
    for row, column in np.argwhere(free):
        for up, across in ((0, 1), (1, 0), (1, 1), (1, -1)):
            r, c = row + up, column + across
            if (
                0 <= r < rows
                and 0 <= c < columns
                and free[r, c]
                and free[row, c]
                and free[r, column]
            ):
                heads.append(node[row, column])
                tails.append(node[r, c])
                weights.append(math.hypot(up, across))
    graph = coo_array((weights, (heads, tails)), shape=(node.size, node.size))
    lengths = dijkstra(graph.tocsr(), directed=False, indices=node[start])
    return lengths.reshape(rows, columns)


# lines


@settings(deadline=None, max_examples=examples(300))
@given(free=worlds, start=spots, end=spots)
def test_a_line_is_free_where_all_cells_it_passes_are(free, start, end):
    rows, columns = cells_on(start, end)
    assume(len(rows) > 3000)
    assert line_is_free(free, *start, *end) <= bool(free[rows, columns].all())
    free[rows, columns] = True
    free[[int(start[1]), int(end[1])], [int(start[0]), int(end[0])]] = True
    xs, ys = np.array([start[0], end[0]]), np.array([start[1], end[1]])
    if np.abs(xs - np.rint(xs)).min() > 1e-3 and np.abs(ys - np.rint(ys)).min() > 1e-3:
        sampled_all = np.abs(np.diff(rows)).max(initial=0) + np.abs(np.diff(columns)).max(initial=0)
        assert sampled_all > 1 or line_is_free(free, *start, *end)


def test_a_line_may_touch_the_corner_between_two_blocked_cells_only_from_free_ones():
    free = np.array([[True, False], [False, True]])
    assert line_is_free(free, 0.5, 0.5, 1.5, 1.5)
    assert not line_is_free(free, 0.5, 0.5, 1.5, 0.5)
    assert not line_is_free(free, 0.5, 0.5, 2.5, 0.5)


def cells_entered(start, end, shape):
    """Cells inside of which a line runs some way: its shares within each column and each row."""
    (x, y), (dx, dy) = start, (end[0] - start[0], end[1] - start[1])
    columns, rows = (np.arange(count)[:, None] + (0.0, 1.0) for count in (shape[1], shape[0]))
    across, up = np.sort((columns - x) / dx, axis=1), np.sort((rows - y) / dy, axis=1)
    first = np.maximum(np.maximum(across[None, :, 0], up[:, None, 0]), 0.0)
    last = np.minimum(np.minimum(across[None, :, 1], up[:, None, 1]), 1.0)
    return first < last


@pytest.mark.parametrize("blocked", [0.02, 0.1])
def test_a_line_is_free_if_and_only_if_all_cells_that_it_enters_are(blocked):
    rng, found = np.random.default_rng(3), []
    for _ in range(200):
        free = rng.random((12, 14)) >= blocked
        start, end = (rng.uniform((0.0, 0.0), (14.0, 12.0)).tolist() for _ in range(2))
        found.append(bool(free[cells_entered(start, end, free.shape)].all()))
        assert line_is_free(free, *start, *end) == found[-1]
    assert 20 < sum(found) < 180


# theta_star


@pytest.mark.requirement(39)
@pytest.mark.parametrize("seed", range(10))
def test_among_many_blocked_cells_theta_star_finds_what_eight_neighbours_connect(seed):
    rng = np.random.default_rng(seed)
    free = rng.random((12, 14)) >= 0.4
    free[6, 7] = True
    planner, lengths = (
        ThetaStarPlanner(Grid(1.0, 12, 14), costs_of(free)),
        eight_neighbour_lengths(free, (6, 7)),
    )
    for row, column in np.argwhere(free)[::5].tolist():
        path = planner.plan((7.5, 6.5), (column + 0.5, row + 0.5))
        assert (path is not None) == bool(np.isfinite(lengths[row, column]))
        if path is not None:
            assert path.length <= lengths[row, column] + 1e-9


@pytest.mark.requirement(39)
@settings(deadline=None, max_examples=examples(200))
@given(free=worlds, start=spots, goal=spots)
def test_theta_star_finds_what_there_is_and_never_more_than_eight_neighbours_need(
    free, start, goal
):
    first, last = (int(start[1]), int(start[0])), (int(goal[1]), int(goal[0]))
    assume(free[first] and free[last])
    planner = ThetaStarPlanner(Grid(1.0, 12, 14), costs_of(free))
    path = planner.plan(start, goal)
    lengths = eight_neighbour_lengths(free, first)
    assert (path is not None) == np.isfinite(lengths[last])
    if path is None:
        return
    assert path.points[0] == start
    assert path.points[-1] == goal
    for a, b in zip(path.points, path.points[1:], strict=False):
        rows, columns = cells_on(a, b)
        assert free[rows, columns].all()
    assert path.length >= math.dist(start, goal) - 1e-9
    assert path.length <= lengths[last] + 2.0 * math.sqrt(2.0) + 1e-9


# navfn


@settings(deadline=None, max_examples=60)
@given(costs=hnp.arrays(np.uint8, (9, 11), elements=st.integers(0, 254)), allow=st.booleans())
def test_the_potential_fulfils_the_published_equations_everywhere(costs, allow):
    costs[3, 3] = costs[6, 8] = 0
    crossing = crossing_costs(costs, 253, allow)
    potential = potential_from(crossing, (3, 3), (-1, -1))
    areas, _ = label(np.isfinite(crossing))
    assert np.array_equal(np.isfinite(potential), areas == areas[3, 3])
    padded = np.pad(potential, 1, constant_values=math.inf)
    for row, column in np.argwhere(np.isfinite(potential)):
        if (row, column) == (3, 3):
            assert potential[3, 3] == 0.0
            continue
        r, c = row + 1, column + 1
        low, high = sorted(
            (min(padded[r, c - 1], padded[r, c + 1]), min(padded[r - 1, c], padded[r + 1, c]))
        )
        cost = min(3.0 * costs[row, column] + 50.0, 252.0)
        part = (high - low) / cost
        more = 1.0 if part >= 1.0 else -0.2301 * part**2 + 0.5307 * part + 0.7040
        # the parabola is 0.46 % above the plane wave where they meet; the lower of both is kept
        assert -1e-9 <= low + cost * more - potential[row, column] <= 0.0047 * cost


@pytest.mark.parametrize(("cost", "lethal", "allow", "crossing"), [
    (0, 253, True, 50.0),
    (67, 253, True, 251.0),
    (68, 253, True, 252.0),
    (251, 253, True, 252.0),
    (252, 253, True, math.inf),
    (255, 253, True, 252.0),
    (255, 253, False, math.inf),
])  # fmt: skip
def test_crossing_costs_saturate_as_in_global_planner(cost, lethal, allow, crossing):
    costs = np.full((3, 3), cost, np.uint8)
    assert crossing_costs(costs, lethal, allow)[1, 1] == crossing
    assert crossing_costs(costs, lethal, allow)[0, 1] == math.inf


@settings(deadline=None, max_examples=examples(150))
@given(free=worlds, picks=st.tuples(st.integers(0, 167), st.integers(0, 167)))
def test_navfn_finds_a_way_wherever_four_neighbours_lead(free, picks):
    inside = bordered(free)
    cells = [tuple(cell) for cell in np.argwhere(inside).tolist()]
    assume(cells)
    first, last = (cells[pick % len(cells)] for pick in picks)
    start, goal = ((column + 0.3, row + 0.6) for row, column in (first, last))
    path = NavfnPlanner(Grid(1.0, 12, 14), costs_of(free)).plan(start, goal)
    areas, _ = label(inside)
    assert (path is not None) == (areas[first] == areas[last])
    if path is not None:
        assert all(inside[int(y), int(x)] for x, y in path.points)


def test_navfn_keeps_away_from_what_costs():
    costs = np.zeros((21, 41), np.uint8)
    costs[8:13, 10:31] = 60
    planner = NavfnPlanner(Grid(1.0, 21, 41), costs)
    path = planner.plan((2.5, 10.5), (38.5, 10.5))
    straight = ThetaStarPlanner(Grid(1.0, 21, 41), costs).plan((2.5, 10.5), (38.5, 10.5))
    assert max(abs(y - 10.5) for _, y in path.points) > 2.0
    assert straight.length == 36.0


@on_grids
def test_unknown_cells_are_passed_only_if_that_is_allowed(planner):
    costs = np.zeros((9, 21), np.uint8)
    costs[:, 10] = NO_INFORMATION
    grid = Grid(1.0, 9, 21)
    assert planner(grid, costs).plan((2.5, 4.5), (18.5, 4.5)) is not None
    assert planner(grid, costs, allow_unknown=False).plan((2.5, 4.5), (18.5, 4.5)) is None


# all planners, by name


def random_queries(count):
    rng = np.random.default_rng(7)
    found = []
    while len(found) < count:
        a, b = (tuple(map(float, rng.uniform((0, 0), (11.5, 10.1)))) for _ in range(2))
        if all(p.is_free(a) and p.is_free(b) for p in LAB.values()):
            found.append((a, b))
    return found


@pytest.mark.requirement(34, 39)
@pytest.mark.parametrize(
    ("name", "mean", "worst"), [("theta_star", 0.01, 0.03), ("navfn", 0.03, 0.15)]
)
def test_ways_on_five_centimetre_cells_are_little_longer_than_the_shortest(name, mean, worst):
    exact = LAB["exact"]
    over = []
    for start, goal in random_queries(60):
        shortest = exact.plan(start, goal).length
        over.append(LAB[name].plan(start, goal).length / max(shortest, 0.5) - 1.0)
    assert np.mean(over) <= mean
    assert max(over) <= worst


@pytest.mark.requirement(34)
@names
def test_no_way_leads_through_an_inflation_or_the_user(name):
    bare = ExactPlanner(OUTER, OBSTACLES, inflation_radius=0.77)
    for start, goal in random_queries(30):
        path = LAB[name].plan(start, goal, USER)
        if path is None:
            continue
        for a, b in zip(path.points, path.points[1:], strict=False):
            for part in np.linspace(0.0, 1.0, 20):
                x, y = a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])
                if path.points[0] == a and not LAB[name].is_free(a, USER):
                    continue
                assert bare.clearance((x, y)) >= 0.77 - 0.05
                assert math.dist((x, y), (USER.x, USER.y)) >= USER.radius - 0.05


@names
def test_start_at_the_goal_is_a_short_way(name):
    path = LAB[name].plan((3.0, 3.0), (3.0, 3.0))
    assert path.length == 0.0
    assert path.points[0] == path.points[-1] == (3.0, 3.0)


@names
@pytest.mark.parametrize("goal", [(6.75, 5.1), (50.0, 5.0), (math.nan, 1.0), (1.0, -math.inf)])
def test_a_goal_that_is_not_free_has_no_way(name, goal):
    assert LAB[name].plan((3.0, 3.0), goal) is None


@names
@pytest.mark.parametrize("start", [(math.nan, 1.0), (math.inf, 5.0)])
def test_a_start_that_is_no_place_has_no_way(name, start):
    assert LAB[name].plan(start, (3.0, 3.0)) is None


@names
def test_a_start_inside_an_inflation_is_left_away_from_the_wall(name):
    path = LAB[name].plan((0.3, 5.0), (3.0, 2.0))
    assert path.points[0] == (0.3, 5.0)
    assert path.points[1] == pytest.approx((0.77, 5.0), abs=0.06)


@names
@pytest.mark.parametrize(("side", "below"), [(1, True), (-1, False)])
def test_either_way_round_the_user_can_be_asked_for(name, side, below):
    path = LAB[name].plan((1.5, 5.0), (5.5, 5.1), USER, side)
    assert all((y < USER.y) == below for x, y in path.points if abs(x - USER.x) < 0.5)


@names
@pytest.mark.parametrize("local", list(LOCAL_PLANNERS))
@pytest.mark.few(2)
def test_the_robot_drives_to_its_goal_whichever_planners_it_has(name, local):
    walls = {"walls": (OUTER, *OBSTACLES), "wall_distance": 0.77} if local == "teb" else {}
    driver = LOCAL_PLANNERS[local](LAB[name], Limits(), Tolerance(), **walls)
    driver.go_to(Pose2(9.0, 2.0, 1.0))
    pose, velocity, nearest = Pose2(2.0, 4.9), STILL, math.inf
    for _ in range(500):
        command = driver.command(pose, velocity.rotated(-pose.yaw), USER, 0.05)
        following = command.rotated(pose.yaw + 0.5 * command.wz * 0.05)
        mean = Twist2(0.5 * (velocity.vx + following.vx), 0.5 * (velocity.vy + following.vy))
        yaw = wrap(pose.yaw + following.wz * 0.05)
        pose, velocity = Pose2(pose.x + mean.vx * 0.05, pose.y + mean.vy * 0.05, yaw), following
        nearest = min(nearest, math.dist((pose.x, pose.y), (USER.x, USER.y)))
        if driver.status == "arrived":
            break
    assert driver.status == "arrived"
    assert nearest >= USER.radius - 1e-6


@settings(deadline=None, max_examples=examples(150))
@given(worlds, spots, st.tuples(st.floats(0, 14), st.floats(0, 12), st.floats(0, 3)))
def test_the_nearest_free_cell_is_the_nearest_of_all_in_sight(free, place, user):
    planner = ThetaStarPlanner(Grid(1.0, *free.shape), costs_of(free), lethal_cost=LETHAL)
    disc = Disc(*user)
    found = planner.nearest_free(place, disc)
    at = (int(place[1]), int(place[0]))
    passable = free if free[at] else np.ones_like(free)
    reach = min(disc.radius, math.dist(place, user[:2])) - 1e-6
    seen = []
    for row, column in np.argwhere(free):
        cell = (column + 0.5, row + 0.5)
        line = shapely.LineString((place, cell))
        if math.dist(cell, user[:2]) < disc.radius:
            continue
        if line.distance(shapely.Point(user[:2])) >= reach and line_is_free(
            passable, *place, *cell
        ):
            seen.append(math.dist(place, cell))
    if not seen:
        assert found is None or math.dist(found, user[:2]) >= disc.radius
    else:
        assert found is not None
        assert math.dist(found, place) <= min(seen) + 1e-9
        assert free[int(found[1]), int(found[0])]


@on_grids
def test_clearance_is_that_of_the_polygons_within_a_cell(planner):
    exact, grid = LAB["exact"], planner.in_room(OUTER, OBSTACLES, inflation_radius=0.77)
    rng = np.random.default_rng(5)
    places = rng.uniform((0.3, 0.3), (11.2, 9.8), (300, 2)).tolist()
    free = [place for place in places if exact.clearance(place) > 0.2 and exact.is_free(place)]
    assert len(free) > 100
    for place in free:
        assert grid.clearance(place) == pytest.approx(exact.clearance(place), abs=0.05)
    assert grid.clearance((50.0, 1.0)) == 0.0


def test_many_places_are_free_as_each_is():
    planner = LAB["theta_star"]
    places = np.random.default_rng(6).uniform(-1.0, 12.0, (500, 2))
    places[0] = math.nan
    expected = [planner.is_free((x, y)) for x, y in places.tolist()]
    assert planner.are_free(places).tolist() == expected
    assert any(expected)


@pytest.mark.requirement(51)
@pytest.mark.parametrize("name", ["theta_star", "navfn"])
def test_who_is_too_near_to_something_may_go_along_and_away_but_no_nearer(name):
    outer = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
    post = ((3.9, 3.9), (4.1, 3.9), (4.1, 4.1), (3.9, 4.1))
    planner = GLOBAL_PLANNERS[name](outer, (post,), inflation_radius=1.0)
    here = (3.4, 4.0)
    assert not planner.is_free(here)
    for angle in np.arange(-180, 180, 15):
        there = (here[0] + 0.2 * math.cos(math.radians(angle)),
                 here[1] + 0.2 * math.sin(math.radians(angle)))  # fmt: skip
        away = planner.clearance(there) - planner.clearance(here)
        assert planner.allows(here, there) == (away >= -1e-6)
    assert not planner.allows(here, (4.6, 4.0))  # through it to a place as far on the other side
    assert planner.allows(here, (3.39, 4.0), slack=0.0)
    assert planner.allows(here, (3.41, 4.0), slack=0.02)
