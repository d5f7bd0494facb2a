"""Another version of a chart that runs, or of one that it uses, from its text."""

from __future__ import annotations

from pathlib import Path

from cobodeck.project import findings_of, reached
from cobodeck.setup import Setup, with_values
from engine import text
from engine.chart import Library, load_text
from engine.files import did_you_mean
from engine.machine import Machine


def changed_machine(running: Machine, written: str, setup: Setup) -> Machine | str:
    """What runs, with this text in place of its chart of that name; text: why that cannot run.

    Parameters have the values of the run's profile, as at the start.

    Raises:
        Mismatch: what the run was given is of another type now.
        Problem, FileError: the profile has a value that does not fit.
    """
    main, library = running.chart.name, running.library
    inside = reached({main}, library)
    name = next(iter(load_text(written, running.chart.file)), main)
    if name not in inside:
        return f"no chart {name!r} runs here; {did_you_mean(name, inside)}"
    found = load_text(written, library[name].file)
    if found.findings:
        return text(found.findings, found.sources).rstrip()
    changed = Library()
    changed.update({**library, **found})
    inside = reached({main}, changed)
    changed.sources |= {changed[one].file: changed[one].source for one in inside}
    findings = findings_of(changed, setup.catalogue, [Path(file) for file in changed.sources])
    errors = [finding for finding in findings if finding.severity == "error"]
    if errors:
        return text(errors, changed.sources).rstrip()
    charts = with_values(setup.profile, changed, inside)
    return running.changed(charts[main], charts)
