"""Begins records, under names that tell the runs apart."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from cobodeck.console import USAGE, Problem
from cobodeck.loop import Loop
from cobodeck.record.header import attachments, header, kind_of
from cobodeck.record.recorder import Description, Recorder
from cobodeck.record.scenery import scene_update
from cobodeck.record.sink import ENDING, Sink, Taken, open_free
from cobodeck.stage import Options
from cobodeck.wiring import Setup

FOLDER = Path("out")
_LONGEST = 30
"""Letters of each part of a default name; file systems take 255 bytes in all."""


def default_name(setup: Setup, options: Options, at: datetime, kind: str | None = None) -> str:
    """`KIND-CHART-SCENE-PERSON-PROFILE-SEED-TIME`, of letters that are safe in names of files."""
    where = setup.robot.name if setup.scene is None else setup.scene.name
    scenes = None if setup.scene is None else setup.scene.user
    person = Path(str(options.user or scenes or "nobody").partition("@")[0]).name
    parts = (
        kind or kind_of(options),
        setup.chart.name,
        where,
        person,
        setup.profile.name,
        options.seed,
    )
    short = [str(part)[:_LONGEST] for part in parts]
    return re.sub(r"[^\w.-]", "_", "-".join([*short, f"{at:%Y%m%dT%H%M%S}"]), flags=re.ASCII)


def recorder(
    setup: Setup,
    options: Options,
    path: Path | None,
    at: datetime,
    tell: Callable[[str], None],
    kind: str | None = None,
) -> Recorder | None:
    """A recorder, by default in `out/`; None, and why, where no file can be made.

    `kind` of plant: by default what the options say.

    Raises:
        Problem: the file asked for exists.
    """
    named = path or FOLDER / (default_name(setup, options, at, kind) + ENDING)
    try:
        sink = open_free(named) if path is None else Sink(path)
    except Taken as taken:
        raise Problem(str(taken), USAGE) from None
    except OSError as error:
        tell(f"no record: {error.filename or named}: {error.strerror}")
        return None
    began = at.astimezone(UTC).isoformat(timespec="milliseconds")
    describe = partial(_described, setup, options, began, kind or kind_of(options))
    return Recorder(sink, describe, tell)


def _described(setup: Setup, options: Options, began: str, kind: str, loop: Loop) -> Description:
    found = header(setup, options, loop, sys.argv, began, kind)
    scene = setup.scene
    walls = None if scene is None else scene_update(scene, setup.robot.footprint)
    return Description(found, attachments(setup), walls)
