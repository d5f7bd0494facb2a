"""Poses of all scans of a log, without a map, from one pose graph.

Nodes are scans, thinned where the base stands. Edges are the wheels' displacements, as uncertain as
wheels may slip; the matches of scan to scan, by their information, which is 0 along a corridor; the
loops (`loops.py`); and at the end the matches of each scan to the map of all of them, measured from
the first pose, which is held. Scans between two nodes share the correction of both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hw import Pose2, wrap
from states.localization.filter import inverse
from states.localization.matching import TrackerValues, match, rotated
from states.localization.slam.incremental_mapping import (
    Growing,
    GrowingValues,
    matched_information,
    near_points,
    wheel_covariance,
)
from states.localization.slam.loop_closure import Loops, LoopValues
from states.localization.slam.pose_graph import PoseEdge, solved
from states.maps import RESOLUTION, Array, Field

Progress = Callable[[str, float], None]
"""Called with the current step and the share done, 0 to 1."""
ROUNDS = 3
"""Number of times loops are looked for, and number of maps that all scans are matched to."""
NODE_M, NODE_RAD = 0.1, 0.1
"""Nodes of the graph are this far apart, or turned by this against each other."""
_WIDE = TrackerValues(beams=1000, scale=0.2, inlier_distance=0.15, iterations=20, healthy=0.3)
_NEAR = np.diag([0.1**2, 0.1**2, 0.03**2])
"""How far a scan may be from where the map of all scans has it, m2 and rad2."""


class PlacedScan(NamedTuple):
    """A scan: its sensor, points (n, 2) in the base frame, m, and odometry, if there is any."""

    sensor: str
    points: Array
    odom_from_base: Pose2 | None


class Placing(NamedTuple):
    """map_from_base of all scans; numbers of loops found, and of those left out as wrong."""

    poses: list[Pose2]
    loops: int
    wrong: int


def place(
    scans: Sequence[PlacedScan],
    field_of: Callable[[Sequence[Pose2]], Field],
    progress: Progress,
    values: LoopValues | None = None,
    resolution: float = RESOLUTION,
) -> Placing:
    """Place all scans; `field_of` makes the map of all scans from their poses.

    Raises:
        ValueError: the map becomes too large.
    """
    grown, known = _grown(scans, resolution, progress)
    keys = _keys(grown)
    bent = [grown[key] for key in keys]
    clouds = [near_points(scans[key].points) for key in keys]
    steps = _steps(scans, grown, known, keys)
    loops = Loops(bent, clouds, values)
    kept: list[bool] = []
    for turn in range(ROUNDS):
        progress("loops", turn / ROUNDS)
        if not loops.look(bent):
            break
        edges = [*steps, *loops.edges.values()]
        bent, kept = solved(bent, edges)
    good = _counted(loops, kept[len(steps) :])
    poses = _carried(grown, keys, bent)
    for turn in range(ROUNDS):
        progress("map of all scans", turn / ROUNDS)
        walls = _to_map(bent, clouds, field_of(poses))
        bent, _ = solved(bent, [*steps, *good, *walls])
        poses = _carried(grown, keys, bent)
    return Placing(poses, len(loops.edges), len(loops.edges) - len(good))


def _grown(
    scans: Sequence[PlacedScan], resolution: float, progress: Progress
) -> tuple[list[Pose2], list[Array]]:
    """Poses scan by scan, and the information of their matches, (3, 3) in the map."""
    growing, poses, known = Growing(resolution), [], []
    for number, scan in enumerate(scans):
        progress(f"scan {number} of {len(scans)}", number / len(scans))
        poses.append(growing.add_scan(scan.odom_from_base, scan.sensor, scan.points))
        known.append(growing.information)
    return poses, known


def _keys(poses: Sequence[Pose2]) -> list[int]:
    keys = [0]
    for number, pose in enumerate(poses):
        last = poses[keys[-1]]
        if last.distance_to(pose) >= NODE_M or abs(wrap(pose.yaw - last.yaw)) >= NODE_RAD:
            keys.append(number)
    return keys


def _steps(
    scans: Sequence[PlacedScan], poses: Sequence[Pose2], known: Sequence[Array], keys: Sequence[int]
) -> list[PoseEdge]:
    """Edges from node to node: displacements by the wheels, and by the matches."""
    edges, values = [], GrowingValues()
    for second in range(1, len(keys)):
        last, key = keys[second - 1], keys[second]
        information = rotated(known[key], -poses[last].yaw)
        between = poses[last].inverse() @ poses[key]
        before, after = scans[last].odom_from_base, scans[key].odom_from_base
        if before is not None and after is not None:
            by_wheels = before.inverse() @ after
            weight = inverse(wheel_covariance(by_wheels, values))
            edges.append(PoseEdge(second - 1, second, by_wheels, weight))
        elif not information.any():
            information = inverse(wheel_covariance(between, values))
        edges.append(PoseEdge(second - 1, second, between, information))
    return edges


def _counted(loops: Loops, kept: Sequence[bool]) -> list[PoseEdge]:
    """The loops that count, from now on beyond doubt."""
    found = list(loops.edges.values())[: len(kept)]
    return [edge._replace(is_loop=False) for edge, keep in zip(found, kept, strict=True) if keep]


def _to_map(poses: Sequence[Pose2], clouds: Sequence[Array], field: Field) -> list[PoseEdge]:
    """Edges from the first pose to each that matches the map."""
    edges, begin = [], poses[0].inverse()
    for number in range(1, len(poses)):
        found = match(field, clouds[number], poses[number], _NEAR, _WIDE)
        if found.is_healthy(_WIDE):
            information = rotated(matched_information(found), -poses[0].yaw)
            edges.append(PoseEdge(0, number, begin @ found.map_from_base, information))
    return edges


def _carried(poses: Sequence[Pose2], keys: Sequence[int], bent: Sequence[Pose2]) -> list[Pose2]:
    """All poses; between two nodes the correction goes over from that of one to the other's."""
    found, at = [], 0
    for number, pose in enumerate(poses):
        while at + 1 < len(keys) and keys[at + 1] <= number:
            at += 1
        moved = bent[at] @ (poses[keys[at]].inverse() @ pose)
        if at + 1 < len(keys):
            share = (number - keys[at]) / (keys[at + 1] - keys[at])
            moved = moved.between(bent[at + 1] @ (poses[keys[at + 1]].inverse() @ pose), share)
        found.append(moved)
    return found
