"""The pose graph against a dense solver, and loops that are wrong."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from hw.geometry import Pose2
from states.localization.slam.pose_graph import PoseEdge, solved


def chain(seed, count=20):
    """True poses, poses to begin with, and edges with errors as their information says."""
    rng = np.random.default_rng(seed)
    true = [Pose2(0.0, 0.0)]
    for _ in range(count - 1):
        true.append(true[-1] @ Pose2(0.5, 0.0, float(rng.normal(0.0, 0.5))))
    pairs = [(n, n + 1) for n in range(count - 1)]
    pairs += [(int(a), int(b)) for a, b in rng.integers(0, count, (8, 2)) if a != b]
    edges, begun = [], [true[0]]
    for i, j in pairs:
        root = rng.normal(0.0, 0.02, (3, 3))
        covariance = root @ root.T + np.diag([1e-4, 1e-4, 1e-5])
        error = rng.multivariate_normal(np.zeros(3), covariance)
        between = true[i].inverse() @ true[j]
        x, y, yaw = np.array([between.x, between.y, between.yaw]) + error
        edge = PoseEdge(i, j, Pose2(x, y, yaw), np.linalg.inv(covariance), abs(i - j) > 1)
        edges.append(edge)
        if j == i + 1 and len(begun) == i + 1:
            begun.append(begun[-1] @ edge.pose)
    return true, begun, edges


def dense(begun, edges):
    """Poses (n, 3) by scipy's dense solver, written with complex numbers."""

    def errors(flat):
        state = np.vstack([[begun[0].x, begun[0].y, begun[0].yaw], flat.reshape(-1, 3)])
        found = []
        for edge in edges:
            (xi, yi, ti), (xj, yj, tj) = state[edge.first], state[edge.second]
            off = (complex(xj, yj) - complex(xi, yi)) * np.exp(-1j * ti)
            turn = np.angle(np.exp(1j * (tj - ti - edge.pose.yaw)))
            e = np.array([off.real - edge.pose.x, off.imag - edge.pose.y, turn])
            found.append(np.linalg.cholesky(edge.information).T @ e)
        return np.concatenate(found)

    start = np.array([[p.x, p.y, p.yaw] for p in begun[1:]]).ravel()
    return least_squares(errors, start, xtol=1e-14, ftol=1e-14, gtol=1e-12).x.reshape(-1, 3)


def compare(found, expected):
    for pose, (x, y, yaw) in zip(found[1:], expected, strict=True):
        assert math.hypot(pose.x - x, pose.y - y) < 1e-5
        assert abs(math.remainder(pose.yaw - yaw, math.tau)) < 1e-5


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.few(2)
def test_poses_are_those_of_a_dense_solver(seed):
    _, begun, edges = chain(seed)
    plain = [edge._replace(is_loop=False) for edge in edges]
    compare(solved(begun, plain).poses, dense(begun, plain))


@pytest.mark.parametrize("seed", range(4))
def test_wrong_loops_are_left_out_and_bend_nothing(seed):
    _, begun, edges = chain(seed)
    rng = np.random.default_rng(seed)
    wrong = [
        PoseEdge(int(a), int(b), Pose2(*rng.uniform(2.0, 5.0, 2), 1.0), 1e3 * np.eye(3), True)
        for a, b in ((1, 15), (4, 18), (2, 12))
    ]
    found = solved(begun, [*edges, *wrong])

    assert found.kept[-3:] == [False] * 3
    counted = [e for e, keep in zip([*edges, *wrong], found.kept, strict=True) if keep]
    assert len(counted) >= len(edges) - 1
    compare(found.poses, dense(begun, counted))


def test_a_match_along_a_corridor_leaves_the_way_to_the_wheels():
    """The match knows x not at all, y well; the wheels know both a little."""
    wheels = PoseEdge(0, 1, Pose2(1.0, 0.3), np.diag([100.0, 100.0, 100.0]))
    corridor = PoseEdge(0, 1, Pose2(5.0, 0.0), np.diag([0.0, 1e6, 1e6]))
    _, pose = solved([Pose2(0.0, 0.0), Pose2(1.0, 0.3)], [wheels, corridor]).poses

    assert abs(pose.x - 1.0) < 1e-6
    assert abs(pose.y) < 1e-3
