import itertools
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, Twist2, wrap
from hw.model.robot import MotionLimits, load_robot
from hw.safety.guarded import GuardedBase
from hw.safety.limits import SafetyLimits
from hw.sim.sim_base import SimBase

ROBOT = load_robot("rbkairos_ur10")
LIMITS = MotionLimits(base_acceleration=1.0, base_yaw_acceleration=2.0)
TICK = 1e9 / 30


def base(limits=LIMITS, mode="omni", yaw=0.0):
    made = SimBase(ROBOT, limits, Pose2(0.0, 0.0, yaw))
    made.use(mode)
    return made


def go(made, command, ticks, start=0):
    """States after each tick, with the command repeated."""
    states = []
    for n in range(start, start + ticks):
        if command is not None:
            made.drive(command)
        made.advance(round((n + 1) * TICK))
        states.append((made.pose, made.twist))
    return states


def velocity(state):
    pose, twist = state
    return twist.rotated(pose.yaw)


wide = st.floats(-5.0, 5.0)
commands = st.lists(st.tuples(wide, wide, wide, st.integers(1, 20)), min_size=1, max_size=8)


@pytest.mark.requirement(50)
@pytest.mark.parametrize("mode", ["omni", "differential"])
@settings(deadline=None, max_examples=60)
@given(commands, st.sampled_from([0.2, 0.5, 1.0, 3.0]), st.floats(-3, 3))
def test_speed_and_acceleration_never_exceed_the_limits(mode, script, acceleration, yaw):
    limits = MotionLimits(
        base_acceleration=acceleration, base_yaw_acceleration=1.5, base_speed=2.5, base_yaw_rate=1.2
    )
    made, n = base(limits, mode, yaw), 0
    states = [(made.pose, made.twist)]
    for vx, vy, wz, ticks in script:
        states += go(made, Twist2(vx, vy, wz), ticks, n)
        n += ticks
    dt = 1 / 30 + 1e-9
    for before, after in itertools.pairwise(states):
        assert after[1].speed <= 2.5 + 1e-9
        assert abs(after[1].wz) <= 1.2 + 1e-9
        a, b = velocity(before), velocity(after)
        assert math.hypot(b.vx - a.vx, b.vy - a.vy) <= acceleration * dt * (1 + 1e-6)
        assert abs(b.wz - a.wz) <= 1.5 * dt * (1 + 1e-6)
        assert before[0].distance_to(after[0]) <= 2.5 * dt * (1 + 1e-6)


def accelerations(made, command_at, seconds):
    """Change of the velocity in the map from millisecond to millisecond, m/s2."""
    found, before = [], velocity((made.pose, made.twist))
    for n in range(round(1000 * seconds)):
        made.drive(command_at(made))
        made.advance((n + 1) * 1_000_000)
        after = velocity((made.pose, made.twist))
        found.append(math.hypot(after.vx - before.vx, after.vy - before.vy) / 1e-3)
        before = after
    return found


def with_chain(made):
    """Driven past the guard, which takes whatever moves for a stop that goes on."""
    GuardedBase(made, replace(SafetyLimits.of(ROBOT, LIMITS), watched=False))
    return made


@pytest.mark.requirement(50)
@pytest.mark.parametrize("prepare", [lambda made: made, with_chain])
def test_turning_hides_no_acceleration(prepare):
    """The same velocity over the floor of the base is a bend in the map: 1.5 m/s2 if followed."""
    made = prepare(base())
    found = accelerations(made, lambda _: Twist2(1.0, 0.0, 1.5), 5.0)
    assert max(found) <= 1.0 * (1 + 1e-6)
    assert max(found[-1000:]) > 0.9
    assert made.twist.wz == pytest.approx(1.5)


@pytest.mark.requirement(50)
@pytest.mark.parametrize("prepare", [lambda made: made, with_chain])
def test_turning_fakes_no_acceleration(prepare):
    """Straight on in the map while turning: as fast as without a turn, then no acceleration."""
    made = prepare(base())

    def straight_on(b):
        ahead = Twist2(1.5, 0.0).rotated(-b.pose.yaw - 0.5e-3 * b.twist.wz)
        return Twist2(ahead.vx, ahead.vy, 1.0)

    found = accelerations(made, straight_on, 4.0)
    assert made.pose.x == pytest.approx(0.5 * 1.5**2 + 1.5 * 2.5, abs=0.01)
    assert abs(made.pose.y) < 0.01
    assert max(found[1600:]) < 0.01


@pytest.mark.requirement(2)
@settings(deadline=None, max_examples=40)
@given(commands)
def test_a_differential_base_never_goes_sideways(script):
    made, n = base(mode="differential"), 0
    for vx, vy, wz, ticks in script:
        for pose, twist in go(made, Twist2(vx, vy, wz), ticks, n):
            assert twist.vy == 0.0
            across = velocity((pose, twist)).rotated(-pose.yaw).vy
            assert across == pytest.approx(0.0, abs=1e-12)
        n += ticks


@pytest.mark.requirement(2)
def test_the_mode_changes_only_at_standstill():
    made = base()
    go(made, Twist2(0.0, 1.0, 0.0), 30)
    made.use("differential")
    states = go(made, Twist2(0.5, 0.5, 0.0), 60, 30)
    first = next(i for i, state in enumerate(states) if made.mode and state[1].vx > 0.0)
    assert all(state[1].vy > 0.0 or state[1].vx == 0.0 for state in states[:first])
    assert states[-1][1] == Twist2(0.5, 0.0, 0.0)
    assert made.mode == "differential"
    with pytest.raises(ValueError, match="omni, differential"):
        made.use("sideways")


def test_a_straight_start_follows_the_closed_form_whatever_the_step():
    for step_ns in (1_000_000, 33_333_333, 100_000_000):
        made, now = base(MotionLimits(base_acceleration=0.5)), 0
        while now < 4_000_000_000:
            made.drive(Twist2(1.5, 0.0, 0.0))
            now = min(now + step_ns, 4_000_000_000)
            made.advance(now)
        assert made.pose.x == pytest.approx(0.5 * 0.5 * 3.0**2 + 1.5 * 1.0, abs=1e-9)
        assert made.twist.vx == 1.5


def test_a_command_too_fast_keeps_its_direction():
    twist = go(base(MotionLimits(base_acceleration=9.0)), Twist2(6.0, 2.5, 0.0), 60)[-1][1]
    assert twist.vy / twist.vx == pytest.approx(2.5 / 6.0)
    assert twist.speed < 3.0


def test_a_mecanum_base_is_slower_on_the_diagonal_than_ahead():
    quick = MotionLimits(base_acceleration=9.0)
    ahead = go(base(quick), Twist2(9.0, 0.0, 0.0), 60)[-1][1]
    diagonal = go(base(quick), Twist2(9.0, 9.0, 0.0), 60)[-1][1]
    assert ahead.speed == pytest.approx(3.0, abs=1e-3)
    assert diagonal.speed == pytest.approx(3.0 / math.sqrt(2.0), abs=1e-3)


def test_steady_turns_go_round_a_circle():
    made = base(MotionLimits(base_acceleration=3.0, base_yaw_acceleration=9.0))
    go(made, Twist2(1.0, 0.0, 1.0), 90)
    points = [pose for pose, _ in go(made, Twist2(1.0, 0.0, 1.0), 190, 90)]
    centre_x = sum(p.x for p in points[:188]) / 188
    centre_y = sum(p.y for p in points[:188]) / 188
    radii = [math.hypot(p.x - centre_x, p.y - centre_y) for p in points]
    assert min(radii) == pytest.approx(1.0, abs=0.02)
    assert max(radii) == pytest.approx(1.0, abs=0.02)


def test_a_smaller_step_gives_the_same_turn_within_a_millimetre():
    ends = []
    for parts in (1, 10):
        made = base()
        for n in range(90 * parts):
            made.drive(Twist2(1.0, 0.5, 1.0) if n < 60 * parts else Twist2(0.0, -0.5, -1.0))
            made.advance(round((n + 1) * TICK / parts))
        ends.append(made.pose)
    assert ends[0].distance_to(ends[1]) < 1e-3
    assert wrap(ends[0].yaw - ends[1].yaw) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.requirement(42)
def test_an_old_command_times_out():
    made = base(MotionLimits(base_acceleration=3.0))
    go(made, Twist2(1.0, 0.0, 0.0), 30)
    made.drive(Twist2(1.0, 0.0, 0.0))
    states = go(made, None, 60, 30)
    assert states[13][1].vx == 1.0
    assert states[16][1].vx < 1.0
    assert states[-1][1] == Twist2(0.0, 0.0, 0.0)


def test_braking_is_harder_than_slowing_down():
    def way(brake):
        made = base(MotionLimits(base_acceleration=0.5))
        go(made, Twist2(1.5, 0.0, 0.0), 120)
        made.braked, start = brake, made.pose
        made.stop()
        return start.distance_to(go(made, None, 120, 120)[-1][0])

    assert way(False) == pytest.approx(1.5**2 / (2 * 0.5), abs=1e-6)
    assert way(True) == pytest.approx(1.5**2 / (2 * 3.0), abs=1e-6)


def test_energy_is_the_change_of_kinetic_energy_and_rolling():
    made = base(MotionLimits(base_acceleration=1.0))
    go(made, Twist2(1.0, 0.0, 0.0), 60)
    made.stop()
    go(made, None, 60, 60)
    rolling = 0.05 * 130.0 * 9.81 * made.distance_m
    assert made.distance_m == pytest.approx(made.pose.x)
    assert made.energy_j == pytest.approx(2 * 0.5 * 130.0 * 1.0**2 + rolling, rel=1e-9)


def test_a_command_holds_until_it_times_out_whatever_the_step():
    """1 m/s is reached after a second; nothing is commanded from the time-out on."""
    ways, timeout = [], ROBOT.base.command_timeout
    for steps in (1, 500):
        made = base()
        made.drive(Twist2(0.5 * timeout, 0.0, 0.0))
        for n in range(steps):
            made.advance(round((n + 1) * 5e9 / steps))
        assert made.twist == Twist2(0.0)
        ways.append(made.pose.x)
    # half of the time-out speeding up and half of it driving on, and as long again to brake
    assert ways == pytest.approx([0.5 * timeout * timeout] * 2, abs=1e-6)
