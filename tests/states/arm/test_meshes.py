"""The capsules against the maker's own meshes; runs where the extra `verify` is installed.

The meshes (BSD-3) come with its package example-robot-data; UR10_MESHES names another folder that
holds `example-robot-data/robots/ur_description`.
"""

from __future__ import annotations

import os
import sysconfig
from pathlib import Path

import numpy as np
import pytest

from hw.model.prop import load_prop, prop_names
from hw.model.robot import MotionLimits
from hw.model.urdf import read_urdf
from states.arm.description.urdf_arm import manipulator_from_urdf
from states.arm.kinematics.collision import CollisionChecker, Surroundings
from states.arm.kinematics.kinematics import forward
from states.arm.planning.planning import Plan, Query, goals_at, plan
from tests.states.arm.urdf_writing import urdf_of

pinocchio = pytest.importorskip("pinocchio", reason="needs the extra 'verify'")
coal = pytest.importorskip("coal", reason="needs the extra 'verify'")

SHARE = Path(sysconfig.get_path("purelib"), "cmeel.prefix/share")
FOLDER = os.environ.get("UR10_MESHES", str(SHARE))
URDF = Path(FOLDER, "example-robot-data/robots/ur_description/urdf/ur10_robot.urdf")
MOUNT = np.array([0.0, 0.0, 0.511])

pytestmark = pytest.mark.skipif(
    not URDF.is_file(), reason="needs the meshes of example-robot-data, or UR10_MESHES"
)


class Meshes:
    """The arm and its prop as the maker's meshes on the rover's boxes, without the floor."""

    def __init__(self, arm) -> None:
        self.model, solids, _ = pinocchio.buildModelsFromUrdf(str(URDF), [FOLDER])
        self.data = self.model.createData()
        self.links = [g.geometry for g in solids.geometryObjects][:7]
        self.prop = [
            (coal.Capsule(c.radius, c.end[2] - c.start[2]), (c.start[2] + c.end[2]) / 2)
            for c in arm.tool.capsules
        ]
        self.boxes = [
            (coal.Box(*np.subtract(box.high, box.low)), np.add(box.high, box.low) / 2)
            for box in arm.body
        ]

    def gap(self, q) -> float:
        """The least distance of links that are not neighbours, prop and boxes; 0 for a touch."""
        return min(self._distance(*one, *other) for one, other in self._pairs(q, ()))

    def touches(self, q, cylinders) -> bool:
        """Does anything touch, what stands around counted? Cylinders: x, y, radius, bottom, top."""
        request = coal.CollisionRequest()
        return any(
            coal.collide(*one, *other, request, coal.CollisionResult())
            for one, other in self._pairs(q, cylinders)
        )

    def _pairs(self, q, cylinders):
        """Solids with their places, two by two."""
        pinocchio.forwardKinematics(self.model, self.data, np.asarray(q, float))
        poses = [pinocchio.SE3.Identity(), *(self.data.oMi[i] for i in range(1, 7))]
        links = [coal.Transform3s(p.rotation, p.translation + MOUNT) for p in poses]
        # the old description's last link looks along y
        wrist = poses[6]
        turn = wrist.rotation @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
        flange = wrist.translation + MOUNT + wrist.rotation @ [0, 0.0922, 0]
        prop = [
            (solid, coal.Transform3s(turn, flange + wrist.rotation @ [0, ahead, 0]), 6)
            for solid, ahead in self.prop
        ]
        things = [*zip(self.links, links, range(7), strict=True), *prop]
        for one in things:
            yield from ((one[:2], other[:2]) for other in things if other[2] - one[2] > 1)
        around = [
            (coal.Cylinder(radius, top - low), np.array([x, y, (low + top) / 2]))
            for x, y, radius, low, top in cylinders
        ]
        for solid, centre in [*self.boxes, *around]:
            stands = coal.Transform3s(np.eye(3), centre)
            yield from ((thing[:2], (solid, stands)) for thing in things if thing[2] >= 2)

    @staticmethod
    def _distance(a, place_a, b, place_b) -> float:
        result = coal.DistanceResult()
        return max(coal.distance(a, place_a, b, place_b, coal.DistanceRequest(), result), 0.0)


@pytest.fixture(scope="module")
def meshes(arm):
    return Meshes(arm)


def test_the_meshes_stand_where_the_chain_says(meshes, arm, sets):
    for q in sets.anywhere(50):
        pinocchio.forwardKinematics(meshes.model, meshes.data, q)
        wrist = meshes.data.oMi[6]
        tip = wrist.translation + MOUNT + wrist.rotation @ [0, 0.0922 + 0.15, 0]
        assert forward(arm, q)[:3, 3] == pytest.approx(tip, abs=1e-9)


@pytest.mark.requirement(43)
def test_what_the_capsules_call_free_is_free(meshes, arm, sets):
    checker = CollisionChecker.of(arm, Surroundings.empty(), margin=0.0)
    q = sets.anywhere(2000)
    free = q[checker.free(q)]
    gaps = np.array([meshes.gap(row) for row in free])
    assert len(free) > 400
    assert (gaps > 0.0).all()


@pytest.mark.requirement(46)
@pytest.mark.parametrize("prop", prop_names())
@pytest.mark.parametrize("pose", ["parked", "parked_paper"])
def test_the_parked_arm_is_15_mm_clear_of_itself(arm, prop, pose):
    held = arm.with_tool(load_prop(prop))
    assert Meshes(held).gap(getattr(held.tool, pose)) >= 0.015


@pytest.mark.requirement(17, 26)
def test_the_makers_description_is_read_with_its_meshes_and_stands_as_pinocchio_says(arm, sets):
    urdf = read_urdf(URDF)
    assert sum(len(link.collisions) for link in urdf.links.values()) == 7
    model = pinocchio.buildModelFromUrdf(str(URDF))
    data = model.createData()
    imported = manipulator_from_urdf(urdf, "base_link", "ee_link", arm)
    for q in sets.anywhere(50):
        pinocchio.framesForwardKinematics(model, data, q)
        named = dict(zip(imported.shape.joints, q, strict=True))
        poses = urdf.poses(named)
        for link, pose in poses.items():
            expected = data.oMf[model.getFrameId(link)].homogeneous
            assert np.abs(pose - expected).max() <= 1e-12
        tip = data.oMf[model.getFrameId("ee_link")].homogeneous
        assert np.abs(forward(imported, q) - tip).max() <= 1e-12


@pytest.mark.requirement(17, 26)
def test_what_we_write_stands_as_pinocchio_says(arm, sets):
    model = pinocchio.buildModelFromXML(urdf_of(arm))
    data = model.createData()
    for q in sets.anywhere(200):
        pinocchio.framesForwardKinematics(model, data, q)
        tip = data.oMf[model.getFrameId("tcp")].homogeneous
        assert np.abs(forward(arm, q) - tip).max() <= 1e-12


@pytest.mark.requirement(43)
def test_meshes_that_go_through_something_are_noticed(meshes, arm):
    q = np.array(arm.tool.parked)
    x, y, z = forward(arm, q)[:3, 3]
    assert not meshes.touches(q, [])
    assert meshes.touches(q, [(x, y, 0.1, 0.0, z)])
    assert meshes.touches([0, -1.57, 3.1, 0, 0, 0], [])


@pytest.mark.requirement(43, 143)
@pytest.mark.parametrize("count", [8, pytest.param(500, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("parked", "limits"),
    [
        ("parked", {"arm_acceleration": 5.0, "tool_speed": 1.0}),
        ("parked_paper", {"arm_acceleration": 1.0}),
    ],
)
def test_no_plan_makes_the_meshes_touch(meshes, arm, problems, count, parked, limits):
    start = np.array(getattr(arm.tool, parked))
    even = MotionLimits(**limits)
    solved = 0
    for problem in problems[:count]:
        checker = CollisionChecker.of(arm, problem.around)
        answer = plan(Query(checker, even, start, goals_at(arm, problem.deep, start)))
        if isinstance(answer, Plan):
            solved += 1
            path = answer.trajectory.path
            q, _, _ = path.at(np.append(np.arange(0.0, path.length, 0.01), path.length))
            assert not any(meshes.touches(row, problem.around.cylinders) for row in q)
    assert solved > 0.7 * count
