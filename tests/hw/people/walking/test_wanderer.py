"""The person who wanders about by chance."""

import math
from dataclasses import replace

import pytest
from shapely.geometry import LineString, Point

from engine.files.finding import FileError
from hw.geometry import Pose2
from hw.people.user import open_user
from hw.samples import USER_RADIUS
from hw.scene.scene import load_scene

FAR = Pose2(100.0, 100.0)
LAB = load_scene("lab_a")


def walk(seed, requests=5, scene=LAB, informed=lambda n: False):
    person = open_user("random", scene, requests, seed=seed)
    rows = []
    for n in range(30 * 100 * requests):
        person.step(n * 10**9 // 30, FAR, informed(n))
        rows.append((person.body, person.speed, person.request))
        if person.finished:
            return rows
    raise AssertionError("the person does not come to an end")


@pytest.mark.requirement(67)
def test_the_same_seed_gives_the_same_walk_and_another_seed_another():
    assert walk(3) == walk(3)
    assert walk(3) != walk(4)


@pytest.mark.parametrize("scene", ["lab_a", "lab_b", "hall"])
def test_the_whole_person_stays_off_the_walls(scene):
    scene = load_scene(scene)
    floor = scene.room.free_space
    for body, _, _ in walk(1, scene=scene)[::5]:
        assert floor.contains(Point(body.x, body.y))
        assert floor.boundary.distance(Point(body.x, body.y)) >= USER_RADIUS - 1e-9


def test_speeds_headings_and_places_spread():
    rows = walk(2, requests=40)
    speeds = [speed for _, speed, _ in rows if speed > 0.0]
    assert 0.5 <= min(speeds) < 0.6
    assert 1.4 < max(speeds) <= 1.5
    asked = list(dict.fromkeys(request for _, _, request in rows if request is not None))
    assert len(asked) == 40
    assert {math.floor(deep.yaw / (math.pi / 2)) for deep in asked} == {-2, -1, 0, 1}
    west = sum(body.x < 6.75 for body, _, _ in rows) / len(rows)
    assert 0.3 < west < 0.9


def test_every_touch_is_asked_for_while_standing():
    for _, speed, request in walk(5):
        assert request is None or speed == 0.0


def test_shown_the_robot_the_person_stands_and_then_goes_the_same_way():
    held = walk(7, informed=lambda n: 100 <= n < 200)
    assert all(speed == 0.0 for _, speed, _ in held[140:200])
    asked = [{request for _, _, request in rows if request} for rows in (held, walk(7))]
    assert asked[0] == asked[1]


def test_a_start_beside_a_wall_is_an_error():
    with pytest.raises(FileError, match=r"not 0\.5 m away from walls"):
        open_user("random", replace(LAB, user_start=Pose2(0.3, 5.0)))


def test_only_a_recording_can_be_stretched():
    with pytest.raises(FileError, match="stretched"):
        open_user("random", LAB, size=8.0)


def test_the_clearance_of_a_way_is_the_distance_to_all_walls():
    room = LAB.room
    boundary = room.free_space.boundary
    for way in ((1.0, 1.0, 5.0, 9.0), (5.0, 3.5, 9.0, 4.0), (2.0, 3.0, 2.0, 3.0)):
        line = LineString([way[:2], way[2:]])
        assert room.way_clearance(*way) == pytest.approx(boundary.distance(line))
    assert room.way_clearance(5.0, 1.0, 9.0, 1.0) == 0.0
