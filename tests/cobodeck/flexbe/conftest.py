"""The behaviours' JSON, where it is, and runs in virtual time."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from cobodeck.flexbe import Behaviour, Conversion, convert, yaml_of
from engine.chart.load import Library, load_files
from engine.files.source import read
from engine.machine.machine import Machine
from engine.machine.scripted_states import LeafScript
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from tests.cobodeck.flexbe.known import CLASSES, USERDATA, VARIABLES
from tests.cobodeck.flexbe.states import INTERFACES, TYPES

DATA = Path(__file__).resolve().parents[3] / "../shared/data/flexbe"
CHARTS = Path(__file__).parent / "charts"
HZ = 10
NAMES = ("action_follow", "action_give", "detect_pipes", "example_3", "example_4")


@pytest.fixture(scope="session")
def behaviours() -> dict[str, Any]:
    if not DATA.is_dir():
        pytest.skip("the FlexBE behaviours are not beside this checkout (shared/data/flexbe)")
    files = {name: next(DATA.glob(f"*__{name}.json")) for name in NAMES}
    return {name: json.loads(file.read_text()) for name, file in files.items()}


@pytest.fixture(scope="session")
def converted(behaviours: Mapping[str, Any]) -> Conversion:
    read = [
        Behaviour(name, json, userdata=USERDATA.get(name, {}), variables=VARIABLES)
        for name, json in behaviours.items()
    ]
    return convert(read, CLASSES)


@pytest.fixture(scope="session")
def library(converted: Conversion) -> Library:
    return library_of(converted)


@pytest.fixture(scope="session")
def machine(converted: Conversion, library: Library) -> Callable[[str], Machine]:
    """Makes a machine of a converted chart."""
    return lambda name: Machine(library[name], library, converted.interfaces())


def library_of(conversion: Conversion) -> Library:
    library = Library()
    for name, chart in conversion.charts.items():
        library.add(read(yaml_of(chart).encode(), f"{name}.yaml"))
    return library


def written_library() -> Library:
    return load_files(sorted(CHARTS.glob("*.yaml")))


def written_machine(name: str, parameters: Mapping[str, Any] | None = None) -> Machine:
    library = written_library()
    return Machine(library[name], library, INTERFACES, parameters, TYPES)


class Play:
    """One run in virtual time; its leaves do as told unless `scripted` is false."""

    def __init__(
        self, machine: Machine, level: int | None = None, *, scripted: bool = True
    ) -> None:
        self.machine = machine
        self.script = LeafScript(machine) if scripted else None
        stand_ins = self.script.stand_ins if self.script is not None else {}
        self.run = ChartRun(machine, level=level, stand_ins=stand_ins)
        self.operator = Operator(self.run)
        self.ticks = 0

    @property
    def seconds(self) -> float:
        """When the last tick was."""
        return (self.ticks - 1) / HZ

    @property
    def steps(self) -> list[str]:
        """The leaves stepped in the last tick."""
        assert self.script is not None
        return [path for what, path in self.script.log if what == "step"]

    @property
    def stops(self) -> list[str]:
        """The leaves whose clean-up ran in the last tick."""
        assert self.script is not None
        return [path for what, path in self.script.log if what == "stop"]

    def tick(self, times: int = 1) -> list[str]:
        """Run ticks; the active leaves after them."""
        for _ in range(times):
            if self.script is not None:
                self.script.log.clear()
            self.run.tick(self.ticks * 10**9 // HZ)
            self.ticks += 1
        return self.run.active

    def end(self, *events: tuple[str, str], **outputs: Any) -> list[str]:
        """Have leaves end in the next tick, and run it."""
        assert self.script is not None
        for path, outcome in events:
            self.script.end(path, outcome, **outputs)
        return self.tick()

    def until(self, holds: Callable[[], Any], seconds: float = 60) -> None:
        """Run ticks until something holds."""
        for _ in range(round(seconds * HZ)):
            self.tick()
            if holds():
                return
        raise AssertionError(f"not within {seconds} s; active: {self.run.active}")
