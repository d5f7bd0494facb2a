"""Arms of six and seven joints by URDF: frames, inverse kinematics, capsules, errors."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine.files import FileError
from engine.files.text import instead, noting
from hw.model import FlangeChain, load_arm, load_robot, matrix
from hw.model.urdf.capsules import around_box, around_cylinder, around_mesh, without_covered
from hw.model.urdf.meshes import mesh_file, triangles
from states.arm.description import manipulator_of
from states.arm.kinematics import deviation, followed, forward, inverse, inverse_near, jacobian
from states.arm.planning import goals_at, tool_lines
from tests.states.arm.other_arms import (
    BALL_AXES,
    BALL_FLANGE,
    BALL_STEPS,
    PANDA_DH,
    PANDA_FLANGE,
    arm_file,
    ball_urdf,
    panda_urdf,
    robot_file,
)

FOLDED = {
    "panda": "[-0.64, -0.57, 0.44, -1.78, -0.49, 1.57, 1.68]",
    "ball": "[0.21, -0.84, 0.82, -3.14, 0, 0.39]",
}


@pytest.fixture(params=("panda", "ball"))
def robot(request, tmp_path):
    return load_robot(robot_file(tmp_path, request.param, FOLDED[request.param]))


@pytest.fixture
def arm(robot):
    return manipulator_of(robot)


def sets(arm, count: int, seed: int = 1):
    return np.random.default_rng(seed).uniform(arm.lower, arm.upper, (count, arm.count))


def screw(axis: str, angle: float) -> np.ndarray:
    found = np.eye(4)
    found[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return found


def moved(x: float, y: float, z: float) -> np.ndarray:
    found = np.eye(4)
    found[:3, 3] = x, y, z
    return found


def drawn_flange(name: str, joints) -> np.ndarray:
    """base_from_flange by the published values alone."""
    found = np.eye(4)
    if name == "panda":
        for (a, d, alpha), angle in zip(PANDA_DH, joints, strict=True):
            found = found @ screw("x", alpha) @ moved(a, 0, 0) @ screw("z", angle) @ moved(0, 0, d)
        return found @ moved(0, 0, PANDA_FLANGE)
    for step, axis, angle in zip(BALL_STEPS, BALL_AXES, joints, strict=True):
        found = found @ moved(*step) @ screw("xyz"[axis.split().index("1")], angle)
    return found @ moved(BALL_FLANGE, 0, 0) @ screw("y", 0.5 * math.pi)


def test_the_tool_is_where_the_drawing_says(robot, arm):
    mount, tcp = matrix(robot.arm.mount), matrix(arm.tool.tcp)
    for q in sets(arm, 20):
        wanted = mount @ drawn_flange(arm.name, q) @ tcp
        assert np.abs(forward(arm, q) - wanted).max() < 1e-12


def test_the_flange_of_simulations_is_the_same(robot, arm):
    chain = FlangeChain(robot.arm)
    for q in sets(arm, 5):
        pose = chain.on_base(tuple(q))
        wanted = drawn_flange(arm.name, q)
        assert (pose.x, pose.y, pose.z) == pytest.approx(tuple(wanted[:3, 3]), abs=1e-12)


def test_the_jacobian_is_the_slope_of_the_poses(arm):
    q, step = sets(arm, 1)[0], 1e-6
    for i in range(arm.count):
        dq = step * np.eye(arm.count)[i]
        ahead, back = forward(arm, q + dq), forward(arm, q - dq)
        turn = Rotation.from_matrix(ahead[:3, :3] @ back[:3, :3].T).as_rotvec()
        slope = np.concatenate([ahead[:3, 3] - back[:3, 3], turn]) / (2.0 * step)
        assert np.abs(jacobian(arm, q)[:, i] - slope).max() < 1e-8


@pytest.mark.slow
def test_inverse_finds_what_can_be_reached_within_the_limits(arm):
    targets = forward(arm, sets(arm, 60))
    found = inverse(arm, targets)
    assert found.valid.any(axis=1).all()
    joints = found.joints[found.valid]
    assert ((joints >= arm.lower) & (joints <= arm.upper)).all()
    wanted = np.repeat(targets[:, None], found.valid.shape[1], axis=1)[found.valid]
    distance, angle = deviation(forward(arm, joints), wanted)
    assert max(distance.max(), angle.max()) < 1e-9


@pytest.mark.slow
def test_what_is_out_of_reach_has_no_solution_and_a_near_one(arm):
    far = forward(arm, np.clip(np.zeros(arm.count), arm.lower, arm.upper))
    far[:3, 3] += 3.0
    assert not inverse(arm, far).valid.any()
    near = inverse_near(arm, far).position_error.min()
    assert 1.0 < near < 3.0 * math.sqrt(3.0)


def test_a_pose_that_is_none_is_refused(arm):
    bad = np.eye(4)
    bad[0, 0] = 2.0
    with pytest.raises(ValueError, match="is no rigid pose"):
        inverse(arm, bad)


@pytest.mark.slow
def test_the_seventh_joint_stays_near_where_it_is(tmp_path):
    arm = manipulator_of(load_robot(robot_file(tmp_path, "panda", FOLDED["panda"])))
    q = 0.6 * sets(arm, 1, seed=3)[0] + 0.2 * (arm.lower + arm.upper)
    target = forward(arm, q)
    target[:3, 3] += 0.01
    nearest = goals_at(arm, target, q)[0]
    assert np.abs(nearest - q).max() < 0.15
    off = np.linalg.svd(jacobian(arm, q))[2][-1] @ (nearest - q)
    assert abs(off) < 0.01  # hardly any of it along the self-motion


@pytest.mark.slow
def test_a_line_of_the_tool_is_straight(arm):
    middle = 0.5 * (arm.lower + arm.upper)
    start = middle + 0.3 * np.sin(np.arange(arm.count) + 1.0)
    (line,) = tool_lines(arm, start[None], 0.1)
    assert line.length > 0.02
    at = forward(arm, line.path.at(np.linspace(0.0, line.length, 20))[0])
    away = at[:, :3, 3] - at[0, :3, 3]
    across = away - (away @ at[0, :3, 0])[:, None] * at[0, :3, 0]
    assert np.linalg.norm(across, axis=1).max() < 2e-4


@pytest.mark.slow
def test_following_stops_at_limits(arm):
    target = forward(arm, arm.upper)
    found, _ = followed(arm, arm.upper[None] - 0.1, target[None])
    assert (found <= arm.upper).all()


def inside(points, capsules) -> np.ndarray:
    held = np.zeros(len(points), dtype=bool)
    for capsule in capsules:
        start, along = capsule.ends[0], capsule.ends[1] - capsule.ends[0]
        share = np.clip((points - start) @ along / max(along @ along, 1e-18), 0.0, 1.0)
        off = np.linalg.norm(points - start - share[:, None] * along, axis=1)
        held |= off <= capsule.radius + 1e-9
    return held


@pytest.mark.parametrize("sides", [(0.1, 0.2, 0.5), (0.3, 0.3, 0.02), (0.1, 0.1, 0.1)])
def test_boxes_lie_within_their_capsules(sides):
    points = np.random.default_rng(2).uniform(-0.5, 0.5, (2000, 3)) * sides
    points[:1000] = np.sign(points[:1000]) * 0.5 * sides  # corners
    assert inside(points, around_box(sides)).all()


@pytest.mark.parametrize(("radius", "length"), [(0.05, 0.4), (0.1, 0.02), (0.1, 0.2)])
def test_cylinders_lie_within_their_capsules(radius, length):
    angle = np.linspace(0.0, 6.28, 100)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(100, 0.5 * length)], 1)
    assert inside(np.concatenate([rim, rim * (1, 1, -1)]), around_cylinder(radius, length)).all()


def club() -> np.ndarray:
    """Small triangles of a thin bar with a thick end."""
    rng = np.random.default_rng(5)
    middle = rng.uniform(-0.5, 0.5, (300, 1, 3)) * (1.0, 0.04, 0.04)
    middle[:100] = rng.uniform(-0.5, 0.5, (100, 1, 3)) * (0.2, 0.3, 0.3) + (0.5, 0.0, 0.0)
    return middle + rng.uniform(-0.01, 0.01, (300, 3, 3))


def test_meshes_lie_within_their_capsules_cut_where_it_is_worth_it():
    capsules = around_mesh(club())
    assert len(capsules) > 1
    share = np.random.default_rng(6).dirichlet((1, 1, 1), len(club()))
    assert inside(np.einsum("nk,nki->ni", share, club()), capsules).all()


def test_a_capsule_within_another_is_left_out():
    long, short = around_cylinder(0.05, 0.4), around_cylinder(0.05, 0.3)
    assert list(without_covered([*short, *long])) == long


def test_meshes_are_read_as_text_binary_and_obj(tmp_path):
    corners = np.zeros((2, 3, 3), "<f4")
    corners[0, 1, 0] = corners[0, 2, 1] = corners[1, 1, 1] = corners[1, 2, 2] = 1.0
    text = "solid a\n" + "".join(
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in one)
        + "endloop\nendfacet\n"
        for one in corners
    )
    (tmp_path / "a.stl").write_text(text + "endsolid\n")
    records = b"".join(bytes(12) + one.tobytes() + bytes(2) for one in corners)
    (tmp_path / "b.STL").write_bytes(b"solid".ljust(80) + (2).to_bytes(4, "little") + records)
    lines = [f"v {x} {y} {z}" for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))]
    (tmp_path / "c.obj").write_text("\n".join([*lines, "f 1/1 2/1 3/1", "f -4 3 4"]))
    for name in ("a.stl", "b.STL", "c.obj"):
        assert np.array_equal(triangles(tmp_path / name), corners), name
    found = mesh_file("package://some_description/a.stl", tmp_path / "..".replace("..", "."))
    assert found.name == "a.stl"


def refused(path: Path) -> str:
    with pytest.raises(FileError) as caught:
        load_arm(path)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('name="joint3" type="revolute"', 'name="joint3" type="prismatic"', "'joint3' slides"),
        ('name="joint3" type="revolute"', 'name="joint3" type="fixed"', "5 joints turn"),
        ('name="joint3" type="revolute"', 'name="joint3" type="continuous"', "without end"),
        ('velocity="5.2"', "", "'joint3' has no velocity"),
        ('lower="-3.49"', 'lower="3.49"', "no lower below upper"),
        ("<collision>", "<nothing>", "no link of the arm has a <collision> shape"),
        ('<sphere radius="0.055"/>', '<mesh filename="a.dae"/>', "'a.dae', which is not there"),
        ('<sphere radius="0.055"/>', '<sphere radius="0"/>', "needs radius above 0"),
        (
            "</robot>",
            '<link name="w"/><joint name="wheel" type="continuous"><parent link="panda_link3"/>'
            '<child link="w"/></joint></robot>',
            "the arm branches: joint 'wheel' moves 'w'",
        ),
        (
            '<axis xyz="1 0 0"/><limit lower="-4.71"',
            '<mimic joint="joint1"/><axis xyz="1 0 0"/><limit lower="-4.71"',
            "mimics another",
        ),
    ],
)
def test_what_is_no_such_arm_is_refused_with_its_reason(old, new, told, tmp_path):
    path = arm_file(tmp_path, "ball")
    text = ball_urdf()
    assert old in text
    text = text.replace(old, new).replace(
        "</collision>", "</nothing>" if "<no" in new else "</collision>"
    )
    (tmp_path / "ball.urdf").write_text(text)
    assert told in refused(path)


def test_an_unreadable_mesh_is_named_with_what_to_do(tmp_path):
    path = arm_file(tmp_path, "ball")
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    text = ball_urdf().replace('<sphere radius="0.055"/>', '<mesh filename="a.dae"/>')
    (tmp_path / "ball.urdf").write_text(text)
    assert "mesh a.dae; STL and OBJ are read: convert it" in refused(path)


def with_mesh(folder: Path, made: str = "ball.urdf") -> Path:
    """The rover with a ball wrist, one of whose shapes is a mesh beside the description."""
    path = robot_file(folder, "ball", FOLDED["ball"])
    corners = [(-0.05, 0, 0), (0.05, 0, 0), (0, 0.05, 0), (0, 0, 0.05)]
    lines = [*(f"v {x} {y} {z}" for x, y, z in corners), "f 1 2 3", "f 1 2 4", "f 2 3 4"]
    text = ball_urdf().replace('<sphere radius="0.055"/>', '<mesh filename="../meshes/a.obj"/>')
    for name, content in (("meshes/a.obj", "\n".join(lines)), (f"description/{made}", text)):
        (folder / name).parent.mkdir()
        (folder / name).write_text(content)
    own = folder / "ball.yaml"
    own.write_text(own.read_text().replace("file: ball.urdf", f"file: description/{made}"))
    (folder / "ball.urdf").unlink()
    return path


def test_what_was_read_suffices_for_the_robot_where_its_files_are_not(tmp_path):
    path = with_mesh(tmp_path)
    with noting() as read:
        robot = load_robot(path)

    shutil.rmtree(tmp_path)
    with instead(read):
        assert load_robot(path) == robot


def test_of_a_xacro_the_expansion_and_its_meshes_suffice(tmp_path):
    pytest.importorskip("xacro", reason="needs the extra urdf")
    path = with_mesh(tmp_path, "ball.urdf.xacro")
    main = tmp_path / "description" / "ball.urdf.xacro"
    head, body = main.read_text().split(">", 1)
    spaced = f'{head} xmlns:xacro="http://www.ros.org/wiki/xacro">'
    part = body.removesuffix("</robot>").replace("0.448", "${reach}")
    wrapped = f'{spaced}<xacro:macro name="all" params="reach">{part}</xacro:macro></robot>'
    (main.parent / "part.xacro").write_text(wrapped)
    main.write_text(
        f'{spaced}<xacro:include filename="part.xacro"/><xacro:all reach="0.448"/></robot>'
    )
    with noting() as read:
        robot = load_robot(path)
    frames = [matrix(step) for step in robot.arm.model.placements[:3]]
    height = np.linalg.multi_dot(frames)[2, 3]
    assert height == pytest.approx(sum(step[2] for step in BALL_STEPS[:3]))

    shutil.rmtree(tmp_path)
    with instead(read):
        assert load_robot(path) == robot


def test_joints_of_the_arm_file_count_for_those_of_the_urdf(tmp_path):
    own = "{lower: -1, upper: 1, speed: 0.5, torque: 3}"
    arm = load_arm(arm_file(tmp_path, "panda", f"joints: {{panda_joint2: {own}}}\n"))
    assert arm.joints["panda_joint2"].speed == 0.5
    assert arm.joints["panda_joint4"].lower == -3.0718
    (tmp_path / "panda.yaml").unlink()
    path = arm_file(tmp_path, "panda", f"joints: {{panda_joint: {own}}}\n")
    assert "the arm has no joint 'panda_joint'" in refused(path)


def test_fixed_links_are_folded_in_and_what_hangs_on_the_flange_is_not(tmp_path):
    plain = load_arm(arm_file(tmp_path, "panda"))
    more = (
        '<link name="box"><inertial><mass value="1"/></inertial><collision><geometry>'
        '<sphere radius="0.3"/></geometry></collision></link>'
        '<joint name="stuck" type="fixed"><parent link="panda_link{}"/><child link="box"/></joint>'
    )
    for link, count in ((8, 0), (5, 1)):
        text = panda_urdf().replace("</robot>", more.format(link) + "</robot>")
        (tmp_path / "panda.urdf").write_text(text)
        found = load_arm(tmp_path / "panda.yaml")
        assert sum(c.radius == 0.3 for c in found.capsules) == count
        assert found.masses["panda_link5"].mass == pytest.approx(
            plain.masses["panda_link5"].mass + count
        )


def test_a_folded_pose_of_too_few_joints_is_refused(tmp_path):
    with pytest.raises(FileError, match=r"6 joint angles; it has 7"):
        load_robot(robot_file(tmp_path, "panda", FOLDED["ball"]))


def test_robot_files_describe_and_calibrate_ur_arms_only(tmp_path):
    path = robot_file(tmp_path, "panda", FOLDED["panda"])
    text = path.read_text().replace("calibration: null", "calibration: robotnik_ur10")
    path.write_text(text)
    with pytest.raises(FileError, match="is for UR arms; panda is described by its own URDF"):
        load_robot(path)
