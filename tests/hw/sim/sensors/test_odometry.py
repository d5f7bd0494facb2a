"""Wheels that do as they are told under a body that slips."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, Twist2, wrap
from hw.model.sensing import OdometryModel
from hw.model.sensor_errors import OdometryErrors, SensorErrors, Slip
from hw.sim.sensors.odometry import SimOdometry
from hw.sim.sensors.track import Track
from tests.hw.sim.driven import PERFECT, Driven, ticks

START = Pose2(7.0, 7.0, -0.785)
NO_SLIP = Slip(0.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0)


def wander(turn: float):
    """Legs of 1.5 s along the corners of an octagon; the heading turns on, to and fro, rad/s."""

    def command(now: int) -> Twist2:
        n = now // 1_500_000_000
        angle = 0.25 * math.pi * (n % 8)
        return Twist2(0.9 * math.cos(angle), 0.9 * math.sin(angle), turn if n % 8 < 5 else -turn)

    return command


def missed(run: Driven) -> float:
    assert run.world.collisions.wall_hits == 0
    return drift(run).distance_to(Pose2(0.0, 0.0))


def drift(run: Driven) -> Pose2:
    """Where the wheels take themselves to be, seen from where the body is."""
    stamp, odometry = run.values("base.odometry")[-1]
    known = dict(run.truth)
    pose = known[min(known, key=lambda now: abs(now - stamp))]
    return pose.inverse() @ (START @ odometry.pose)


def test_without_slip_the_wheels_know_the_way() -> None:
    run = Driven(instants=ticks(3.0, 200.0))
    truth = dict(run.truth)
    assert run.world.base.pose.distance_to(START) > 1.0
    for stamp, odometry in run.values("base.odometry"):
        before = stamp // 5_000_000 * 5_000_000
        share = (stamp - before) / 5_000_000
        after = truth.get(before + 5_000_000, truth[before])
        pose = truth[before].between(after, share)
        assert (START @ odometry.pose).distance_to(pose) < 1e-4
    stamps = [stamp for stamp, _ in run.values("base.odometry")]
    assert all(abs(b - a - 20_000_000) <= 1 for a, b in pairwise(stamps))
    twist = run.values("base.odometry")[-1][1].twist
    assert (twist.vx, twist.vy, twist.wz) == pytest.approx((0.8, 0.0, 0.4), abs=0.01)


def test_a_base_that_slips_gives_no_pose_and_drives_as_its_wheels_are_told() -> None:
    slipping, firm = Driven(SensorErrors()), Driven()
    assert "base.pose" not in slipping.got
    assert "base.pose" not in slipping.world.parts["base"].signals
    assert slipping.values("base.twist") == firm.values("base.twist")
    ends = [run.world.base.pose for run in (slipping, firm)]
    assert ends[0].distance_to(ends[1]) > 0.02


@pytest.mark.requirement(29)
@pytest.mark.slow
def test_drift_grows_with_the_way_and_with_turns() -> None:
    errors = replace(PERFECT, slip=Slip())

    def rms(seconds: float, turn: float) -> float:
        runs = (
            Driven(errors, seed=seed, instants=ticks(seconds), asked=["odometry"],
                   command=wander(turn))
            for seed in range(4)
        )  # fmt: skip
        return math.sqrt(sum(missed(run) ** 2 for run in runs) / 4)

    short, turning, straight = rms(3.0, 0.3), rms(24.0, 0.3), rms(24.0, 0.0)
    assert turning > 2.0 * short
    assert turning > 1.5 * straight
    assert 0.2 < turning < 2.0


@pytest.mark.requirement(29)
def test_turns_are_lost_by_their_share() -> None:
    slip = replace(NO_SLIP, turning=0.1)
    run = Driven(replace(PERFECT, slip=slip), command=lambda _: Twist2(0.0, 0.0, 1.0))
    stamp, odometry = run.values("base.odometry")[-1]
    body = wrap(dict(run.truth)[run.truth[-1][0]].yaw - START.yaw)
    wheels = odometry.pose.yaw + (run.truth[-1][0] - stamp) * 1e-9
    assert body / wheels == pytest.approx(0.9, abs=0.002)


@pytest.mark.requirement(146)
@pytest.mark.parametrize(("along", "across"), [(0.9, 0.0), (0.0, 0.9), (0.6, 0.6)])
def test_a_body_runs_on_where_the_wheels_brake(along: float, across: float) -> None:
    slip = replace(NO_SLIP, pulling=0.01, braking=0.05)

    def command(now: int) -> Twist2:
        return Twist2(along, across, 0.0) if now < 2_000_000_000 else Twist2(0.0)

    run = Driven(replace(PERFECT, slip=slip), command=command, instants=ticks(5.0))
    x, y, _ = (getattr(drift(run), name) for name in ("x", "y", "yaw"))
    # less than the wheels' way says the drift is behind: the body is ahead by 40 ms of speed
    assert -x == pytest.approx(0.04 * along, abs=0.002)
    assert -y == pytest.approx(0.04 * across, abs=0.002)


def test_each_patch_of_the_floor_has_its_own_slip_whatever_the_steps() -> None:
    errors = replace(PERFECT, slip=replace(NO_SLIP, patchy=0.2))
    ends = [
        Driven(errors, seed=2, instants=ticks(6.0, rate), asked=()).world.base.pose
        for rate in (30.0, 60.0)
    ]
    firm = Driven(instants=ticks(6.0), asked=()).world.base.pose
    assert ends[0].distance_to(ends[1]) < 0.03
    assert ends[0].distance_to(firm) > 0.1


def test_encoders_have_noise_on_speeds_only_while_they_turn() -> None:
    errors = replace(PERFECT, odometry=OdometryErrors(0.01, 0.02))

    def command(now: int) -> Twist2:
        return Twist2(0.5, 0.0, 0.0) if now > 1_000_000_000 else Twist2(0.0)

    noisy = Driven(errors, instants=ticks(5.0), command=command).values("base.odometry")
    exact = Driven(instants=ticks(5.0), command=command).values("base.odometry")
    assert [(s, o.pose) for s, o in noisy] == [(s, o.pose) for s, o in exact]
    differences = [a.twist.vx - b.twist.vx for (_, a), (_, b) in zip(noisy, exact, strict=True)]
    assert not any(differences[:45])
    moved = differences[60:]
    assert math.sqrt(sum(d * d for d in moved) / len(moved)) == pytest.approx(0.01, rel=0.25)


def test_a_body_that_is_pushed_is_not_heard_by_the_wheels() -> None:
    run = Driven(replace(PERFECT, slip=NO_SLIP), command=lambda _: Twist2(0.0))
    run.world.base.block(START @ Pose2(0.5, 0.0))
    now = run.truth[-1][0] + 100_000_000
    run.world.advance(now)
    last = run.world.parts["odometry"].samples(now)[-1].value
    assert last.pose.distance_to(Pose2(0.0, 0.0)) < 1e-9
    assert run.world.truth.base.distance_to(START) == pytest.approx(0.5)


@settings(deadline=None, max_examples=50)
@given(st.floats(-3.1, 3.1), st.floats(-0.5, 0.5), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_the_velocity_is_along_the_axes_of_the_base_half_way(yaw, turn, dx, dy):
    track = Track(Pose2(3.0, 4.0, yaw))
    odometry = SimOdometry(OdometryModel(50.0), track, OdometryErrors(0.0, 0.0), 0)
    track.note(0, Pose2(3.0, 4.0, yaw))
    track.note(10**9, Pose2(3.0 + 50.0 * dx, 4.0 + 50.0 * dy, wrap(yaw + turn)))

    _, last = odometry.samples(10**9)[-2:]

    middle = yaw + turn * (last.stamp_ns * 1e-9 - 0.01)
    seen = complex(dx, dy) / 0.02 * cmath.exp(-1j * middle)
    twist = last.value.twist
    assert (twist.vx, twist.vy) == pytest.approx((seen.real, seen.imag), abs=1e-9)
    assert twist.wz == pytest.approx(turn, abs=1e-9)
