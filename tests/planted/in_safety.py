"""Faults in the safety chain, its governor and its sources."""

from __future__ import annotations

from tests.planted.fault import Fault

FAULTS = (
    Fault(
        "no-number-is-a-velocity",
        "hw/safety/checks.py",
        "return abs(a) < _NOWHERE and abs(b) < _NOWHERE and abs(c) < _NOWHERE",
        "return not (abs(a) >= _NOWHERE or abs(b) >= _NOWHERE or abs(c) >= _NOWHERE)",
        "tests/hw/safety/test_safety.py::test_one_value_that_is_no_number_stops_the_base",
    ),
    Fault(
        "turn-held-back-by-another-share",
        "hw/safety/separation.py",
        "        wz *= left\n",
        "        wz *= math.sqrt(left)\n",
        (
            "tests/hw/safety/test_safety_separation.py::"
            "test_velocity_and_turn_are_shortened_by_the_same_share"
        ),
    ),
    Fault(
        "ticks-that-stop-go-unnoticed",
        "hw/safety/chain.py",
        "at = now_ns if stamp is None else stamp",
        "at = now_ns",
        (
            "tests/hw/safety/test_guarded.py::"
            "test_without_ticks_the_wheels_are_stopped_within_a_tenth_of_a_second"
        ),
    ),
    Fault(
        "poses-of-another-time-are-kept",
        "hw/safety/checks.py",
        "        forget(rule.user)\n        rule.must_stand = False\n",
        "        rule.must_stand = False\n",
        (
            "tests/hw/safety/test_safety.py::"
            "test_time_that_runs_backwards_latches_and_what_was_before_it_is_forgotten"
        ),
    ),
    Fault(
        "reset-while-the-base-moves",
        "hw/safety/checks.py",
        "if lost or rule.measured > STANDING:",
        "if lost:",
        "tests/hw/safety/test_safety.py::test_a_base_faster_than_its_limit_is_stopped_and_latches",
    ),
    Fault(
        "reset-while-the-user-is-lost",
        "hw/safety/checks.py",
        "lost = rule.latched == _LOST and _stale(rule, age_of(rule.user, now_ns)) != 0",
        "lost = False",
        (
            "tests/hw/safety/test_safety.py::"
            "test_a_long_loss_of_tracking_latches_until_the_operator_resets_it_with_the_user_back"
        ),
    ),
    Fault(
        "latched-base-moves",
        "hw/safety/checks.py",
        "    if rule.latched:\n        return _LATCHED\n",
        "    if rule.latched == _LOST:\n        return _LATCHED\n",
        "tests/hw/safety/test_safety.py::test_a_base_faster_than_its_limit_is_stopped_and_latches",
    ),
    Fault(
        "stop-line-leaves-the-way-out",
        "hw/safety/checks.py",
        "    if rule.stopped:\n",
        "    if rule.stopped and rule.measured > STANDING:\n",
        (
            "tests/hw/safety/test_guarded.py::"
            "test_a_pulled_stop_line_stops_the_wheels_before_the_next_tick"
        ),
    ),
    Fault(
        "command-ages-like-a-pose",
        "hw/safety/checks.py",
        "_share(rule.command_age, limits.command_late, limits.command_age)",
        "_share(rule.command_age, limits.late, limits.old)",
        (
            "tests/hw/safety/test_safety.py::"
            "test_the_speed_limit_falls_from_a_command_40_ms_old_on_and_is_nothing_at_80"
        ),
    ),
    Fault(
        "command-ahead-of-the-clock",
        "hw/safety/checks.py",
        "if since < -rule.limits.ahead:",
        "if since < -rule.limits.old:",
        "tests/hw/safety/test_safety.py::test_a_command_stamped_ahead_of_the_clock_moves_nothing",
    ),
    Fault(
        "pose-ahead-of-the-clock-stays-fresh",
        "hw/safety/user_track.py",
        "    stamp_ns = min(stamp_ns, now_ns)\n",
        "",
        (
            "tests/hw/safety/test_safety_separation.py::"
            "test_poses_from_nowhere_from_the_past_and_from_the_future_are_refused"
        ),
    ),
    Fault(
        "user-who-was-never-seen-is-lost",
        "hw/safety/checks.py",
        "if limits.lost < age < math.inf:",
        "if limits.lost < age:",
        (
            "tests/hw/safety/test_safety.py::"
            "test_a_pulled_stop_line_admits_nothing_not_even_the_way_out"
        ),
    ),
    Fault(
        "loss-of-tracking-latches-at-once",
        "hw/safety/checks.py",
        "if limits.lost < age < math.inf:",
        "if limits.old < age < math.inf:",
        (
            "tests/hw/safety/test_safety.py::"
            "test_the_older_the_pose_of_the_user_the_slower_the_base_until_it_stops"
        ),
    ),
    Fault(
        "turn-measured-against-the-speed",
        "hw/safety/checks.py",
        "turn > FASTER * limits.yaw_rate:",
        "turn > FASTER * limits.speed:",
        "tests/hw/safety/test_safety.py::test_a_base_faster_than_its_limit_is_stopped_and_latches",
    ),
    Fault(
        "reaction-of-the-brakes-in-nanoseconds",
        "hw/safety/checks.py",
        "round((limits.reaction + SLOWER * within) * 1e9)",
        "round(limits.reaction + SLOWER * within * 1e9)",
        "tests/hw/safety/test_safety.py::test_a_stop_that_does_not_stop_the_base_latches",
    ),
    Fault(
        "turn-limited-before-the-speed",
        "hw/safety/checks.py",
        "if turn * scale > share * limits.yaw_rate + ROUNDING:",
        "if turn > share * limits.yaw_rate + ROUNDING:",
        (
            "tests/hw/safety/test_safety.py::"
            "test_a_command_beyond_both_limits_is_scaled_by_the_one_that_it_exceeds_more"
        ),
    ),
    Fault(
        "uncertain-pose-counts-as-certain",
        "hw/safety/checks.py",
        "allowed_speed(near.gap - off, speed",
        "allowed_speed(near.gap, speed",
        "tests/hw/safety/test_safety.py::test_an_unsure_pose_needs_more_room",
    ),
    Fault(
        "late-user-walks-no-faster",
        "hw/safety/checks.py",
        "speed = max(speed, limits.walking)",
        "speed = min(speed, limits.walking)",
        "tests/hw/safety/test_safety.py::test_a_late_pose_is_taken_for_a_user_who_walks",
    ),
    Fault(
        "user-as-fast-as-measured",
        "hw/safety/checks.py",
        "speed = user.speed + limits.uncertainty if user.speed_known",
        "speed = user.speed if user.speed_known",
        "tests/hw/safety/test_safety.py::test_a_late_pose_is_taken_for_a_user_who_walks",
    ),
    Fault(
        "user-who-sets-off-is-noticed-late",
        "hw/safety/user_track.py",
        "user.speed = max(quick, user.steady)",
        "user.speed = user.steady",
        (
            "tests/hw/safety/test_safety_separation.py::"
            "test_the_speed_is_that_of_the_last_tenth_of_a_second"
        ),
    ),
    Fault(
        "lever-of-the-other-side",
        "hw/safety/separation.py",
        "qx * ny - qy * nx)",
        "qy * nx - qx * ny)",
        (
            "tests/hw/safety/test_safety_separation.py::"
            "test_velocity_and_turn_close_the_gap_as_fast_as_nearness_says"
        ),
    ),
    Fault(
        "turn-that-opens-is-held-back",
        "hw/safety/separation.py",
        "if near.lever * wz > 0.0:",
        "if wz > 0.0:",
        (
            "tests/hw/safety/test_safety.py::"
            "test_a_turn_that_takes_the_nearest_corner_away_is_free_and_the_other_one_is_not"
        ),
    ),
    Fault(
        "braking-counted-twice",
        "hw/safety/separation.py",
        "closing * (reaction + 0.5 * stop)",
        "closing * (reaction + stop)",
        "tests/hw/safety/test_safety.py::test_the_needed_separation_is_that_of_the_measured_motion",
    ),
    Fault(
        "touch-deeper-than-its-tolerance",
        "hw/safety/checks.py",
        ".gap - limits.touch_slack)",
        ".gap - 2.0 * limits.touch_slack)",
        (
            "tests/hw/safety/test_safety.py::"
            "test_a_grant_ends_at_the_gap_of_the_pose_less_its_tolerance"
        ),
    ),
    Fault(
        "touch-as-fast-by-late-poses",
        "hw/safety/checks.py",
        "_share(age, limits.late, limits.old) * limits.touch_speed",
        "limits.touch_speed",
        (
            "tests/hw/safety/test_safety.py::"
            "test_a_late_pose_slows_a_granted_touch_and_does_not_forbid_it"
        ),
    ),
    Fault(
        "touch-of-a-user-who-walks",
        "hw/safety/checks.py",
        "or user.steady >= limits.still:",
        "or user.steady >= limits.walking:",
        "tests/hw/safety/test_safety.py::test_a_user_who_has_asked_and_moves_is_not_approached",
    ),
    Fault(
        "grant-ends-with-the-next-request",
        "hw/safety/rule.py",
        "        if not level:\n            self.state",
        "        if True:\n            self.state",
        "tests/hw/safety/test_safety.py::test_a_grant_that_comes_before_its_request_is_kept",
    ),
    Fault(
        "offer-from-the-future",
        "hw/safety/multiplexer.py",
        "if since is not None and 0 <= now_ns - since <= timeout_ns:",
        "if since is not None and now_ns - since <= timeout_ns:",
        (
            "tests/hw/safety/test_multiplexer.py::"
            "test_after_a_leap_back_in_time_what_was_said_before_it_counts_no_more"
        ),
    ),
    Fault(
        "arm-folded-to-one-side",
        "hw/safety/guarded.py",
        "all(abs(a - b) <= FOLDED_RAD",
        "all(a - b <= FOLDED_RAD",
        (
            "tests/hw/safety/test_guarded.py::"
            "test_an_arm_is_folded_while_no_joint_is_more_than_a_fiftieth_off_in_either_direction"
        ),
    ),
    Fault(
        "measurement-from-the-future",
        "hw/safety/chain.py",
        "-limits.ahead <= (now_ns - stamp) / 1e9 <= limits.old",
        "(now_ns - stamp) / 1e9 <= limits.old",
        (
            "tests/hw/safety/test_guarded.py::"
            "test_plain_wheels_whose_own_measurements_are_missing_or_old_stand"
        ),
    ),
    Fault(
        "wheels-turn-faster-than-they-can",
        "hw/safety/ramps.py",
        "abs(vx) + abs(vy) + ramps.lever * abs(wz)",
        "abs(vx) + abs(vy) + abs(wz)",
        (
            "tests/hw/safety/test_ramps.py::"
            "test_a_command_is_scaled_to_the_lesser_of_the_robots_and_the_profiles_limits"
        ),
    ),
    Fault(
        "velocity-by-the-heading-before",
        "hw/safety/ramps.py",
        "math.cos(yaw + turn), math.sin(yaw + turn)",
        "math.cos(yaw), math.sin(yaw)",
        "tests/hw/sim/test_sim_base.py::test_speed_and_acceleration_never_exceed_the_limits",
    ),
    Fault(
        "governor-is-never-off",
        "hw/safety/checks.py",
        "if limits.governor and closing_speed(near, admitted) > allowed:",
        "if closing_speed(near, admitted) > allowed:",
        "tests/hw/safety/test_safety.py::test_without_the_governor_all_but_the_separation_is_kept",
    ),
)
