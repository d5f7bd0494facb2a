"""A context of plain values, and a site, for tests of states."""

from __future__ import annotations

from typing import Any

import pytest

from behaviors.profile.profile import load_profile
from hw.model.robot import load_robot
from hw.scene.room import Room
from states.environment.environment import Environment

ROOM = Room(outer=((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0)))


def step(run: Any) -> str | tuple[str, Any] | None:
    """One step of a state: its outcome, or None while it is busy."""
    try:
        next(run)
    except StopIteration as stop:
        outcome: str | tuple[str, Any] = stop.value
        return outcome
    return None


@pytest.fixture
def take_step() -> Any:
    return step


@pytest.fixture(scope="session")
def environment() -> Environment:
    return load_profile("tuned").environment(ROOM, load_robot("rbkairos_ur10"))
