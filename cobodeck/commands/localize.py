"""Run the localization on a recorded log and report its accuracy.

Takes a record (MCAP), an MRPT rawlog or simplemap, a CARMEN log or a ROS bag. Without a map one is
built from the first half of the scans, and the second is scored. Exit code 1: the base was not
localized.
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.terminal import (
    FAILED,
    OK,
    Problem,
    ProgressLine,
    json_options,
    length,
    pose,
    scan_mounts,
    show,
    show_json,
    table,
    word,
)
from engine.files.declared import YAML

if TYPE_CHECKING:
    from cobodeck.logs import Ground, Localized
    from cobodeck.logs.formats import SensorLog
    from hw import Pose2


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("log", type=Path, metavar="LOG", help="the recording")
    parser.add_argument(
        "--map", dest="place", type=word, metavar="MAP",
        help="a map (YAML), a scene, or a simplemap; default: from part of the log",
    )  # fmt: skip
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--start", type=pose, metavar="X,Y,YAW",
        help="initial pose of the base, m and rad; default: that of its map, else unknown",
    )  # fmt: skip
    where.add_argument(
        "--global", dest="anywhere", action="store_true", help="search the whole map for the base"
    )
    scan_mounts(parser)
    parser.add_argument("--seed", type=int, default=0, help="of all random numbers; default 0")
    parser.add_argument(
        "--resolution", type=length, metavar="M", help="of maps from scans; default 0.05"
    )
    parser.add_argument("--save-map", type=_yaml, metavar="FILE", help="the map from scans, X.yaml")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="the trajectory, for spreadsheets")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="X.svg, .png or .pdf")
    json_options(parser)


def _yaml(text: str) -> Path:
    if not text.endswith(YAML):
        raise argparse.ArgumentTypeError(f"{text!r} does not end in .yaml, as maps do")
    return Path(text)


def run(args: argparse.Namespace) -> int:
    """Localize, report, draw."""
    if args.output is not None:
        from cobodeck.pictures.drawing import form_of

        form_of(args.output)
    from cobodeck.logs import open_log
    from cobodeck.logs.formats import SCAN

    log = open_log(args.log).mounted(dict(args.scan_mounts))
    if log.count(SCAN) == 0:
        return _reckon(log, args)
    from cobodeck.logs import first_pose, localize

    ground = _ground(log, args)
    start = None if args.anywhere else args.start or first_pose(ground)
    found = localize(log, ground, start, args.seed, time.perf_counter)
    written = list(_written(found, args))
    if args.json:
        from cobodeck.logs import figures

        show_json(figures(found))
    else:
        show(summary(found))
        for path in written:
            show(str(path))
    return OK if found.walls and found.steps[-1].pose is not None else FAILED


def _ground(log: SensorLog, args: argparse.Namespace) -> Ground:
    from cobodeck.logs import built_ground, given_ground
    from states.maps import RESOLUTION

    resolution = args.resolution or RESOLUTION
    if args.place is None:
        progress = ProgressLine("map from the log")
        try:
            return built_ground(log, resolution, progress.at)
        finally:
            progress.done()
    return given_ground(args.place, log, resolution)


def _written(found: Localized, args: argparse.Namespace) -> list[Path]:
    """Write the requested files; returns their paths."""
    written = []
    if args.save_map is not None:
        if found.ground.map is None:
            raise Problem(f"--save-map: {found.ground.source} is no map of scans")
        from states.maps import save_map

        save_map(found.ground.map, args.save_map)
        written.append(args.save_map)
    if args.csv is not None:
        _write_csv(found, args.csv)
        written.append(args.csv)
    if args.output is not None:
        from cobodeck.pictures import localized_picture
        from cobodeck.pictures.drawing import save

        save(localized_picture(found), args.output)
        written.append(args.output)
    return written


def _write_csv(found: Localized, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream)
        rows.writerow(("t", "x", "y", "yaw", "sigma", "sigma_yaw", "status", "wall"))
        for step in found.steps:
            at, sigma = step.pose, step.sigma
            where = ["", "", "", "", ""]
            if at is not None:
                told = at.x, at.y, at.yaw, sigma.position, sigma.yaw
                where = [repr(number) for number in told]
            wall = "" if step.wall is None else step.wall
            rows.writerow((step.stamp_ns / 1e9, *where, step.status, wall))


def _reckon(log: SensorLog, args: argparse.Namespace) -> int:
    """For a log without scans: the path by wheels and inertial sensor."""
    from cobodeck.logs import reckon, reckoning_figures

    for name, given in (("--map", args.place), ("--start", args.start), ("-o", args.output)):
        if given is not None:
            raise Problem(f"{log.path}: has no scans, so that there is nothing for {name}")
    found = reckoning_figures(log, reckon(log))
    if args.json:
        show_json(found)
        return OK
    x, y, z = found["final_position_m"]
    rows = [
        ("samples", ", ".join(f"{count} {name}" for name, count in found["samples"].items())),
        ("duration", f"{found['duration_s']:.1f} s"),
        ("way", f"{found['way_m']:.1f} m"),
        ("ends at", f"{x:.4f}, {y:.4f}, {z:.4f} m, yaw {found['final_yaw_rad']:.4f} rad"),
        *(("look at", remark) for remark in log.remarks),
    ]
    show(f"{log.path}: {log.form} without scans, by wheels and inertial sensor\n\n{table(rows)}")
    return OK


def summary(found: Localized) -> str:
    """The figures as text for people."""
    from cobodeck.logs import figures

    told = figures(found)
    walls, errors, took = told["wall_distance_m"], told["errors"], told["time_per_scan_ms"]
    status = ", ".join(f"{count} {name}" for name, count in told["status"].items())
    begins = "anywhere" if found.start is None else _where(found.start)
    rows = [
        ("map", told["map"]),
        ("begins", begins),
        ("scans", f"{told['scans']}, {told['scored']} scored: {status}"),
        ("beams to walls", _walls(walls)),
        ("against corrected poses", _errors(errors)),
        ("time per scan", f"{took['median']:.2f} ms, p99 {took['p99']:.1f} ms" if took else "-"),
        *(("look at", remark) for remark in found.remarks),
    ]
    return f"{found.log.path}: {found.log.form}, {found.log.duration:.1f} s\n\n{table(rows)}"


def _where(start: Pose2) -> str:
    return f"at {start.x:.2f}, {start.y:.2f} m, {math.degrees(start.yaw):.1f} deg"


def _walls(walls: dict[str, float] | None) -> str:
    if walls is None:
        return "-"
    return (
        f"{1e2 * walls['median']:.1f} cm in the median, p95 {1e2 * walls['p95']:.1f} cm, "
        f"max {1e2 * walls['max']:.1f} cm; below 5 cm in {walls['share_below_5cm']:.1%} of scans"
    )


def _errors(errors: dict[str, Any] | None) -> str:
    if errors is None:
        return "there are none"
    frame = "" if errors["frame"] == "same" else ", laid onto each other"
    return (
        f"rmse {1e2 * errors['position_rmse_m']:.1f} cm, p95 {1e2 * errors['position_p95_m']:.1f} "
        f"cm, max {1e2 * errors['position_max_m']:.1f} cm; "
        f"{math.degrees(errors['yaw_rmse_rad']):.2f} deg{frame}"
    )
