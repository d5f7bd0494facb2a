"""Draw a chart (SVG, PNG, PDF, DOT or Mermaid text), a recorded run, or a room.

A chart is drawn with the values that a run by the same profile uses.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from cobodeck.pictures import render_scene as room
from cobodeck.project import catalogue, chart_file, load_beside, misfits, reached, replacements
from cobodeck.setup import profile_with, with_values
from cobodeck.terminal import FAILED, OK, Problem, complain, instant, is_record, show
from engine import text
from engine.draw import FILE_FORMS, CannotRender, dot, mermaid, nodes_shown, render
from engine.files import did_you_mean

TEXT_FORMS = ("dot", "mmd")
LARGEST = 10_000
LEVELS = 64


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
    room.arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Draw."""
    if args.chart is not None and is_record(args.chart):
        return _draw_run(args)
    if args.start_s is not None or args.end_s is not None:
        raise Problem("--from and --to are for records of runs, X.mcap")
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
    shown = nodes_shown(chart.name, library, LEVELS if depth is None else depth, {})
    if shown > LARGEST:
        raise Problem(f"a picture of {shown} nodes; at most {LARGEST}, choose a smaller --depth")
    profile = profile_with(args.profile, args.sets)
    used = reached({chart.name}, library)
    for told in (*replacements(library, known, used), *misfits(library, known, used)):
        complain(told)
    charts = with_values(profile, library, used)
    write = mermaid if form == "mmd" else dot
    written = write(charts[chart.name], charts, depth, constants=profile.constants)
    try:
        data = written.encode() if form in TEXT_FORMS else render(written, form)  # type: ignore[arg-type]
    except CannotRender as error:
        raise Problem(str(error), FAILED) from None
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_bytes(data)
    show(str(output))
    return OK


def _draw_run(args: argparse.Namespace) -> int:
    if args.scene is not None:
        raise Problem(f"{args.chart}: a record has its own room; leave out --scene")
    from cobodeck.pictures.run import draw_run

    return draw_run(Path(args.chart), args.output, args.start_s, args.end_s)
