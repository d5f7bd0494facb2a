"""Measure how much of a room or map the robot can use, and whether that is enough.

Takes a scene, by name or file, or the YAML file of a map. Exit code 1: too small for all
behaviours.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cobodeck.checks import FloorReport, floor_report
from cobodeck.setup import PROFILE, profile_with
from cobodeck.terminal import FAILED, OK, json_options, length, profile, show, show_json, table


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("place", metavar="SCENE|MAP", help="name or file")
    parser.add_argument(
        "--inflation",
        type=length,
        metavar="M",
        help="kept from walls; default: that of Haptic",
    )
    parser.add_argument(
        "--corners", choices=("round", "square"), default="round",
        help="how rooms are inflated around corners; default round, as the planners do",
    )  # fmt: skip
    profile(parser, PROFILE)
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="X.svg, .png or .pdf")
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Measure, report, draw."""
    if args.output is not None:
        from cobodeck.pictures.drawing import form_of

        form_of(args.output)

    values = profile_with(args.profile, args.sets)
    found = floor_report(args.place, values, inflation=args.inflation, corners=args.corners)
    if args.json:
        show_json(figures(found))
    else:
        show(summary(found))
    if args.output is not None:
        _draw(found, args.output)
        if not args.json:
            show(str(args.output))
    return OK if found.shortcoming is None else FAILED


def figures(found: FloorReport) -> dict[str, Any]:
    """The report as JSON; m, m2."""
    from states.floors import smallest_square

    space = found.space
    return {
        "place": found.name,
        "inflation_m": space.inflation,
        "corners": found.corners,
        "free_m2": space.free_m2,
        "usable_m2": space.usable_m2,
        "usable_share": space.share,
        "pieces_m2": list(space.pieces),
        "closed_passages": [
            {"x": passage.middle[0], "y": passage.middle[1], "width_m": passage.width}
            for passage in space.closed
        ],
        "smallest_square_room_m": smallest_square(space.inflation),
        "fits_all_behaviours": found.shortcoming is None,
        "shortcoming": found.shortcoming,
        "no_haptic_pose_share": found.untouchable.overall,
        "wall_ahead_m": {str(angle): ahead for angle, ahead in found.wall_ahead.items()},
        "remarks": list(found.remarks),
    }


def summary(found: FloorReport) -> str:
    """The report as a table."""
    from states.floors import smallest_square

    space, side = found.space, smallest_square(found.space.inflation)
    head = f"{found.name}: kept {space.inflation:g} m from walls, {found.corners} corners"
    rows = [
        ("free", f"{space.free_m2:.2f} m2"),
        ("left for the robot", f"{space.usable_m2:.2f} m2{_percent(space.share, ', {}')}"),
        ("in pieces of", _listed(space.pieces)),
        ("closed passages", _passages(found)),
        ("user poses without a Haptic pose", _percent(found.untouchable.overall) or "-"),
        ("nearest wall ahead for Haptic", _ahead(found.wall_ahead)),
        ("smallest square room", f"{side:.4g} x {side:.4g} m"),
        ("for all behaviours", found.shortcoming or "large enough"),
        *(("look at", remark) for remark in found.remarks),
    ]
    return f"{head}\n\n{table(rows)}"


def _percent(share: float | None, form: str = "{}") -> str:
    return "" if share is None else form.format(f"{share:.1%}")


def _listed(pieces: tuple[float, ...]) -> str:
    shown = ", ".join(f"{area:.2f}" for area in pieces[:6]) or "none"
    more = f" and {len(pieces) - 6} more" if len(pieces) > 6 else ""
    return f"{shown} m2{more}" if pieces else "nothing"


def _passages(found: FloorReport) -> str:
    places = [
        f"{passage.width:.2f} m at ({passage.middle[0]:.2f}, {passage.middle[1]:.2f})"
        for passage in found.space.closed
    ]
    more = f" and {len(places) - 6} more" if len(places) > 6 else ""
    return ", ".join(places[:6]) + more if places else "none"


def _ahead(distances: Mapping[int, float]) -> str:
    shown = ", ".join(f"{ahead:.2f} m ({angle} deg)" for angle, ahead in distances.items())
    return f"{shown}, by pose"


def _draw(found: FloorReport, output: Path) -> None:
    from cobodeck.pictures import space_picture
    from cobodeck.pictures.drawing import save

    space = found.space
    line = (
        f"{space.free_m2:.1f} m² free, {space.usable_m2:.1f} m²{_percent(space.share, ' ({})')} "
        f"left at {space.inflation:g} m, {found.corners} corners"
    )
    none = _percent(found.untouchable.overall, "no Haptic pose for {} of user poses")
    text = "\n".join(part for part in (line, none) if part)
    save(space_picture(found.floor, space, found.untouchable, found.name, text), output)
