"""Faults in the arm: kinematics, timing and its separation."""

from __future__ import annotations

from tests.planted.fault import Fault

FAULTS = (
    Fault(
        "rotation-not-renormalized",
        "states/arm/kinematics/inverse_kinematics.py",
        "            turn[i, j] = 1.5 * pose[i, j]\n",
        "            turn[i, j] = pose[i, j] + 0.5 * pose[i, 0] * 0.0\n",
        (
            "tests/states/arm/kinematics/test_inverse_kinematics.py::"
            "test_singular_poses_rounded_to_single_precision_are_solved_within_the_rounding"
        ),
    ),
    Fault(
        "wrist-turned-the-wrong-way",
        "states/arm/kinematics/inverse_kinematics.py",
        "q6 -= shift if c5 > 0.0 else -shift",
        "q6 -= shift",
        (
            "tests/states/arm/kinematics/test_inverse_kinematics.py::"
            "test_poses_with_several_singularities_at_once_are_solved"
        ),
    ),
    Fault(
        "farther-of-two-angles",
        "states/arm/kinematics/inverse_kinematics.py",
        "shift = first if abs(first) <= abs(second) else second",
        "shift = first",
        (
            "tests/states/arm/kinematics/test_inverse_kinematics.py::"
            "test_poses_with_several_singularities_at_once_are_solved"
        ),
    ),
    Fault(
        "whole-turns-truncated",
        "states/arm/kinematics/inverse_kinematics.py",
        "turns = np.round((np.asarray(near) - joints) / _TURN)",
        "turns = np.trunc((np.asarray(near) - joints) / _TURN)",
        (
            "tests/states/arm/kinematics/test_inverse_kinematics.py::"
            "test_nearest_copies_stay_within_the_limits_and_within_half_a_turn"
        ),
    ),
    Fault(
        "torque-without-coriolis",
        "states/arm/kinematics/dynamics.py",
        "a[k - 1] * axes[k] + np.cross(spin[k - 1], turn)",
        "a[k - 1] * axes[k]",
        "tests/states/arm/kinematics/test_dynamics.py::test_torques_are_those_of_the_energies",
    ),
    Fault(
        "inertia-in-the-frame-of-the-link",
        "states/arm/kinematics/dynamics.py",
        "turned @ tensor @ turned.T",
        "turned.T @ tensor @ turned",
        "tests/states/arm/kinematics/test_dynamics.py::test_torques_are_those_of_the_energies",
    ),
    Fault(
        "bend-at-the-far-end-halved",
        "states/arm/motion/timing_kernels.py",
        "slope[e, i] + 2.0 * step * e * bend[e, i], bend[e, i]",
        "slope[e, i] + step * e * bend[e, i], bend[e, i]",
        "tests/states/arm/motion/test_timing.py::test_limits_of_joints_and_tool_are_never_exceeded",
    ),
    Fault(
        "walk-in-the-frame-of-the-map",
        "states/arm/separation_kernels.py",
        "c, s = math.cos(-rover.yaw), math.sin(-rover.yaw)",
        "c, s = math.cos(rover.yaw), math.sin(rover.yaw)",
        (
            "tests/states/arm/test_arm_separation.py::"
            "test_the_pace_does_not_depend_on_the_frame_of_the_map"
        ),
    ),
    Fault(
        "allowance-for-what-lies-ahead",
        "states/arm/separation_kernels.py",
        "later = max(0.0, course.ahead[n] - REACTION_S) / stopping[n]",
        "later = course.ahead[n] / stopping[n]",
        (
            "tests/states/arm/test_arm_separation.py::"
            "test_what_lies_ahead_may_be_as_much_faster_as_can_be_braked_until_then"
        ),
    ),
    Fault(
        "hand-seen-long-ago-is-where-it-was",
        "states/arm/separation_kernels.py",
        "late = HAND_REACTION_S + ages[j]",
        "late = HAND_REACTION_S",
        "tests/states/arm/test_limbs.py::test_the_nearer_and_the_older_a_hand_the_slower_the_arm",
    ),
    Fault(
        "braking-of-the-whole-pace",
        "states/arm/separation_kernels.py",
        "stop = max(0.0, pace - pair.least) * pair.stopping",
        "stop = pace * pair.stopping",
        (
            "tests/states/arm/test_limbs.py::"
            "test_the_arm_is_slow_once_the_gap_is_used_up_and_not_before"
        ),
    ),
    Fault(
        "hand-beyond-the-deep",
        "states/arm/arm_situation.py",
        "t = (-b - math.sqrt(square)) / a",
        "t = (-b + math.sqrt(square)) / a",
        (
            "tests/states/arm/planning/test_approach.py::"
            "test_an_arm_ends_where_it_first_comes_near_the_deep_wherever_it_begins"
        ),
    ),
    Fault(
        "arm-that-stands-never-ends",
        "states/arm/following.py",
        "SLOWEST = 0.05",
        "SLOWEST = 0.0",
        (
            "tests/states/arm/test_states_arm.py::"
            "test_an_arm_that_hardly_runs_fails_after_twenty_times_its_time"
        ),
    ),
    Fault(
        "wall-on-the-side-of-the-person",
        "states/arm/arm_situation.py",
        "deep.transform(-WALL_BEHIND, side * WALL_HALF_WIDTH)",
        "deep.transform(WALL_BEHIND, side * WALL_HALF_WIDTH)",
        (
            "tests/states/arm/planning/test_approach.py::"
            "test_a_low_deep_is_not_met_from_the_persons_side_either"
        ),
    ),
)
