import cmath
import dataclasses
import math
import typing

import pytest
from hypothesis import example, given, settings, strategies as st

from hw.geometry import (
    AnyAngle,
    Coordinate,
    Pose2,
    Pose3,
    Twist2,
    total,
    unwrap,
    velocity_of,
    wrap,
)

coordinate = st.floats(-1e3, 1e3)
angle = st.floats(-50.0, 50.0)
pose2 = st.builds(Pose2, coordinate, coordinate, angle.map(wrap))


@st.composite
def poses3(draw):
    q = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
    length = math.hypot(*q)
    return Pose3(draw(coordinate), draw(coordinate), draw(coordinate), *(v / length for v in q))


def matrix2(p):
    c, s = math.cos(p.yaw), math.sin(p.yaw)
    return [[c, -s, p.x], [s, c, p.y], [0.0, 0.0, 1.0]]


def matrix3(p):
    x, y, z, w = p.qx, p.qy, p.qz, p.qw
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), p.x],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), p.y],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), p.z],
        [0.0, 0.0, 0.0, 1.0],
    ]


def product(a, b):
    n = len(a)
    return [[sum(a[i][k] * b[k][j] for k in range(n)) for j in range(n)] for i in range(n)]


def assert_close(a, b, tolerance=1e-9):
    for row_a, row_b in zip(a, b, strict=True):
        assert row_a == pytest.approx(row_b, abs=tolerance, rel=1e-12)


@settings(deadline=None, max_examples=300)
@given(st.floats(-1e6, 1e6))
def test_wrap_keeps_the_direction_and_lands_in_the_half_open_turn(a):
    assert -math.pi < wrap(a) <= math.pi
    assert math.cos(wrap(a)) == pytest.approx(math.cos(a), abs=1e-9)
    assert math.sin(wrap(a)) == pytest.approx(math.sin(a), abs=1e-9)


def test_wrap_maps_minus_pi_to_pi():
    assert wrap(-math.pi) == math.pi
    assert wrap(math.pi) == math.pi
    assert wrap(3 * math.pi) == pytest.approx(math.pi)


@settings(deadline=None, max_examples=200)
@given(pose2, pose2)
def test_composition_in_the_plane_is_the_matrix_product(a, b):
    assert_close(matrix2(a @ b), product(matrix2(a), matrix2(b)))


@settings(deadline=None, max_examples=200)
@given(pose2)
def test_a_plane_pose_and_its_inverse_cancel(a):
    assert_close(matrix2(a @ a.inverse()), matrix2(Pose2(0.0, 0.0, 0.0)))


@settings(deadline=None, max_examples=200)
@given(poses3(), poses3())
def test_composition_in_space_is_the_matrix_product(a, b):
    assert_close(matrix3(a @ b), product(matrix3(a), matrix3(b)))


@settings(deadline=None, max_examples=200)
@given(poses3())
def test_a_space_pose_and_its_inverse_cancel(a):
    assert_close(matrix3(a @ a.inverse()), matrix3(Pose3(0.0, 0.0, 0.0)))
    assert a.angle_to(a) == pytest.approx(0.0, abs=1e-9)


@settings(deadline=None, max_examples=100)
@given(coordinate, coordinate, coordinate, angle)
def test_an_upright_pose_seen_from_above_keeps_its_yaw(x, y, z, yaw):
    flat = Pose3.from_yaw(x, y, z, yaw).flat()
    assert (flat.x, flat.y) == (x, y)
    assert wrap(flat.yaw - yaw) == pytest.approx(0.0, abs=1e-9)


def test_the_bearing_of_a_point_to_the_left_is_positive():
    assert Pose2(1.0, 1.0, 0.0).bearing_to(Pose2(1.0, 3.0)) == pytest.approx(math.pi / 2)


def test_a_rotated_twist_keeps_its_speed():
    assert Twist2(3.0, 4.0, 1.0).rotated(1.2).speed == pytest.approx(5.0)


def test_a_thousand_turns_leave_the_quaternion_a_unit():
    step, pose = Pose3.from_yaw(0.0, 0.0, 0.0, 0.1), Pose3(0.0, 0.0, 0.0)
    for _ in range(1000):
        pose = pose @ step
    assert math.hypot(pose.qx, pose.qy, pose.qz, pose.qw) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.requirement(15)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_values_from_outside_that_are_not_finite_are_refused_by_name(bad):
    with pytest.raises(ValueError, match="yaw is"):
        Pose2.checked(0.0, 0.0, bad)
    with pytest.raises(ValueError, match="qz is"):
        Pose3.checked((0.0, 0.0, 0.0), (0.0, 0.0, bad, 1.0))
    with pytest.raises(ValueError, match="vx is"):
        Twist2.checked(bad, 0.0, 0.0)


def test_a_quaternion_that_is_no_unit_is_refused():
    with pytest.raises(ValueError, match="length 2"):
        Pose3.checked((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 2.0))


@settings(deadline=None)
@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_an_angle_is_continued_by_the_shorter_turn(angle, last):
    """By complex numbers: the same direction, and no other copy of it is nearer."""
    found = unwrap(angle, last)
    off = cmath.rect(1.0, found) / cmath.rect(1.0, angle)
    assert off == pytest.approx(1.0, abs=1e-9)
    others = (found - math.tau, found + math.tau)
    assert all(abs(found - last) <= abs(other - last) + 1e-9 for other in others)


@settings(deadline=None)
@given(pose2, pose2, st.floats(0.0, 1.0))
def test_between_two_poses_it_turns_by_the_shorter_way(a, b, share):
    """The directions of both and of what is between lie on one arc of the circle."""
    turned = cmath.phase(cmath.rect(1.0, b.yaw) / cmath.rect(1.0, a.yaw))
    expected = cmath.rect(1.0, a.yaw + share * turned)
    if abs(turned) < math.pi - 1e-9:
        assert cmath.rect(1.0, a.between(b, share).yaw) == pytest.approx(expected, abs=1e-9)
    assert abs(a.between(b, share).yaw - a.yaw) <= math.pi * share + 1e-9


def about(axis, angle):
    """The rotation matrix about axis 0, 1 or 2."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    turned = [[float(row == column) for column in range(3)] for row in range(3)]
    turned[i][i], turned[i][j], turned[j][i], turned[j][j] = c, -s, s, c
    return turned


def turn_of(p):
    return [row[:3] for row in matrix3(p)[:3]]


@settings(deadline=None)
@given(
    st.floats(-3.1, 3.1),
    st.floats(-3.1, 3.1),
    st.one_of(
        st.floats(-math.pi / 2, math.pi / 2),
        st.tuples(st.sampled_from([-1.0, 1.0]), st.floats(-12.0, -1.0)).map(
            lambda drawn: drawn[0] * (math.pi / 2 - 10.0 ** drawn[1])
        ),
        st.sampled_from([-math.pi / 2, math.pi / 2]),
    ),
)
def test_roll_pitch_and_yaw_give_the_orientation_again_up_to_the_vertical(roll, yaw, pitch):
    """Rounding may take the sine of the pitch beyond 1, and there all of the roll away."""
    turns = product(product(about(2, yaw), about(1, pitch)), about(0, roll))
    q = 0.5 * roll, 0.5 * pitch
    nod = Pose3(0.0, 0.0, 0.0, 0.0, math.sin(q[1]), 0.0, math.cos(q[1]))
    tip = Pose3(0.0, 0.0, 0.0, math.sin(q[0]), 0.0, 0.0, math.cos(q[0]))
    pose = Pose3.from_yaw(0.0, 0.0, 0.0, yaw) @ nod @ tip
    assert_close(turn_of(pose), turns)

    found = pose.roll_pitch_yaw

    assert abs(found[1]) <= math.pi / 2
    again = product(product(about(2, found[2]), about(1, found[1])), about(0, found[0]))
    assert_close(again, turns, 1e-6)


def test_a_velocity_is_scaled_as_a_whole_and_never_up() -> None:
    fast, slow = Twist2(1.2, 0.9, 1.0), Twist2(0.1, 0.0, 0.1)

    assert fast.scaled_to(1.5, 1.0) == fast
    assert fast.scaled_to(0.75, 0.5) == Twist2(0.6, 0.45, 0.5)
    assert fast.scaled_to(4.5, 0.5) == Twist2(0.6, 0.45, 0.5)
    assert slow.scaled_to(0.75, 0.5) == slow
    assert fast.scaled_to(0.0, 0.0) == Twist2(0.0, 0.0, 0.0)


def test_a_total_is_added_up_from_left_to_right_whatever_python():
    values = [0.1] * 10

    assert total(values) == 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1
    assert total(values) != math.fsum(values)
    assert total([]) == 0.0


def test_a_pose_of_a_chart_is_turned_about_fixed_axes_like_those_of_files():
    down = Pose3.written(1.0, 2.0, 0.5, pitch=-math.pi / 2)
    assert down.transform(0.1, 0.0, 0.0) == pytest.approx((1.0, 2.0, 0.6))
    both = Pose3.written(0.0, 0.0, 0.0, roll=0.3, yaw=0.4)
    assert both == Pose3.from_angles(0.0, 0.0, 0.0, (0.3, 0.0, 0.4))
    assert Pose2.written(1.0, 2.0, 1.5 * math.pi) == Pose2(1.0, 2.0, -0.5 * math.pi)
    assert Pose2.written(1.0, 2.0) == Pose2(1.0, 2.0, 0.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_pose_of_a_chart_is_finite(bad):
    with pytest.raises(ValueError, match=f"y is {bad}"):
        Pose2.written(0.0, bad)
    with pytest.raises(ValueError, match=f"pitch is {bad}"):
        Pose3.written(0.0, 0.0, 0.0, pitch=bad)


def test_charts_write_lengths_and_angles_and_name_places():
    hints = typing.get_type_hints(Pose3.written, include_extras=True)
    assert hints["z"] is Coordinate
    assert hints["roll"] is AnyAngle
    assert Pose2.named_by == "place"
    assert [field.name for field in dataclasses.fields(Pose2)] == ["x", "y", "yaw"]


@given(st.floats(-math.pi, math.pi), st.sampled_from((-1.0, 1.0)))
@example(math.pi - 0.02, 1.0)
@example(0.02 - math.pi, -1.0)
def test_poses_are_near_if_they_differ_by_less_also_across_half_a_turn(yaw, way):
    pose, turned = Pose2(1.0, 2.0, yaw), Pose2(1.0, 2.0, wrap(yaw + way * 0.05))
    assert pose.is_near(turned, 0.01, 0.051)
    assert not pose.is_near(turned, 0.01, 0.049)


@given(poses3(), poses3(), st.booleans())
def test_the_angle_between_orientations_is_that_of_their_matrices(a, b, negated):
    """The trace of a rotation is 1 + 2 cos of its angle; a quaternion and its negative are one."""
    if negated:
        b = Pose3(b.x, b.y, b.z, -b.qx, -b.qy, -b.qz, -b.qw)
    apart = product(
        [*zip(*matrix3(Pose3(0.0, 0.0, 0.0, *a.as_motion()[3:])), strict=True)], matrix3(b)
    )
    cosine = 0.5 * (sum(apart[i][i] for i in range(3)) - 1.0)
    assert math.cos(a.angle_to(b)) == pytest.approx(cosine, abs=1e-9)
    assert 0.0 <= a.angle_to(b) <= math.pi


@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.1, 3.1), st.floats(0.01, 10.0))
def test_the_velocity_of_a_displacement_leads_there_along_an_arc(x, y, yaw, time):
    """In the complex plane v e^(i w s) integrates to v (e^(i w t) - 1) / (i w)."""
    found = velocity_of(Pose2(x, y, yaw), time)
    turn = 1j * found.wz * time
    share = (cmath.exp(turn) - 1.0) / turn if abs(turn) > 1e-4 else 1.0 + turn / 2.0
    there = complex(found.vx, found.vy) * time * share
    assert abs(there - complex(x, y)) < 1e-6
    assert found.wz * time == pytest.approx(yaw, abs=1e-12)
