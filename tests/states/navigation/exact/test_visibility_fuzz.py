"""Random worlds against an oracle of shapely polygons and scipy's Dijkstra.

Shapely's buffers have inscribed corners: the world inflated by r is a little too small, inflated
by OUTER_SCALE * r a little too large. The shortest ways in both enclose the true one.
"""

import math
from dataclasses import dataclass

import numpy as np
import pytest
import shapely
from scipy.sparse.csgraph import dijkstra
from shapely.geometry import Point, Polygon
from shapely.ops import nearest_points, unary_union

from hw.scene.room import Disc
from states.navigation.exact.visibility import ExactPlanner
from tests.repeats import fewer

QUAD_SEGS = 8
OUTER_SCALE = 1.0 / math.cos(2.0 * math.pi / (4 * QUAD_SEGS))  # GEOS drops corners of arcs
QUERIES = 40


@dataclass
class FuzzWorld:
    outer: Polygon
    boxes: list
    radius: float
    user: Disc | None

    def region(self, scale, grow=0.0):
        """Free space for the centre, shapely; scale > 1 is on the safe side."""
        reach = self.radius * scale + grow
        walls = unary_union([*self.boxes, self.outer.exterior])
        taken = walls.buffer(reach, quad_segs=QUAD_SEGS)
        if self.user:
            disc = Point(self.user.x, self.user.y)
            taken = taken.union(disc.buffer(self.user.radius * scale + grow, quad_segs=16))
        return self.outer.difference(taken)


def ring(polygon):
    return [(float(x), float(y)) for x, y in polygon.exterior.coords[:-1]]


def random_world(rng):
    width, height = rng.uniform(6, 12, 2)
    outer = shapely.box(0, 0, width, height)
    if rng.random() < 0.3:
        corner = shapely.box(0, 0, width * 0.4, height * 0.4)
        outer = outer.difference(corner)
    boxes = []
    for _ in range(rng.integers(1, 7)):
        x, y = rng.uniform(0, width), rng.uniform(0, height)
        size_x, size_y = rng.uniform(0.1, 2.5, 2)
        box = shapely.box(x, y, x + size_x, y + size_y)
        kind = rng.random()
        if kind < 0.4:
            box = shapely.affinity.rotate(box, rng.uniform(0, 90))
        elif kind < 0.7 and boxes:  # share a corner or a side with an earlier one
            other = ring(boxes[-1])[rng.integers(4)]
            box = shapely.box(*other, other[0] + size_x, other[1] + size_y)
        boxes.append(box)
    radius = float(rng.choice([0.0, 0.1, 0.25, 0.5, 0.77, 1.0]))
    user = None
    if rng.random() < 0.5:
        place = rng.uniform(0, width), rng.uniform(0, height)
        user = Disc(*map(float, place), float(rng.choice([0.5, 1.27])))
    return FuzzWorld(outer, boxes, max(radius, 1e-3), user)


def random_places(rng, world, region, count):
    """Places in the region, some exactly on its corners and edges."""
    low_x, low_y, high_x, high_y = region.bounds
    corners = shapely.get_coordinates(region)
    places = []
    while len(places) < count:
        kind = rng.random()
        if kind < 0.15:
            place = corners[rng.integers(len(corners))]
        elif kind < 0.3:
            line = region.boundary
            spot = line.interpolate(rng.uniform(0, line.length))
            place = nearest_points(region, spot)[0].coords[0]
        else:
            place = rng.uniform(low_x, high_x), rng.uniform(low_y, high_y)
            if not region.contains(Point(place)):
                continue
        places.append((float(place[0]), float(place[1])))
    return places


def shortest_lengths(region, starts, goals):
    """All lengths start i to goal i in a polygonal region, by all-pairs visibility."""
    if region.is_empty:
        return np.full(len(starts), math.inf)
    points = np.concatenate([shapely.get_coordinates(region), starts, goals])
    points, index = np.unique(points, axis=0, return_inverse=True)
    first, second = np.triu_indices(len(points), 1)
    lines = shapely.linestrings(np.stack([points[first], points[second]], axis=1))
    loose = region.buffer(2e-6, quad_segs=1, join_style="mitre")
    shapely.prepare(loose)
    visible = shapely.covers(loose, lines)
    graph = np.full((len(points), len(points)), np.inf)
    graph[first[visible], second[visible]] = shapely.length(lines[visible])
    graph[second, first] = graph[first, second]
    count = len(starts)
    start_index, goal_index = index.ravel()[-2 * count : -count], index.ravel()[-count:]
    unique, back = np.unique(start_index, return_inverse=True)
    lengths = dijkstra(np.where(np.isinf(graph), 0.0, graph), directed=False, indices=unique)
    return lengths[back.ravel(), goal_index]


def faults_of(world, rng):
    """Every way in which the planner's answers in one world are wrong."""
    inner, outer = world.region(OUTER_SCALE), world.region(1.0)
    if inner.is_empty or inner.area < 0.05:
        return []
    places = random_places(rng, world, inner, 2 * QUERIES)
    starts, goals = places[:QUERIES], places[QUERIES:]
    goals[0] = starts[0]
    upper = shortest_lengths(inner, starts, goals)
    lower = shortest_lengths(outer, starts, goals)
    planner = ExactPlanner(
        ring(world.outer), [ring(box) for box in world.boxes], inflation_radius=world.radius
    )
    walls = unary_union([*world.boxes, world.outer.exterior])
    faults = []
    for start, goal, most, least in zip(starts, goals, upper, lower, strict=True):
        path = planner.plan(start, goal, world.user)
        back = planner.plan(goal, start, world.user)
        faults += [
            (fault, start, goal, path and path.length, least, most)
            for fault in faults_of_path(world, walls, path, back, (start, goal, most, least))
        ]
    return faults


def faults_of_path(world, walls, path, back, query):
    start, goal, most, least = query
    if path is None or back is None:
        return ["no way found"] if math.isfinite(most) or path is not back else []
    line = shapely.LineString(path.points)
    user = Point(world.user.x, world.user.y) if world.user else None
    found = {
        "wrong ends": path.points[0] != start or path.points[-1] != goal,
        "through inflation": line.distance(walls) < world.radius - 2e-6,
        "outside": not world.outer.covers(line),
        "through the user": user and line.distance(user) < world.user.radius - 2e-6,
        "too short": path.length < least - 1e-5 or not math.isfinite(least),
        "too long": path.length > most + 1e-5,
        "not as long as its line": not 0.0 <= line.length - path.length + 1e-9 <= 0.01,
        "longer in one direction": abs(path.length - back.length) > 1e-6,
    }
    return [fault for fault, happened in found.items() if happened]


def assert_no_faults(seeds):
    for seed in seeds:
        rng = np.random.default_rng(seed)
        assert faults_of(random_world(rng), rng) == [], f"world {seed}"


@pytest.mark.requirement(34, 39)
def test_ways_in_random_worlds_are_free_and_the_shortest():
    assert_no_faults(range(12))


@pytest.mark.slow
@pytest.mark.requirement(34, 39)
def test_48_000_ways_in_1_200_random_worlds_are_free_and_the_shortest():
    assert_no_faults(fewer(range(1_200), of=12))
