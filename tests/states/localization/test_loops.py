"""Loops are closed where scans tell so, and left alone where they do not."""

import math
from itertools import pairwise

import numpy as np
import pytest

from hw.geometry import Pose2
from states.localization.loops import LoopValues, PoseEdge, close_loops, polished, relaxed
from states.maps.field import room_field
from tests.states.localization.world import ROOM, cast

CORNERS = [(2.0, 2.0), (5.5, 2.2), (5.6, 7.4), (2.5, 8.2), (2.6, 3.6), (2.0, 2.0), (5.0, 2.1)]
SIDES = np.array(ROOM.segments)


def truth(step=0.25):
    """A round in the room, the beginning of it twice."""
    found = []
    for (x1, y1), (x2, y2) in pairwise(CORNERS):
        count = math.ceil(math.dist((x1, y1), (x2, y2)) / step)
        yaw = math.atan2(y2 - y1, x2 - x1)
        found += [
            Pose2(x1 + (x2 - x1) * n / count, y1 + (y2 - y1) * n / count, yaw) for n in range(count)
        ]
    return found


def clouds_of(poses, beams=180, seed=1):
    rng = np.random.default_rng(seed)
    found = []
    for pose in poses:
        angles = np.linspace(-math.pi, math.pi, beams, endpoint=False)
        ranges = cast(pose.x, pose.y, angles + pose.yaw, SIDES, np.zeros((0, 3)))
        ranges = ranges + rng.normal(0.0, 0.01, beams)
        found.append(np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1))
    return found


def drifted(poses, twist=0.016):
    """Each step turned a little more than it was."""
    found = [poses[0]]
    for before, after in pairwise(poses):
        step = before.inverse() @ after
        found.append(
            found[-1] @ Pose2(step.x, step.y, step.yaw + twist * math.hypot(step.x, step.y))
        )
    return found


def off(poses, true):
    return [pose.distance_to(other) for pose, other in zip(poses, true, strict=True)]


def test_a_round_that_did_not_close_is_bent_until_it_does():
    true = truth()
    poses, clouds = drifted(true), clouds_of(true)
    values = LoopValues(gone=6.0)
    closed = close_loops(poses, clouds, values)

    assert max(off(poses, true)) > 0.8
    assert max(off(closed, true)) < 0.35
    ends = off(closed[-10:], true[-10:])
    assert max(ends) < 0.1


def test_a_way_without_a_loop_stays_as_it_is():
    true = truth()[:12]
    poses = drifted(true)

    assert max(off(close_loops(poses, clouds_of(true)), poses)) < 1e-9


def test_walls_elsewhere_make_no_loop():
    """The second round sees another room: what does not fit is no loop, however near it seems."""
    true = truth()
    clouds = clouds_of(true)
    half = len(true) // 2
    clouds[half:] = [cloud * 1.7 + 3.0 for cloud in clouds[half:]]
    poses = drifted(true, 0.002)

    found = close_loops(poses, clouds, LoopValues(gone=6.0))
    assert max(off(found, poses)) < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_edges_without_contradiction_are_met(seed):
    rng = np.random.default_rng(seed)
    true = [Pose2(*rng.uniform(-3.0, 3.0, 2), float(rng.uniform(-3.0, 3.0))) for _ in range(12)]
    pairs = [(n, n + 1) for n in range(11)] + [(0, 6), (3, 11), (1, 9)]
    edges = [
        PoseEdge(i, j, true[i].inverse() @ true[j], (0.1, 0.05), is_loop=abs(i - j) > 1)
        for i, j in pairs
    ]
    begun = [
        Pose2(p.x + dx, p.y + dy, p.yaw + 0.1 * dx)
        for p, (dx, dy) in zip(true, rng.normal(0.0, 0.1, (12, 2)), strict=True)
    ]
    begun[0] = true[0]
    found = relaxed(begun, edges)

    assert max(off(found, true)) < 1e-6


def test_one_wrong_loop_among_many_has_no_say():
    true = [Pose2(0.5 * n, 0.0) for n in range(30)]
    edges = [
        PoseEdge(n, n + 1, Pose2(0.5, 0.0), (0.02, 0.01), is_loop=False) for n in range(29)
    ] + [PoseEdge(n, n + 12, Pose2(6.0, 0.0), (0.03, 0.01), is_loop=True) for n in range(0, 17, 2)]
    wrong = PoseEdge(2, 25, Pose2(1.0, 4.0, 2.0), (0.03, 0.01), is_loop=True)

    assert max(off(relaxed(true, [*edges, wrong]), true)) < 0.05


def test_polishing_brings_scans_onto_the_walls():
    true = truth()[::4]
    rng = np.random.default_rng(4)
    rough = [
        Pose2(p.x + dx, p.y + dy, p.yaw + turn)
        for p, (dx, dy, turn) in zip(true, rng.normal(0.0, 0.03, (len(true), 3)), strict=True)
    ]
    found = polished(rough, clouds_of(true), room_field(ROOM))

    assert max(off(found, true)) < 0.02
