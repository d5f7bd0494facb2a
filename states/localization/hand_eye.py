"""Two ways to a tracker: over the tracking's frame, and over the base on the floor.

map_from_vive @ vive_from_tracker = map_from_base @ base_from_tracker, with two unknown frames
(Shah's robot-world hand-eye problem), here for a base that moves in a plane. A closed first guess,
then robust Gauss-Newton steps on the frames themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from hw.geometry import Pose2, Pose3
from states.localization.tracks import Array, Pairs

STEPS = 50
_SETTLED = 1e-9  # m, rad and s of a last step
_HOLD = 1e-2  # of the normal equations: directions that the drive leaves open hardly move
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Frames:
    """What is looked for: places (f, 3) and turns of map_from_vive, then of each base_from_tracker.

    `yaws` (s,): by how much each scanner is turned on its mount, rad; `clock`: by how much stamps
    of trackers are behind those of scanners, s.
    """

    places: Array
    turns: tuple[Rotation, ...]
    yaws: Array
    clock: float


@dataclass(frozen=True, slots=True)
class CalibrationProblem:
    """What is known, and which of the frames are to be found.

    `scales`: a residual of so many m, rad and s counts as 1. `free`: frames from the first on; the
    rest is known. `named`: scanners whose yaw is looked for; `nominal`: base_from_scanner of all.
    """

    pairs: Pairs
    free: int
    named: Sequence[int]
    nominal: Sequence[Pose2]
    scales: tuple[float, float, float]

    @property
    def unknowns(self) -> int:
        """How many numbers are looked for: places, turns, yaws, the clock."""
        return 6 * self.free + len(self.named) + 1

    def misses(self, frames: Frames) -> tuple[Array, Array]:
        """By how much the two ways differ, means over windows (w, 3): m, and turns in rad.

        In the map's axes; the last column of the second is the yaw.
        """
        pairs = self.pairs
        base, yaw = self._base(frames)
        heading = headings(yaw)
        by_base = base + heading.apply(frames.places[1:][pairs.tracker])
        by_vive = frames.places[0] + frames.turns[0].apply(pairs.places)
        mounts = Rotation.concatenate(frames.turns[1:])[pairs.tracker]
        apart = frames.turns[0] * pairs.turns * (heading * mounts).inv()
        return pairs.mean(by_vive - by_base), pairs.mean(apart.as_rotvec())

    def residuals(self, frames: Frames) -> Array:
        """In units of the scales; behind them what is settled by convention."""
        offset, turn = self.misses(frames)
        length, angle, clock = self.scales
        settled = [frames.clock / clock]
        if self.free > 1:
            settled += [frames.places[0, 2] / length, frames.yaws.sum() / angle]
        return np.concatenate((offset.ravel() / length, turn.ravel() / angle, settled))

    def jacobian(self, frames: Frames) -> Array:
        """Of the residuals by the unknowns, for turns that are nearly equal."""
        pairs, n = self.pairs, len(self.pairs.times)
        _, yaw = self._base(frames)
        heading = headings(yaw)
        columns: list[tuple[Array, Array]] = []
        zero = np.zeros((n, 3))
        seen = frames.turns[0].apply(pairs.places)
        levers = heading.apply(frames.places[1:][pairs.tracker])
        axes = np.eye(3)
        columns += [(np.tile(axis, (n, 1)), zero) for axis in axes]
        for at in range(1, self.free):
            here = (pairs.tracker == at - 1)[:, None]
            columns += [(np.where(here, -heading.apply(axis), 0.0), zero) for axis in axes]
        columns += [(np.cross(axis, seen), np.tile(axis, (n, 1))) for axis in axes]
        for at in range(1, self.free):
            here = (pairs.tracker == at - 1)[:, None]
            columns += [(zero, np.where(here, -heading.apply(axis), 0.0)) for axis in axes]
        for moved in range(len(self.named) + 1):
            by_place, by_yaw = self._base_slope(frames, moved)
            swung = by_place + by_yaw[:, None] * np.cross(_UP, levers)
            columns.append((-swung, -np.outer(by_yaw, _UP)))
        length, angle, clock = self.scales
        table = np.array(
            [
                np.concatenate((pairs.mean(o).ravel() / length, pairs.mean(t).ravel() / angle))
                for o, t in columns
            ]
        ).T
        settled = np.zeros((3 if self.free > 1 else 1, self.unknowns))
        settled[0, -1] = 1.0 / clock
        if self.free > 1:
            settled[1, 2] = 1.0 / length
            settled[2, 6 * self.free : -1] = 1.0 / angle
        return np.vstack((table, settled))

    def moved(self, frames: Frames, step: Array) -> Frames:
        """The frames after a step of all unknowns."""
        n = 3 * self.free
        places, turns = frames.places.copy(), list(frames.turns)
        places[: self.free] += step[:n].reshape(-1, 3)
        for at, turn in enumerate(step[n : 2 * n].reshape(-1, 3)):
            turns[at] = Rotation.from_rotvec(turn) * turns[at]
        yaws = frames.yaws.copy()
        yaws[list(self.named)] += step[2 * n : -1]
        return Frames(places, tuple(turns), yaws, frames.clock + float(step[-1]))

    def _base(self, frames: Frames) -> tuple[Array, Array]:
        """Place (n, 3) and yaw (n,) of the base at the trackers' times."""
        base, yaw = self.pairs.base_at(frames.clock)
        for at, (nominal, turned) in enumerate(zip(self.nominal, frames.yaws, strict=True)):
            # a scanner turned by d on its mount m tells base @ m @ turn(d) @ inv(m) for the base
            back = nominal @ Pose2(0.0, 0.0, -float(turned)) @ nominal.inverse()
            here = self.pairs.scanner == at
            c, s = np.cos(yaw[here]), np.sin(yaw[here])
            base[here, 0] += c * back.x - s * back.y
            base[here, 1] += s * back.x + c * back.y
            yaw[here] -= turned
        return base, yaw

    def _base_slope(self, frames: Frames, moved: int) -> tuple[Array, Array]:
        """By the yaw of a named scanner, or, behind them, by the clock; from two places."""
        h = 1e-5
        if moved < len(self.named):
            step = np.zeros(len(frames.yaws))
            step[self.named[moved]] = h
            ends = [replace(frames, yaws=frames.yaws + sign * step) for sign in (-1.0, 1.0)]
        else:
            h = 1e-2
            ends = [replace(frames, clock=frames.clock + sign * h) for sign in (-1.0, 1.0)]
        (base_0, yaw_0), (base_1, yaw_1) = (self._base(end) for end in ends)
        return (base_1 - base_0) / (2.0 * h), (yaw_1 - yaw_0) / (2.0 * h)


def fit(problem: CalibrationProblem, frames: Frames) -> tuple[Frames, Array, Array]:
    """The frames of least squares, with residuals and Jacobian as they were weighed at last.

    Residuals far above 1 count by their first power (pseudo-Huber), so that jumps spoil little.
    """
    for _ in range(STEPS):
        residuals, jacobian = problem.residuals(frames), problem.jacobian(frames)
        weights = (1.0 + residuals**2) ** -0.25
        rest, slope = weights * residuals, weights[:, None] * jacobian
        normal = slope.T @ slope + _HOLD * np.eye(problem.unknowns)
        step = np.asarray(-np.linalg.solve(normal, slope.T @ rest), np.float64)
        frames = problem.moved(frames, step)
        if np.abs(step).max() < _SETTLED:
            break
    return frames, rest, slope


def headings(yaw: Array) -> Rotation:
    """Turns about the vertical by yaw (n,)."""
    return Rotation.from_rotvec(np.outer(yaw, (0.0, 0.0, 1.0)))


def first_guess(pairs: Pairs, mounts: Mapping[str, Pose3] | None) -> Frames:
    """All frames without any prior knowledge, or map_from_vive alone if the mounts are known.

    The axis about which trackers turn is the floor's normal, and with it the rest is linear.
    """
    yaws = np.zeros(len(pairs.scanners))
    base, yaw = pairs.base_at(0.0)
    if mounts is not None:
        known = [mounts[name] for name in pairs.trackers]
        mounted = np.array([(pose.x, pose.y, pose.z) for pose in known])
        screwed = [Rotation.from_quat((pose.qx, pose.qy, pose.qz, pose.qw)) for pose in known]
        place, turn = _vive_by_mounts(pairs, base, yaw, mounted, screwed)
        return Frames(np.vstack((place, mounted)), (turn, *screwed), yaws, 0.0)
    upright = _upright(pairs, yaw)
    flat = upright.apply(pairs.places)
    turned, x, y, levers = _planar(pairs, base, yaw, flat)
    map_from_level = Rotation.from_rotvec([0.0, 0.0, -turned])
    # flat = turn(turned) (base + turn(yaw) lever) + (x, y): read the other way round
    place = -map_from_level.apply([x, y, 0.0])
    vive_turn = map_from_level * upright
    heading = headings(yaw)
    places, turns = [place], [vive_turn]
    for at in range(len(pairs.trackers)):
        here = pairs.tracker == at
        turns.append((heading[here].inv() * vive_turn * pairs.turns[here]).mean())
        places.append(np.array([*levers[at], np.mean(flat[here, 2])]))
    return Frames(np.array(places), tuple(turns), yaws, 0.0)


def _vive_by_mounts(
    pairs: Pairs, base: Array, yaw: Array, places: Array, turns: list[Rotation]
) -> tuple[Array, Rotation]:
    heading = headings(yaw)
    turn = (heading * Rotation.concatenate(turns)[pairs.tracker] * pairs.turns.inv()).mean()
    seen = turn.apply(pairs.places)
    return np.median(base + heading.apply(places[pairs.tracker]) - seen, axis=0), turn


def _upright(pairs: Pairs, yaw: Array) -> Rotation:
    """A turn of the tracking's frame that makes the axis of the base's turns the z axis."""
    axis = np.zeros(3)
    for at in range(len(pairs.trackers)):
        here = np.flatnonzero(pairs.tracker == at)
        for step in (len(here) // 7 + 1, len(here) // 3 + 1):
            first, second = here[:-step], here[step:]
            turned = (pairs.turns[second] * pairs.turns[first].inv()).as_rotvec()
            by = (yaw[second] - yaw[first] + np.pi) % (2.0 * np.pi) - np.pi
            clear = (np.abs(by) > 0.2) & (np.abs(by) < 2.9)
            axis += (np.sign(by)[:, None] * turned)[clear].sum(axis=0)
    length = float(np.linalg.norm(axis))
    if length < 1.0:  # hardly any turn: it is believed to count upwards along z
        return Rotation.identity()
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [axis / length])
    return turn


def _planar(
    pairs: Pairs, base: Array, yaw: Array, flat: Array
) -> tuple[float, float, float, Array]:
    """The turn, the offset and each tracker's lever (t, 2) in the plane: linear in all of them."""
    n, t = len(yaw), len(pairs.trackers)
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = base[:, 0], base[:, 1]
    one, zero = np.ones(n), np.zeros(n)
    rows = np.zeros((2 * n, 4 + 2 * t))
    rows[:n, :4] = np.column_stack((x, -y, one, zero))
    rows[n:, :4] = np.column_stack((y, x, zero, one))
    for at in range(t):
        here = np.flatnonzero(pairs.tracker == at)
        rows[here, 4 + 2 * at], rows[here, 5 + 2 * at] = c[here], -s[here]
        rows[n + here, 4 + 2 * at], rows[n + here, 5 + 2 * at] = s[here], c[here]
    solution = np.linalg.lstsq(rows, np.concatenate((flat[:, 0], flat[:, 1])), rcond=1e-6)[0]
    turned = float(np.arctan2(solution[1], solution[0]))
    c1, s1 = np.cos(turned), np.sin(turned)
    levers = solution[4:].reshape(-1, 2) @ np.array([[c1, -s1], [s1, c1]])
    return turned, float(solution[2]), float(solution[3]), levers
