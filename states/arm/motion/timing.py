"""Time-optimal timing of a joint path under limits of joints and points of the arm (R45).

With s the arc length of the path, x = (ds/dt)^2 and u = d2s/dt2, joint velocity is q' sqrt(x) and
joint acceleration q' u + q'' x (derivatives by s: slope and bend). As dx/ds = 2 u, a constant u
over an interval of length d changes x by 2 d u, and all limits are linear in (x, u). So a backward
pass over a grid finds the largest x at each point from which the goal can still be met at rest, and
a forward pass takes the largest u that stays below it (reachability analysis, Pham and Pham, IEEE
T-RO 2018). A straight line without tool limit is a trapezoid.

A jerk limit is met by averaging the speed over a window of time, then stretching time. Where a line
meets a rounded corner the acceleration still jumps; corners are better left sharp then.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hw import example
from hw.model import MotionLimits
from states.arm.kinematics import Array, Integers, Manipulator, fastest_point, forward, tcp_speed
from states.arm.motion.joint_path import JointPath
from states.arm.motion.timing_kernels import line_times, passes
from states.arm.motion.trajectory import SlowZone, Trajectory, with_rates

GRID_STEP, TURN_STEP = 0.02, 0.02
"""Largest grid step along a path, rad, and largest change of its unit slope per step."""

LINE_SAMPLES = 33
"""Samples along a line whose duration is only compared with others'."""

_FEWEST, _MOST = 8, 200
# speeds of points are bounded at grid points only; between two they exceed that by less than
_TOOL_SLACK = 1e-3
_UNBOUNDED = 1e12


def time_path(
    arm: Manipulator, path: JointPath, limits: MotionLimits, slow: SlowZone | None = None
) -> Trajectory:
    """The fastest trajectory along a path; at rest at both ends and at corners left sharp.

    In `slow` the tcp keeps the limit of the zone as well.
    """
    if not len(path.pieces):
        return with_rates(path, np.zeros(1), np.zeros(1), np.zeros(1))
    straight = len(path.pieces) == 1 and not path.pieces[0, 2].any()
    if straight and slow is None and math.isinf(limits.tool_speed):
        found = _trapezoid(arm, path, limits)
    else:
        found = _fastest(arm, path, limits, slow)
    return found if math.isinf(limits.arm_jerk) else _smooth(arm, found, limits, slow)


def line_durations(
    arm: Manipulator,
    starts: Array,
    goals: Array,
    limits: MotionLimits,
    slow: SlowZone | None = None,
    samples: int = LINE_SAMPLES,
) -> Array:
    """Durations (k,) of straight joint lines from starts (j,) or (k, j) to goals (k, j), s.

    Exact without a tool limit, good to about 1 % with one and the usual `samples` along a line; a
    jerk limit is not considered. A line's share runs from 0 to 1 at a rate <= v with a gain <= a: a
    trapezoid with the peak p = min(v, sqrt(a)) takes 1 / p + p / a.
    """
    steps = goals - starts
    size = np.maximum(np.abs(steps), 1e-9)
    rate = np.min(arm.max_speed / size, axis=1)
    gain = np.min(limits.arm_acceleration / size, axis=1)
    if slow is None and math.isinf(limits.tool_speed):
        peak = np.minimum(rate, np.sqrt(gain))
        found = 1.0 / peak + peak / gain
    else:
        most = np.repeat(rate[:, None], samples, axis=1)
        shares = np.linspace(0.0, 1.0, samples)[:, None]
        q = (goals[:, None] + (shares - 1.0) * steps[:, None]).reshape(-1, steps.shape[1])
        cap = _point_rates(arm, q, np.repeat(steps, samples, axis=0), limits, slow)
        most = np.minimum(most, cap.reshape(most.shape))
        found = np.zeros(len(goals))
        line_times(most * most, gain, found)
    return np.where(np.abs(steps).max(axis=1) > 0.0, found, 0.0)


def _trapezoid(arm: Manipulator, path: JointPath, limits: MotionLimits) -> Trajectory:
    """One straight line: speed up, cruise, slow down; the ramps cover peak^2 / gain together.

    Without a cruise that is the whole length, so the peak is at most sqrt(gain length).
    """
    slope, length = np.abs(path.pieces[0, 1]), path.length
    used = slope > 0.0
    rate = float(np.min(arm.max_speed[used] / slope[used]))
    gain = float(np.min(limits.arm_acceleration / slope[used]))
    peak = min(rate, math.sqrt(gain * length))
    ramp, cruise = peak / gain, max(length / peak - peak / gain, 0.0)
    took, rates = [ramp, cruise, ramp], [0.0, peak, peak, 0.0]
    if cruise < 1e-9 * ramp:
        took, rates = [ramp, ramp], [0.0, peak, 0.0]
    moved = 0.5 * np.array(took) * (np.array(rates[1:]) + rates[:-1])
    places = np.concatenate([[0.0], np.cumsum(moved)])
    return with_rates(path, np.cumsum([0.0, *took]), places, np.array(rates))


def _fastest(
    arm: Manipulator, path: JointPath, limits: MotionLimits, slow: SlowZone | None
) -> Trajectory:
    s, knots, slope, bend = _grid(path)
    most = np.full(len(s), _UNBOUNDED)
    for here, at_end in ((most[:-1], slope[:, 0]), (most[1:], slope[:, 1])):
        rate = np.min(arm.max_speed / np.maximum(np.abs(at_end), 1e-6), axis=1)
        np.minimum(here, rate * rate, out=here)
    if slow is not None or math.isfinite(limits.tool_speed):
        q, along, _ = path.at(s)
        rate = (1.0 - _TOOL_SLACK) * _point_rates(arm, q, along, limits, slow, between=True)
        most = np.minimum(most, rate * rate)
    most[0] = most[-1] = 0.0
    most[knots[1:-1][path.sharp()]] = 0.0
    squares, gains = np.zeros(len(s)), np.full(arm.count, limits.arm_acceleration)
    passes(np.diff(s), slope, bend, gains, most, squares)
    rates = np.sqrt(squares)
    took = 2.0 * np.diff(s) / (rates[1:] + rates[:-1])
    found = with_rates(path, np.concatenate([[0.0], np.cumsum(took)]), s, rates)
    if not path.pieces[:, 2].any():
        return found
    # limits hold at grid points; in a tight bend they may be exceeded between two of them
    between = found.times[:-1] + 0.5 * took
    return _stretched(found, _excess(arm, found, limits, slow, between))


def _grid(path: JointPath) -> tuple[Array, Integers, Array, Array]:
    """Grid points s (n + 1,), the indices of knots, slope and bend (n, 2, 6) at interval ends."""
    turned = np.linalg.norm(2.0 * path.pieces[:, 2], axis=1) * path.lengths
    fine = np.maximum(path.lengths / GRID_STEP, turned / TURN_STEP)
    fewest = min(_FEWEST, max(2, 3 * _FEWEST // len(fine)))
    counts = np.clip(np.ceil(fine), fewest, _MOST).astype(np.int64)
    knots = path.knots
    s = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(knots, knots[1:], counts, strict=False)]
    places = np.concatenate([*s, knots[-1:]])
    piece = np.repeat(np.arange(len(counts)), counts)
    x = np.stack([places[:-1] - knots[piece], places[1:] - knots[piece]], axis=1)
    p = path.pieces[piece]
    slope = p[:, None, 1] + 2.0 * x[..., None] * p[:, None, 2]
    bend = np.repeat(2.0 * p[:, None, 2], 2, axis=1)
    return places, np.concatenate([[0], np.cumsum(counts)]), slope, bend


def _point_rates(
    arm: Manipulator,
    q: Array,
    slope: Array,
    limits: MotionLimits,
    slow: SlowZone | None,
    between: bool = False,
) -> Array:
    """The largest ds/dt at joints q (n, 6) with slopes dq/ds (n, 6) that points and tcp allow.

    `between`: the zone's limit holds at the neighbours of what is inside, too, so that a path of
    these joints keeps it from its edge on.
    """
    rate = limits.tool_speed / np.maximum(fastest_point(arm, q, slope), 1e-9)
    if slow is not None:
        held = slow.holds(forward(arm, q)[:, :3, 3])
        inside = held.copy()
        if between:
            inside[1:] |= held[:-1]
            inside[:-1] |= held[1:]
        tool = np.maximum(tcp_speed(arm, q[inside], slope[inside]), 1e-9)
        rate[inside] = np.minimum(rate[inside], slow.speed / tool)
    return rate


def _smooth(
    arm: Manipulator, sharp: Trajectory, limits: MotionLimits, slow: SlowZone | None
) -> Trajectory:
    """The same path with its speed averaged over a window w, then stretched to the limits.

    Averaging makes the jerk (a(t) - a(t - w)) / w, which is the limit for w = a_max / j_max where
    the acceleration steps from 0 to a_max; steps from a_max to -a_max need more. A longer window
    needs less stretching, so the shortest result of three is taken.
    """
    ramp = limits.arm_acceleration / limits.arm_jerk
    tried = [_averaged(sharp, ramp * factor) for factor in (1.0, 1.5, 2.0)]
    fitted = [_stretched(t, _excess(arm, t, limits, slow, _everywhere(t))) for t in tried]
    return min(fitted, key=lambda t: t.duration)


def _averaged(sharp: Trajectory, window: float) -> Trajectory:
    """The speed as its mean over the `window` seconds before; s is then cubic between knots."""
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
    # at rest s is known exactly: rounding errors of the sums so far are dropped
    resting = np.flatnonzero((speed == 0.0) & (past == 0.0))
    places[resting] = waiting.along(then[resting])[0]
    return Trajectory(sharp.path, times, places, rates, gains, jerks)


def _with_waits(sharp: Trajectory, wait: float) -> Trajectory:
    """Each stop at a sharp corner held for `wait` s, so that the average speed reaches 0 there."""
    stop = sharp.rates == 0.0
    stop[0] = stop[-1] = False
    k = np.repeat(np.arange(len(stop)), 1 + stop)
    again = np.concatenate([[False], k[1:] == k[:-1]])
    return with_rates(
        sharp.path, sharp.times[k] + wait * np.cumsum(again), sharp.places[k], sharp.rates[k]
    )


def _everywhere(trajectory: Trajectory) -> Array:
    return np.union1d(np.linspace(0.0, trajectory.duration, 1000), trajectory.times)


def _excess(
    arm: Manipulator,
    trajectory: Trajectory,
    limits: MotionLimits,
    slow: SlowZone | None,
    t: Array,
) -> float:
    """The factor >= 1 by which time must be stretched for the limits to hold at times t (n,).

    Velocity falls with the factor, acceleration with its square, jerk with its cube. Jerk is
    q' s''' + 3 q'' s' s'', since q''' is 0 on lines and parabolas.
    """
    s, rate, gain = trajectory.along(t)
    q, slope, bend = trajectory.path.at(s)
    speed = slope * rate[:, None]
    acceleration = slope * gain[:, None] + bend * (rate * rate)[:, None]
    ratios = [
        np.max(np.abs(speed) / arm.max_speed),
        np.max(1.0 / _point_rates(arm, q, speed, limits, slow)),
        math.sqrt(np.max(np.abs(acceleration) / limits.arm_acceleration)),
    ]
    if math.isfinite(limits.arm_jerk):
        last = len(trajectory.jerks) - 1
        k = np.clip(np.searchsorted(trajectory.times, t, side="right") - 1, 0, last)
        jerk = slope * trajectory.jerks[k, None] + 3.0 * bend * (rate * gain)[:, None]
        ratios.append(math.cbrt(np.max(np.abs(jerk) / limits.arm_jerk)))
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


@example
def _example() -> None:
    both = np.ones((1, 2, 6))
    passes(np.ones(1), both, both, np.ones(6), np.zeros(2), np.zeros(2))
    line_times(np.ones((1, 3)), np.ones(1), np.zeros(1))
