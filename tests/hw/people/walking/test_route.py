"""The evaluation's person at random poses."""

import math
from itertools import pairwise

import pytest
from shapely.geometry import LineString, Point

from engine.files.finding import FileError
from hw.geometry import Pose2
from hw.people.user import open_user
from hw.people.walking.route import APART, route
from hw.people.walking.script import RequestStep, Stand, WalkStep, load_script
from hw.samples import USER_RADIUS
from hw.scene.room import Room
from hw.scene.scene import load_scene

FAR = Pose2(100.0, 100.0)
STUDY = load_scene("study")


def poses(script):
    return [Pose2(s.x, s.y, s.yaw) for s in script.steps if isinstance(s, WalkStep)]


@pytest.mark.requirement(130, 131)
def test_only_the_poses_differ_from_the_evaluation_s_script():
    script, study = route(STUDY.room, STUDY.robot_start, 3), load_script("study")
    for ours, theirs in zip(script.steps, study.steps, strict=True):
        assert type(ours) is type(theirs)
        if isinstance(ours, Stand | RequestStep):
            assert ours == theirs
        else:
            assert ours.speed == theirs.speed == 1.5
    assert (script.turn_rate, script.rounds) == (study.turn_rate, study.rounds)
    assert script.start == poses(script)[-1]


def test_the_seed_alone_decides():
    same = [route(STUDY.room, STUDY.robot_start, 3) for _ in range(2)]
    assert same[0] == same[1]
    assert poses(same[0]) != poses(route(STUDY.room, STUDY.robot_start, 4))


@pytest.mark.parametrize("name", ["study", "lab_b", "hall"])
def test_ways_are_free_and_the_robot_has_room_opposite(name):
    scene = load_scene(name)
    floor, walls = scene.room.free_space, scene.room.free_space.boundary
    for seed in range(8):
        found = poses(route(scene.room, scene.robot_start, seed))
        assert len(found) == 7
        for start, end in pairwise([found[-1], *found]):
            way = LineString([(start.x, start.y), (end.x, end.y)])
            assert floor.contains(way)
            assert walls.distance(way) >= USER_RADIUS - 1e-9
            assert way.length >= APART
        for pose in found:
            there = Point(pose.x + 1.85 * math.cos(pose.yaw), pose.y + 1.85 * math.sin(pose.yaw))
            assert floor.contains(there)
            assert walls.distance(there) >= 1.2 - 1e-9


def test_a_person_walks_the_route_and_asks_at_each_pose():
    person = open_user("route:hasty", STUDY, 7, seed=5)
    asked = []
    for n in range(30 * 60 * 8):
        person.step(n * 10**9 // 30, FAR, False)
        if person.request is not None and person.request not in asked:
            asked.append(person.request)
        if person.finished:
            break
    expected = [
        pose.transform(0.85, 0.0) for pose in poses(route(STUDY.room, STUDY.robot_start, 5))
    ]
    assert person.finished
    assert [(deep.x, deep.y) for deep in asked] == [pytest.approx(place) for place in expected]


def test_a_room_without_such_poses_is_refused():
    with pytest.raises(FileError, match="no 7 poses"):
        route(Room(((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))), FAR, 1)
