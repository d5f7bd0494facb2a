"""Finds in records what was tried before, and decides whether a real robot may move."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from cobodeck.project import CHARTS, kind_of, reached
from cobodeck.real.release_stages import (
    SERVED,
    WORDS,
    Stage,
    StageResult,
    Tried,
    Wanted,
    differences,
    found_for,
    is_of,
    stages_of,
)
from cobodeck.record.format import code, label, read_files, sha256
from cobodeck.record.read import Record
from cobodeck.record.write import FOLDER
from cobodeck.setup import PROFILE, TICK_HZ, Setup
from cobodeck.terminal import REFUSED, Problem
from engine.files import FileError

BODY = frozenset(("profile", "robot", "prop", "calibration", "arm"))
"""Kinds of files, besides charts, that determine how a robot behaves."""
URDF = ".urdf"
RECORDED = FOLDER / "simulated.mcap"


def refuse_untried(
    setup: Setup, dummy: bool, files: Sequence[Path] | None, although: Sequence[str]
) -> list[str]:
    """Check that a real robot may move; returns lines to report about it.

    Args:
        setup: what is to be run, by a connection.
        dummy: the planned run is itself the stage with a dummy.
        files: the records to search; None: all in `out/`.
        although: the stages to skip, in the words of `cobodeck.real.release_stages.WORDS`.

    Raises:
        Problem: a stage is neither passed nor skipped.
    """
    wanted = wanted_of(setup)
    found = [
        found_for(stage, list(tried(files, stage, wanted)), wanted)
        for stage in stages_of(wanted, dummy)
        if WORDS[stage] not in although
    ]
    lacking = [finding for finding in found if not finding.passed]
    if lacking:
        raise Problem(_refusal(setup, lacking), REFUSED)
    told = [f"{finding.stage}: {finding.file}" for finding in found]
    return [*told, *(f"although {WORDS[stage]}" for stage in WORDS if WORDS[stage] in although)]


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
        code=code(setup),
        limits=asdict(setup.limits),
        tick_hz=setup.tick_hz,
        connection=(setup.connection.name, setup.connection.sha256),
        person=setup.uses().person,
        profile=setup.profile.sha256,
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


def _refusal(setup: Setup, lacking: Sequence[StageResult]) -> str:
    """The message on missing stages, with the command for each."""
    assert setup.connection is not None
    lines = [
        f"connection {setup.connection.name} is of a real robot, and this was not tried before as "
        "it is now:"
    ]
    for finding in lacking:
        lines += [f"  {WORDS[finding.stage]}{_why(finding)}", f"    {_command(setup, finding)}"]
    words = " ".join(f"--although {shlex.quote(WORDS[finding.stage])}" for finding in lacking)
    return "\n".join((*lines, f"or, with nobody near the robot: {words}"))


def _why(finding: StageResult) -> str:
    if finding.file is None:
        return ": there is no record of it"
    return f": {finding.file}: {'; '.join(finding.why)}"


def _command(setup: Setup, finding: StageResult) -> str:
    """The command line that can pass a stage."""
    assert setup.connection is not None
    if finding.stage == "simulated":
        words = ["simulate", _chart(setup), "--robot", setup.connection.known_as]
        person = ["--requests", str(SERVED[finding.stage])] if setup.uses().person else []
        words += [*person, "--record", str(RECORDED)]
    else:
        words = ["run", _chart(setup), "--robot", setup.connection.known_as]
        words += ["--user", str(RECORDED)]
    asked = {"--scene": setup.given["scene"], "--profile": setup.given["profile"]}
    asked["--profile"] = None if asked["--profile"] == PROFILE else asked["--profile"]
    for name, value in asked.items():
        words += [] if value is None else [name, str(value)]
    for text in setup.profile.sets:
        words += ["--set", text]
    if setup.tick_hz != TICK_HZ:
        words += ["--tick-hz", str(setup.tick_hz)]
    return shlex.join(["cobodeck", *words])


def _chart(setup: Setup) -> str:
    """The chart as a command line names it: shipped ones by name."""
    file = Path(setup.chart.file)
    return setup.chart.name if file.parent == CHARTS else str(file)
