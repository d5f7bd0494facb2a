"""A project whose package has states in FlexBE's manner, written for these tests."""

import sys
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

import pytest

from cobodeck.project import Catalogue, catalogue, load_beside
from cobodeck.testing import ChartTester
from engine.chart import Library

PROJECT = """
[project]
name = "tea"
version = "0"
[project.entry-points."cobodeck.states"]
{package} = "{package}"
"""
TABLE = """
topics: tea
hears:
  /bell: {signal: bell}
  /odom: {signal: base.pose}
  /level: {signal: level, fields: {percentage: "", header.frame_id: ""}}
publishes:
  /cmd_vel: {part: base, command: drive}
  /say: {part: speaker, command: say, fields: {text: data}}
calls:
  /lid: {part: pot, command: open}
acts:
  /pour: {part: pot, command: pour, result: poured, feedback: poured.share}
parameters: {/strength: 3, names: [a, b]}
"""
SIGNALS = """
from engine import Measured

class Part:
    signals = ()
    def stop(self): pass
    def samples(self, now_ns): return []

class Speaker(Part):
    def say(self, text): pass

class Pot(Part):
    def open(self): pass
    def __init__(self):
        self.pour = print  # some are known once it is made

PARTS = {"speaker": Speaker, "pot": Pot}
SIGNALS = (
    Measured("bell", str, event=True),
    Measured("level", float),
    Measured("poured", object),
    Measured("poured.share", float),
)
"""


class Written:
    """The project: modules are written into it, charts run in it."""

    def __init__(self, folder: Path, package: str) -> None:
        self.folder, self.package = folder, package
        (folder / package).mkdir()
        (folder / ".git").mkdir()
        (folder / "pyproject.toml").write_text(PROJECT.format(package=package))
        (folder / package / "topics.yaml").write_text(TABLE)
        (folder / package / "__init__.py").write_text(SIGNALS)

    def write(self, module: str, text: str) -> Path:
        file = self.folder / self.package / f"{module}.py"
        file.write_text(text)
        return file

    @cached_property
    def catalogue(self) -> Catalogue:
        return catalogue(self.folder)

    def start(self, node: str, ends: str = "done", **given: object) -> ChartTester:
        """Run a chart with one state."""
        chart = f"""
chart: alone
outcomes: [{ends}]
inputs: {{{", ".join(f"{key}: any" for key in given.get("inputs", ()))}}}
states:
  a: {node}
"""
        sim = ChartTester(self.folder, self.folder)
        if "inputs: {}" in chart:
            chart = chart.replace("inputs: {}\n", "")
        return sim.start(chart, real=["a"], **given)  # type: ignore[arg-type]


def _written(folder: Path, name: str) -> Iterator[Written]:
    package = f"tea_{abs(hash(name)) % 10**9}"
    path = list(sys.path)
    yield Written(folder, package)
    sys.path[:] = path
    for module in [module for module in sys.modules if module.startswith(package)]:
        del sys.modules[module]


@pytest.fixture(scope="module")
def tea(
    tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest
) -> Iterator[Written]:
    """The project of a test module, with its `MODULES`."""
    read: list[Library] = []

    def read_once(files: Sequence[Path], known: Catalogue) -> Library:
        read[:] = read or [load_beside(files, known)]
        return read[0]

    for written in _written(tmp_path_factory.mktemp("tea"), request.node.nodeid):
        for module, text in request.module.MODULES.items():
            written.write(module, text)
        with pytest.MonkeyPatch.context() as patch:  # the shipped charts are read once
            patch.setattr("cobodeck.testing.chart_only.load_beside", read_once)
            yield written


@pytest.fixture
def fresh(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Written]:
    """A project of one test."""
    yield from _written(tmp_path, request.node.nodeid)
