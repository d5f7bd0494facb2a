"""A pose graph: the poses that fit measured displacements best (Lu and Milios 1997).

The error of an edge in the frame of its first pose is e = (R_i^T (p_j - p_i), yaw_j - yaw_i) less
the measured displacement; minimised is the sum of e^T I e with the information I of each edge, by
Gauss-Newton on sparse normal equations. I may be singular, as along a corridor.

Loops may be wrong. They get the weights of Geman and McClure, w = (m c^2 / (r^2 + m c^2))^2 with
r^2 = e^T I e, while m falls from where all weights are near 1 down to 1 (graduated non-convexity,
Yang et al. 2020). Loops that are then farther off than c are left out, the others count in full.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve

from hw import Pose2, wrap
from states.maps import Array

BARRIER = 16.27
"""c^2: the squared error of a right loop is below it in 99.9 % of cases (chi^2, 3 axes)."""
ENOUGH = 1e-6
"""Steps shorter than this end the iteration, m and rad."""
ITERATIONS = 20
FALL = 2.0
"""m is divided by this between two steps."""


class PoseEdge(NamedTuple):
    """A measured first_from_second between the poses of two numbers.

    `information` (3, 3) is about x, y and yaw in the frame of the first pose, 1/m2 and 1/rad2.
    """

    first: int
    second: int
    pose: Pose2
    information: Array
    is_loop: bool = False


class Solution(NamedTuple):
    """Poses, and for each edge whether it counts."""

    poses: list[Pose2]
    kept: list[bool]


Numbers = NDArray[np.int64]


class _Edges(NamedTuple):
    """Edges as arrays: numbers (n,), displacements (n, 3), roots of the information (n, 3, 3)."""

    first: Numbers
    second: Numbers
    measured: Array
    roots: Array


def solved(poses: Sequence[Pose2], edges: Sequence[PoseEdge]) -> Solution:
    """The poses that fit the edges best, and the edges that count; the first pose is held."""
    state = np.array([[pose.x, pose.y, pose.yaw] for pose in poses])
    if not edges:
        return Solution(list(poses), [])
    arrays, loops = _arrays(edges), np.array([edge.is_loop for edge in edges])
    kept = np.ones(len(edges), np.bool_)
    if loops.any():
        state = _converged(state, arrays, np.ones(len(edges)))
        state, square = _graduated(state, arrays, loops)
        kept = ~loops | (square <= BARRIER)
    state = _converged(state, arrays, kept.astype(np.float64))
    return Solution([Pose2(x, y, wrap(yaw)) for x, y, yaw in state.tolist()], kept.tolist())


def _graduated(state: Array, edges: _Edges, loops: Array) -> tuple[Array, Array]:
    """The state with all loops weighed, and squared errors (n,) of all edges."""
    square = _squares(state, edges)
    fall = max(1.0, 2.0 * float(square[loops].max()) / BARRIER)
    while True:
        share = fall * BARRIER / (square + fall * BARRIER)
        state = state + _step(state, edges, np.where(loops, share * share, 1.0))
        square = _squares(state, edges)
        if fall == 1.0:
            return state, square
        fall = max(1.0, fall / FALL)


def _converged(state: Array, edges: _Edges, weights: Array) -> Array:
    for _ in range(ITERATIONS):
        step = _step(state, edges, weights)
        state = state + step
        if np.abs(step).max() < ENOUGH:
            break
    return state


def _arrays(edges: Sequence[PoseEdge]) -> _Edges:
    first, second = (np.array([edge[n] for edge in edges], np.int64) for n in (0, 1))
    measured = np.array([[e.pose.x, e.pose.y, e.pose.yaw] for e in edges])
    values, axes = np.linalg.eigh(np.array([edge.information for edge in edges]))
    roots = np.sqrt(np.maximum(values, 0.0))[:, :, None] * axes.transpose(0, 2, 1)
    return _Edges(first, second, measured, roots)


def _errors(state: Array, edges: _Edges) -> tuple[Array, Array]:
    """Errors (n, 3), and displacements (n, 3) in the frames of the first poses."""
    begin, off = state[edges.first], state[edges.second] - state[edges.first]
    c, s = np.cos(begin[:, 2]), np.sin(begin[:, 2])
    ahead, aside = c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0]
    seen = np.stack([ahead, aside, off[:, 2]], axis=1)
    error = seen - edges.measured
    error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return error, seen


def _squares(state: Array, edges: _Edges) -> Array:
    error, _ = _errors(state, edges)
    squares: Array = (np.einsum("nij,nj->ni", edges.roots, error) ** 2).sum(axis=1)
    return squares


def _step(state: Array, edges: _Edges, weights: Array) -> Array:
    """One step of Gauss-Newton, (poses, 3).

    The derivative of e is R_i^T by p_j, -R_i^T by p_i, (aside, -ahead, -1) by yaw_i.
    """
    error, seen = _errors(state, edges)
    count, yaw = len(error), state[edges.first, 2]
    c, s = np.cos(yaw), np.sin(yaw)
    second = np.zeros((count, 3, 3))
    second[:, 0, 0], second[:, 0, 1], second[:, 1, 0], second[:, 1, 1] = c, s, -s, c
    second[:, 2, 2] = 1.0
    first = -second
    first[:, 0, 2], first[:, 1, 2] = seen[:, 1], -seen[:, 0]
    roots = np.sqrt(weights)[:, None, None] * edges.roots
    blocks = np.stack([roots @ first, roots @ second], axis=1)
    row = np.broadcast_to(3 * np.arange(count)[:, None, None, None] + _ROWS, blocks.shape)
    column = 3 * np.stack([edges.first, edges.second], axis=1)[:, :, None, None] + _COLUMNS
    column = np.broadcast_to(column, blocks.shape)
    shape = (3 * count, 3 * len(state))
    slope = csr_matrix((blocks.ravel(), (row.ravel(), column.ravel())), shape=shape)[:, 3:]
    right = np.einsum("nij,nj->ni", roots, error).ravel()
    step = np.zeros_like(state)
    step[1:] = -spsolve((slope.T @ slope).tocsc(), slope.T @ right).reshape(-1, 3)
    return step


_ROWS, _COLUMNS = np.arange(3)[:, None], np.arange(3)[None, :]
