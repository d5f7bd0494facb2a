"""NaN, infinity, subnormals and float32 as such: refused or ignored, and nothing is harmed."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hw.finite import is_finite
from hw.geometry import Pose2, Pose3, Twist2, displacement_of, velocity_of, wrap
from hw.jit import wrapped
from hw.model.tracking import Tracking
from hw.motion.velocity_estimator import Motion
from hw.safety.limits import SafetyLimits
from hw.safety.rule import SafetyRule
from hw.samples import ImuReading, Odometry, TrackerPose, UserPose
from states.localization.filter.measurement_sources import Measurement, MeasurementSource
from states.localization.filter.planar import PlanarFilter, planar_config
from states.localization.localizer import Localizer
from states.localization.matching.scan_tracker import match
from states.maps.field import room_field
from states.navigation.exact.visibility import ExactPlanner
from tests.states.localization.world import ROOM, sensing
from tests.stress.bodies import LIMITS, ROBOT
from tests.stress.estimators import HERE, UNSURE, scanned
from tests.stress.planners import JOINTS, arm

BROKEN = (math.nan, math.inf, -math.inf)
TINY = (5e-324, -5e-324, 1e-310, 2.2250738585072014e-308)
broken = pytest.mark.parametrize("value", BROKEN)


@broken
@pytest.mark.parametrize(
    "made",
    [
        lambda v: Pose2.checked(1.0, v, 0.0),
        lambda v: Pose2.checked(1.0, 2.0, v),
        lambda v: Twist2.checked(v, 0.0, 0.0),
        lambda v: Pose3.checked((0.0, v, 0.0), (0.0, 0.0, 0.0, 1.0)),
        lambda v: Pose3.checked((0.0, 0.0, 0.0), (0.0, v, 0.0, 1.0)),
        lambda v: Pose3.written(0.0, 0.0, 0.0, v),
        lambda v: ExactPlanner(((0, 0), (v, 0), (5, 5)), inflation_radius=0.5),
        lambda v: ExactPlanner(((0, 0), (5, 0), (5, 5)), inflation_radius=v),
    ],
)  # fmt: skip
def test_what_is_made_of_outside_data_refuses_it(
    made: Callable[[float], object], value: float
) -> None:
    with pytest.raises(ValueError, match=r"nan|inf|finite"):
        made(value)


@broken
@pytest.mark.parametrize("at", range(5))
def test_no_sample_with_it_arrives(at: int, value: float) -> None:
    one = [value if k == at else 0.5 for k in range(5)]
    pose = Pose2(*one[:3])
    samples = (
        UserPose(pose, one[3], head=Pose3(one[4], 0.0, 0.0)),
        Odometry(pose, Twist2(one[3], one[4])),
        TrackerPose("front_tracker", Pose3(*one[:3], 0.0, 0.0, one[3], one[4])),
        ImuReading((one[0], one[1], one[2]), (one[3], one[4], 0.0)),
    )

    assert not any(map(is_finite, samples))


@broken
def test_a_localizer_is_unharmed(value: float) -> None:
    one, other = (
        Localizer(room_field(ROOM), sensing(), Tracking.of(sensing()), HERE, 0) for _ in range(2)
    )
    for k in range(30):
        odometry = Odometry(Pose2(0.01 * k, 0.0, 0.0), Twist2(0.5))
        for found in (one, other):
            found.update("base.odometry", k * 20_000_000, odometry)
        bad = Pose2(value, 0.0, 0.0)
        other.update("base.odometry", k * 20_000_000 + 7, Odometry(bad, Twist2(0.0)))
        other.update("base.imu", k * 20_000_000 + 8, ImuReading((0.0, 0.0, value), (0.0,) * 3))

    assert one.pose == other.pose
    assert one.pose is not None
    np.testing.assert_array_equal(one.covariance, other.covariance)


@broken
@pytest.mark.parametrize("axis", range(3))
def test_a_filter_leaves_the_axis_out(axis: int, value: float) -> None:
    filters = [PlanarFilter(planar_config(MeasurementSource("all", ("x", "y", "yaw"))))] * 1
    filters.append(PlanarFilter(planar_config(MeasurementSource("all", ("x", "y", "yaw")))))
    for k in range(10):
        for filter_, off in zip(filters, (0.0, value), strict=True):
            values = [1.0, 2.0, 3.1]
            if k % 2:
                values[axis] = off if math.isnan(off) or math.isinf(off) else values[axis]
            covariance = (1e-4, 1e-4, 1e-4)
            filter_.correct(Measurement(k * 20_000_000, "all", values, covariance))
    good, found = filters

    assert np.isfinite(found.mean).all()
    assert np.isfinite(found.covariance).all()
    np.testing.assert_allclose(found.mean[:3], good.mean[:3], atol=1e-6)
    assert found.covariance[axis, axis] > good.covariance[axis, axis]


@broken
def test_a_filter_leaves_out_an_axis_of_such_a_variance(value: float) -> None:
    filter_ = PlanarFilter(planar_config(MeasurementSource("all", ("x", "y", "yaw"))))
    verdict = filter_.correct(Measurement(0, "all", (1.0, 2.0, 3.0), (value, value, value)))

    assert verdict.outcome == "empty"
    assert filter_.stamp_ns is None


@given(
    st.lists(st.floats() | st.sampled_from((*BROKEN, *TINY, 1e300)), min_size=6, max_size=6),
    st.integers(-(1 << 63), (1 << 63) - 1),
)
def test_the_safety_rule_lets_nothing_pass_that_is_no_number(
    values: list[float], stamp_ns: int
) -> None:
    rule = SafetyRule(SafetyLimits.of(ROBOT, LIMITS))
    rule.track_user(0, 0, 9.0, 9.0)
    rule.track_user(stamp_ns, stamp_ns, values[0], values[1])
    place, twist = Pose2(*values[:3]), Twist2(*values[3:])
    found = rule.admit(10_000_000, twist, 0, place, twist)

    assert all(map(math.isfinite, (found.vx, found.vy, found.wz)))
    assert found.speed <= LIMITS.base_speed + 1e-9


@broken
def test_beams_of_no_number_are_no_points(value: float) -> None:
    points = scanned().copy()
    points[::7] = value
    if math.isinf(value):
        points = points[np.isfinite(points).all(axis=1)]
    found = match(room_field(ROOM), points, HERE, UNSURE).map_from_base

    assert all(map(math.isfinite, (found.x, found.y, found.yaw)))


@given(*[st.sampled_from(TINY) | st.floats(-1e-300, 1e-300)] * 3, st.floats(1e-9, 10.0))
def test_subnormal_motions_are_none(vx: float, vy: float, wz: float, time: float) -> None:
    twist = Twist2(vx, vy, wz)
    moved = displacement_of(twist, time)
    back = velocity_of(moved, time)

    for found in (moved.x, moved.y, moved.yaw, back.vx, back.vy, back.wz, *_scaled(twist)):
        assert abs(found) <= 1e-290


def _scaled(twist: Twist2) -> tuple[float, float, float]:
    found = twist.scaled_to(1.0, 1.0)
    return found.vx, found.vy, found.wz


@given(st.floats(allow_nan=False, allow_infinity=False) | st.sampled_from(TINY))
def test_every_angle_wraps_into_one_turn_compiled_or_not(angle: float) -> None:
    assert -math.pi < wrap(angle) <= math.pi
    assert wrapped(angle) == wrap(angle)
    assert wrap(wrap(angle)) == wrap(angle)


def test_float32_given_as_such_is_as_good_as_rounded() -> None:
    """At the inlets, where a driver of numpy arrays may pass them on."""
    told = [np.float32(v) for v in (1.1, 2.2, 3.1)]
    pose = Pose2.checked(*told)
    assert all(type(v) is float for v in (pose.x, pose.y, pose.yaw))
    twist = Twist2.checked(*told)
    assert all(type(v) is float for v in (twist.vx, twist.vy, twist.wz))
    filters = [PlanarFilter(planar_config(MeasurementSource("all", ("x", "y")))) for _ in "ab"]
    for values, filter_ in zip((told[:2], [float(v) for v in told[:2]]), filters, strict=True):
        filter_.correct(Measurement(0, "all", values, np.array([1e-4, 1e-4], np.float32)))
    np.testing.assert_array_equal(filters[0].mean, filters[1].mean)


@pytest.mark.slow
def test_float32_of_arrays_and_poses_gives_seven_digits() -> None:
    from states.arm.kinematics.inverse_kinematics import inverse
    from states.arm.kinematics.kinematics import forward

    single = forward(arm(), JOINTS.astype(np.float32))
    np.testing.assert_allclose(single, forward(arm(), JOINTS), atol=1e-6)
    met = forward(arm(), inverse(arm(), single.astype(np.float32)).branches())
    np.testing.assert_allclose(met, np.broadcast_to(single, met.shape), atol=2e-6)
    motion, exact = Motion(0.3), Motion(0.3)
    for k in range(12):
        x, y, yaw = 2.0 + 0.02 * k, 3.0 - 0.01 * k, 3.1 + 0.02 * k
        motion.add_pose(k * 33_000_000, *(np.float32(v) for v in (x, y, wrap(yaw))))
        exact.add_pose(k * 33_000_000, x, y, wrap(yaw))
    assert motion.velocity is not None
    assert exact.velocity is not None
    assert motion.velocity.vx == pytest.approx(exact.velocity.vx, abs=1e-5)
    assert motion.velocity.wz == pytest.approx(exact.velocity.wz, abs=1e-5)
