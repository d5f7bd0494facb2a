"""A driver of a UR arm for a robot without one is told while its file is checked."""

import json
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from tests.hw.model.differential_rover import runner
from tests.states.arm.other_arms import robot_file

WRITTEN = """\
connection: own
model: ./{}.yaml
parts:
  wrench: {{driver: UrWrench, host: 192.0.2.1}}
"""


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("runner", "runner has no arm, and this is the driver of a UR arm: take the entry out"),
        ("rover_panda", "rover_panda has the arm panda, and this driver speaks to UR arms"),
        pytest.param("rbkairos_ur10", None, marks=pytest.mark.slow),
    ],
)
def test_a_robot_without_a_ur_arm_is_told_at_its_driver(
    name: str, told: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runner(tmp_path)
    robot_file(tmp_path, "panda", "[-0.64, -0.57, 0.44, -1.78, -0.49, 1.57, 1.68]")
    file = tmp_path / "own.yaml"
    text = WRITTEN.format(name)
    file.write_text(text if told else text.replace("./rbkairos_ur10.yaml", name))

    assert (main(["validate", str(file)]) == 0) is (told is None)

    found = capsys.readouterr()
    said = found.out + found.err
    assert told is None or (told in said and "own.yaml:4:20" in said)


def test_the_doctor_heads_it_with_the_entry(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runner(tmp_path)
    file = tmp_path / "own.yaml"
    file.write_text(WRITTEN.format("runner"))

    assert main(["doctor", "--robot", str(file), "--json"]) != 0

    checks = json.loads(capsys.readouterr().out)["checks"]
    [told] = [check for check in checks if "has no arm" in check["about"]]
    assert (told["what"], told["state"]) == ("parts.wrench", "bad")
