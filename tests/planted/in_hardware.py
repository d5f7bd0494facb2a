"""Faults in poses, motion and the simulated robot."""

from __future__ import annotations

from tests.planted.fault import Fault

FAULTS = (
    Fault(
        "yaw-of-a-person-not-unwrapped",
        "hw/motion/velocity_estimator.py",
        "yaw = last[2] + wrapped(yaw - last[2])",
        "yaw = last[2] + (yaw - last[2])",
        (
            "tests/hw/motion/test_velocity_estimator.py::"
            "test_a_turn_through_half_a_turn_goes_on_at_its_rate"
        ),
    ),
    Fault(
        "slope-over-absolute-stamps",
        "hw/motion/velocity_estimator.py",
        (
            "        middle += (stamps[k] - stamps[first]) * 1e-9\n"
            "    middle /= end - first\n"
            "    spread = vx = vy = wz = 0.0\n"
            "    for k in range(first, end):\n"
            "        away = (stamps[k] - stamps[first]) * 1e-9 - middle\n"
        ),
        (
            "        middle += stamps[k] * 1e-9\n"
            "    middle /= end - first\n"
            "    spread = vx = vy = wz = 0.0\n"
            "    for k in range(first, end):\n"
            "        away = stamps[k] * 1e-9 - middle\n"
        ),
        (
            "tests/hw/motion/test_velocity_estimator.py::"
            "test_when_it_was_seen_changes_no_bit_of_a_velocity"
        ),
    ),
    Fault(
        "who-turns-on-the-spot-stands",
        "hw/motion/velocity_estimator.py",
        (
            "if end == first or x != poses[end - 1, 0] or y != poses[end - 1, 1] or yaw != "
            "poses[end - 1, 2]:"
        ),
        "if end == first or x != poses[end - 1, 0] or y != poses[end - 1, 1]:",
        "tests/hw/motion/test_velocity_estimator.py::test_a_steady_walk_is_found_exactly",
    ),
    Fault(
        "pose-between-the-longer-way-round",
        "hw/geometry.py",
        "self.yaw + share * wrap(other.yaw - self.yaw)",
        "self.yaw + share * (other.yaw - self.yaw)",
        "tests/hw/test_geometry.py::test_between_two_poses_it_turns_by_the_shorter_way",
    ),
    Fault(
        "poses-at-either-side-of-pi-are-not-near",
        "hw/geometry.py",
        "abs(wrap(other.yaw - self.yaw)) < radians",
        "abs(other.yaw - self.yaw) < radians",
        (
            "tests/hw/test_geometry.py::"
            "test_poses_are_near_if_they_differ_by_less_also_across_half_a_turn"
        ),
    ),
    Fault(
        "angle-of-the-other-quaternion",
        "hw/geometry.py",
        "math.hypot(qx, qy, qz), abs(qw))",
        "math.hypot(qx, qy, qz), qw)",
        "tests/hw/test_geometry.py::test_the_angle_between_orientations_is_that_of_their_matrices",
    ),
    Fault(
        "sign-at-a-vertical-axis",
        "hw/geometry.py",
        "wrap(-sign * 2.0 * math.atan2(self.qx, self.qw))",
        "wrap(sign * 2.0 * math.atan2(self.qx, self.qw))",
        (
            "tests/hw/test_geometry.py::"
            "test_roll_pitch_and_yaw_give_the_orientation_again_up_to_the_vertical"
        ),
    ),
    Fault(
        "lever-of-an-arc",
        "hw/geometry.py",
        "x, y = along * moved.x + half * moved.y, along * moved.y - half * moved.x",
        "x, y = along * moved.x - half * moved.y, along * moved.y + half * moved.x",
        "tests/hw/test_geometry.py::test_the_velocity_of_a_displacement_leads_there_along_an_arc",
    ),
    Fault(
        "quaternions-between-the-longer-way",
        "hw/se3.py",
        "    if cosine < 0.0:\n        v = -v\n",
        "",
        "tests/hw/test_se3.py::test_between_two_motions_it_turns_evenly_the_shorter_way",
    ),
    Fault(
        "odometry-reckoned-backwards",
        "hw/motion/reckoner.py",
        "max(0, now_ns - newest.stamp_ns) * 1e-9",
        "(now_ns - newest.stamp_ns) * 1e-9",
        "tests/hw/motion/test_reckoner.py::test_before_its_newest_odometry_it_is_where_that_says",
    ),
    Fault(
        "slip-of-the-whole-way",
        "hw/motion/reckoner.py",
        "fix.sigma + SLIP * (way - fix.way)",
        "fix.sigma + SLIP * way",
        "tests/hw/motion/test_reckoner.py::test_only_what_was_driven_since_a_fix_makes_it_unsure",
    ),
    Fault(
        "fix-by-the-newest-odometry",
        "hw/motion/reckoner.py",
        "then = newest[1] if stamp_ns > newest[0] else self._wheels.at(stamp_ns)",
        "then = newest[1]",
        "tests/hw/motion/test_reckoner.py::test_a_fix_is_moved_on_by_the_wheels",
    ),
    Fault(
        "forgotten-poses-come-back",
        "hw/motion/pose_history.py",
        "        if n == self._first:\n",
        "        if n == 0:\n",
        "tests/hw/motion/test_pose_history.py::test_the_whole_span_is_kept_and_one_pose_before_it",
    ),
    Fault(
        "track-not-unwrapped",
        "hw/sim/sensors/track.py",
        "yaw = last[3] + wrapped(yaw - last[3])",
        "yaw = last[3] + (yaw - last[3])",
        (
            "tests/hw/sim/sensors/test_track.py::"
            "test_a_body_that_turns_on_and_on_is_seen_turning_evenly"
        ),
    ),
    Fault(
        "braking-arm-speeds-up-again",
        "hw/sim/sim_arm.py",
        "if course is not None and 0.0 < course.rate != share:",
        "if course is not None and course.rate != share:",
        "tests/hw/sim/test_sim_arm.py::test_an_arm_that_brakes_does_not_speed_up_again_for_a_pace",
    ),
    Fault(
        "way-while-the-pace-changes",
        "hw/sim/sim_arm.py",
        "(self.before + 0.5 * slope * changing)",
        "(self.before + slope * changing)",
        "tests/hw/sim/test_sim_arm.py::test_the_way_along_a_course_is_the_integral_of_its_rate",
    ),
    Fault(
        "gap-of-the-slot-before-ends-with-it",
        "hw/sim/sensors/vive.py",
        "[self._gap(slot - 1), self._gap(slot)]",
        "[(0.0, 0.0), self._gap(slot)]",
        "tests/hw/sim/sensors/test_vive.py::test_a_gap_does_not_end_where_the_next_slot_begins",
    ),
    Fault(
        "tracker-yaw-in-the-frame-of-the-map",
        "hw/sim/sensors/vive.py",
        "yaw = yaw + mount[3] + self._vive_from_map.yaw",
        "yaw = yaw + mount[3]",
        (
            "tests/hw/sim/sensors/test_vive.py::"
            "test_a_restart_of_the_tracking_moves_person_and_request_together"
        ),
    ),
    Fault(
        "slip-along-the-heading-at-the-end",
        "hw/sim/slip.py",
        "heading = floor.place[2] + 0.5 * turned",
        "heading = floor.place[2] + turned",
        (
            "tests/hw/sim/test_slip.py::"
            "test_shares_of_the_way_are_lost_along_the_body_whichever_way_it_has_turned"
        ),
    ),
    Fault(
        "slip-shares-of-both-axes-alike",
        "hw/sim/slip.py",
        "dy * (1.0 - floor.across - floor.patchy * patch[1])",
        "dy * (1.0 - floor.along - floor.patchy * patch[1])",
        (
            "tests/hw/sim/test_slip.py::"
            "test_shares_of_the_way_are_lost_along_the_body_whichever_way_it_has_turned"
        ),
    ),
    Fault(
        "acceleration-sideways-in-the-wrong-frame",
        "hw/sim/sensors/imu.py",
        "cos * ay - sin * ax + bias[4]",
        "cos * ay + sin * ax + bias[4]",
        "tests/hw/sim/sensors/test_imu.py::test_accelerations_and_turns_are_those_of_the_motion",
    ),
    Fault(
        "random-walk-grows-with-time",
        "hw/sim/sensors/imu.py",
        "errors.rate_walk * math.sqrt(self._period)",
        "errors.rate_walk * self._period",
        "tests/hw/sim/sensors/test_imu.py::test_noise_bias_and_walk_have_their_sizes",
    ),
    Fault(
        "odometry-along-the-heading-before",
        "hw/sim/sensors/odometry.py",
        "half = now[0] - before[0], now[1] - before[1], before[2] + 0.5 * turn",
        "half = now[0] - before[0], now[1] - before[1], before[2]",
        (
            "tests/hw/sim/sensors/test_odometry.py::"
            "test_the_velocity_is_along_the_axes_of_the_base_half_way"
        ),
    ),
    Fault(
        "contact-at-the-other-end-of-the-step",
        "hw/sim/contact/meeting.py",
        "round((1.0 - touch.share) * span_s * 1e9)",
        "round(touch.share * span_s * 1e9)",
        (
            "tests/hw/sim/contact/test_contact_cause.py::"
            "test_who_walks_into_a_standing_robot_has_caused_the_contact"
        ),
    ),
    Fault(
        "turn-opens-what-it-closes",
        "hw/sim/contact/contact.py",
        "+ near.lever * wrap(b.yaw - a.yaw)",
        "- near.lever * wrap(b.yaw - a.yaw)",
        "tests/hw/sim/contact/test_contact_cause.py::test_a_turning_corner_is_as_fast_as_its_lever",
    ),
    Fault(
        "swept-the-longer-way-round",
        "hw/sim/contact/contact.py",
        "turn = wrap(b.yaw - a.yaw)",
        "turn = b.yaw - a.yaw",
        (
            "tests/hw/sim/contact/test_contact.py::"
            "test_a_sweep_across_half_a_turn_is_that_of_the_same_motion_elsewhere"
        ),
    ),
    Fault(
        "braking-recovers-energy",
        "hw/sim/wheel_cycles.py",
        "abs(kinetic - body.kinetic) + body.rolling * way",
        "max(0.0, kinetic - body.kinetic) + body.rolling * way",
        "tests/hw/sim/test_sim_base.py::test_energy_is_the_change_of_kinetic_energy_and_rolling",
    ),
    Fault(
        "command-ends-before-its-time",
        "hw/sim/sim_base.py",
        "self._move(max(self._now, self._expires))",
        "self._move(self._now)",
        "tests/hw/sim/test_sim_base.py::test_a_command_holds_until_it_times_out_whatever_the_step",
    ),
)
