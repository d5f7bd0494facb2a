"""A chart without robot and room: parts are stubs, signals come from the caller."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cobodeck.loop import Inlet, Loop, Nothing, Wired
from cobodeck.project import Catalogue, findings_of, known_names, load_beside
from cobodeck.setup import wanted_inputs
from cobodeck.testing.stub_parts import Parts
from engine import TickGrid, text as report_text
from engine.chart import Chart, Library, load_text
from engine.machine import Machine
from engine.run import ChartRun
from engine.signals import Board, Measured, Signal

__tracebackhide__ = True  # a failing test shows its own line

HZ = 30
"""Ticks per second of virtual time."""
_FILE = "<test>"


def chart_of_text(text: str, known: Catalogue) -> tuple[Chart, Library]:
    """The first chart of a YAML text, and all the charts that it may use.

    Raises:
        AssertionError: the chart has errors; the message shows them.
    """
    library = load_text(text, _FILE)
    for name, other in load_beside([], known).items():
        library.setdefault(name, other)
    findings = findings_of(library, known, [Path(_FILE)])
    errors = [finding for finding in findings if finding.severity == "error"]
    if errors:
        raise AssertionError(f"the chart cannot run\n{report_text(errors, library.sources)}")
    return next(iter(library.values())), library


def loop_alone(
    chart: Chart,
    library: Library,
    known: Catalogue,
    parts: Parts,
    signals: Mapping[str, Any],
    parameters: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
) -> Loop:
    """A loop over a chart with stub parts; places are those of all known scenes.

    Args:
        chart: what to run.
        library: the charts that it uses.
        known: the states and signals that it may name.
        parts: the stubs, made on first access.
        signals: values at the start; these signals become measured ones, even if derived elsewhere.
        parameters: of the chart.
        inputs: of the chart.

    Raises:
        AssertionError: an input has no value.
        Mismatch: a value is wrong; the message says which.
    """
    around = known_names(library, known, for_run=True)
    machine = Machine(
        chart, library, known.interfaces, parameters, known.types, inputs=inputs, around=around
    )
    require_inputs(machine)
    board = Board(_declared(machine, known, signals))
    inlet = Inlet(board)
    for name, value in signals.items():
        fitting(inlet, name, value)
        inlet.put(name, value, 0)
    commands = {name for leaf in machine.leaves for name in leaf.interface.commands}
    run = ChartRun(machine, board, {name: parts[name] for name in sorted(commands)})
    return Loop(Nothing(parts), Wired(run, board, inlet), TickGrid(HZ))


def require_inputs(machine: Machine) -> None:
    """Make sure that all inputs of a chart have values.

    Raises:
        AssertionError: one has none; the message says how to give it.
    """
    if wanted := wanted_inputs(machine):
        hint = ", ".join(f"{name!r}: …" for name in machine.missing)
        raise AssertionError(f"{wanted}; start it with inputs={{{hint}}}")


def fitting(inlet: Inlet, name: str, value: Any) -> None:
    """Make sure that a value is of its signal's type.

    Raises:
        AssertionError: it is not; the message says what would be right.
    """
    if wrong := inlet.why_not(name, value):
        raise AssertionError(f"signal {name!r}: {wrong}")


def _declared(
    machine: Machine, known: Catalogue, taken_over: Mapping[str, Any]
) -> dict[str, Signal]:
    """The signals that the chart reads: a project's own as declared, all others as measured ones.

    If the given values include an `environment`, its planners are declared too.
    """
    kinds = {name: signal.type for name, signal in known.signals.items()}
    from behaviors import MEASURED, planning

    shipped = (
        *MEASURED,
        *(planning(taken_over["environment"]) if "environment" in taken_over else ()),
    )
    others = (s for s in (*shipped, *known.own_signals) if s.name not in taken_over)
    own = {s.name: s for s in MEASURED} | {s.name: s for s in others}
    found: dict[str, Signal] = {}

    def add(name: str) -> None:
        if name in found:
            return
        signal = own.get(name) or Measured(name, kinds.get(name, object))
        for source in getattr(signal, "of", ()):
            add(source)
        found[name] = signal

    for name in taken_over:
        add(name)
    for leaf in machine.leaves:
        for name in leaf.interface.reads:
            add(name)
    return found
