"""The benchmark of ways and drives: its reference is right, its figures are those of the drives."""

import json
import math

import numpy as np
import pytest

from cobodeck.bench.navigation import navigation_bench as navigation
from cobodeck.bench.navigation.disturbed import CASES, WALKERS
from cobodeck.bench.navigation.drive_trials import TRIALS, slow_enough
from cobodeck.bench.navigation.drives import (
    disturbed_rows,
    period_rows,
    profile_rows,
    tolerance_rows,
)
from cobodeck.bench.navigation.navigation_bench import (
    MAP_FOLDER,
    BenchFloor,
    answered,
    map_floor,
    outline_lengths,
    path_rows,
)
from cobodeck.bench.navigation.path_peers import PATH_PEERS
from cobodeck.bench.table import RESULTS
from hw.geometry import Pose2
from states.maps.cells import Grid
from states.maps.occupancy import OccupancyMap

SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
PILLAR = ((3.5, 3.5), (4.5, 3.5), (4.5, 4.5), (3.5, 4.5))
FLOOR = BenchFloor("pillar", SQUARE, (PILLAR,), 0.5)


def around_the_pillar():
    """From (1, 4) to (7, 4) round two corners of the pillar, worked out with tangents and arcs."""
    to_corner = math.dist((1.0, 4.0), (3.5, 4.5))
    tangent = math.sqrt(to_corner**2 - 0.5**2)
    bend = math.atan2(0.5, 2.5) + math.asin(0.5 / to_corner)
    return 2.0 * tangent + 2.0 * 0.5 * bend + 1.0


def rows_of(floor, **how):
    return list(path_rows(floor, resolutions=(0.1,), queries=4, rounds=1, **how))


@pytest.mark.requirement(34)
def test_the_reference_is_the_way_round_the_pillar_worked_out_by_hand():
    (found,) = outline_lengths(FLOOR, [((1.0, 4.0), (7.0, 4.0))])
    assert found == pytest.approx(around_the_pillar(), rel=1e-4)
    assert found <= around_the_pillar()
    assert FLOOR.planner("exact").plan((1.0, 4.0), (7.0, 4.0)).length == pytest.approx(
        around_the_pillar(), rel=1e-9
    )


@pytest.mark.requirement(34, 39)
def test_every_planner_has_a_row_and_exact_is_the_shortest():
    rows = {(row.name, row.variant): row for row in rows_of(FLOOR)}
    assert {variant for _, variant in rows} == {"exact", "theta_star", "navfn"}
    exact = rows["paths in pillar", "exact"]
    assert exact.default
    assert exact.error <= 0.01
    for name in ("theta_star", "navfn"):
        row = rows["paths in pillar", name]
        assert (row.knob, row.value, row.reference) == ("resolution", 0.1, "exact")
        assert -1.0 < row.error <= rows["paths in pillar, worst", name].error < 20.0
        assert row.time_us > 0.0


def test_the_queries_are_free_far_enough_apart_and_the_same_every_time():
    planner = FLOOR.planner("exact")
    found = answered([planner], FLOOR, 10)
    assert found == answered([planner], FLOOR, 10)
    assert len(found) == 10
    for start, goal in found:
        assert planner.is_free(start)
        assert planner.is_free(goal)
        assert math.dist(start, goal) >= navigation.SHORTEST


def room_of_cells():
    """A map of 4 x 3 m with a wall of one cell and a loose corner that is not reached."""
    values = np.full((60, 80), 100, np.int16)
    values[2:58, 2:78] = 0
    values[20:58, 40] = 100
    values[0, 0] = 0
    return OccupancyMap(values, 0.05, Pose2(3.0, 1.0))


@pytest.mark.parametrize("resolution", [0.1, 0.05, 0.025])
@pytest.mark.parametrize("name", ["theta_star", "navfn"])
def test_a_map_is_the_same_place_as_polygons_and_as_cells(name, resolution):
    floor = map_floor("wall", room_of_cells(), 0.3)
    start, goal = (1.0, 2.5), (3.2, 2.5)
    shortest = floor.planner("exact").plan(start, goal).length
    assert shortest > 4.0  # round the end of the wall
    found = floor.planner(name, resolution).plan(start, goal).length
    assert shortest * 0.98 <= found <= shortest * 1.15


def test_a_thin_wall_of_a_map_is_not_lost_in_larger_cells():
    floor = map_floor("wall", room_of_cells(), 0.1)
    cells = floor.planner("theta_star", 0.1)
    wall = 0.1 + 40.5 * 0.05
    assert not any(cells.is_free((wall, 0.1 + y)) for y in np.arange(1.05, 2.8, 0.1))


@pytest.mark.requirement(34)
def test_a_straight_drive_takes_the_time_worked_out_by_hand():
    # 1 m at 1 m/s2 from rest: the peak is at 0.5 m without an end speed; 3 m at 1.5 m/s cruises
    assert slow_enough(1.0, 9.0, 1.0, 0.0) == pytest.approx(2.0)
    assert slow_enough(3.0, 1.5, 1.0, 0.0) == pytest.approx(3.5)
    assert slow_enough(2.95, 1.5, 1.0) == pytest.approx(TRIALS[0].least_time, abs=1e-3)


@pytest.mark.requirement(39, 50)
@pytest.mark.slow
def test_a_shorter_period_loses_less_time_and_nobody_is_touched():
    rows = list(period_rows(rounds=1, periods=(0.2, 0.05), trials=TRIALS[1:2]))
    for name in ("profile", "teb"):
        slow, quick = (row.error for row in rows if row.variant == name and row.time_us)
        assert 0.0 <= quick < slow
    deep = [row for row in rows if row.name.endswith("intrusion")]
    assert len(deep) == 4
    assert all(row.error <= row.goal for row in deep if row.goal is not None)
    by_profile = list(profile_rows(rounds=1, periods=(0.2, 0.02)))
    assert {row.variant for row in by_profile} == {"paper", "tuned"}
    assert all(row.error >= 0.0 for row in by_profile)
    assert by_profile[-1].error < by_profile[-2].error


@pytest.mark.slow
def test_drives_brake_into_their_goals_whatever_the_tolerance():
    """A drive has arrived when it is slow as well: then it is nearer than any usual tolerance."""
    rows = {
        (row.variant, row.value): row.error for row in tolerance_rows(1, tolerances=(0.2, 0.02))
    }
    for variant in ("profile", "profile, all three"):
        assert 0.0 < rows[variant, 0.02] <= rows[variant, 0.2] < 5.0


def test_peers_search_the_same_cells_and_know_eight_directions_only():
    """Over open floor such a way is as long as the octile distance; ours is straight."""
    grid = Grid(0.1, 40, 60)
    start, goal = (0.55, 0.55), (5.05, 2.55)  # centres of cells: 45 across, 20 up
    octile = 0.1 * (25 + 20 * math.sqrt(2.0))
    for make, _ in PATH_PEERS.values():
        length = make(np.ones((40, 60), dtype=bool), grid)
        assert length(start, goal) == pytest.approx(octile)
        assert length(start, (5.08, 2.51)) == pytest.approx(octile + 0.05)


@pytest.mark.requirement(50, 52)
@pytest.mark.slow
def test_drives_by_estimated_poses_have_rows_of_time_and_intrusion_with_their_goals():
    rows = [*disturbed_rows(CASES[1], [0]), *disturbed_rows(WALKERS[0], [0])]
    assert [
        (row.name, row.variant, row.error_unit, row.goal)
        for row in rows
        if row.variant == "profile"
    ] == [
        ("drives, delay 20 ms", "profile", "% over the least time, mean", 6.0),
        ("drives, delay 20 ms: intrusion", "profile", "cm", 0.0),
        ("drives, walkers, drift 5 mm: intrusion", "profile", "cm", 0.0),
    ]
    assert len(rows) == 6
    assert all(row.error <= row.goal for row in rows)


def test_maps_that_are_not_there_are_left_out_with_a_note(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(navigation, "MAP_FOLDER", tmp_path)
    assert [floor.name for floor in navigation.floors()] == list(navigation.ROOMS)
    assert capsys.readouterr().err.count("left out") == len(navigation.MAPS)


@pytest.mark.skipif(not MAP_FOLDER.exists(), reason="the maps are not here")
def test_the_real_maps_are_measured_where_they_are():
    names = [floor.name for floor in navigation.floors()]
    assert names == [*navigation.ROOMS, *navigation.MAPS]


def test_the_committed_ways_drives_and_decisions_keep_their_goals():
    names = ("navigation", "drives")
    rows = [
        row for name in names for row in json.loads((RESULTS / f"{name}.json").read_text())["rows"]
    ]
    kept = [row for row in rows if row["goal"] is not None and row["variant"] != "teb"]
    variants = {"exact", "theta_star", "profile", "paper", "tuned"}
    assert {row["variant"] for row in kept} == variants
    for row in kept:
        assert (row["ratio"] if row["error"] is None else row["error"]) <= row["goal"], row
