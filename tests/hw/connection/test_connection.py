"""Connections: what serves which part, and how far it may narrow the body."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from engine.files.finding import FileError
from hw.connection.connection import FOLDER, Narrowed, connection_names, load_connection
from hw.model.robot import MotionLimits, load_robot

BODY = load_robot("rbkairos_ur10")
ROVER = """connection: rover
model: rbkairos_ur10
parts:
  base: {driver: "hw.nothing:Base", link: bus}
  chain: {driver: "hw.nothing:Chain", hardware: {driver: "hw.nothing:Wheels", deep: {driver: 3}}}
links:
  bus: {driver: "hw.nothing:Bus"}
"""


def written(folder: Path, text: str) -> str:
    file = folder / "rover.yaml"
    file.write_text(text)
    return str(file)


def refused(folder: Path, text: str) -> str:
    with pytest.raises(FileError) as failure:
        load_connection(written(folder, text))
    return str(failure.value)


def test_every_connection_that_is_shipped_can_be_read() -> None:
    assert "mock" in connection_names()
    for name in connection_names():
        found = load_connection(name)
        assert found.name == name
        assert found.known_as == name
        assert found.file == str(FOLDER / f"{name}.yaml")
        assert found.about
        assert not (found.real and found.peers)
        for served in (found.parts | found.links | found.peers).values():  # to other processes
            assert pickle.loads(pickle.dumps(served.arguments)) == served.arguments


def test_one_of_ones_own_is_found_by_its_file_and_known_by_its_text(tmp_path: Path) -> None:
    first = load_connection(written(tmp_path, ROVER))
    second = load_connection(written(tmp_path, ROVER + "about: another\n"))

    assert first.known_as == first.file == str(tmp_path / "rover.yaml")
    assert first.sha256 != second.sha256


def test_drivers_inside_others_are_told_of_too(tmp_path: Path) -> None:
    found = load_connection(written(tmp_path, ROVER))

    named = {(entry, driver) for entry, _, driver in found.drivers}
    assert named == {
        ("links.bus", "hw.nothing:Bus"),
        ("parts.base", "hw.nothing:Base"),
        ("parts.chain", "hw.nothing:Chain"),
        ("parts.chain", "hw.nothing:Wheels"),
    }


WRONG = {
    "model: rbkairos_ur1": ("rover.yaml:2:8: ", "no such robot"),
    "limits: {speed: 9 m/s}": ("rover.yaml:8:17: ", "it may only narrow"),
    "limits: {brakes: 9.9 m/s2}": ("rover.yaml:8:18: ", "it may only narrow"),
    "limits: {yaw_rate: 19.9 rad/s}": ("rover.yaml:8:20: ", "it may only narrow"),
    "plant: mock": ("rover.yaml:2:8: ", "a mock has none; leave it out"),
    "peers: {fake: {driver: 'hw.x:F'}}\nreal: true": ("rover.yaml:8:", "has no fakes beside it"),
    "told: [3]": ("rover.yaml:8:8: ", "told"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_does_not_fit_is_told_with_its_place(wrong: str, tmp_path: Path) -> None:
    text = ROVER.replace("model: rbkairos_ur10", wrong) if "model" in wrong else ROVER + wrong

    told = refused(tmp_path, text)

    for expected in WRONG[wrong]:
        assert expected in told


@pytest.mark.parametrize("key", ["model", "parts"])
def test_only_a_mock_needs_no_body_and_no_parts(key: str, tmp_path: Path) -> None:
    text = {"model": 'parts: {base: {driver: "hw.x:B"}}', "parts": "model: rbkairos_ur10"}[key]

    assert f"the key '{key}' is missing" in refused(tmp_path, f"connection: c\n{text}\n")
    assert load_connection(written(tmp_path, "connection: c\nplant: mock\n")).model is None


figures = st.none() | st.floats(0.05, 5.0)


@given(figures, figures, figures, figures, figures)
def test_limits_only_ever_narrow(
    speed: float | None,
    yaw_rate: float | None,
    acceleration: float | None,
    yaw_acceleration: float | None,
    brakes: float | None,
) -> None:
    limits = Narrowed(speed, yaw_rate, acceleration, yaw_acceleration, brakes)
    before, motion = BODY.base, MotionLimits(base_speed=1.5, base_yaw_rate=1.2)

    after, slower = limits.body(BODY).base, limits.motion(motion)

    assert after.max_speed == min(before.max_speed, speed or before.max_speed)
    assert after.max_yaw_rate == min(before.max_yaw_rate, yaw_rate or before.max_yaw_rate)
    weakest = min(before.brake_deceleration, brakes or before.brake_deceleration)
    assert after.brake_deceleration == weakest
    assert slower.base_speed == min(1.5, speed or 1.5)
    assert slower.base_yaw_rate == min(1.2, yaw_rate or 1.2)
    assert slower.base_yaw_acceleration == min(1.0, yaw_acceleration or 1.0)
    assert slower.base_acceleration == min(0.5, acceleration or 0.5, brakes or 0.5)


@pytest.mark.parametrize(
    "name", ["UrArm", '"hw.drivers.ur.arm:UrArm"', '"hw.drivers.anywhere:UrArm"']
)
def test_a_driver_of_ours_is_its_class_wherever_a_file_says_it_is(
    tmp_path: Path, name: str
) -> None:
    text = ROVER.replace('"hw.nothing:Wheels"', name).replace('"hw.nothing:Base"', name)
    found = load_connection(written(tmp_path, text))

    named = {entry: driver for entry, _, driver in found.drivers}
    assert named["parts.base"] == "hw.drivers.ur.ur_arm:UrArm"
    assert "hw.drivers.ur.ur_arm:UrArm" in [d for e, _, d in found.drivers if "chain" in e]


def test_a_driver_that_is_nobodys_is_refused_with_the_nearest(tmp_path: Path) -> None:
    told = refused(tmp_path, ROVER.replace('"hw.nothing:Base"', "UrAm"))

    assert ":4:18: parts.base.driver: 'UrAm' names no driver" in told
    assert "did you mean 'UrArm'?" in told
