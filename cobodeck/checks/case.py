"""What checks may be about."""

from __future__ import annotations

from collections.abc import Collection, Container, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from cobodeck.checks.floor_space import FloorReport
    from cobodeck.project import Catalogue
    from cobodeck.real import Connected, PriorRuns
    from cobodeck.setup import Options, RunPlace, Setup, Uses
    from engine.chart import Chart
    from engine.machine import Leaf
    from engine.signals import Signal
    from hw.connection import Connection
    from hw.model import RobotModel, TrackingFile


class Case(TypedDict, total=False):
    """What may be at hand when checks are asked; a check is asked if all that it takes is."""

    although: Collection[str]
    arguments: Mapping[str, Any]
    connection: Connection
    declared: Mapping[str, Signal]
    driver: str
    entry: str
    model: str | None
    floor: FloorReport
    known: Catalogue
    leaves: Sequence[Leaf]
    library: Mapping[str, Chart]
    options: Options
    packages: Container[str]
    parts: Mapping[str, Any]
    place: RunPlace
    plant: Connected
    prior: PriorRuns
    profile: Profile
    robot: RobotModel
    scene_file: Path
    setup: Setup
    tracking: TrackingFile
    uses: Uses
