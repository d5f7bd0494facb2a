"""Report from how many of the rover's directions the arm reaches a level DEEP, by its height.

The paper's seven directions lie on a half circle behind the DEEP. Reach is tested exactly: every
branch of the inverse kinematics, free of contact with itself, rover and floor. Exit code 1: nothing
is reached.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.terminal import FAILED, OK, Problem, json_options, show, show_json, table
from engine.files import FileError

if TYPE_CHECKING:
    from states.arm.kinematics import Manipulator
    from states.arm.planning import ParkedPose, ReachTable

HEIGHTS = (0.3, 1.9, 0.1)
DISTANCES = (0.8, 0.9, 1.0, 1.1, 1.2)
MOST = 1000


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "--height", type=_lengths, metavar="M[:M[:STEP]]", default=_range(*HEIGHTS),
        help="of the DEEP above the floor, one or from:to:step; default 0.3:1.9:0.1",
    )  # fmt: skip
    parser.add_argument(
        "--distance", type=_lengths, metavar="M[:M[:STEP]]", default=DISTANCES,
        help="of the rover's centre from the DEEP; default 0.8:1.2:0.1",
    )  # fmt: skip
    parser.add_argument(
        "--tool", metavar="M|NAME|FILE",
        help="another prop: its length from the flange, or its name or file as in hw/props",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=_tolerance, metavar="M", default=0.0,
        help="count only what is reached from this far around the rover's pose, too; default 0",
    )  # fmt: skip
    parser.add_argument(
        "--robot", metavar="NAME|FILE", default="rbkairos_ur10", help="default rbkairos_ur10"
    )
    parser.add_argument(
        "--park", action="store_true", help="find poses in which the arm is folded with its prop"
    )
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="X.svg, .png or .pdf")
    json_options(parser)


def _lengths(text: str) -> tuple[float, ...]:
    """`1.2`, `0.5:1.6` (every 0.1) or `0.5:1.6:0.05`, m."""
    try:
        parts = [float(part) for part in text.split(":")]
    except ValueError:
        parts = []
    if not 1 <= len(parts) <= 3 or not all(map(math.isfinite, parts)):
        raise argparse.ArgumentTypeError(f"{text} is no length in m, nor from:to:step")
    low, high = parts[0], parts[min(1, len(parts) - 1)]
    step = parts[2] if len(parts) == 3 else 0.1
    if not (0.0 < low <= high and step > 0.0):
        raise argparse.ArgumentTypeError(f"{text} does not go upwards from above 0 m")
    if (high - low) / step > MOST:
        raise argparse.ArgumentTypeError(f"{text} gives more than {MOST} values")
    return _range(low, high, step)


def _tolerance(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is no length of 0 m or more")
    return value


def _range(low: float, high: float, step: float) -> tuple[float, ...]:
    count = math.floor((high - low) / step + 1e-9) + 1
    return tuple(round(low + i * step, 9) for i in range(count))


@dataclass(frozen=True)
class ReachReport:
    """The table, the prop it is for, and the tolerance of the rover's pose."""

    table: ReachTable
    robot: str
    tool: str
    length: float
    tolerance: float
    told: str = ""

    def heights_within(self, column: int) -> tuple[float, float] | None:
        """The lowest and highest height that is reached at all from a distance; None: none."""
        pairs = zip(self.table.heights, self.table.share[:, column], strict=True)
        found = [height for height, share in pairs if share > 0.0]
        return (found[0], found[-1]) if found else None


def run(args: argparse.Namespace) -> int:
    """Compute, report, draw."""
    if args.park:
        return _park(args)
    if args.output is not None:
        from cobodeck.pictures.drawing import form_of

        form_of(args.output)
    found = reach_report(args.height, args.distance, args.robot, args.tool, args.tolerance)
    if args.json:
        show_json(figures(found))
    else:
        show(summary(found))
    if args.output is not None:
        from cobodeck.pictures import reach_picture
        from cobodeck.pictures.drawing import save

        save(reach_picture(found.table, *_head(found).split(", ", 1)), args.output)
        if not args.json:
            show(str(args.output))
    return OK if found.table.share.any() else FAILED


def _park(args: argparse.Namespace) -> int:
    """Print parked poses of a robot's arm with a prop, as its file has them."""
    from hw.model import load_prop, load_robot
    from states.arm.planning import ParkingSearch

    if args.tool is not None and _number(args.tool) is not None:
        raise Problem(f"--tool {args.tool}: --park needs the name or the file of a prop")
    try:
        held = None if args.tool is None else load_prop(args.tool).for_any()
        robot = load_robot(args.robot, prop=held)
    except FileError as error:
        raise Problem(str(error)) from None
    if robot.arm is None or robot.prop is None:
        raise Problem(f"robot {robot.name} has no arm")
    found = ParkingSearch(robot).best()
    name = robot.arm.model.name
    if args.json:
        show_json({"poses": [asdict(pose) for pose in found]})
    elif found:
        prop = robot.prop.name
        show(f"poses of {name} with {prop}, quickest first; for `parked` of the prop's file, or of")
        show(f"the arm's own file as `parked: {{{prop}: [...]}}`:")
        show(table([_parked(name, pose) for pose in found]))
    else:
        show(f"{name} with {robot.prop.name} does not fit inside the bumper frame")
    return OK if found else FAILED


def _parked(name: str, pose: ParkedPose) -> tuple[str, ...]:
    joints = ", ".join(f"{angle:g}" for angle in pose.joints)
    return (
        f"{name}: [{joints}]",
        f"{pose.clearance * 1e3:.0f} mm clear",
        f"{pose.time:.2f} s to {pose.reached:.0%} of DEEPs",
    )


def reach_report(
    heights: Sequence[float],
    distances: Sequence[float],
    robot: str,
    tool: str | None,
    tolerance: float,
) -> ReachReport:
    """Reach by height and distance, m.

    Raises:
        Problem: there is no such robot or tool, or a file is wrong.
    """
    from states.arm.kinematics import slowness
    from states.arm.planning import ANGLES, Reach

    arm = arm_of(robot, tool)
    found = Reach(arm, arm).table(
        heights, distances, ANGLES, (tolerance, 0.1 if tolerance else 0.0)
    )
    told = slowness(arm.shape) if arm.is_numeric else ""
    return ReachReport(found, robot, arm.tool.name, _length(arm), tolerance, told)


def arm_of(robot: str, tool: str | None) -> Manipulator:
    """The arm of a robot with its own prop, with one of this length, m, or with a named one.

    Raises:
        Problem: the length is impossible, or a file is wrong or missing.
    """
    from hw.model import load_robot
    from states.arm.description import manipulator_of

    length = _number(tool)
    try:
        arm = manipulator_of(load_robot(robot, prop=tool if length is None else None))
    except FileError as error:
        raise Problem(str(error)) from None
    if length is None:
        return arm
    if not 0.0 < length < 2.0:
        raise Problem(f"--tool {tool}: a prop is longer than 0 m and shorter than 2 m")
    return _lengthened(arm, length)


def _number(text: str | None) -> float | None:
    try:
        return None if text is None else float(text)
    except ValueError:
        return None


def _lengthened(arm: Manipulator, length: float) -> Manipulator:
    """The arm with a prop of this length, m; its capsules end as far from the tip as before."""
    from dataclasses import replace

    tool, longer = arm.tool, length - _length(arm)
    x, y, _ = tool.tcp.xyz
    capsules = tuple(
        replace(c, end=(c.end[0], c.end[1], max(c.start[2], c.end[2] + longer)))
        for c in tool.capsules
    )
    tcp = replace(tool.tcp, xyz=(x, y, length))
    return arm.with_tool(replace(tool, tcp=tcp, capsules=capsules))


def _length(arm: Manipulator) -> float:
    return float(arm.tool.tcp.xyz[2])


def figures(found: ReachReport) -> dict[str, Any]:
    """The figures for programs; m, shares of the directions."""
    return {
        "robot": found.robot,
        "tool": found.tool,
        "tool_length_m": found.length,
        "tolerance_m": found.tolerance,
        "angles_deg": [round(math.degrees(angle), 6) for angle in found.table.angles],
        "rows": [
            {"height_m": height, "distance_m": distance, "share": float(share)}
            for height, shares in zip(found.table.heights, found.table.share, strict=True)
            for distance, share in zip(found.table.distances, shares, strict=True)
        ],
        "reached_m": {
            f"{distance:g}": found.heights_within(column)
            for column, distance in enumerate(found.table.distances)
        },
    }


def summary(found: ReachReport) -> str:
    """The figures for people: directions out of all of them, the highest DEEP first."""
    reach, count = found.table, len(found.table.angles)
    shown = [
        (f"{height:.2f} m", *(f"{share * count:.0f}/{count}" for share in shares))
        for height, shares in reversed(list(zip(reach.heights, reach.share, strict=True)))
    ]
    head = ("height", *(f"{distance:g} m" for distance in reach.distances))
    right = frozenset(range(len(head)))
    told = f"\n\n{found.told}" if found.told else ""
    return f"{_head(found)}\n\n{table([head, *shown], right)}\n\n{_band(found)}{told}"


def _head(found: ReachReport) -> str:
    around = f", from {found.tolerance:g} m around each pose" if found.tolerance else ""
    return (
        f"directions from which a level DEEP is reached, "
        f"{found.robot} with {found.tool} of {found.length:g} m{around}"
    )


def _band(found: ReachReport) -> str:
    lines = []
    for column, distance in enumerate(found.table.distances):
        band = found.heights_within(column)
        told = "nothing" if band is None else f"{band[0]:g} to {band[1]:g} m high"
        lines.append((f"from {distance:g} m", told))
    return table(lines)
