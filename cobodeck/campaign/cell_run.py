"""Runs cells, and hashes all that decides their figures.

An address is the hash of a cell with the content of its chart, scene, profile, robot and person, of
all code and the versions of the numeric libraries: runs of equal addresses have equal figures.
"""

from __future__ import annotations

import hashlib
import json
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property, lru_cache
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cobodeck.campaign.cell import CampaignCell, bare_name
from cobodeck.evaluate import OF_THE_MACHINE
from cobodeck.fitness import require
from cobodeck.project import Catalogue, catalogue, open_chart
from cobodeck.record.format import code, sha256, versions
from cobodeck.run import simulate, stage
from cobodeck.setup import REFERENCE, Options, Setup, longest_s, open_setup, read_inputs, warm_up
from cobodeck.terminal import ENDING, Problem, behind_record, complain
from engine.files import FileError, noting
from hw import missing
from hw.people import open_user
from hw.scene import Scene

OTHERS = "this worker has other files or other code than the client"
KEPT = 8
"""Charts and setups that are kept for the next cells."""
NAMED = ("scene", "user")
"""Figures that may be paths."""


def canonical(value: Any) -> str:
    """JSON in one line with sorted keys: equal for equal figures, bit for bit."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


def sha256_of(value: Any) -> str:
    """The hash of what `canonical` gives."""
    return sha256(canonical(value).encode())


def _simulated(setup: Setup, options: Options, record: Path | None) -> dict[str, Any]:
    """The figures of a run, of which a record is kept in this new file, if any."""
    recorder = None
    if record is not None:
        from cobodeck.record.write import recorder as recorder_of

        recorder = recorder_of(setup, options, record, datetime.now(), complain)
    return dict(simulate(setup, options, recorder=recorder).figures)


def _avoidable(setup: Setup, options: Options, contacts: int) -> int:
    """How many of a run's contacts could have been avoided: it is run again, on record."""
    if contacts == 0:
        return 0
    from cobodeck.avoidable import contacts_avoidable  # needs the extra `record`

    with TemporaryDirectory() as folder, noting():
        record = Path(folder) / f"judged{ENDING}"
        _simulated(setup, options, record)
        return contacts_avoidable(record)


def run_cell(cell: CampaignCell, record: Path | None = None, *, own: bool = True) -> dict[str, Any]:
    """The figures of a run by their names in `simulate --json`, without times of the machine.

    Args:
        cell: what to run.
        record: keep a record in this new file.
        own: charts, states and files of projects are found, too.

    Raises:
        Problem: it cannot run; FileError: a file or value is wrong.
    """
    with noting():  # a record tells which files this run has read
        return CellRunner(catalogue(own=own)).run(cell, record)


@dataclass(frozen=True, slots=True)
class CellResult:
    """What became of a cell: its figures and the CPU that they took, s, or why there are none."""

    cell: CampaignCell
    address: str
    figures: Mapping[str, Any] | None
    cpu_s: float = 0.0
    failure: str | None = None

    @property
    def figures_sha256(self) -> str | None:
        """The hash of the figures; None without."""
        return None if self.figures is None else sha256_of(self.figures)


class CellRunner:
    """Runs cells one after the other; what several of them share is read and compiled once.

    Args:
        known: what charts may name, by default all that is found from the current folder.
    """

    def __init__(self, known: Catalogue | None = None) -> None:
        self.known = known or catalogue()
        self._opened: Callable[..., Setup] = lru_cache(KEPT)(self._open)
        self._charts = lru_cache(KEPT)(lambda name: open_chart(name, self.known))
        self._persons: dict[tuple[str, str | None], str] = {}

    def setup(self, cell: CampaignCell) -> Setup:
        """What a cell runs, checked.

        Raises:
            Problem: it cannot run; FileError: a file or value is wrong.
        """
        named = cell.chart, cell.scene, cell.robot, cell.profile, cell.sets, cell.inputs
        return self._opened(*named, cell.tick_hz)

    def address(self, cell: CampaignCell) -> str:
        """The hash of all that decides a cell's figures; raises as `setup` does."""
        setup = self.setup(cell)
        assert setup.scene is not None  # every cell names one
        content = {
            "cell": cell.content(),
            "seed": cell.seed,
            "chart": setup.chart_sha256,
            "scene": setup.scene.sha256,
            "profile": setup.profile.sha256,
            "robot": sha256(repr(setup.robot).encode()),
            "person": self._person(setup.scene, cell.user or setup.scene.user),
            "code": self._code,
            "versions": self._versions,
        }
        return sha256_of(content)

    def check(self, cell: CampaignCell) -> None:
        """Set up a run as far as its first tick; raises as `address` does, and for its tier.

        A package that is missing here is no mistake of the campaign: the cell itself tells it.
        """
        self.address(cell)
        try:
            if cell.tier < REFERENCE or find_spec("mujoco") is not None:
                stage(self.setup(cell), _options(cell))
        except ModuleNotFoundError as error:
            if missing(error) is None:
                raise

    def run(self, cell: CampaignCell, record: Path | None = None) -> dict[str, Any]:
        """The figures of a cell, see `run_cell`; files are named without their folders."""
        setup, options = self.setup(cell), _options(cell)
        figures = _simulated(setup, options, record)
        if cell.judge and figures["contacts"] is not None:
            figures["contacts_avoidable"] = _avoidable(setup, options, figures["contacts"])
        kept = {name: value for name, value in figures.items() if name not in OF_THE_MACHINE}
        kept |= {name: bare_name(kept[name]) for name in NAMED}
        found: dict[str, Any] = json.loads(canonical(kept))  # as they come back from a file
        return found

    def result(self, cell: CampaignCell, address: str) -> CellResult:
        """What becomes of a cell: why it has no figures is told, also where that is a bug."""
        began = time.process_time()
        try:
            if self.address(cell) != address:
                raise Problem(OTHERS)
            began = time.process_time()  # what is read once for many cells is no cost of this one
            with redirect_stdout(sys.stderr):  # states may print
                figures = self.run(cell)
        except (Problem, FileError, OSError) as error:
            return CellResult(cell, address, None, time.process_time() - began, str(error))
        except Exception:  # noqa: BLE001  a bug in one cell leaves the others to be run
            told = traceback.format_exc()
            return CellResult(cell, address, None, time.process_time() - began, told)
        return CellResult(cell, address, figures, time.process_time() - began)

    def warm_up(self, cell: CampaignCell) -> None:
        """Compile what a cell needs, so that processes that begin later load it."""
        if cell.tier:
            setup = self.setup(cell)
            warm_up(setup, setup.machine())

    def _person(self, scene: Scene, source: str | None) -> str:
        """The hash of the files of a person, who has to fit into the scene."""
        known = scene.sha256, source
        if known not in self._persons:
            self._persons[known] = sha256_of(_files_of(scene, source))
        return self._persons[known]

    @cached_property
    def _versions(self) -> dict[str, str]:
        return versions()

    @cached_property
    def _code(self) -> dict[str, str]:
        return code(self.known)

    def _open(
        self,
        chart: str | None,
        scene: str,
        robot: str | None,
        profile: str,
        sets: tuple[str, ...],
        inputs: tuple[str, ...],
        tick_hz: int,
    ) -> Setup:
        setup = open_setup(
            chart,
            scene,
            profile,
            tick_hz,
            robot,
            known=self.known,
            sets=sets,
            inputs=read_inputs(inputs),
            opened=lambda name, _: self._charts(name),
        )
        require("begin", setup=setup)
        return setup


def _options(cell: CampaignCell) -> Options:
    return Options(
        user=cell.user,
        requests=cell.requests,
        tier=cell.tier,
        seed=cell.seed,
        duration_s=cell.duration_s or longest_s(cell.requests),
    )


def _files_of(scene: Scene, source: str | None) -> dict[str, str]:
    """The hashes of the files that a person is read from, by label."""
    if source is None:
        return {}
    if behind_record(source) is not None:
        path = Path(source)
        with path.open("rb") as stream:
            return {path.name: hashlib.file_digest(stream, "sha256").hexdigest()}
    with noting() as read:
        open_user(source, scene)
    return {path.name: sha256(data) for path, data in read.items()}
