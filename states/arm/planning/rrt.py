"""RRT-Connect between one start and several goals, and the shortening of its paths.

Kuffner and LaValle, ICRA 2000: two trees grow in turn; one takes a step towards a random joint set,
the other then tries to connect to the new node in one line. Lines are checked exactly (`sweep`).
"""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from states.arm.kinematics import Array, CollisionChecker, Manipulator

STEP = 1.0
"""Longest edge of a tree towards a random joint set, rad."""

SURROUND = 1.5
"""Random joint angles are drawn up to this far outside the box of start and goals, rad."""

SHORTCUTS = 80
"""Shortcuts tried on each path."""

# an edge cut short by an obstacle is kept from this length on, rad
_NEVER_SHORTER = 0.1


class JointTree:
    """Free joint sets, each joined to its parent by a free line; roots have no parent."""

    def __init__(self, roots: Array) -> None:
        self._nodes = np.zeros((max(256, 2 * len(roots)), roots.shape[1]))
        self._nodes[: len(roots)] = roots
        self._parents = [-1] * len(roots)

    def add(self, joints: Array, parent: int) -> int:
        """Add a node; returns its index."""
        count = len(self._parents)
        if count == len(self._nodes):
            self._nodes = np.concatenate([self._nodes, np.zeros_like(self._nodes)])
        self._nodes[count] = joints
        self._parents.append(parent)
        return count

    def at(self, node: int) -> Array:
        """Joints (j,) of a node."""
        return np.asarray(self._nodes[node])

    def nearest(self, joints: Array) -> int:
        """The node nearest to these joints, by Euclidean distance."""
        gaps = self._nodes[: len(self._parents)] - joints
        return int(np.argmin(np.einsum("ij,ij->i", gaps, gaps)))

    def path_to_root(self, node: int) -> Array:
        """Joints from a node to its root, (k, j)."""
        chain = []
        while node >= 0:
            chain.append(self._nodes[node])
            node = self._parents[node]
        return np.array(chain)


def connect(
    checker: CollisionChecker,
    start: Array,
    goals: Array,
    rng: np.random.Generator,
    budget: int,
    portion: int,
) -> Generator[None, None, tuple[Array | None, int]]:
    """Corners (k, j) of a free path from start to one of the goals; None if the budget ran out.

    Yields about every `portion` joint sets checked, and returns their number beside the corners.
    """
    trees = JointTree(start[None]), JointTree(goals)
    low, high = drawing_box(checker.arm, start, goals)
    checks, due, forward = 0, portion, True
    while checks < budget:
        one, other = trees if forward else trees[::-1]
        drawn = rng.uniform(low, high)
        grown, used = _extend(checker, one, drawn, STEP)
        checks += used
        if grown is not None:
            met, used = _extend(checker, other, one.at(grown), np.inf)
            checks += used
            if met is not None and np.array_equal(other.at(met), one.at(grown)):
                here, there = (grown, met) if forward else (met, grown)
                return _joined(trees[0].path_to_root(here), trees[1].path_to_root(there)), checks
        forward = not forward
        if checks >= due:
            due = checks + portion
            yield
    return None, checks


def drawing_box(arm: Manipulator, start: Array, goals: Array) -> tuple[Array, Array]:
    """Lowest and highest joint angles to draw from, rad."""
    every = np.concatenate([start[None], goals])
    low = np.maximum(every.min(axis=0) - SURROUND, arm.lower)
    return low, np.minimum(every.max(axis=0) + SURROUND, arm.upper)


def shortened(
    checker: CollisionChecker, corners: Array, rng: np.random.Generator, portion: int
) -> Generator[None, None, tuple[Array, int]]:
    """The path with free lines across its corners, and the number of joint sets checked."""
    checks, due = 0, portion
    for _ in range(SHORTCUTS):
        if len(corners) < 3:
            break
        candidate = _cut(corners, rng)
        if candidate is None:
            continue
        begin, end, shorter = candidate
        free, used = checker.sweep_line(begin, end - begin)
        checks += used
        if free >= 1.0:
            corners = shorter
        if checks >= due:
            due = checks + portion
            yield
    return corners, checks


def _extend(
    checker: CollisionChecker, tree: JointTree, towards: Array, step: float
) -> tuple[int | None, int]:
    """Grow the tree towards joints by at most `step`, rad, or four fifths of the free part of it.

    Returns the node reached (None: the free part is too short) and the joint sets checked.
    """
    parent = tree.nearest(towards)
    begin = tree.at(parent)
    line = towards - begin
    length = float(np.linalg.norm(line))
    if length == 0.0:
        return parent, 0
    share = min(1.0, step / length)
    free, checks = checker.sweep_line(begin, share * line)
    if free >= 1.0:
        end = towards if share == 1.0 else begin + share * line
        return tree.add(end, parent), checks
    short = begin + 0.8 * free * share * line
    if 0.8 * free * share * length < _NEVER_SHORTER or not checker.free(short)[0]:
        return None, checks + 1
    return tree.add(short, parent), checks + 1


def _joined(from_start: Array, to_goal: Array) -> Array:
    return np.concatenate([from_start[::-1], to_goal[1:]])


def _cut(corners: Array, rng: np.random.Generator) -> tuple[Array, Array, Array] | None:
    """Two random points on different lines of the path, and the corners of the shorter path."""
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    # corners are drawn as often as points between them
    places = np.sort(
        [rng.choice(knots) if rng.uniform() < 0.5 else rng.uniform(0.0, knots[-1]) for _ in "ab"]
    )
    i, j = np.clip(np.searchsorted(knots, places, side="right") - 1, 0, len(corners) - 2)
    if i == j:
        return None
    share = (places - knots[[i, j]]) / (knots[[i + 1, j + 1]] - knots[[i, j]])
    begin, end = (
        corners[k] + s * (corners[k + 1] - corners[k]) for k, s in zip((i, j), share, strict=True)
    )
    kept = np.concatenate([corners[: i + 1], [begin, end], corners[j + 1 :]])
    moved = np.linalg.norm(np.diff(kept, axis=0), axis=1) > 1e-9
    return begin, end, kept[np.concatenate([[True], moved])]
