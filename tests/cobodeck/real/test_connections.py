"""Connections in commands: listed, checked, with a scene of their body, their limits everywhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.fitness.check_list import require
from cobodeck.project.state_catalogue import catalogue
from cobodeck.record.read.reader import Record
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.terminal.console import FAILED, OK, USAGE, Problem
from hw.connection.connection import connection_names, load_connection

ROOT = Path(__file__).resolve().parents[3]
SLOW = """connection: slow
model: rbkairos_ur10
scene: hall
limits: {speed: 0.3 m/s, brakes: 0.6 m/s2}
parts:
  base: {driver: "hw.connection.connection:Connection"}
"""


@pytest.fixture
def slow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slow.yaml").write_text(SLOW)
    return "slow.yaml"


def test_all_are_listed_with_what_they_serve(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "connections", "--json"]) == OK

    found = {one["connection"]: one for one in json.loads(capsys.readouterr().out)["connections"]}
    assert set(found) == set(connection_names())
    assert found["mock"]["parts"] == "all"
    for name, one in found.items():
        assert one["real"] == ("yes" if load_connection(name).real else "no")


def test_all_that_are_shipped_are_valid(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", str(ROOT / "hw" / "connections")]) == OK, capsys.readouterr().out


def test_all_that_are_shipped_take_drivers_of_ours_alone() -> None:
    for name in connection_names():
        require("import", connection=load_connection(name), packages={"hw"})


WRONG = {
    '"elsewhere.can:Base"': "5:18: error[D01] parts.base.driver: 'elsewhere' is the package of no",
    '"hw.drivers.nothing:Base"': "5:18: error[D01] parts.base.driver: there is no module",
    '"hw.sim.world:Wrld"': "5:18: error[D01] parts.base.driver: hw.sim.world has no 'Wrld'",
    '"hw.nothing.at_all:Base"': "5:18: error[D01] parts.base.driver: there is no module",
}


@pytest.mark.parametrize("driver", WRONG)
def test_drivers_that_are_not_there_are_told_of_without_importing_any(
    driver: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "c.yaml"
    file.write_text(
        f"connection: c\nmodel: rbkairos_ur10\nscene: hall\nparts:\n  base: {{driver: {driver}}}\n"
    )

    assert main(["validate", str(file)]) == FAILED

    assert WRONG[driver] in capsys.readouterr().out


def test_arguments_that_a_driver_does_not_take_or_lacks_are_told_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a class with a constructor, with that of its base, and of one that does not tell."""
    file = tmp_path / "c.yaml"
    file.write_text(
        "connection: c\nmodel: rbkairos_ur10\nscene: hall\n"
        "links:\n"
        "  unity: {driver: Unity, prot: 10000}\n"
        "parts:\n"
        "  arm: {driver: UrArm, host: loopback, hots: loopback, tells: unity}\n"
        "  rover_trackers: {driver: UnityRoverTrackers, link: unity, rate: 3}\n"
        '  base: {driver: "hw.connection.connection:Connection", any: 1}\n'
    )

    assert main(["validate", str(file)]) == FAILED

    told = capsys.readouterr().out
    for one in (
        "c.yaml:5:19: error[D01] links.unity.driver: Unity needs a 'port'\n",
        "c.yaml:5:32: error[D01] links.unity.prot: Unity takes no 'prot'\n",
        "c.yaml:7:46: error[D01] parts.arm.hots: UrArm takes no 'hots'\n",
        "c.yaml:8:67: error[D01] parts.rover_trackers.rate: UnityRoverTrackers takes no 'rate'\n",
        "did you mean 'port'?",
        "did you mean 'host'?",
    ):
        assert one in told
    assert told.count("error[") == 4, told


def test_a_driver_inside_an_entry_is_looked_at_too(slow: str) -> None:
    text = SLOW.replace("Connection", 'Connection", hardware: {driver: "os:system"}, x: "')
    Path(slow).write_text(text)

    with pytest.raises(Problem, match="'os' is the package of no project"):
        require("import", connection=load_connection(slow), packages=catalogue().packages)


def test_scene_and_connection_have_to_be_of_one_body(
    slow: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path(slow).write_text(SLOW.replace("rbkairos_ur10", "rbkairos_plus_ur10"))

    for scene in (["--scene", "lab_a"], []):
        assert main(["run", "cobodeck", "--robot", slow, *scene]) == USAGE

        told = capsys.readouterr().err
        assert f"scene {scene[1] if scene else 'hall'} is made for robot rbkairos_ur10" in told
        assert "connection slow is of rbkairos_plus_ur10" in told


def test_its_limits_are_those_of_chain_and_plans_alike(slow: str) -> None:
    setup = open_setup(robot=load_connection(slow))
    world = stage(setup, Options()).plant

    assert setup.scene is not None
    assert setup.scene.name == "hall"
    assert setup.body.base.max_speed == setup.environment.robot.base.max_speed == 0.3
    assert setup.environment.limits.base_speed == 0.3
    assert setup.environment.limits.base_acceleration <= 0.6
    assert all(
        subsystem.max_speed <= 0.3
        for subsystem in (
            setup.environment.navigation.named(name) for name in ("chase", "haptic", "escape")
        )
    )
    assert world.guard is not None
    assert world.guard.chain.limits.speed == 0.3


def test_a_simulation_with_them_never_goes_faster_and_is_repeated_by_its_record(
    slow: str, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ["simulate", "cobodeck", "--robot", slow, "--duration", "20", "--json"]
    assert main([*call, "--record", "slow.mcap"]) == OK
    figures: dict[str, Any] = json.loads(capsys.readouterr().out)
    record = Record(Path("slow.mcap"))

    assert figures["scene"] == "hall"
    assert 0.5 < figures["distance_m"] < 0.3 * 20.0
    assert record.header["connection"] == {
        "name": "slow",
        "sha256": load_connection(slow).sha256,
        "real": False,
    }
    assert record.header["limits"]["speed"] == 0.3

    Path(slow).write_text(SLOW.replace("0.3", "0.4"))  # the record has its own
    assert main(["replay", "slow.mcap", "--check"]) == OK
