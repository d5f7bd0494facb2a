"""Check charts, scenes, users, robots, profiles and all other files; no state or driver is run.

Without a path: the charts of the project around the present folder, or all shipped files.
Exit code 0: no errors; 1: errors, with --strict also warnings.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from cobodeck.campaign import FOLDER as CAMPAIGNS
from cobodeck.project import (
    CHARTS,
    Catalogue,
    catalogue,
    errors_in_used,
    errors_in_users,
    files_in,
    findings_of,
    known_names,
    load_beside,
    reached,
    read_source,
    replacements,
    shipped_charts,
    strictly,
    wrong_parts,
)
from cobodeck.terminal import FAILED, OK, Problem, complain, json_options, show, show_json
from cobodeck.validation import (
    OPEN,
    Explored,
    FileChecker,
    dead_end_tests,
    explanation,
    schema_notes,
)
from engine import FORMATS, as_json, report
from engine.chart import Chart, Library
from engine.files import Finding, Place, SourceFile, in_order
from engine.machine import Machine, explore

WALKED = 2_000
"""Limit of explored configurations; the report says when it is reached."""
FARTHER = 10 * WALKED
"""That of `--explain`."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("paths", nargs="*", metavar="PATH", help="files or folders", type=Path)
    parser.add_argument("--strict", action="store_true", help="warnings are errors")
    parser.add_argument("--format", choices=FORMATS, default="text", help="default: text")
    parser.add_argument(
        "--explain", action="store_true", help="tell dead ends of charts, and what never happens"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="with --explain: a test, X.py, of these"
    )
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Check and report.

    Raises:
        Problem: `-o` does not name a new test or goes without `--explain`, or that is not text.
    """
    args.format = "json" if args.json else args.format
    if args.output is not None and not (args.explain and args.output.suffix == ".py"):
        raise Problem("-o FILE.py goes with --explain: it takes the dead ends as tests")
    if args.output is not None and args.output.exists():
        raise Problem(f"{args.output}: exists; name another file with -o")
    if args.explain and args.format != "text":
        raise Problem(f"--explain tells people; it is not there as {args.format}")
    return _checked(args)


def _checked(args: argparse.Namespace) -> int:
    """The exit code, after the report."""
    known = catalogue(own=args.own)
    files = files_in(args.paths or _default_paths(known))
    charts = [file for file, kind in files if kind == "chart"]
    in_code = [*known.doubts, *wrong_parts(known.own_parts, known.signal_names)]
    library = load_beside(charts, known)
    findings = findings_of(library, known, charts)
    sources: dict[str, SourceFile] = {str(file): library.sources[str(file)] for file in charts}
    outside = errors_in_used(library, known, charts) + errors_in_users(library, known, charts)
    for finding in outside:
        findings.append(finding)
        sources[finding.place.file] = library.sources[finding.place.file]
    checker = FileChecker(known, [file for file, kind in files if kind == "robot"])
    for file, kind in files:
        if kind != "chart":
            sources[str(file)] = read_source(str(file))
            findings += checker.findings(file, kind)
    findings = _once(findings)
    for name in {place.file for finding in findings for place in _places(finding)}:
        sources.setdefault(name, read_source(name))
    findings = in_order(strictly(findings) if args.strict else findings)
    given = {name for name, chart in library.items() if Path(chart.file) in charts}
    for told in (*in_code, *replacements(library, known, reached(given, library))):
        complain(told)
    if args.format == "json":
        answer = {"files": [*sources], "findings": [as_json(finding) for finding in findings]}
        show_json({**answer, "in_code": in_code})
    else:
        show(report(findings, sources, args.format).rstrip("\n"))
    if in_code or any(finding.severity == "error" for finding in findings):
        return FAILED
    if args.format == "text":
        named = ((kind, sources[str(file)]) for file, kind in files if kind != "map")
        for note in schema_notes(named, known):
            show(f"note: {note}")
        _explore(_not_used(library, {str(file) for file in charts}), library, known, args)
    return OK


def _explore(
    charts: Iterable[Chart], library: Library, known: Catalogue, args: argparse.Namespace
) -> None:
    """Tell what explorations of these charts find; with `-o`, write their dead ends as tests."""
    dead = []
    for chart in charts:
        if needed := [p.name for p in chart.parameters.values() if p.required]:
            if args.explain:
                show(f"{chart.name}: not explored, as it is given no {', '.join(needed)}")
            continue
        walk = _walked(chart, library, known, FARTHER if args.explain else WALKED)
        show(
            "\n".join(explanation(walk))
            if args.explain
            else f"{chart.name}: {walk.found.summary()}"
        )
        if walk.found.stuck:
            dead.append(walk)
    output: Path | None = args.output
    if output is None:
        return
    if not dead:
        show(f"no dead ends: {output} is not written")
        return
    text = dead_end_tests(dead, output.parent)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(text, encoding="utf-8")
    first = f"give each `{OPEN}` in it a value, then " if f": {OPEN},  #" in text else ""
    show(f"{output}: {first}run it with pytest")


def _once(findings: Iterable[Finding]) -> list[Finding]:
    """The findings without repetitions, which occur if several files name a wrong one."""
    found: dict[tuple[Place, str], Finding] = {}
    for finding in findings:
        key = (finding.place, finding.message)
        if key not in found or not finding.related:
            found[key] = finding
    return list(found.values())


def _places(finding: Finding) -> list[Place]:
    return [finding.place, *(place for place, _ in finding.related)]


def _not_used(library: Library, files: set[str]) -> list[Chart]:
    """The charts of these files that no other chart uses."""
    nodes = (node for chart in library.values() for node in chart.root.walk())
    used = {node.target for node in nodes if node.form == "use"}
    return [chart for name, chart in library.items() if chart.file in files and name not in used]


def _walked(chart: Chart, library: Library, known: Catalogue, limit: int) -> Explored:
    """An exploration of the chart."""
    around = replace(known_names(library, known), named=None)  # a run has its own places
    machine = Machine(chart, library, known.interfaces, types=known.types, around=around)
    return Explored(machine, explore(machine, limit))


def _default_paths(known: Catalogue) -> list[Path]:
    own = [file for project in known.projects if project.folder for file in project.yaml_files()]
    if own:
        return own
    import hw

    hardware = Path(hw.__path__[0])
    shipped = [*shipped_charts(), CHARTS / "profiles", hardware, CAMPAIGNS]
    here = Path.cwd()
    return [path.relative_to(here) if path.is_relative_to(here) else path for path in shipped]
