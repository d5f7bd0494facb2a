"""Benchmark of navigation: run time against error of every global planner, and decisions.

Paths are compared with the shortest ones. Those of `exact` are compared with a visibility graph
over inflated outlines, which shares no code with the planner; its paths are shorter by up to
0.01 %, because its round corners are polygons. Maps are converted to polygons, so that all planners
have the same floor. Of the planners on cells `theta_star` is led by a heuristic, the distance as
the crow flies; `navfn` by none. Peers (`path_peers`) search the same cells.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy import ndimage, sparse

from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed
from cobodeck.bench.navigation import decisions
from cobodeck.bench.navigation.path_peers import PATH_PEERS
from cobodeck.terminal import complain
from hw import Pose2, compile_examples
from hw.scene import Point, load_scene
from states.maps import FREE, OCCUPIED, Grid, OccupancyMap, load_map
from states.navigation import GLOBAL_PLANNERS
from states.navigation.exact import visibility
from states.navigation.grid import (
    Costmap,
    Costs,
    Inflation,
    NavfnPlanner,
    StaticLayer,
    ThetaStarPlanner,
)

NAME = "navigation"
ROOMS = ("lab_a", "lab_b", "hall")
MAPS = {"ipa-kitchen": 0.35, "lse_arena": 0.3}
"""Real maps, and the distance kept from their walls, m."""
MAP_FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data" / "maps"
INFLATION = 0.77
RESOLUTIONS = (0.2, 0.1, 0.05, 0.025)
CELL_PLANNERS = {"theta_star": ThetaStarPlanner, "navfn": NavfnPlanner}
QUERIES = 40
SHORTEST = 1.0
"""Least distance of start and goal, m: relative errors of short paths mean little."""
SEED = 3

Ring = Sequence[Point]
PathEnds = tuple[Point, Point]


@dataclass(frozen=True, slots=True)
class BenchFloor:
    """A floor: outer ring, obstacle rings, and the distance `inflation` to keep from both, m.

    `map` is the same floor as cells, None for a drawn room.
    """

    name: str
    outer: Ring
    obstacles: tuple[Ring, ...]
    inflation: float
    map: OccupancyMap | None = None

    def planner(self, name: str, resolution: float | None = None) -> Any:
        """A global planner for this floor; with `resolution`, m, on cells of this size."""
        make = GLOBAL_PLANNERS[name]
        if resolution is None:
            return make(self.outer, self.obstacles, inflation_radius=self.inflation)
        if self.map is not None:
            return CELL_PLANNERS[name](*_cells(self, resolution), allow_unknown=False)
        kept = {"inflation_radius": self.inflation, "resolution": resolution}
        return make(self.outer, self.obstacles, **kept)


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """All rows of the benchmark."""
    compile_examples((visibility,))
    for floor in floors():
        yield from path_rows(floor, rounds=rounds)
    yield from decisions.rows(rounds)


def floors() -> Iterator[BenchFloor]:
    """The rooms, and the maps that are present."""
    for name in ROOMS:
        room = load_scene(name).room
        yield BenchFloor(name, room.outer, room.obstacles, INFLATION)
    for name, inflation in MAPS.items():
        file = MAP_FOLDER / f"{name}.yaml"
        if file.exists():
            yield map_floor(name, load_map(file), inflation)
        else:
            complain(f"bench {NAME}: no map {file}; left out")


def map_floor(name: str, map_: OccupancyMap, inflation: float) -> BenchFloor:
    """The largest free area of a map, merged into polygons; everything else is occupied."""
    pieces, _ = ndimage.label(map_.values == FREE)
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    free = np.pad(pieces == sizes.argmax(), 2)
    row, column = np.nonzero(free)
    size = map_.resolution
    cells = shapely.box(column * size, row * size, (column + 1) * size, (row + 1) * size)
    outline = shapely.simplify(shapely.unary_union(cells), 0.0)
    outer, *holes = (list(ring.coords)[:-1] for ring in (outline.exterior, *outline.interiors))
    return BenchFloor(name, outer, tuple(holes), inflation, _as_map(free, size))


def _as_map(free: Any, resolution: float) -> OccupancyMap:
    values = np.where(free, FREE, OCCUPIED).astype(np.int16)
    return OccupancyMap(values, resolution, Pose2(0.0, 0.0))


def _cells(floor: BenchFloor, resolution: float) -> tuple[Grid, Costs]:
    """The map's cells merged or split to a resolution, m; merged ones are free if all parts are."""
    assert floor.map is not None
    free = floor.map.values == FREE
    join = max(1, round(resolution / floor.map.resolution))
    split = max(1, round(floor.map.resolution / resolution))
    free = np.pad(free, [(0, -length % join) for length in free.shape])
    free = free.reshape(len(free) // join, join, -1, join).all(axis=(1, 3))
    free = free.repeat(split, axis=0).repeat(split, axis=1)
    grid = Grid(resolution, *free.shape)
    inflation = Inflation(floor.inflation, floor.inflation)
    return grid, Costmap(StaticLayer.of(_as_map(free, resolution), grid), inflation).costs


# paths


def path_rows(
    floor: BenchFloor,
    resolutions: Iterable[float] = RESOLUTIONS,
    queries: int = QUERIES,
    rounds: int = ROUNDS,
) -> Iterator[BenchRow]:
    """For every planner: mean time of a query, mean and largest excess length."""
    exact = floor.planner("exact")
    own = [("exact", None, exact)] + [
        (name, resolution, floor.planner(name, resolution))
        for name in GLOBAL_PLANNERS
        if name != "exact"
        for resolution in resolutions
    ]
    asked = answered([planner for _, _, planner in own], floor, queries)
    points, worst = [], []
    shortest = [exact.plan(*query).length for query in asked]
    for name, resolution, planner in own:
        over = _reference_excess(floor, asked, shortest)
        if name != "exact":
            lengths = (planner.plan(*query).length for query in asked)
            over = [own / least - 1.0 for own, least in zip(lengths, shortest, strict=True)]
        row = _path_row(floor, name, resolution, over)
        points.append((row, _asking(planner, asked)))
        if over:
            worst.append(_worst_row(row, over))
    if floor.name == ROOMS[0]:
        points += list(_peer_points(floor, resolutions, asked, shortest))
    yield from timed(points, rounds)
    yield from worst


def _reference_excess(
    floor: BenchFloor, asked: Sequence[PathEnds], shortest: Sequence[float]
) -> list[float]:
    """By how much `exact` differs from the reference; of cells there is none: too many corners."""
    if floor.map is not None:
        return []
    reference = outline_lengths(floor, asked)
    return [abs(own / least - 1.0) for own, least in zip(shortest, reference, strict=True)]


def _peer_points(
    floor: BenchFloor,
    resolutions: Iterable[float],
    asked: Sequence[PathEnds],
    shortest: Sequence[float],
) -> Iterator[TimedPoint]:
    for name, (make, finest) in PATH_PEERS.items():
        for resolution in resolutions:
            if resolution < finest:
                continue
            planner = floor.planner("theta_star", resolution)
            length = make(planner.costs < planner.lethal_cost, planner.grid)
            lengths = (length(*query) for query in asked)
            over = [own / least - 1.0 for own, least in zip(lengths, shortest, strict=True)]
            row = _path_row(floor, name, resolution, over)
            work = Work(partial(_ask_all, length, asked), items=len(asked))
            yield replace(row, peer=True, goal=None), work


def _asking(planner: Any, asked: Sequence[PathEnds]) -> Work:
    return Work(partial(_ask_all, planner.plan, asked), items=len(asked))


def _ask_all(plan: Callable[..., Any], asked: Sequence[PathEnds], count: int) -> None:
    for _ in range(count):
        for query in asked:
            plan(*query)


def _path_row(
    floor: BenchFloor, name: str, resolution: float | None, over: Sequence[float]
) -> BenchRow:
    return BenchRow(
        NAME,
        f"paths in {floor.name}",
        name,
        knob=None if resolution is None else "resolution",
        value=resolution,
        error=round(100.0 * statistics.fmean(over), 4) if over else None,
        error_unit="% longer, mean" if over else None,
        reference=_reference(name, over),
        goal=_goal(name, resolution) if over else None,
        default=name == "exact",
    )


def _reference(name: str, over: Sequence[float]) -> str:
    if name != "exact":
        return "exact"
    return "visibility graph of outlines, within 0.01 %" if over else "is the reference"


def _worst_row(row: BenchRow, over: Sequence[float]) -> BenchRow:
    worst = round(100.0 * max(over), 3)
    name = f"{row.name}, worst"
    return replace(
        row, name=name, error=worst, error_unit="% longer, worst", goal=None, default=False
    )


def _goal(name: str, resolution: float | None) -> float | None:
    if name == "exact":
        return 0.01
    return 1.0 if (name, resolution) == ("theta_star", 0.05) else None


def answered(planners: Sequence[Any], floor: BenchFloor, count: int) -> list[PathEnds]:
    """Starts and goals, m, from a fixed seed, between which every planner finds a path."""
    rng = np.random.default_rng(SEED)
    low, high = np.min(floor.outer, axis=0), np.max(floor.outer, axis=0)
    found: list[PathEnds] = []
    for _ in range(1000 * count):
        start, goal = ((float(x), float(y)) for x, y in rng.uniform(low, high, (2, 2)))
        free = (planner.is_free(place) for planner in planners for place in (start, goal))
        if math.dist(start, goal) < SHORTEST or not all(free):
            continue
        if all(planner.plan(start, goal) is not None for planner in planners):
            found.append((start, goal))
        if len(found) == count:
            break
    return found


def outline_lengths(floor: BenchFloor, queries: Sequence[PathEnds]) -> list[float]:
    """Lengths of shortest paths by a visibility graph over inflated outlines, m."""
    walls = shapely.union_all([shapely.Polygon(ring) for ring in floor.obstacles])
    free = shapely.Polygon(floor.outer).difference(walls).buffer(-floor.inflation, quad_segs=32)
    corners = np.concatenate(
        [
            bends
            for part in shapely.get_parts(free)
            for bends in (_bends(part.exterior, -1.0), *(_bends(r, 1.0) for r in part.interiors))
        ]
    )
    nodes = np.concatenate([corners, *np.array(queries)])
    first, last = np.triu_indices(len(nodes), 1)
    lines = shapely.linestrings(np.stack([nodes[first], nodes[last]], axis=1))
    room = free.buffer(1e-6)
    shapely.prepare(room)
    seen = shapely.covers(room, lines)
    edges = shapely.length(lines[seen]), (first[seen], last[seen])
    graph = sparse.coo_array(edges, shape=(len(nodes), len(nodes))).tocsr()
    starts = len(corners) + 2 * np.arange(len(queries))
    found = sparse.csgraph.dijkstra(graph, directed=False, indices=starts)
    return [float(found[i, start + 1]) for i, start in enumerate(starts)]


def _bends(ring: Any, sense: float) -> Any:
    """The corners of a ring, taken counter-clockwise, that turn left (sense 1) or right (-1)."""
    points = np.array(ring.coords)[:-1]
    if not ring.is_ccw:
        points = points[::-1]
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return points[sense * turn > 0.0]
