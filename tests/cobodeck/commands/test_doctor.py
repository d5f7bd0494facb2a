"""The doctor tells what is missing, and which other packages hide ours."""

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.checks import machine_checks
from cobodeck.terminal.console import FAILED, OK


def test_here_everything_that_is_needed_is_found(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--json"]) == OK

    checks = json.loads(capsys.readouterr().out)["checks"]
    found = {check["what"]: check["state"] for check in checks}
    assert found["python"] == "ok"
    assert "bad" not in found.values()


def test_a_package_that_hides_ours_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "states.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))

    assert main(["doctor"]) == FAILED

    told = capsys.readouterr().out
    assert re.search(rf"package states +bad +{tmp_path}/states.py: it hides", told)
    assert "package engine" not in told


def test_a_library_for_some_machines_only_is_no_failure() -> None:
    advice = machine_checks.advice("ur-rtde>=1.6.0", "platform_machine == 'x86_64'")

    assert "the rest works without it" in advice
    assert "no UR arm" in advice
    assert "UR" not in machine_checks.advice("pygraphviz>=2.0", "sys_platform == 'linux'")
    assert machine_checks.advice("numpy>=2.0", "") == "pip install 'numpy>=2.0'"


LOOKED_AT: dict[tuple[str, ...], dict[str, Any]] = {}
"""What was told of a shipped scene; a look at a floor takes a second."""


def looked_at(
    capsys: pytest.CaptureFixture[str], *arguments: str, code: int = OK
) -> dict[str, Any]:
    if arguments not in LOOKED_AT:
        assert main(["doctor", *arguments, "--json"]) == code
        found = json.loads(capsys.readouterr().out)["checks"]
        LOOKED_AT[arguments] = {check["what"]: (check["state"], check["about"]) for check in found}
    return LOOKED_AT[arguments]


@pytest.mark.requirement(126)
@pytest.mark.parametrize(
    ("profile", "angle", "tolerance"),
    [("paper", 60, 0.2), ("tuned", 60, 0.05)],
)
@pytest.mark.few(1)
def test_the_wall_distance_a_user_needs_is_told(
    capsys: pytest.CaptureFixture[str], profile: str, angle: int, tolerance: float
) -> None:
    needed = 0.85 + math.cos(math.radians(angle)) + 1.0 + tolerance
    state, about = looked_at(capsys, "--scene", "lab_a", "--profile", profile)["wall ahead"]

    assert state == "ok"
    assert f"needs {needed:.2f} m for the Haptic pose at {angle} deg" in about


@pytest.mark.requirement(126)
def test_places_without_a_haptic_pose_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a corridor 2.3 m wide the robot's centre has a strip of 0.3 m, along the middle."""
    file = tmp_path / "corridor.yaml"
    file.write_text(
        "scene: corridor\nroom: {outer: [[0, 0], [12, 0], [12, 2.3], [0, 2.3]]}\n"
        "robot: {start: {x: 6, y: 1.15}}\n"
    )

    found = looked_at(capsys, "--scene", str(file), code=FAILED)

    state, about = found["room corridor"]
    assert state == "bad"
    assert "too small for all behaviours" in about
    match = re.search(
        r"none for ([\d.]+)% of user poses, at (\d+) of (\d+) places", found["haptic poses"][1]
    )
    assert match is not None
    share, places, all_places = (float(number) for number in match.groups())
    assert 30.0 < share < 100.0
    assert places == all_places


@pytest.mark.requirement(3)
def test_both_radii_of_the_robot_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    _, about = looked_at(capsys, "--scene", "lab_a", "--profile", "tuned")["robot"]

    assert "corners 0.725 m" in about  # half the diagonal of 1.13 x 0.91 m
    assert "0.77 m kept" in about


@pytest.mark.requirement(3)
def test_what_the_acceleration_means_for_escape_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    _, about = looked_at(capsys, "--scene", "lab_a", "--profile", "paper")["escape"]

    assert f"1.27 m aside takes {(2 * 1.27 / 1.5) ** 0.5:.2f} s" in about
    assert f"{(2 * 1.27 / 3.0) ** 0.5:.2f} s with its brakes' 3 m/s2" in about


@pytest.mark.requirement(126)
@pytest.mark.parametrize("profile", ["paper", "tuned"])
def test_space_and_doctor_report_the_same_of_a_room(
    capsys: pytest.CaptureFixture[str], profile: str
) -> None:
    assert main(["space", "lab_a", "--profile", profile, "--json"]) == OK
    space = json.loads(capsys.readouterr().out)

    found = looked_at(capsys, "--scene", "lab_a", "--profile", profile)

    assert f"none for {space['no_haptic_pose_share']:.1%} of" in found["haptic poses"][1]
    assert f"{space['wall_ahead_m']['60']:.2f} m for" in found["wall ahead"][1]
    usable = f"{space['usable_m2']:.1f} of {space['free_m2']:.1f} m2"
    assert usable in found["floor"][1]


def test_a_library_with_extras_is_found_by_its_name() -> None:
    assert ("python-can", "ok") in [(one.what, one.state) for one in machine_checks.libraries()]


@pytest.mark.requirement(46, 142)
def test_the_arm_of_a_scene_or_a_connection_is_told_with_what_a_reach_asks_of_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for found in (
        looked_at(capsys, "--scene", "study"),
        looked_at(capsys, "--robot", "mock")
        | looked_at(capsys, "--scene", "lab_a", "--profile", "tuned"),
    ):
        state, folded = found["arm ur10"]
        clear = re.search(r"folded with prop it is (\d+) mm clear", folded)
        assert state == "ok"
        assert clear is not None
        assert int(clear[1]) >= 15
        state, reach = found["reach"]
        told = re.search(
            r"1\.2 m high, 1 m ahead, in ([\d.]+) s, with (\d+)% of the torque .*, ([\d.]+) kg m/s "
            r"and (\d+) W; its installation allows 25 kg m/s and 300 W", reach,
        )  # fmt: skip
        assert state == "ok"
        assert told is not None
        seconds, torque, momentum, power = map(float, told.groups())
        assert 1.0 < seconds < 2.5
        assert 20 < torque < 60
        assert 3.0 < momentum < 25.0
        assert 20 < power < 300


@pytest.mark.slow
def test_an_arm_beyond_its_installation_is_bad(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shipped = Path(__file__).resolve().parents[3] / "hw"
    robot = (shipped / "robots/rbkairos_ur10.yaml").read_text()
    weak = "calibration: null\n  installation: {power: 300 W, momentum: 2 kg m/s}"
    (tmp_path / "weak.yaml").write_text(robot.replace("calibration: null", weak))
    scene = (shipped / "scenes/study.yaml").read_text()
    (tmp_path / "room.yaml").write_text(scene.replace("rbkairos_ur10", "./weak.yaml"))
    found = looked_at(capsys, "--scene", str(tmp_path / "room.yaml"), code=FAILED)
    assert found["reach"][0] == "bad"
    assert "allows 2 kg m/s" in found["reach"][1]
