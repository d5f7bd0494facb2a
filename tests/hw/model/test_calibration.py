"""A calibration belongs to an arm: every other arm refuses it, by name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from engine.files.finding import FileError
from hw.model.arm import ALIKE, ALIKE_TURN, arm_names, arms_of, load_arm
from hw.model.calibration import load_calibration
from hw.model.prop import Placement
from hw.model.robot import FOLDER, load_robot

DH = {name: load_arm(name).dh for name in arm_names()}
SIGNS = (1, -1, 1, 1, -1, -1)


def robot_file(folder: Path, arm: str, calibration: str) -> Path:
    """A robot with this arm and calibration, and a prop that any arm holds."""
    prop = (FOLDER.parent / "props" / "prop.yaml").read_text().splitlines()
    keys = ("parked:", "parked_paper:", "  ur")
    (folder / "held.yaml").write_text(
        "\n".join(line for line in prop if not line.startswith(keys))
        + "\nparked: [-1.7, -1.25, -1.5, 0, 0.2, -1.6]\n"
    )
    text = (FOLDER / "rbkairos_ur10.yaml").read_text()
    text = text.replace("model: ur10", f"model: {arm}").replace("prop: prop", "prop: ./held.yaml")
    path = folder / f"{arm}.yaml"
    path.write_text(text.replace("calibration: null", f"calibration: {calibration}"))
    return path


def calibration_file(path: Path, chain: Sequence[Placement]) -> None:
    frames = "".join(f"  - {{xyz: {[*p.xyz]}, rpy: {[*p.rpy]}}}\n" for p in chain)
    path.write_text(f"calibration: {path.stem}\nchain:\n{frames}")


def measured(arm: str, signs: Sequence[int]) -> list[Placement]:
    """A chain that is off by as much as calibrations are: 3 mm and 8 mrad per joint at most."""
    return [
        Placement(
            tuple(x + signs[n - k] * 0.0017 for k, x in enumerate(p.xyz)),
            (p.rpy[0] + signs[n - 3] * 0.008, p.rpy[1], p.rpy[2]),
        )
        for n, p in enumerate(DH[arm].placements())
    ]  # fmt: skip


@pytest.mark.requirement(17)
def test_every_arm_accepts_its_own_calibration_and_no_other():
    for of in DH:
        assert [arm for arm in DH if DH[arm].misfit(measured(of, SIGNS)) is None] == [of]


@pytest.mark.slow
@pytest.mark.requirement(17)
@pytest.mark.parametrize("of", DH)
def test_a_robot_with_the_calibration_of_another_arm_is_refused_by_name(tmp_path, of):
    calibration_file(tmp_path / "mine.yaml", measured(of, SIGNS))
    for arm in DH:
        path = robot_file(tmp_path, arm, "./mine.yaml")
        if arm == of:
            assert load_robot(path).arm.calibration == load_calibration(tmp_path / "mine.yaml")
            continue
        with pytest.raises(FileError) as caught:
            load_robot(path)
        (finding,) = caught.value.findings
        assert (finding.place.line, Path(finding.place.file)) == (25, path)
        assert f"arm.calibration: is that of {of}, not of {arm}: its joint " in str(caught.value)


@pytest.mark.requirement(17)
@pytest.mark.parametrize("arm", ["ur10", "ur10e"])
def test_the_shipped_calibration_is_that_of_a_ur10(tmp_path, arm):
    path = robot_file(tmp_path, arm, "robotnik_ur10")
    if arm == "ur10":
        assert load_robot(path).arm.calibration == load_calibration()
    else:
        with pytest.raises(FileError, match=f"is that of ur10, not of {arm}: its joint 1 is"):
            load_robot(path)


@given(
    st.sampled_from([*DH]), st.integers(0, 5), st.integers(0, 2),
    st.floats(-3.0, 3.0), st.booleans(),
)  # fmt: skip
def test_one_frame_that_is_moved_or_turned_is_refused_from_a_bound_on(arm, joint, axis, off, turns):
    """The frame is compared with a rotation by scipy."""
    chain = list(DH[arm].placements())
    xyz, rpy = [*chain[joint].xyz], [*chain[joint].rpy]
    own = Rotation.from_euler("xyz", rpy)
    (rpy if turns else xyz)[axis] += off * (ALIKE_TURN if turns else ALIKE)
    chain[joint] = Placement(tuple(xyz), tuple(rpy))
    away = math.dist(xyz, DH[arm].placements()[joint].xyz)
    angle = (own.inv() * Rotation.from_euler("xyz", rpy)).magnitude()
    if abs(away - ALIKE) > 1e-9 and abs(angle - ALIKE_TURN) > 1e-9:
        refused = away > ALIKE or angle > ALIKE_TURN
        assert (DH[arm].misfit(chain) is not None) == refused


def test_a_chain_of_no_known_arm_says_so(tmp_path):
    assert arms_of(load_calibration()) == ["ur10"]
    chain = list(DH["ur5"].placements())
    chain[2] = Placement((-0.45, 0.0, 0.0))
    calibration_file(tmp_path / "odd.yaml", chain)
    with pytest.raises(
        FileError, match="is that of no known arm, not of ur5: its joint 3 is 25 mm"
    ):
        load_robot(robot_file(tmp_path, "ur5", "./odd.yaml"))


def test_a_frame_as_a_pose_turns_as_in_a_description():
    rpy = (0.3, -0.7, 2.1)
    pose = Placement((1.0, 2.0, 3.0), rpy).pose()
    x, y, z = Rotation.from_euler("xyz", rpy).apply((0.1, 0.2, 0.3))
    assert pose.transform(0.1, 0.2, 0.3) == pytest.approx((x + 1.0, y + 2.0, z + 3.0), abs=1e-14)
