"""Recorded walks, where they are, and scripted people in an empty hall."""

from __future__ import annotations

from pathlib import Path

import pytest

from hw.people.walking.manner import ATTENTIVE
from hw.people.walking.script import load_script
from hw.people.walking.walker import Walker
from hw.scene.room import Room

WALKING = (Path(__file__).resolve().parents[3] / "../shared/data/walking").resolve()
HALL = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 12.0), (0.0, 12.0)))


def shared(name: str) -> Path:
    if not (WALKING / name).is_file():
        pytest.skip(f"no {WALKING / name}")
    return WALKING / name


def someone(tmp_path, steps, start=(2.0, 6.0, 0.0), room=HALL, manner=ATTENTIVE, seed=0):
    path = tmp_path / "someone.yaml"
    x, y, yaw = start
    path.write_text(f"user: someone\nstart: {{x: {x}, y: {y}, yaw: {yaw}}}\nsteps:\n{steps}")
    return Walker(load_script(path), room, manner=manner, seed=seed)
