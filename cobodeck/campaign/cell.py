"""One run of a campaign: what is run, and in which world."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from cobodeck.setup import PROFILE, SCENE, TICK_HZ
from engine.files.declared import is_path


@dataclass(frozen=True, slots=True)
class CampaignCell:
    """A run: names and files as `simulate` takes them; None stands for the scene's own.

    Without `chart` it is the profile's. `sets` are values of the profile and `inputs` those of the
    chart, as KEY=VALUE. `duration_s` limits the run, s. `judge`: find out how many contacts could
    have been avoided. `repetition` tells runs apart that differ by chance alone.
    """

    chart: str | None = None
    scene: str = SCENE
    user: str | None = None
    robot: str | None = None
    profile: str = PROFILE
    sets: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    tier: int = 1
    tick_hz: int = TICK_HZ
    requests: int | None = None
    duration_s: float | None = None
    judge: bool = False
    repetition: int = 0

    @property
    def seed(self) -> int:
        """The seed of all chance: 32 bits, from what the world is.

        What is compared (chart, robot, profile, tier, tick rate) does not count, so that all
        variants meet the same people: with common random numbers, differences between variants
        vary less than figures do (Law, Simulation Modeling and Analysis, 5th ed., 11.2).
        """
        world = (bare_name(self.scene), bare_name(self.user), self.requests, self.duration_s)
        text = json.dumps((*world, self.repetition))
        entropy = int.from_bytes(hashlib.sha256(text.encode()).digest())
        return int(np.random.SeedSequence(entropy).generate_state(1)[0])

    def key(self) -> dict[str, Any]:
        """Every field by name, for JSON."""
        return {name: _plain(value) for name, value in asdict(self).items()}

    def content(self) -> dict[str, Any]:
        """As `key`, with files by their names alone: equal wherever they lie."""
        named = ("chart", "scene", "user", "robot", "profile")
        return self.key() | {name: bare_name(getattr(self, name)) for name in named}


def bare_name(name: str | None) -> str | None:
    """A file by its name alone; other names as they are."""
    return PurePath(name).name if name is not None and is_path(name) else name


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
