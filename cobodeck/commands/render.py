"""Draw a chart (SVG, PNG, PDF, DOT or Mermaid text), a recorded run, or a room.

A chart is drawn with the values that a run by the same profile uses.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from cobodeck.pictures import render_scene as room
from cobodeck.project import (
    Catalogue,
    catalogue,
    chart_file,
    load_beside,
    misfits,
    reached,
    replacements,
)
from cobodeck.setup import profile_with, with_values
from cobodeck.terminal import FAILED, OK, Problem, complain, instant, is_record, show
from engine import text
from engine.chart import Chart
from engine.draw import FILE_FORMS, MOST_NODES, CannotRender, dot, mermaid, nodes_shown, render
from engine.files import did_you_mean

TEXT_FORMS = ("dot", "mmd")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "chart", nargs="?", metavar="CHART|RECORD", help="name or file, or X.mcap: a recorded run"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="X.svg, .png, .pdf, .dot or .mmd"
    )
    parser.add_argument(
        "--depth", type=int, default=0, metavar="N", help="levels of used charts; -1: all"
    )
    for option, what in (("--from", "start"), ("--to", "end")):
        about = f"{what} of what is drawn of RECORD; default: its own"
        parser.add_argument(option, dest=f"{what}_s", type=instant, metavar="S", help=about)
    parser.add_argument(
        "--coverage",
        nargs="+",
        type=Path,
        metavar="RECORD",
        help="how often these runs took each edge of CHART",
    )
    parser.add_argument(
        "--foxglove",
        type=Path,
        metavar="LAYOUT.json",
        help="instead of a picture, a layout with which the Foxglove app shows RECORD",
    )
    room.arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Draw."""
    if args.chart is not None and is_record(args.chart):
        return _draw_run(args) if args.foxglove is None else _write_layout(args)
    if args.foxglove is not None:
        raise Problem("--foxglove is for records of runs, X.mcap")
    if args.start_s is not None or args.end_s is not None:
        raise Problem("--from and --to are for records of runs, X.mcap")
    if args.coverage and (args.chart is None or args.scene is not None):
        raise Problem("--coverage is drawn on a CHART; name one")
    if args.scene is not None:
        return room.draw_scene(args)
    if args.chart is None:
        raise Problem("name a CHART, a RECORD, or a room with --scene")
    return _draw_chart(args)


def _draw_chart(args: argparse.Namespace) -> int:
    known = catalogue(own=args.own)
    file = chart_file(args.chart, known)
    output = args.output or Path(f"{file.stem}.svg")
    form = output.suffix.removeprefix(".")
    if form not in (*FILE_FORMS, *TEXT_FORMS):
        raise Problem(f"{output}: unknown form; {did_you_mean(form, (*FILE_FORMS, *TEXT_FORMS))}")
    library = load_beside([file], known)
    chart = next((c for c in library.values() if c.file == str(file)), None)
    if chart is None:
        sources = {str(file): library.sources[str(file)]}
        raise Problem(f"{file} is no chart\n{text(library.findings, sources)}".rstrip(), FAILED)
    depth = None if args.depth < 0 else args.depth
    nodes = nodes_shown(chart.name, library, depth)
    if nodes > MOST_NODES:
        raise Problem(f"a picture of {nodes} nodes; at most {MOST_NODES}, choose a smaller --depth")
    profile = profile_with(args.profile, args.sets)
    used = reached({chart.name}, library)
    for told in (*replacements(library, known, used), *misfits(library, known, used)):
        complain(told)
    charts = with_values(profile, library, used)
    write = mermaid if form == "mmd" else dot
    shown = charts[chart.name]
    counts = _counts(args.coverage, shown, charts, known) if args.coverage else None
    written = write(shown, charts, depth, constants=profile.constants, counts=counts)
    try:
        data = written.encode() if form in TEXT_FORMS else render(written, form)  # type: ignore[arg-type]
    except CannotRender as error:
        raise Problem(str(error), FAILED) from None
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_bytes(data)
    show(str(output))
    return OK


def _write_layout(args: argparse.Namespace) -> int:
    """Write a layout for the Foxglove app."""
    from cobodeck.record.read import Record
    from cobodeck.record.write import foxglove_layout

    record = Record(Path(args.chart))
    record.require_ticks()
    topics = {told.topic for group in record.groups() for told in group.told}
    args.foxglove.parent.mkdir(parents=True, exist_ok=True)
    args.foxglove.write_text(foxglove_layout(topics), encoding="utf-8")
    show(str(args.foxglove))
    return OK


def _counts(
    files: list[Path], chart: Chart, charts: Mapping[str, Chart], known: Catalogue
) -> dict[tuple[str, str], int]:
    """How often the recorded runs took each edge of a chart."""
    from cobodeck.record.read import Record
    from cobodeck.review import edge_counts

    return edge_counts(chart, charts, map(Record, files), known, complain)


def _draw_run(args: argparse.Namespace) -> int:
    if args.scene is not None:
        raise Problem(f"{args.chart}: a record has its own room; leave out --scene")
    if args.coverage:
        raise Problem(f"--coverage is drawn on a CHART, and {args.chart} is a record")
    from cobodeck.pictures.run import draw_run

    return draw_run(Path(args.chart), args.output, args.start_s, args.end_s)
