"""Where runs are kept, and names that tell them apart."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

from cobodeck.record.format.record_header import kind_of
from cobodeck.setup import Options, Setup

FOLDER = Path("out")
_LONGEST = 30
"""Longest part of a default name, in letters; file systems allow 255 bytes in all."""


def default_name(setup: Setup, options: Options, at: datetime) -> str:
    """`KIND-CHART-SCENE-PERSON-PROFILE-SEED-TIME`, in characters that are safe in file names."""
    where = setup.robot.name if setup.scene is None else setup.scene.name
    scenes = None if setup.scene is None else setup.scene.user
    person = Path(str(options.user or scenes or "nobody").partition("@")[0]).name
    profile, seed = setup.profile.name, options.seed
    parts = (kind_of(options), setup.chart.name, where, person, profile, seed)
    short = [str(part)[:_LONGEST] for part in parts]
    return re.sub(r"[^\w.-]", "_", "-".join([*short, f"{at:%Y%m%dT%H%M%S}"]), flags=re.ASCII)
