"""Scans of a whole log are placed: loops are closed where scans tell so, wheels never torn."""

import math
from itertools import pairwise

import numpy as np

from hw.geometry import Pose2
from states.localization.slam.incremental_mapping import GrowingValues, points_in, wheel_covariance
from states.localization.slam.loop_closure import LoopValues
from states.localization.slam.placing import PlacedScan, place
from states.maps.field import map_field
from states.maps.mapping import Mapper
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


def quiet(_text, _share):
    pass


def placed(poses, clouds):
    """What `place` makes of scans with these poses by the wheels."""

    def field_of(found):
        mapper = Mapper(0.05)
        for pose, cloud in zip(found, clouds, strict=True):
            mapper.add((pose.x, pose.y), points_in(pose, cloud))
        return map_field(mapper.map())

    scans = [PlacedScan("laser", cloud, pose) for pose, cloud in zip(poses, clouds, strict=True)]
    return place(scans, field_of, quiet, LoopValues(gone=6.0))


def laid(poses, true):
    """Poses moved so that the first is right."""
    move = true[0] @ poses[0].inverse()
    return [move @ pose for pose in poses]


def test_a_round_by_wheels_that_turn_wrongly_closes():
    true = truth()
    poses = drifted(true, 0.05)
    found = placed(poses, clouds_of(true))

    assert max(off(poses, true)) > 1.0
    assert found.loops > 0
    assert found.wrong == 0
    assert max(off(found.poses, true)) < 0.05


def test_a_place_that_looks_otherwise_makes_no_loop():
    true = truth()
    clouds = clouds_of(true)
    half = len(true) // 2
    clouds[half:] = [cloud * 1.7 + 3.0 for cloud in clouds[half:]]
    found = placed(drifted(true, 0.002), clouds)

    assert found.loops == found.wrong


def test_scans_are_never_torn_from_the_wheels():
    """One scan in seven shows a shifted room; the wheels say that nobody jumped."""
    true = truth()
    clouds = clouds_of(true)
    for n in range(5, len(clouds), 7):
        clouds[n] = clouds[n] + [0.3, -0.2]
    poses = drifted(true)
    found = placed(poses, clouds).poses

    for (a, b), (c, d) in zip(pairwise(poses), pairwise(found), strict=True):
        step = a.inverse() @ b
        sigma = np.sqrt(np.diag(wheel_covariance(step, GrowingValues())))
        moved = step.inverse() @ (c.inverse() @ d)
        assert max(abs(np.array([moved.x, moved.y, moved.yaw])) / sigma) < 4.0
