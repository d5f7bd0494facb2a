"""Subjects that run: whole simulations in a room elsewhere, people of all kinds, maps that grow."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path

from cobodeck.loop.loop import Loop
from cobodeck.run.simulation import simulate
from cobodeck.setup.open_scene import RunPlace
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from hw.people.recorded.gaps import across_jumps
from hw.people.user import open_user
from hw.scene.objects import Thing
from hw.scene.scene import load_scene
from hw.scene.surface import Surface
from hw.scene.zones import SpeedZone, Zones
from states.floors.floor_cells import MapFloor
from states.floors.usable_space import measure
from states.localization.slam.incremental_mapping import Growing
from states.maps.cells import room_map
from states.maps.occupancy import OccupancyMap
from states.maps.rooms import room_of, start_in, tidied
from tests.stress.elsewhere import Elsewhere
from tests.stress.estimators import scanned

STEPS = """\
  - walk: {{x: {0}, y: {1}}}
  - stand: 0.5
  - request: {{hold: 2, ahead: 0.85, height: 1.3}}
  - walk: {{x: {2}, y: {3}, yaw: {4}}}
  - approach: {{target: robot, stop_at: 1.0, for: 2}}
  - stand: 5
"""


@cache
def opened() -> Setup:
    return open_setup("cobodeck", "lab_a")


def moved_scene(at: Elsewhere) -> Setup:
    """Lab A with a chair, somebody who walks about, a zone and a surface."""
    scene, setup = load_scene("lab_a"), opened()
    chair = Thing("chair", at.point(3.0, 3.2))
    other = Thing("person", at.point(8.9, 8.0), walks=(at.point(8.9, 3.0),), again=True)
    slow = SpeedZone(at.ring(((2.0, 6.0), (4.0, 6.0), (4.0, 8.0), (2.0, 8.0))), 0.5)
    place = replace(
        scene,
        room=at.room(scene.room),
        robot_start=at.pose(3.0, 5.0, 2.9),
        user_start=at.pose(5.2, 2.2, 2.0),
        places={},
        touchable=(Surface(at.point(4.0, 3.9), at.point(5.5, 3.9)),),
        objects=(chair, other),
        zones=Zones((), (slow,)),
    )
    return replace(setup, place=RunPlace(place))


def run(at: Elsewhere, tier: int, seconds: float) -> list[float]:
    """Where robot and person are at every tick, and what the judge says."""
    found: list[float] = []

    @contextmanager
    def watched(loop: Loop) -> Iterator[None]:
        class Watch:
            def watch(self, now_ns: int) -> None:
                truth = loop.plant.truth
                assert truth is not None
                for pose in (truth.base, truth.body):
                    assert pose is not None
                    found.extend(at.home_pose(pose))

        loop.observers = [*loop.observers, Watch()]
        yield

    numbers = (*at.point(4.6, 4.0), *at.point(5.2, 6.2), at.yaw(3.1))
    with tempfile.TemporaryDirectory() as folder:
        user = Path(folder) / "walks.yaml"
        user.write_text(f"user: walks\nsteps:\n{STEPS.format(*map(repr, numbers))}")
        options = Options(user=str(user), tier=tier, seed=3, duration_s=seconds)
        result = simulate(moved_scene(at), options, around=watched)
    figures = result.figures
    told = ("distance_m", "energy_j", "min_gap_m", "walking_s", "contacts")
    return [*found, *(float(figures[name]) for name in told)]


def simulated(at: Elsewhere) -> list[float]:
    return run(at, 1, 9.0)


def sensed(at: Elsewhere) -> list[float]:
    """With all sensors, until the first reading may round to another digit."""
    return run(at, 2, 1.0)


def grown_map(at: Elsewhere) -> list[float]:
    """A base that turns on the spot grows its map from where its odometry begins."""
    growing, found = Growing(), []
    for k in range(4):
        growing.add_scan(at.pose(1.0, 2.0, 0.4), "front", scanned())
        pose = growing.add_scan(at.pose(1.02 + 0.02 * k, 2.0, 0.4), "front", scanned())
        found += at.home_pose(pose)
    return found


def map_floor(at: Elsewhere) -> list[float]:
    """A map on cells, its axes turned with it: floor, room, a start."""
    rows = room_map(((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)),
                    [((3.0, 2.0), (3.5, 2.0), (3.5, 3.0), (3.0, 3.0))], 0.05)  # fmt: skip
    corner = rows.map_from_corner
    map_ = tidied(OccupancyMap(rows.values, 0.05, at.pose(corner.x, corner.y, corner.yaw)))
    floor, room = MapFloor(map_), room_of(map_)
    space, quarter = measure(floor, 0.8), floor.quarter(0.8, 2.0)
    assert quarter is not None
    near, start = floor.obstacles_at(quarter, 3.0), start_in(map_)
    return [
        space.free_m2, space.usable_m2, *space.pieces, len(room.segments), room.free_space.area,
        *at.home_point(quarter.x, quarter.y), *at.home_yaw(quarter.angle), len(near),
        *at.home_point(start.x, start.y),
    ]  # fmt: skip


def people_recorded(at: Elsewhere) -> list[float]:
    """Jumps of a recorded walk are left out wherever it was recorded."""
    places = [at.point(2.0 + 0.05 * k + (5.0 if k == 20 else 0.0), 3.0) for k in range(40)]
    xs, ys = zip(*places, strict=True)
    stamps = [at.ns(0.05 * k) for k in range(40)]
    kept, jumps = across_jumps(stamps, xs, ys)
    return [*kept, *jumps]


def wandering(at: Elsewhere) -> list[float]:
    """Somebody walks about by chance, and leaves a robot that is shown to them."""
    scene = moved_scene(at).scene
    assert scene is not None
    person, found = open_user("random", replace(scene, touchable=()), 1, seed=4), []
    for k in range(900):
        person.step(k * 10**9 // 30, at.pose(6.0, 5.5, 0.0), 300 < k < 420)
        found += at.home_pose(person.body)
    return found


def things(at: Elsewhere) -> list[float]:
    """Surfaces, zones and things of a scene, asked directly."""
    surface = Surface(at.point(4.0, 3.9), at.point(5.5, 3.9))
    view = at.pose(4.6, 3.0, 1.5)
    seen = surface.seen_from(view)
    assert seen is not None
    zone = SpeedZone(at.ring(((2.0, 6.0), (4.0, 6.0), (4.0, 8.0), (2.0, 8.0))), 0.5)
    walker = Thing("person", at.point(8.9, 8.0), walks=(at.point(8.9, 3.0),), again=True)
    found = [surface.distance(view.x, view.y), surface.angle_from(view), *at.home_point(*seen)]
    for t in (0.5, 7.3, 86_400.25):
        place = walker.place(round(t * 1e9))
        assert place is not None
        found += at.home_point(*place)
    return [*found, *(zone.speed_at(*at.point(x, 5.0), 1.0) for x in (1.0, 3.0, 9.0))]
