"""Starts records."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from cobodeck.loop import Loop
from cobodeck.record.format import (
    FOLDER,
    Sink,
    Taken,
    attachments,
    default_name,
    header,
    header_of_replay,
    open_free,
)
from cobodeck.record.read import Record
from cobodeck.record.write.mcap_file import McapFile
from cobodeck.record.write.run_file import RunFile
from cobodeck.record.write.run_recorder import Describe, Recorder, RunDescription
from cobodeck.record.write.scenery import fixed_frames, scene_update
from cobodeck.setup import Options, Setup
from cobodeck.terminal import ENDING, USAGE, Problem

TellLine = Callable[[str], None]


def recorder(
    setup: Setup,
    options: Options,
    path: Path | None,
    at: datetime,
    tell: TellLine,
    beside: Sequence[RunFile] = (),
) -> Recorder | None:
    """A recorder of a run, by default in `out/`; None if no file can be created (`tell` says why).

    `beside`: what else takes all that is recorded, with or without a file.

    Raises:
        Problem: the requested file exists.
    """
    named = path or FOLDER / (default_name(setup, options, at) + ENDING)
    file = _opened(named, path is None, tell)
    files: list[RunFile] = [*([] if file is None else [file]), *beside]
    return Recorder(files, _describing(setup, options, at), tell) if files else None


def unkept_recorder(
    setup: Setup, options: Options, at: datetime, tell: TellLine, beside: Sequence[RunFile]
) -> Recorder:
    """As `recorder`, without a file."""
    return Recorder(beside, _describing(setup, options, at), tell)


def _describing(setup: Setup, options: Options, at: datetime) -> Describe:
    def describe(loop: Loop) -> RunDescription:
        found = header(setup, options, loop, sys.argv, _utc(at))
        return RunDescription(
            found, attachments(setup), _walls(setup), fixed_frames(setup.robot.sensing)
        )

    return describe


def replay_recorder(
    record: Record, setup: Setup, path: Path, at: datetime, tell: TellLine
) -> Recorder | None:
    """A recorder of a replay, with the header and the texts of what it replays.

    Raises:
        Problem: the file exists.
    """
    found = header_of_replay(record.header, setup, sys.argv, _utc(at))
    about = RunDescription(
        found, record.attachments, _walls(setup), fixed_frames(setup.robot.sensing)
    )
    file = _opened(path, False, tell)
    return None if file is None else Recorder([file], lambda _: about, tell)


def _opened(path: Path, any_number: bool, tell: TellLine) -> McapFile | None:
    try:
        return McapFile(open_free(path) if any_number else Sink(path))
    except Taken as taken:
        raise Problem(str(taken), USAGE) from None
    except OSError as error:
        tell(f"no record: {error.filename or path}: {error.strerror}")
        return None


def _utc(at: datetime) -> str:
    return at.astimezone(UTC).isoformat(timespec="milliseconds")


def _walls(setup: Setup) -> str | None:
    scene = setup.scene
    return None if scene is None else scene_update(scene, setup.robot.footprint)
