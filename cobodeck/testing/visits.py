"""Which nodes of a run were entered, and whether one is, by the names that a test gives them."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cobodeck.testing.scripted_leaves import is_named
from engine.files import did_you_mean
from engine.run import ChartRun

__tracebackhide__ = True  # a failing test shows its own line


def entered(run: ChartRun, names: Iterable[str]) -> list[str]:
    """The names of the nodes entered, in order; nodes without a name here are left out."""
    paths = [record.subject for record in run.trace if record.kind == "enter"]
    matched = [next((n for n in names if is_named(path, n)), None) for path in paths]
    return [name for name in matched if name is not None]


def reaching(run: ChartRun, where: str) -> Callable[[], bool]:
    """Whether the chart has ended with `where`, or a node of this name is or was entered.

    A node counts that is active now, or is entered from now on.

    Raises:
        AssertionError: there is no such node or outcome.
    """
    outcomes = {*run.machine.chart.outcomes, "error"}
    if where not in outcomes:
        require_node(run, where, outcomes)
    before = sum(1 for _ in run.trace)

    def reached() -> bool:
        if run.outcome == where:
            return True
        active: set[str] = set()
        for n, record in enumerate(run.trace):
            if not is_named(record.subject, where):
                continue
            if record.kind == "enter":
                active.add(record.subject)
                if n >= before:
                    return True
            elif record.kind == "exit":
                active.discard(record.subject)
        return bool(active)

    return reached


def require_node(run: ChartRun, name: str, also: Iterable[str] = ()) -> None:
    """Make sure that the chart has a node of this name.

    Raises:
        AssertionError: it has none; the message has a similar name, one of `also` included.
    """
    vertices = run.machine.vertices
    if not any(is_named(path, name) for path in vertices):
        known = {path.rpartition("/")[2] for path in vertices} | {*vertices, *also}
        raise AssertionError(f"no node {name!r} in the chart; {did_you_mean(name, known - {''})}")
