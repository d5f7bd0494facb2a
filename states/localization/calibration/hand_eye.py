"""Robot-world hand-eye calibration of trackers on a base that moves in a plane.

A tracker's pose in the map is known by two routes, via the tracking system and via the base:

    map_from_vive @ vive_from_tracker = map_from_base @ base_from_tracker

with the first and the last frame unknown (Shah 2013). A closed-form first guess, then robust
Gauss-Newton steps on the frames. Turns are updated on the left, R <- exp(d) R, so that for nearly
equal sides the residual rotation vector changes by +d for map_from_vive and, for a mount, by minus
d turned into the map by the heading.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from hw import Pose2, Pose3
from states.localization.calibration.pose_pairs import Array, Pairs

STEPS = 50
_SETTLED = 1e-9  # the iteration ends with a step below this, m, rad and s
_HOLD = 1e-2  # damping of the normal equations: directions that the drive leaves open hardly move
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Frames:
    """Unknowns: positions (f, 3) and rotations of map_from_vive, then each base_from_tracker.

    `yaws` (s,): yaw of each scanner relative to its nominal mount, rad; `clock`: delay of tracker
    stamps behind scanner stamps, s.
    """

    places: Array
    turns: tuple[Rotation, ...]
    yaws: Array
    clock: float


@dataclass(frozen=True, slots=True)
class CalibrationProblem:
    """The readings, and which of the frames are unknown.

    `scales`: residuals of this size, m, rad and s, count as 1. `free`: number of unknown frames
    from the first on; the rest are known. `named`: scanners whose yaw is estimated; `nominal`:
    base_from_scanner of all.
    """

    pairs: Pairs
    free: int
    named: Sequence[int]
    nominal: Sequence[Pose2]
    scales: tuple[float, float, float]

    @property
    def unknowns(self) -> int:
        """Number of unknowns: positions, rotations, yaws, the clock."""
        return 6 * self.free + len(self.named) + 1

    def misses(self, frames: Frames) -> tuple[Array, Array]:
        """Difference of the two routes, means over windows (w, 3): position, m, and rotation, rad.

        Both along the map's axes; the last column of the rotations is the yaw.
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
        """Residuals in units of the scales, then the conventions.

        Those pin what planar motion leaves open: clock near 0; with unknown mounts the height of
        the tracking's origin 0, and the sum of the scanners' yaws 0.
        """
        offset, turn = self.misses(frames)
        length, angle, clock = self.scales
        settled = [frames.clock / clock]
        if self.free > 1:
            settled += [frames.places[0, 2] / length, frames.yaws.sum() / angle]
        return np.concatenate((offset.ravel() / length, turn.ravel() / angle, settled))

    def jacobian(self, frames: Frames) -> Array:
        """Derivatives of the residuals by the unknowns, for nearly equal sides.

        Moving map_from_vive by d moves the difference by d, turning it by d moves it by d x (the
        tracker seen from the tracking's origin). A mount does the opposite, turned by the heading.
        Yaws of scanners and the clock move the base, and swing the tracker about it.
        """
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
        """The frames after a step (n,) of all unknowns."""
        n = 3 * self.free
        places, turns = frames.places.copy(), list(frames.turns)
        places[: self.free] += step[:n].reshape(-1, 3)
        for at, turn in enumerate(step[n : 2 * n].reshape(-1, 3)):
            turns[at] = Rotation.from_rotvec(turn) * turns[at]
        yaws = frames.yaws.copy()
        yaws[list(self.named)] += step[2 * n : -1]
        return Frames(places, tuple(turns), yaws, frames.clock + float(step[-1]))

    def _base(self, frames: Frames) -> tuple[Array, Array]:
        """Position (n, 3) and yaw (n,) of the base at the trackers' times."""
        base, yaw = self.pairs.base_at(frames.clock)
        for at, (nominal, turned) in enumerate(zip(self.nominal, frames.yaws, strict=True)):
            # a scanner turned by d on its mount m reports base @ m @ turn(d) @ inv(m) for the base
            back = nominal @ Pose2(0.0, 0.0, -float(turned)) @ nominal.inverse()
            here = self.pairs.scanner == at
            c, s = np.cos(yaw[here]), np.sin(yaw[here])
            base[here, 0] += c * back.x - s * back.y
            base[here, 1] += s * back.x + c * back.y
            yaw[here] -= turned
        return base, yaw

    def _base_slope(self, frames: Frames, moved: int) -> tuple[Array, Array]:
        """Derivative of the base by a named scanner's yaw or, last, the clock, by differences."""
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
    """The robust least squares solution, with the weighted residuals and Jacobian of the last step.

    The loss grows like |r| for residuals far above 1 (pseudo-Huber: rho'(r) = r / sqrt(1 + r^2)),
    so that outliers do little harm; as iteratively reweighted least squares, rows are multiplied by
    the root of 1 / sqrt(1 + r^2).
    """
    for _ in range(STEPS):
        residuals, jacobian = problem.residuals(frames), problem.jacobian(frames)
        weights = np.sqrt(robust_weights(residuals))
        rest, slope = weights * residuals, weights[:, None] * jacobian
        normal = slope.T @ slope + _HOLD * np.eye(problem.unknowns)
        step = np.asarray(-np.linalg.solve(normal, slope.T @ rest), np.float64)
        frames = problem.moved(frames, step)
        if np.abs(step).max() < _SETTLED:
            break
    return frames, rest, slope


def robust_weights(residuals: Array) -> Array:
    """Weights of squared residuals, given in units of their scales: rho'(r) / r = 1/sqrt(1+r^2)."""
    return np.asarray(1.0 / np.sqrt(1.0 + residuals**2))


def headings(yaw: Array) -> Rotation:
    """Rotations about the vertical by yaw (n,)."""
    return Rotation.from_rotvec(np.outer(yaw, (0.0, 0.0, 1.0)))


def first_guess(pairs: Pairs, mounts: Mapping[str, Pose3] | None) -> Frames:
    """All frames without prior knowledge, or map_from_vive alone if the mounts are known.

    The axis about which all trackers turn is the floor's normal. With it upright, the rest is a
    linear problem in the plane (`_planar`).
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
    # flat = turn(turned) (base + turn(yaw) lever) + (x, y), solved for base
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
    """The rotation of the tracking's frame that makes the axis of the base's turns the z axis.

    The axis is the mean of rotation vectors between readings far apart, each with the sign of the
    base's own turn; small turns (noisy) and those near half a turn (ambiguous) are left out.
    """
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
    if length < 1.0:  # hardly any turn: the tracking's z axis is taken as upright
        return Rotation.identity()
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [axis / length])
    return turn


def _planar(
    pairs: Pairs, base: Array, yaw: Array, flat: Array
) -> tuple[float, float, float, Array]:
    """Turn, offset and each tracker's lever (t, 2) in the plane, by linear least squares.

    flat = T (base + H(yaw) l) + o with T = (c -s; s c): linear in c, s, o and in T l, since plane
    rotations commute. The levers are turned back at the end.
    """
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
