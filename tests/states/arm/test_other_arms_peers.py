"""Arms by URDF against Pinocchio (frames, inverse kinematics) and Coal (contact of the shapes).

Besides the two arms written for the tests, makers' own descriptions of example-robot-data are read:
with their meshes, or, where these are of other formats or the arm is part of a larger robot, the
chain of their joints alone.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import parse, tostring

import numpy as np
import pytest

from hw.model import Joint, MotionLimits, load_arm, load_robot, matrix, read_urdf
from states.arm.description import manipulator_of
from states.arm.kinematics import CollisionChecker, Surroundings, deviation, forward, inverse
from states.arm.planning import Plan, Query, plan
from tests.states.arm.other_arms import arm_file, robot_file

pinocchio = pytest.importorskip("pinocchio", reason="needs the extra 'verify'")
coal = pytest.importorskip("coal", reason="needs the extra 'verify'")
pytestmark = pytest.mark.slow

FOLDED = {
    "panda": "[-0.64, -0.57, 0.44, -1.78, -0.49, 1.57, 1.68]",
    "ball": "[0.21, -0.84, 0.82, -3.14, 0, 0.39]",
}
SHARE = next(
    (p for up in Path(coal.__file__).parents if (p := up / "share/example-robot-data").is_dir()),
    Path("absent"),
)
MAKERS = {
    "maker_panda": ("panda_description/urdf/panda.urdf", "panda_link0", "panda_link8"),
    "z1": ("z1_description/urdf/z1.urdf", "link00", "link06"),
    "xarm": ("xarm_description/urdf/xarm7.urdf", "link_base", "link_eef"),
    "baxter": ("baxter_description/urdf/baxter.urdf", "right_arm_mount", "right_hand_link"),
}
CHAINS = {
    "kinova": (
        "kinova_description/robots/kinova.urdf", "j2s6s200_link_base", "j2s6s200_end_effector",
    ),
    "pr2": ("pr2_description/urdf/pr2.urdf", "torso_lift_link", "r_wrist_roll_link"),
    "romeo": ("romeo_description/urdf/romeo.urdf", "torso", "r_wrist"),
    "talos": ("talos_data/robots/talos_reduced.urdf", "torso_2_link", "arm_left_7_link"),
    "tiago_pro": (
        "tiago_pro_description/robots/tiago_pro.urdf", "torso_lift_link", "arm_right_7_link",
    ),
    "centauro": ("centauro_description/urdf/centauro.urdf", "torso_2", "arm1_6"),
}  # fmt: skip
ALL = (*FOLDED, *MAKERS, *CHAINS)


def chain_alone(urdf: Path, base: str, flange: str) -> str:
    """The joints between two links of a description; endless ones turn half a turn each way."""
    above = {j.find("child").get("link"): j for j in parse(urdf).iterfind("joint") if len(j)}
    links, joints = [flange], []
    while links[-1] != base:
        joints.append(above[links[-1]])
        links.append(joints[-1].find("parent").get("link"))
    ball = '<collision><geometry><sphere radius="0.01"/></geometry></collision>'
    text = "".join(f'<link name="{name}">{ball}</link>' for name in links)
    for joint in joints:
        if joint.get("type") == "continuous":
            joint.set("type", "revolute")
            joint.find("limit").attrib.update(lower="-3.14159", upper="3.14159")
    text += "".join(tostring(joint, encoding="unicode") for joint in joints)
    return f'<robot name="chain">{text}</robot>'


def described(name: str, tmp_path: Path):
    """An arm alone: its manipulator on the rover's origin without a prop, URDF and flange."""
    if name in FOLDED:
        urdf = arm_file(tmp_path, name).with_suffix(".urdf")
        base, flange = "panda_link0", "panda_link8" if name == "panda" else "panda_link7"
    else:
        file, base, flange = (MAKERS | CHAINS)[name]
        urdf = SHARE / "robots" / file
        if not urdf.is_file():
            pytest.skip("needs the descriptions of example-robot-data")
        if name in CHAINS:
            text, urdf = chain_alone(urdf, base, flange), tmp_path / f"{name}.urdf"
            urdf.write_text(text)
        told = f"{{file: {urdf}, base: {base}, flange: {flange}}}"
        (tmp_path / f"{name}.yaml").write_text(f"arm: {name}\npayload: 3\nurdf: {told}\n")
    shape = load_arm(tmp_path / f"{name}.yaml")
    robot = load_robot("rbkairos_ur10")
    arm = replace(manipulator_of(robot), shape=shape, mount=type(robot.arm.mount)(), body=())
    tool = replace(arm.tool, tcp=type(robot.arm.mount)(), capsules=())
    return arm.with_tool(tool), urdf, base, flange


class Peer:
    """A URDF as Pinocchio reads it."""

    def __init__(self, arm, urdf: Path, base: str, flange: str) -> None:
        self.model = pinocchio.buildModelFromUrdf(str(urdf))
        self.data = self.model.createData()
        self.base, self.flange = self.model.getFrameId(base), self.model.getFrameId(flange)
        self.columns = [self.model.joints[self.model.getJointId(j)].idx_q for j in arm.shape.joints]

    def full(self, q):
        found = pinocchio.neutral(self.model)
        found[self.columns] = q
        return found

    def placed(self, q):
        pinocchio.framesForwardKinematics(self.model, self.data, self.full(q))
        return self.data.oMf[self.base].actInv(self.data.oMf[self.flange])

    def solves(self, target, arm, rng, tries: int) -> bool:
        """Damped least squares from random seeds, clamped to the limits, as in its examples."""
        wanted = pinocchio.SE3(target)
        for _ in range(tries):
            q = rng.uniform(arm.lower, arm.upper)
            for _ in range(150):
                now = self.placed(q)
                error = pinocchio.log6(now.actInv(wanted)).vector
                if np.linalg.norm(error) < 1e-6:
                    return True
                jac = pinocchio.computeFrameJacobian(
                    self.model, self.data, self.full(q), self.flange, pinocchio.LOCAL
                )[:, self.columns]
                step = jac.T @ np.linalg.solve(jac @ jac.T + 1e-6 * np.eye(6), error)
                q = np.clip(q + step, arm.lower, arm.upper)
        return False


@pytest.mark.parametrize("name", ALL)
def test_the_flange_is_where_pinocchio_has_it(name, tmp_path):
    arm, *where = described(name, tmp_path)
    peer = Peer(arm, *where)
    for q in np.random.default_rng(1).uniform(arm.lower, arm.upper, (200, arm.count)):
        assert np.abs(forward(arm, q) - peer.placed(q).homogeneous).max() < 1e-9


@pytest.mark.parametrize("name", ALL)
def test_inverse_finds_99_of_100_reachable_poses_and_as_many_as_pinocchio(name, tmp_path):
    arm, *where = described(name, tmp_path)
    peer, rng = Peer(arm, *where), np.random.default_rng(2)
    targets = forward(arm, rng.uniform(arm.lower, arm.upper, (1000, arm.count)))
    found = inverse(arm, targets)
    reached = found.valid.any(axis=1)
    wanted = np.repeat(targets[:, None], found.valid.shape[1], axis=1)[found.valid]
    distance, angle = deviation(forward(arm, found.joints[found.valid]), wanted)
    assert max(distance.max(), angle.max()) < 1e-6
    assert reached.mean() >= 0.99
    of_peer = np.mean([peer.solves(target, arm, rng, 3) for target in targets[:60]])
    assert reached[:60].mean() >= of_peer


@pytest.mark.parametrize("name", FOLDED)
def test_planned_motions_are_free_by_the_shapes_of_the_urdf(name, tmp_path):
    robot = load_robot(robot_file(tmp_path, name, FOLDED[name]))
    arm = manipulator_of(robot)
    checker = CollisionChecker.of(arm, Surroundings.empty())
    goals = np.random.default_rng(3).uniform(arm.lower, arm.upper, (60, arm.count))
    goals = goals[checker.free(goals)][:8]
    assert len(goals) == 8
    shapes, made = Shapes(arm, tmp_path / f"{name}.urdf"), 0
    for goal in goals:
        start = np.array(robot.parked)
        answer = plan(Query(checker, MotionLimits(), start, goal[None]))
        if isinstance(answer, Plan):
            made += 1
            path = answer.trajectory.path
            for q in path.at(np.linspace(0.0, path.length, 100))[0]:
                assert not shapes.touch(q)
    assert made >= 6


class Shapes:
    """The collision shapes of a URDF written for the tests, and the rover's boxes, in Coal."""

    def __init__(self, arm, urdf: Path) -> None:
        self.arm, self.urdf = arm, read_urdf(urdf)
        self.names = list(arm.shape.links)
        self.boxes = [
            (coal.Box(*np.subtract(b.high, b.low)), np.add(b.high, b.low) / 2) for b in arm.body
        ]

    def touch(self, q) -> bool:
        poses = self.urdf.poses(dict(zip(self.arm.shape.joints, q, strict=True)))
        placed = [
            (n, _geometry(solid), self.arm.base @ poses[name] @ matrix(solid.origin))
            for n, name in enumerate(self.names)
            for solid in self.urdf.links[name].solids
        ]
        own = any(
            _meet(a, at, b, there)
            for i, a, at in placed
            for j, b, there in placed
            if j - i > 1 and (self.names[i], self.names[j]) not in self.arm.grown
        )
        return own or any(
            _meet(a, at, box, _at(middle))
            for n, a, at in placed
            for box, middle in self.boxes
            if n > 1
        )


def _geometry(solid):
    kinds = {"box": coal.Box, "cylinder": coal.Cylinder, "sphere": coal.Sphere}
    return kinds[solid.kind](*solid.sizes)


def _at(point):
    found = np.eye(4)
    found[:3, 3] = point
    return found


def _meet(a, at, b, there) -> bool:
    result = coal.CollisionResult()
    places = [coal.Transform3s(pose[:3, :3], pose[:3, 3]) for pose in (at, there)]
    return coal.collide(a, places[0], b, places[1], coal.CollisionRequest(), result) > 0


def test_joints_of_the_maker_carry_its_limits(tmp_path):
    arm, urdf, *_ = described("maker_panda", tmp_path)
    own: dict[str, Joint] = {joint.name: joint for joint in read_urdf(urdf).joints}
    assert all(arm.shape.joints[name].lower == own[name].lower for name in arm.shape.joints)
    assert arm.shape.joints["panda_joint5"].torque == own["panda_joint5"].effort
