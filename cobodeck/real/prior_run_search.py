"""Finds in records what was tried before a real robot may move, and says how to try it."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from cobodeck.project import kind_of, reached, shipped_charts
from cobodeck.real.release_stages import (
    SERVED,
    WORDS,
    PriorRuns,
    Stage,
    Tried,
    Wanted,
    differences,
    found_for,
    is_of,
    stages_of,
)
from cobodeck.record.format import FOLDER, code, label, read_files, sha256
from cobodeck.record.read import Record
from cobodeck.setup import PROFILE, TICK_HZ, Setup
from engine.files import FileError, written_text

BODY = frozenset(("profile", "robot", "prop", "calibration", "arm"))
"""Kinds of files, besides charts, that determine how a robot behaves."""
URDF = ".urdf"
RECORDED = FOLDER / "simulated.mcap"


def prior_runs(
    setup: Setup, dummy: bool, files: Sequence[Path] | None, although: Collection[str]
) -> PriorRuns:
    """What was tried before a real robot may move.

    Args:
        setup: what is to be run, by a connection.
        dummy: the planned run is itself the stage with a dummy.
        files: the records to search; None: all in `out/`.
        although: the stages to skip, in the words of `cobodeck.real.release_stages.WORDS`.
    """
    wanted = wanted_of(setup)
    results = tuple(
        found_for(stage, list(tried(files, stage, wanted)), wanted)
        for stage in stages_of(wanted, dummy)
        if WORDS[stage] not in although
    )
    lacking = (result.stage for result in results if not result.passed)
    return PriorRuns(results, {stage: _command(setup, stage) for stage in lacking})


def wanted_of(setup: Setup) -> Wanted:
    """The planned run as hashes; call it once all its files have been read."""
    assert setup.connection is not None
    names = reached({setup.chart.name}, setup.library)
    charts = {
        label(Path(setup.library[name].file)): sha256(setup.library[name].source.text.encode())
        for name in names
    }
    body = {
        label(path): sha256(data)
        for path, data in read_files()
        if path.suffix == URDF or kind_of(path) in BODY
    }
    return Wanted(
        files=charts | body,
        code=code(setup.catalogue),
        limits=asdict(setup.limits),
        tick_hz=setup.tick_hz,
        connection=(setup.connection.name, setup.connection.sha256),
        person=setup.uses().person,
        profile=setup.profile.sha256,
        inputs=setup.inputs,
    )


def tried(files: Sequence[Path] | None, stage: Stage, wanted: Wanted) -> Iterator[Tried]:
    """The records of a stage, newest first; figures are read only if the header matches."""
    for record in _records(sorted(FOLDER.glob("*.mcap")) if files is None else files):
        if not is_of(stage, record.header, wanted):
            continue
        same = not any(differences(stage, record.header, wanted))
        figures = record.figures() if same and record.damage() is None else None
        yield Tried(str(record.path), record.header, figures, same)


def _records(files: Iterable[Path]) -> list[Record]:
    found = []
    for file in files:
        try:
            found.append(Record(file))
        except FileError:
            continue
    return sorted(found, key=lambda record: str(record.header["began"]), reverse=True)


def _command(setup: Setup, stage: Stage) -> str:
    """The command line that can pass a stage."""
    assert setup.connection is not None
    if stage == "simulated":
        words = ["simulate", _chart(setup), "--robot", setup.connection.known_as]
        person = ["--requests", str(SERVED[stage])] if setup.uses().person else []
        words += [*person, "--record", str(RECORDED)]
    else:
        words = ["run", _chart(setup), "--robot", setup.connection.known_as]
        words += ["--user", str(RECORDED)]
    asked = {"--scene": setup.given["scene"], "--profile": setup.given["profile"]}
    asked["--profile"] = None if asked["--profile"] == PROFILE else asked["--profile"]
    for name, value in asked.items():
        words += [] if value is None else [name, str(value)]
    for name, given in setup.inputs.items():
        words += ["--in", f"{name}={written_text(given)}"]
    for text in setup.profile.sets:
        words += ["--set", text]
    if setup.tick_hz != TICK_HZ:
        words += ["--tick-hz", str(setup.tick_hz)]
    return shlex.join(["cobodeck", *words])


def _chart(setup: Setup) -> str:
    """The chart as a command line names it: shipped ones by name."""
    file = Path(setup.chart.file)
    return setup.chart.name if file in shipped_charts() else str(file)
