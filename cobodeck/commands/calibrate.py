"""Calibrate the tracking system in the map and the mounts of trackers and scanners, from a log.

Takes the record of a drive with turns both ways and places metres apart. The calibration is written
if it fits within 5 mm and 0.1 degrees; else exit code 1.
"""

from __future__ import annotations

import argparse
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.terminal import (
    FAILED,
    OK,
    Problem,
    json_options,
    pose,
    scan_mounts,
    show,
    show_json,
    table,
    word,
)
from engine.files.declared import YAML

if TYPE_CHECKING:
    from cobodeck.logs import Ground
    from cobodeck.logs.formats import SensorLog
    from hw import Pose3
    from states.localization.calibration import Calibration, NoCalibration


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("log", type=Path, metavar="LOG", help="the record of a drive")
    parser.add_argument(
        "--map", dest="place", type=word, metavar="MAP",
        help="a map (YAML) or a scene; default: the room of the record",
    )  # fmt: skip
    parser.add_argument(
        "--start", type=pose, metavar="X,Y,YAW",
        help="initial pose of the base, m and rad; default: unknown",
    )  # fmt: skip
    parser.add_argument(
        "--mounts", type=Path, metavar="FILE",
        help="an earlier calibration with valid mounts: only the tracking was restarted",
    )  # fmt: skip
    scan_mounts(parser)
    parser.add_argument("--seed", type=int, default=0, help="of all random numbers; default 0")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="the calibration, X.yaml")
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Calibrate, report, write."""
    from cobodeck.logs import calibrated, open_log

    if args.output is not None and args.output.suffix not in YAML:
        raise Problem(
            f"{args.output}: a calibration is a YAML file; its name ends in .yaml or .yml"
        )
    mounts = None if args.mounts is None else _known(args.mounts)
    log = open_log(args.log).mounted(dict(args.scan_mounts))
    found = calibrated(log, _ground(log, args.place), args.start, args.seed, mounts)
    if args.json:
        show_json(figures(found))
    else:
        show(summary(args.log, found))
    if _refused(found):
        return FAILED
    if args.output is not None:
        _write(found, args.log, args.output)
        if not args.json:
            show(str(args.output))
    return OK


def _known(path: Path) -> dict[str, Pose3]:
    from hw.model import load_tracking

    return dict(load_tracking(path).poses().mounts)


def _ground(log: SensorLog, place: str | None) -> Ground:
    from cobodeck.logs import given_ground, room_ground

    if place is not None:
        return given_ground(place, log)
    if log.room is None:
        raise Problem(f"{log.path}: does not name its room; give it with --map MAP")
    return room_ground(log, log.room)


def _refused(found: Calibration | NoCalibration) -> str | None:
    return getattr(found, "text", None)


def _calibration(found: Calibration | NoCalibration) -> Calibration | None:
    from states.localization.calibration import NoCalibration

    return found.found if isinstance(found, NoCalibration) else found


def _write(found: Calibration | NoCalibration, log: Path, output: Path) -> None:
    from cobodeck.logs import tracking_file

    held = _calibration(found)
    assert held is not None  # it was not refused
    name = re.sub(r"\W+", "_", output.stem).strip("_") or "tracking"
    output.write_text(tracking_file(held, name, f"From {log.name}.").text(), encoding="utf-8")


def figures(found: Calibration | NoCalibration) -> dict[str, Any]:
    """The figures for programs; m, rad, s."""
    held, refused = _calibration(found), _refused(found)
    told: dict[str, Any] = {"fits": refused is None, "refused": refused}
    if held is None:
        return told
    return told | {
        "map_from_vive": _numbers(held.map_from_vive),
        "tilt_rad": held.tilt,
        "mounts": {name: _numbers(pose) for name, pose in held.mounts.items()},
        "scanner_yaws_rad": dict(held.scanner_yaws),
        "clock_offset_s": held.clock_offset,
        "position_rms_m": held.position_rms,
        "yaw_rms_rad": held.yaw_rms,
        "windows": held.windows,
        "sigmas": dict(held.sigmas),
    }


def _numbers(pose: Pose3) -> dict[str, float]:
    from hw.model import placement_of

    placed = placement_of(pose)
    (x, y, z), (roll, pitch, yaw) = placed.xyz, placed.rpy
    return {"x": x, "y": y, "z": z, "roll": roll, "pitch": pitch, "yaw": yaw}


def summary(log: Path, found: Calibration | NoCalibration) -> str:
    """The figures for people."""
    held, refused = _calibration(found), _refused(found)
    if held is None:
        return f"{log}: no calibration: {refused}"
    rows = [
        ("map from vive", _pose_text(held.map_from_vive)),
        *((name, _pose_text(pose)) for name, pose in held.mounts.items()),
        *((name, f"turned by {math.degrees(y):.3f} deg") for name, y in held.scanner_yaws.items()),
        ("clocks", f"{1e3 * held.clock_offset:.1f} ms apart"),
        ("fits to", f"{1e3 * held.position_rms:.1f} mm, {math.degrees(held.yaw_rms):.3f} deg"),
        ("over", f"{held.windows} windows"),
        ("verdict", "can be used" if refused is None else f"refused: {refused}"),
    ]
    return f"{log}\n\n{table(rows)}"


def _pose_text(pose: Pose3) -> str:
    at = _numbers(pose)
    place = f"{at['x']:.4f}, {at['y']:.4f}, {at['z']:.4f} m"
    turn = ", ".join(f"{math.degrees(at[axis]):.2f}" for axis in ("roll", "pitch", "yaw"))
    return f"{place}; {turn} deg"
