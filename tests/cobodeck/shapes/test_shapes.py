"""Shapes of a room and of moments in it: where they are, which are made, and how they are sent."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st

from behaviors.chase.waiting_place import free_cells
from behaviors.profile.profile import load_profile
from behaviors.situation.chase_cells import timed_cells, weighted_cells
from behaviors.situation.chase_ring import ChaseRing
from cobodeck.pictures.drawing.canvas import sheet
from cobodeck.pictures.drawing.drawn_shapes import draw
from cobodeck.shapes import actors
from cobodeck.shapes.layers import MOVING, Backdrop, room_shapes, shapes_of
from cobodeck.shapes.moment import Moment, situation_at
from cobodeck.shapes.room_parts import inflation_shapes
from cobodeck.shapes.sensed import MOST_CELLS, costmap_shapes, scan_shapes
from cobodeck.shapes.shape import LAYERS, MapShape, ShapeKind, areas, wire
from cobodeck.shapes.spaces import chase_shapes
from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.samples import Scan, UserPose
from hw.scene.objects import Thing
from hw.scene.scene import load_scene
from states.navigation.grid.grid_planners import ThetaStarPlanner
from states.navigation.grid.inflation import LETHAL, NO_INFORMATION
from tests.repeats import examples

LAB = replace(load_scene("lab_a"), objects=(Thing("chair", (9.0, 8.0)),))
ROBOT = load_robot(LAB.robot)
CHEAP = {"objects", "robot", "arm", "user", "zones", "path", "goal", "trails", "deep", "scan"}
RANGE_M, AROUND_M = 10.0, 3.2
"""Longest beams of scans; how far from the room other shapes reach, m."""


def around(profile: str, *sets: str) -> Backdrop:
    values = load_profile(profile, sets)
    return Backdrop(LAB, values.environment(LAB.room, ROBOT), values, 0.2)


ON_CELLS = [f"navigation.{name}.planner=theta_star" for name in ("chase", "haptic")]
PLACES = [around("paper"), around("tuned"), around("tuned", *ON_CELLS)]

angle = st.floats(-math.pi, math.pi)
poses = st.builds(Pose2, st.floats(0.5, 11.0), st.floats(0.5, 9.5), angle)
users = st.builds(UserPose, poses, angle)
deeps = st.builds(Pose3.from_yaw, st.floats(1, 10), st.floats(1, 9), st.just(1.2), angle)
points = st.lists(st.tuples(st.floats(0, 11), st.floats(0, 10)), max_size=5).map(tuple)
ranges = st.floats(0.0, RANGE_M) | st.sampled_from([math.inf, math.nan, -1.0])
scans = st.builds(Scan, st.just("front"), angle, st.just(0.1), st.lists(ranges).map(tuple))
moments = st.builds(
    Moment,
    robot=st.none() | poses,
    user=st.none() | users,
    deep=st.none() | deeps,
    path=points,
    robot_trail=points,
    user_trail=points,
    joints=st.none() | st.tuples(*[angle] * 6),
    goal=st.none() | poses,
    scans=st.tuples(st.tuples(poses, scans)),
)
FULL = Moment(
    Pose2(1.6, 8.4, 0.3), UserPose(Pose2(4.0, 5.0, 1.0), 1.2), Pose3.from_yaw(4.2, 5.4, 1.2, 1.0),
    ((1.6, 8.4), (2.0, 8.0)), ((1.0, 8.0), (1.6, 8.4)), ((4.0, 4.0), (4.0, 5.0)), "",
    ROBOT.parked, Pose2(2.0, 8.0), scans=((Pose2(1.0, 1.0), Scan("front", 0.0, 0.1, (1.0,))),),
)  # fmt: skip


def is_sound(shape: MapShape) -> bool:
    x_low, y_low, x_high, y_high = LAB.room.bounds
    far = RANGE_M + 1.0 if shape.layer == "scan" else AROUND_M
    near = all(
        x_low - far <= x <= x_high + far and y_low - far <= y <= y_high + far
        for x, y in shape.places
    )
    weighed = len(shape.weights) == (len(shape.places) if shape.kind == "cells" else 0)
    shares = all(0.0 <= share <= 1.0 for share in (*shape.weights, shape.alpha))
    return near and weighed and shares and (shape.kind == "disc") == (shape.radius is not None)


@pytest.mark.few(1)
@pytest.mark.parametrize("place", PLACES)
@given(moments)
@settings(max_examples=examples(16, least=4), deadline=None)
def test_every_shape_is_finite_and_about_the_room(place: Backdrop, moment: Moment) -> None:
    for shape in shapes_of(moment, place, LAYERS):
        assert is_sound(shape), shape


def test_what_stands_still_is_finite_and_in_the_room() -> None:
    found = room_shapes(PLACES[0])

    assert {shape.layer for shape in found} == {"room", "inflations", "tracked", "places"}
    assert all(map(is_sound, found))


@pytest.mark.slow
def test_pictures_have_a_look_for_every_shape() -> None:
    every = [*room_shapes(PLACES[2]), *shapes_of(FULL, PLACES[2], LAYERS)]
    on = sheet(LAB.room.bounds, "all", [])

    draw(on, every)

    abouts = {shape.about for shape in every} - {""}
    assert abouts == set(on.legend)
    assert len(abouts) > 12


def test_a_full_moment_has_all_layers_that_move() -> None:
    assert {shape.layer for shape in shapes_of(FULL, PLACES[2], LAYERS)} == set(MOVING)
    assert set(MOVING) | {"room", "inflations", "tracked", "places"} == set(LAYERS)


@given(st.sets(st.sampled_from(LAYERS)), st.sampled_from(PLACES))
@settings(max_examples=examples(24, least=6), deadline=None)
def test_the_layers_made_are_those_asked_for(layers: set[str], place: Backdrop) -> None:
    every = shapes_of(FULL, place, LAYERS)

    assert shapes_of(FULL, place, layers) == [shape for shape in every if shape.layer in layers]


class Watched:
    """An environment that notes what it is asked for."""

    def __init__(self, inner: Any) -> None:
        self.inner, self.asked = inner, set[str]()

    def __getattr__(self, name: str) -> Any:
        self.asked.add(name)
        return getattr(self.inner, name)


@pytest.mark.parametrize("layer", MOVING)
def test_nothing_is_planned_for_layers_that_show_no_plan(layer: str) -> None:
    place = PLACES[1]
    watched: Any = Watched(place.environment)

    shapes_of(FULL, replace(place, environment=watched), {layer})

    assert ("static_planners" in watched.asked) == (layer not in CHEAP)


def test_nothing_is_asked_for_without_layers() -> None:
    watched: Any = Watched(PLACES[1].environment)

    assert shapes_of(FULL, replace(PLACES[1], environment=watched), set()) == []
    assert watched.asked == set()


# ----------------------------------------------------------------- on the wire

lengths = st.floats(-100.0, 100.0)
shares = st.floats(0.0, 1.0)
shapes = st.builds(
    MapShape,
    st.sampled_from(LAYERS),
    st.sampled_from(get_args(ShapeKind)),
    st.sampled_from(["wall", "inflation-0"]),
    st.lists(st.tuples(lengths, lengths), max_size=9).map(lambda p: tuple(np.ravel(p).tolist())),
    text=st.text(),
    radius=st.none() | st.floats(0.0, 9.0),
    weights=st.lists(shares).map(tuple),
    yaw=st.none() | angle,
    cell=st.none() | st.floats(0.01, 1.0),
    fill=st.booleans(),
    alpha=shares,
)


def are_near(sent: Sequence[float], given: Sequence[float]) -> bool:
    """To the millimetre; `approx` takes most of the time for so many."""
    pairs = zip(sent, given, strict=True)
    return all(abs(there - here) <= 6e-4 for there, here in pairs)


@given(shapes)
@settings(max_examples=examples(100, of=10))
def test_what_is_read_from_the_wire_is_the_shape_to_the_millimetre(shape: MapShape) -> None:
    sent = json.loads(json.dumps(wire(shape), allow_nan=False))

    assert set(sent) <= {*"lkcprswa", "yaw", "cell", "fill"}
    assert (sent["l"], sent["k"], sent["c"]) == (shape.layer, shape.kind, shape.style)
    assert (sent.get("s", ""), sent.get("fill", False)) == (shape.text, shape.fill)
    assert are_near(sent["p"], shape.points)
    assert are_near(sent.get("w", []), shape.weights)
    assert are_near([sent.get("a", 1.0)], [shape.alpha])
    for key, value in (("r", shape.radius), ("yaw", shape.yaw), ("cell", shape.cell)):
        assert (key in sent) == (value is not None)
        assert value is None or are_near([sent[key]], [value])
    assert all(round(value, 3) == value for value in sent["p"])


# ----------------------------------------------------------------- single shapes


def shoelace(shape: MapShape) -> float:
    x, y = np.reshape(shape.points, (-1, 2)).T
    return abs(0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))


def is_inside(shape: MapShape, x: float, y: float) -> bool:
    """By how often a ray from the point crosses the ring."""
    ring, inside = shape.places, False
    for (x1, y1), (x2, y2) in zip(ring, [*ring[1:], ring[0]], strict=True):
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
            inside = not inside
    return inside


def test_a_filled_ring_covers_its_area_without_the_holes() -> None:
    holes = [shapely.box(x, 1.0, x + 0.5, 2.0).exterior.coords for x in (1.0, 2.0, 4.0)]
    area = shapely.Polygon(shapely.box(0.0, 0.0, 5.0, 3.0).exterior.coords, holes)
    area = area.union(shapely.box(7.0, 0.0, 8.0, 1.0))

    left, right = areas("room", "wall", area, fill=True)

    assert shoelace(left) + shoelace(right) == pytest.approx(area.area)
    assert len(areas("room", "wall", area, fill=False)) == 5
    for x in np.arange(0.05, 5.0, 0.1).tolist():
        assert is_inside(left, x, 1.53) == area.contains(shapely.Point(x, 1.53))


def test_inflations_are_where_a_subsystem_keeps_from_walls() -> None:
    found = inflation_shapes(LAB.room, PLACES[0].environment.navigation)
    planners = PLACES[0].environment.static_planners

    assert list(dict.fromkeys(shape.style for shape in found)) == ["inflation-0", "inflation-1"]
    levels = (("inflation-0", "chase", 1.0), ("inflation-1", "escape", 0.77))
    for x, y in np.random.default_rng(4).uniform((0.1, 0.1), (11.4, 10.0), (100, 2)).tolist():
        for style, name, inflation in levels:
            if abs(LAB.room.way_clearance(x, y, x, y) - inflation) > 0.01:
                shut = any(is_inside(shape, x, y) for shape in found if shape.style == style)
                open_to_it = planners[name].is_free((x, y))  # type: ignore[index]
                assert shut == (LAB.room.is_free(x, y) and not open_to_it)


@pytest.mark.requirement(93, 95, 100)
@pytest.mark.parametrize("place", PLACES[:2])
def test_chase_cells_are_those_of_the_policy_by_what_they_are_worth(place: Backdrop) -> None:
    now = situation_at(FULL, place.environment, place.settings)
    assert now is not None
    chase, ring = place.settings.chase, ChaseRing.of(place.settings.chase)
    if place.settings.policy == "paper":
        cells = weighted_cells(ring, chase.best_angle, chase.best_radius)
        free = free_cells(now, cells)
    else:
        cells = timed_cells(place.environment, place.settings, ring)
        cells, free = 1.0 / cells, free_cells(now, cells)
        free[:, 2] = 1.0 / free[:, 2]

    shape = chase_shapes(now)[0]

    assert shape.points == tuple(free[:, :2].ravel())
    low, high = cells[:, 2].min(), cells[:, 2].max()
    assert shape.weights == pytest.approx((free[:, 2] - low) / (high - low))
    assert (shape.cell, shape.yaw) == (chase.cell, now.user.body.yaw)


@given(users, poses)
@settings(max_examples=examples(100, of=10), deadline=None)
def test_a_zone_is_a_wedge_of_72_degrees_and_2_5_m_with_a_ring_of_1_5_m(
    user: UserPose, robot: Pose2
) -> None:
    outline = actors.zone_shapes(user, PLACES[0].settings.escape)[1]
    away = user.body.distance_to(robot)
    gaze = abs(Pose2(user.body.x, user.body.y, user.head_yaw).bearing_to(robot))
    reach = 2.5 if gaze <= math.radians(36.0) else 1.5
    if abs(away - reach) > 0.01 and abs(gaze - math.radians(36.0)) > 0.01:
        assert is_inside(outline, robot.x, robot.y) == (away < reach)


@given(poses, st.tuples(*[angle] * 6))
@settings(max_examples=examples(24, least=3, of=8), deadline=None)
def test_the_arms_outlines_are_as_far_from_its_links_as_their_radii(
    base: Pose2, joints: tuple[float, ...]
) -> None:
    arm = PLACES[0].arm
    assert arm is not None
    ends, radii = arm.capsules_of(joints)
    order = np.argsort(ends[:, :, 2].mean(axis=1), kind="stable")

    found = actors.arm_shapes(base, joints, arm)

    assert [s.style == "held" for s in found] == [arm.parts[k] == arm.held for k in order]
    for k, shape in zip(order, found, strict=True):
        link = shapely.LineString([base.transform(*end[:2]) for end in ends[k].tolist()])
        away = shapely.distance(link, shapely.points(shape.places))
        assert away == pytest.approx(np.full(len(away), radii[k]))
        assert shapely.Polygon(shape.places).contains(link)


def test_beams_end_where_the_scanner_saw_something() -> None:
    pose, sensor = Pose2(3.0, 4.0, 0.5), next(iter(ROBOT.sensing.lidars))
    scan = Scan(sensor, -0.2, 0.1, (1.0, math.inf, 2.0, 0.0, math.nan, 3.0))
    at = pose @ ROBOT.sensing.mount(sensor)

    (found,) = scan_shapes([(pose, scan)], ROBOT.sensing)

    for (x, y), beam in zip(found.places, (0, 2, 5), strict=True):
        assert math.hypot(x - at.x, y - at.y) == pytest.approx(scan.ranges[beam])
        assert at.bearing_to(Pose2(x, y)) == pytest.approx(-0.2 + 0.1 * beam)


@pytest.mark.few(2)
@pytest.mark.parametrize("window", [(2.0, 3.0), (9.0, 9.0)])
@pytest.mark.parametrize("robot", [Pose2(5.0, 5.0), Pose2(0.4, 9.8)])
def test_cells_of_a_costmap_have_the_highest_cost_within_them(
    window: tuple[float, float], robot: Pose2
) -> None:
    planner = PLACES[2].environment.static_planners["chase"]
    assert isinstance(planner, ThetaStarPlanner)

    (shape,) = costmap_shapes(planner, robot, window)

    assert shape.cell is not None
    grid, half = planner.grid, 0.5 * shape.cell
    assert len({x for x, _ in shape.places}) <= MOST_CELLS
    xs, ys = (values.ravel() for values in np.meshgrid(*grid.centers()))
    costs = np.where(planner.costs == NO_INFORMATION, 0, planner.costs).ravel() / LETHAL
    for (x, y), weight in list(zip(shape.places, shape.weights, strict=True))[::17]:
        inside = (abs(xs - x) < half) & (abs(ys - y) < half)
        inside &= (abs(xs - robot.x) < 0.5 * window[0] + 0.05) & (
            abs(ys - robot.y) < 0.5 * window[1] + 0.05
        )
        assert weight == costs[inside].max() > 0.0


def test_of_a_robot_outside_of_the_map_no_costs_are_shown() -> None:
    planner = PLACES[2].environment.static_planners["chase"]

    assert costmap_shapes(planner, Pose2(50.0, 50.0), (5.0, 5.0)) == []


def test_of_a_planner_without_costs_what_scans_have_shown_is_seen() -> None:
    planner = PLACES[0].environment.static_planners["chase"]
    ring = ((5.0, 1.0), (5.5, 1.0), (5.5, 1.5), (5.0, 1.5))

    (shape,) = costmap_shapes(planner.among([ring]), Pose2(5.0, 2.0), (5.0, 5.0))  # type: ignore[attr-defined]

    assert shape.places == list(ring)


def test_deep_points_where_the_person_reaches() -> None:
    ahead, _ = actors.deep_shapes(Pose3.from_yaw(1.0, 2.0, 1.2, math.pi / 2))

    assert (ahead.kind, ahead.points) == ("arrow", pytest.approx((1.0, 2.0, 1.0, 2.4)))
