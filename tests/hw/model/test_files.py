"""Rules for every file of this folder: its YAML in damaged forms, and what importing it brings."""

import random
import subprocess
import sys
from pathlib import Path

import pytest

from engine.files.finding import FileError
from hw.model.robot import FOLDER as ROBOTS, load_robot
from hw.people.walking.script import FOLDER as USERS, load_script
from hw.scene.scene import FOLDER as SCENES, load_scene

FILES = [
    *((path, load_scene) for path in sorted(SCENES.glob("*.yaml"))),
    *((path, load_robot) for path in sorted(ROBOTS.glob("*.yaml"))),
    *((path, load_script) for path in sorted(USERS.glob("*.yaml"))),
]


def damaged(data, chance):
    lines = data.split(b"\n")
    i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
    kind = chance.randrange(6)
    if kind == 0:
        del lines[i]
    elif kind == 1:
        lines[i], lines[j] = lines[j], lines[i]
    elif kind == 2:
        lines[i] = chance.randbytes(12)
    elif kind == 3:
        at = chance.randrange(len(lines[i]) + 1)
        lines[i] = lines[i][:at] + chance.choice(b"{}[]:,-#'\"&*!x09.").to_bytes() + lines[i][at:]
    elif kind == 4:
        at = chance.randrange(len(lines[i]) + 1)
        lines[i] = lines[i][:at] + lines[i][at + 1 :]
    else:
        lines[i] = lines[i].replace(b"0", chance.choice([b"nan", b"1e999", b"-", b"true", b"[]"]))
    return b"\n".join(lines)


@pytest.mark.parametrize(("path", "load"), FILES, ids=lambda value: getattr(value, "stem", ""))
def test_a_damaged_file_still_loads_or_is_an_error_with_its_name(tmp_path, path, load):
    chance = random.Random(path.name)
    refused = []
    for _ in range(60):
        target = tmp_path / path.name
        target.write_bytes(damaged(path.read_bytes(), chance))
        try:
            load(target)
        except FileError as failure:
            refused.append(failure)
    assert len(refused) >= 10
    assert all(
        finding.place.file.endswith(".yaml") and finding.message
        for failure in refused
        for finding in failure.findings
    )


def test_people_and_scenes_are_importable_without_numerical_libraries():
    program = (
        "import sys, hw.people.user, hw.sim.scripted_samples\n"
        "from hw.scene.scene import load_scene\n"
        "scene = load_scene('study')\n"
        "hw.people.user.open_user('study', scene).step(0, scene.robot_start, False)\n"
        "print(sorted({'numpy', 'shapely', 'scipy', 'numba', 'engine.state'} & set(sys.modules)))\n"
    )
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=root, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
