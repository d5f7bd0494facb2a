"""The stages to pass before a real robot moves, shown by records of earlier runs (R53, R56).

Every change is tried in two stages, each with a record: first in simulation, then on the robot with
a dummy, a recorded person who is not in the room. Program, charts, profile, robot and limits must
be those of the planned run. Nothing here opens a file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

Stage = Literal["simulated", "dummy"]
SERVED: Mapping[Stage, int] = {"simulated": 20, "dummy": 1}
"""Number of requests that must be served to pass a stage, if the chart deals with people."""
WORDS: Mapping[Stage, str] = {
    "simulated": "it was not simulated",
    "dummy": "it was not tried with a dummy",
}
"""The words after `--although` that skip a stage."""
ENDED_BADLY = ("error", "failed")
SIMULATION = "simulation"
"""The kind of plant in the header of a simulated run."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """The planned run on a real robot.

    `files` are the hashes of charts, profile and robot files by label, `code` those of the
    program's packages and of modules with states; `connection` is its name and hash; `person`: the
    chart deals with people; `profile` is the hash of all its values; `inputs` are the chart's, as
    written.
    """

    files: Mapping[str, str]
    code: Mapping[str, str]
    limits: Mapping[str, float | None]
    tick_hz: int
    connection: tuple[str, str]
    person: bool
    profile: str
    inputs: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Tried:
    """A record: its file, its header, and its figures if the run was completed and it is intact.

    `looked`: the figures were read; they are not read if the header does not match.
    """

    file: str
    header: Mapping[str, Any]
    figures: Mapping[str, Any] | None
    looked: bool = True


def is_dummy(header: Mapping[str, Any]) -> bool:
    """True if the run's person was replayed from a record."""
    user = header["options"]["user"]
    return isinstance(user, str) and user.endswith(".mcap")


def is_of(stage: Stage, header: Mapping[str, Any], wanted: Wanted) -> bool:
    """True if a record is an attempt at this stage, passed or not."""
    if stage == "simulated":
        return bool(header["plant"] == SIMULATION)
    found = header.get("connection") or {}
    return header["plant"] == wanted.connection[0] == found.get("name") and is_dummy(header)


def differences(stage: Stage, header: Mapping[str, Any], wanted: Wanted) -> Iterator[str]:
    """What differs between a record and the planned run, in words."""
    known = set(header["files"].values())
    for label, hashed in wanted.files.items():
        if hashed not in known:
            yield f"{label} has changed"
    for name in sorted({*header["code"], *wanted.code}):
        if header["code"].get(name) != wanted.code.get(name):
            yield f"the code of {name} has changed"
    if header["profile"]["sha256"] != wanted.profile:  # `--set` changes values without any file
        yield "the profile had other values"
    if header.get("inputs", {}) != wanted.inputs:
        yield "the chart had other inputs"
    if header.get("limits") != wanted.limits:
        yield "it had other limits than those of the connection"
    if header["tick_hz"] != wanted.tick_hz:
        yield f"it ticked at {header['tick_hz']} Hz"
    if stage == "dummy" and header["connection"]["sha256"] != wanted.connection[1]:
        yield "the connection has changed"


def shortcomings(stage: Stage, figures: Mapping[str, Any] | None, person: bool) -> Iterator[str]:
    """Why figures do not pass the stage, in words; None: of an incomplete run, or damaged."""
    if figures is None:
        yield "it did not come to its end, or is damaged"
        return
    if figures["errors"]:
        yield f"errors: {len(figures['errors'])}"
    if figures["outcome"] in ENDED_BADLY:
        yield f"the chart ended with {figures['outcome']}"
    for key, told in (("wall_hits", "walls"), ("object_hits", "objects")):
        if figures.get(key):
            yield f"it ran into {told}: {figures[key]}"
    if person:
        yield from _beside_a_person(stage, figures)


def _beside_a_person(stage: Stage, figures: Mapping[str, Any]) -> Iterator[str]:
    served, least = figures.get("served"), SERVED[stage]
    if served is None or served < least:
        yield f"{'an unknown number' if served is None else served} served, {least} are wanted"
    touched = figures.get("contacts_by_robot")
    if touched:
        yield f"contacts by the robot: {touched}"
    if touched is None and stage == "simulated":
        yield "contacts are not known"


@dataclass(frozen=True, slots=True)
class StageResult:
    """The result of a stage: the record `file` that passes it, or comes nearest and `why` not."""

    stage: Stage
    file: str | None
    why: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """True if the stage is passed."""
        return self.file is not None and not self.why


@dataclass(frozen=True, slots=True)
class PriorRuns:
    """What was tried before a planned run: the results of the stages to pass.

    `commands` are the command lines that can pass those that lack.
    """

    results: tuple[StageResult, ...]
    commands: Mapping[Stage, str]

    @property
    def lacking(self) -> list[StageResult]:
        """The stages that are not passed."""
        return [result for result in self.results if not result.passed]


def found_for(stage: Stage, tried: Sequence[Tried], wanted: Wanted) -> StageResult:
    """The first record that passes a stage, otherwise the one with the fewest objections."""
    best = StageResult(stage, None)
    for one in tried:
        if not is_of(stage, one.header, wanted):
            continue
        why = tuple(differences(stage, one.header, wanted))
        if one.looked:
            why += tuple(shortcomings(stage, one.figures, wanted.person))
        if not why:
            return StageResult(stage, one.file)
        if best.file is None or len(why) < len(best.why):
            best = StageResult(stage, one.file, why)
    return best


def stages_of(wanted: Wanted, with_dummy: bool) -> tuple[Stage, ...]:
    """The stages to pass before a run; only the first if it has no person or is with a dummy."""
    if with_dummy or not wanted.person:
        return ("simulated",)
    return ("simulated", "dummy")
