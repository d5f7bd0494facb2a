"""`cobodeck render --scene …`: a picture of a room, at the start or in the middle of a run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.setup import PROFILE, profile_with
from cobodeck.terminal import OK, Problem, ProgressLine, instant, positive, profile, show, word
from engine.files import did_you_mean

if TYPE_CHECKING:
    from cobodeck.shapes import Moment

SPACES = ("chase", "escape", "haptic")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments for pictures of rooms."""
    parser.add_argument(
        "--scene", type=word, metavar="S", help="draw this room, name or file, not a chart"
    )
    parser.add_argument(
        "--at", type=instant, metavar="T", help="… after T s of a run of CHART; default: its start"
    )
    parser.add_argument(
        "--user", type=word, metavar="NAME|FILE[#id][@x,y,yaw]", help="… with this user"
    )
    parser.add_argument("--requests", type=positive, metavar="N", help="… who asks so many times")
    profile(parser, PROFILE)
    parser.add_argument(
        "--show",
        metavar="SPACES",
        help=f"of {','.join(SPACES)}; default: what the user makes of it",
    )


def draw_scene(args: argparse.Namespace) -> int:
    """Draw the room to a file.

    Raises:
        Problem: an argument is wrong; ValueError of `hw` and `behaviors`: a file is wrong.
    """
    from cobodeck.pictures.drawing import at_start, form_of, save, with_next_drive
    from cobodeck.pictures.scene_picture import scene_picture
    from cobodeck.setup import environment_at, open_place
    from cobodeck.shapes import Surroundings
    from hw.model import load_robot

    place = open_place(args.scene)
    scene = place.scene
    output: Path = args.output or Path(f"{scene.name}.svg")
    form_of(output)
    spaces = _spaces(args.show)
    values = profile_with(args.profile, args.sets)
    robot = load_robot(scene.robot)
    around = Surroundings(scene, environment_at(place, values, robot), values)
    if args.at is None and args.user is None:
        moment = with_next_drive(at_start(scene, robot.parked), around.environment, values.settings)
    else:
        moment = _simulated(args)
    save(scene_picture(around, moment, spaces), output)
    show(str(output))
    return OK


def _spaces(text: str | None) -> tuple[str, ...] | None:
    if text is None:
        return None
    names = tuple(name for name in text.split(",") if name)
    for name in names:
        if name not in SPACES:
            raise Problem(f"--show: no space {name!r}; {did_you_mean(name, SPACES)}")
    return names


def _simulated(args: argparse.Namespace) -> Moment:
    from cobodeck.pictures.drawing import after
    from cobodeck.project import catalogue
    from cobodeck.setup import Options, open_setup

    known = catalogue(own=args.own)
    setup = open_setup(args.chart, args.scene, args.profile, known=known, sets=args.sets)
    progress = ProgressLine("render")
    try:
        return after(setup, Options(args.user, args.requests), args.at or 0.0, progress.at)
    finally:
        progress.done()
