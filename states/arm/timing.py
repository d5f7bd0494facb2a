"""How fast along a path: time-optimal under limits of joints and tool (R45).

The speed along the path is the fastest one under |dq/dt|, |d2q/dt2| and the tool's speed. A
straight line without tool limit is a trapezoid; otherwise a backward pass over a grid finds from
which speeds the goal can still be met, and a forward pass accelerates as much as that allows (the
reachability analysis of Pham and Pham, IEEE T-RO 2018). A jerk limit is met by averaging that speed
over a window of time; where a line meets a rounded corner the acceleration still jumps, so corners
are better left sharp then.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numba import njit

from states.arm.kernels import Array, Integers
from states.arm.kinematics import KinematicChain, jacobian
from states.arm.path import JointPath
from states.arm.trajectory import ArmLimits, Trajectory, with_rates

GRID_STEP, TURN_STEP = 0.02, 0.02
"""Longest step between looks along a path, and largest change of its unit slope; rad and 1."""

LINE_SAMPLES = 33
"""Looks along a line whose time is only compared with others."""

_FEWEST, _MOST = 8, 200
# the tool's speed is looked at on the grid only: between two looks it is higher by less than this
_TOOL_SLACK = 1e-3
_TINY = 1e-12
_UNBOUNDED = 1e12


def time_path(chain: KinematicChain, path: JointPath, limits: ArmLimits) -> Trajectory:
    """The fastest trajectory along a path, at rest at both ends and at corners left sharp."""
    if not len(path.pieces):
        return with_rates(path, np.zeros(1), np.zeros(1), np.zeros(1))
    straight = len(path.pieces) == 1 and not path.pieces[0, 2].any()
    if straight and math.isinf(limits.tool_speed):
        found = _trapezoid(path, limits)
    else:
        found = _fastest(chain, path, limits)
    return found if limits.jerk is None else _smooth(chain, found, limits)


def line_durations(chain: KinematicChain, start: Array, goals: Array, limits: ArmLimits) -> Array:
    """Times of straight joint lines from start (6,) to goals (k, 6), s; (k,).

    Without a tool limit exact, with one good to about a hundredth; a jerk limit is left out.
    """
    steps = goals - start
    size = np.maximum(np.abs(steps), 1e-9)
    rate = np.min(np.array(limits.speed) / size, axis=1)
    gain = np.min(np.array(limits.acceleration) / size, axis=1)
    if math.isinf(limits.tool_speed):
        peak = np.minimum(rate, np.sqrt(gain))
        found = 1.0 / peak + peak / gain
    else:
        most = np.repeat(rate[:, None], LINE_SAMPLES, axis=1)
        shares = np.linspace(0.0, 1.0, LINE_SAMPLES)[:, None]
        q = start + shares * steps[:, None]
        moved = jacobian(chain, q.reshape(-1, 6))[:, :3].reshape(*q.shape[:2], 3, 6)
        tool = np.linalg.norm((moved @ steps[:, None, :, None])[..., 0], axis=2)
        most = np.minimum(most, limits.tool_speed / np.maximum(tool, 1e-9))
        found = np.zeros(len(goals))
        _line_times(most * most, gain, found)
    return np.where(np.abs(steps).max(axis=1) > 0.0, found, 0.0)


def _trapezoid(path: JointPath, limits: ArmLimits) -> Trajectory:
    slope, length = np.abs(path.pieces[0, 1]), path.length
    used = slope > 0.0
    rate = float(np.min(np.array(limits.speed)[used] / slope[used]))
    gain = float(np.min(np.array(limits.acceleration)[used] / slope[used]))
    peak = min(rate, math.sqrt(gain * length))
    ramp, cruise = peak / gain, max(length / peak - peak / gain, 0.0)
    took, rates = [ramp, cruise, ramp], [0.0, peak, peak, 0.0]
    if cruise < 1e-9 * ramp:
        took, rates = [ramp, ramp], [0.0, peak, 0.0]
    moved = 0.5 * np.array(took) * (np.array(rates[1:]) + rates[:-1])
    places = np.concatenate([[0.0], np.cumsum(moved)])
    return with_rates(path, np.cumsum([0.0, *took]), places, np.array(rates))


def _fastest(chain: KinematicChain, path: JointPath, limits: ArmLimits) -> Trajectory:
    s, knots, slope, bend = _grid(path)
    most = np.full(len(s), _UNBOUNDED)
    for here, at_end in ((most[:-1], slope[:, 0]), (most[1:], slope[:, 1])):
        rate = np.min(np.array(limits.speed) / np.maximum(np.abs(at_end), 1e-6), axis=1)
        np.minimum(here, rate * rate, out=here)
    if math.isfinite(limits.tool_speed):
        rate = (
            limits.tool_speed * (1.0 - _TOOL_SLACK) / np.maximum(_tool_rates(chain, path, s), 1e-6)
        )
        most = np.minimum(most, rate * rate)
    most[0] = most[-1] = 0.0
    most[knots[1:-1][path.sharp()]] = 0.0
    squares = np.zeros(len(s))
    _passes(np.diff(s), slope, bend, np.array(limits.acceleration), most, squares)
    rates = np.sqrt(squares)
    took = 2.0 * np.diff(s) / (rates[1:] + rates[:-1])
    found = with_rates(path, np.concatenate([[0.0], np.cumsum(took)]), s, rates)
    if not path.pieces[:, 2].any():
        return found
    # the grid keeps the limits at its places; in a tight bend they may be passed between two
    between = found.times[:-1] + 0.5 * took
    return _stretched(found, _excess(chain, found, limits, between))


def _grid(path: JointPath) -> tuple[Array, Integers, Array, Array]:
    """Places s (n + 1,), which are knots, slope and bend (n, 2, 6) at both ends of intervals."""
    turned = np.linalg.norm(2.0 * path.pieces[:, 2], axis=1) * path.lengths
    fine = np.maximum(path.lengths / GRID_STEP, turned / TURN_STEP)
    counts = np.clip(np.ceil(fine), _FEWEST, _MOST).astype(np.int64)
    knots = path.knots
    s = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(knots, knots[1:], counts, strict=False)]
    places = np.concatenate([*s, knots[-1:]])
    piece = np.repeat(np.arange(len(counts)), counts)
    x = np.stack([places[:-1] - knots[piece], places[1:] - knots[piece]], axis=1)
    p = path.pieces[piece]
    slope = p[:, None, 1] + 2.0 * x[..., None] * p[:, None, 2]
    bend = np.repeat(2.0 * p[:, None, 2], 2, axis=1)
    return places, np.concatenate([[0], np.cumsum(counts)]), slope, bend


def _tool_rates(chain: KinematicChain, path: JointPath, s: Array) -> Array:
    """Speed of the tcp per rate of s, m."""
    q, slope, _ = path.at(s)
    moved = jacobian(chain, q)[:, :3] @ slope[..., None]
    return np.asarray(np.linalg.norm(moved[..., 0], axis=1))


def _smooth(chain: KinematicChain, sharp: Trajectory, limits: ArmLimits) -> Trajectory:
    """The same path with the speed averaged over a window that keeps the jerk limit.

    A longer window needs less stretching afterwards: the shortest result of three is taken.
    """
    jerk = np.array(limits.jerk)
    ramp = float(np.max(np.array(limits.acceleration) / jerk))
    tried = [_averaged(sharp, ramp * factor) for factor in (1.0, 1.5, 2.0)]
    fitted = [_stretched(t, _excess(chain, t, limits, _everywhere(t))) for t in tried]
    return min(fitted, key=lambda t: t.duration)


def _averaged(sharp: Trajectory, window: float) -> Trajectory:
    """Its speed as the mean over the `window` seconds before; s is cubic between knots then."""
    waiting = _with_waits(sharp, window)
    times = np.unique(np.concatenate([waiting.times, waiting.times + window]))
    times = times[np.concatenate([[True], np.diff(times) > 1e-9])]
    then = times - window
    speed = np.interp(times, waiting.times, waiting.rates, left=0.0, right=0.0)
    past = np.interp(then, waiting.times, waiting.rates, left=0.0, right=0.0)
    gains = (speed - past) / window
    rates = (waiting.along(times)[0] - waiting.along(then)[0]) / window
    rates[0] = rates[-1] = 0.0
    took, jerks = np.diff(times), np.diff(gains) / np.diff(times)
    moved = took * (rates[:-1] + took * (gains[:-1] / 2.0 + took * jerks / 6.0))
    places = np.concatenate([[0.0], np.cumsum(moved)])
    # where all speed has been averaged out, the place is known exactly
    resting = np.flatnonzero((speed == 0.0) & (past == 0.0))
    places[resting] = waiting.along(then[resting])[0]
    return Trajectory(sharp.path, times, places, rates, gains, jerks)


def _with_waits(sharp: Trajectory, wait: float) -> Trajectory:
    # a stop at a sharp corner must last as long as the window, or averaging would drive through it
    stop = sharp.rates == 0.0
    stop[0] = stop[-1] = False
    k = np.repeat(np.arange(len(stop)), 1 + stop)
    again = np.concatenate([[False], k[1:] == k[:-1]])
    return with_rates(
        sharp.path, sharp.times[k] + wait * np.cumsum(again), sharp.places[k], sharp.rates[k]
    )


def _everywhere(trajectory: Trajectory) -> Array:
    return np.union1d(np.linspace(0.0, trajectory.duration, 1000), trajectory.times)


def _excess(chain: KinematicChain, trajectory: Trajectory, limits: ArmLimits, t: Array) -> float:
    """The factor, at least 1, by which time must be stretched for the limits to hold at t (n,)."""
    s, rate, gain = trajectory.along(t)
    q, slope, bend = trajectory.path.at(s)
    speed = slope * rate[:, None]
    acceleration = slope * gain[:, None] + bend * (rate * rate)[:, None]
    tool = np.linalg.norm((jacobian(chain, q)[:, :3] @ speed[..., None])[..., 0], axis=1)
    ratios = [
        np.max(np.abs(speed) / limits.speed),
        np.max(tool) / limits.tool_speed,
        math.sqrt(np.max(np.abs(acceleration) / limits.acceleration)),
    ]
    if limits.jerk is not None:
        last = len(trajectory.jerks) - 1
        k = np.clip(np.searchsorted(trajectory.times, t, side="right") - 1, 0, last)
        jerk = slope * trajectory.jerks[k, None] + 3.0 * bend * (rate * gain)[:, None]
        ratios.append(math.cbrt(np.max(np.abs(jerk) / np.array(limits.jerk))))
    worst = float(max(ratios))
    return 1.0 if worst <= 1.0 else worst * (1.0 + 1e-4)


def _stretched(trajectory: Trajectory, factor: float) -> Trajectory:
    return replace(
        trajectory,
        times=trajectory.times * factor,
        rates=trajectory.rates / factor,
        accelerations=trajectory.accelerations / factor**2,
        jerks=trajectory.jerks / factor**3,
    )


def warm_up() -> None:
    """Compiles what this module needs, so that no control tick does."""
    both = np.ones((1, 2, 6))
    _passes(np.ones(1), both, both, np.ones(6), np.zeros(2), np.zeros(2))
    _line_times(np.ones((1, 3)), np.ones(1), np.zeros(1))


@njit(cache=True)
def _line_times(most: Array, gain: Array, found: Array) -> None:
    """Writes the times of lines from share 0 to 1 whose squared rate is bounded by most (k, n)."""
    for k in range(len(most)):
        n = most.shape[1]
        gained = 2.0 * gain[k] / (n - 1)
        most[k, 0] = most[k, n - 1] = 0.0
        for i in range(1, n):
            most[k, i] = min(most[k, i], most[k, i - 1] + gained)
        for i in range(n - 2, -1, -1):
            most[k, i] = min(most[k, i], most[k, i + 1] + gained)
        found[k] = 0.0
        for i in range(1, n):
            found[k] += 2.0 / (n - 1) / (math.sqrt(most[k, i - 1]) + math.sqrt(most[k, i]))


@njit(cache=True)
def _passes(
    steps: Array, slope: Array, bend: Array, limit: Array, most: Array, squares: Array
) -> None:
    """Writes the squared rates of s at the grid's places into squares (n + 1,).

    `most` (n + 1,) bounds them, `limit` (6,) the joint accelerations; slope and bend are (n, 2, 6),
    at both ends of each interval.
    """
    n = len(steps)
    reach = np.empty(n + 1)
    reach[n] = most[n]
    for k in range(n - 1, -1, -1):
        reach[k] = _largest(slope[k], bend[k], limit, steps[k], most[k], reach[k + 1])
    squares[0] = 0.0
    for k in range(n):
        _, _, up, _ = _window(slope[k], bend[k], limit, steps[k], squares[k], reach[k + 1])
        squares[k + 1] = min(max(squares[k] + 2.0 * steps[k] * up, 0.0), reach[k + 1])


@njit(cache=True)
def _largest(
    slope: Array, bend: Array, limit: Array, step: float, most: float, after: float
) -> float:
    """The largest squared rate from which some acceleration leads to at most `after`."""
    x = most
    for i in range(6):
        if abs(slope[0, i]) <= _TINY and bend[0, i] != 0.0:
            x = min(x, limit[i] / abs(bend[0, i]))
        if abs(slope[1, i] + 2.0 * step * bend[1, i]) <= _TINY and bend[1, i] != 0.0:
            x = min(x, limit[i] / abs(bend[1, i]))
    for _ in range(50):
        low, low_slope, up, up_slope = _window(slope, bend, limit, step, x, after)
        gap, gain = low - up, low_slope - up_slope
        if gap <= 1e-12 * (1.0 + abs(up)) or gain <= 0.0:
            break
        x = max(x - gap / gain, 0.0)  # the gap is convex in x: Newton's method comes from above
    return x


@njit(cache=True)
def _window(
    slope: Array, bend: Array, limit: Array, step: float, x: float, after: float
) -> tuple[float, float, float, float]:
    """The accelerations of s allowed at squared rate x: low, its slope in x, high, its slope.

    The joints' limits are kept at both ends of the interval, at whose end the squared rate is
    x + 2 step u: not below 0 and not above `after`.
    """
    fall = -0.5 / step
    low, low_slope = fall * x, fall
    up, up_slope = 0.5 * after / step + fall * x, fall
    for e in range(2):
        for i in range(6):
            p, r = slope[e, i] + 2.0 * step * e * bend[e, i], bend[e, i]
            if abs(p) <= _TINY:
                continue
            middle, half = -r * x / p, limit[i] / abs(p)
            if middle + half < up:
                up, up_slope = middle + half, -r / p
            if middle - half > low:
                low, low_slope = middle - half, -r / p
    return low, low_slope, up, up_slope
