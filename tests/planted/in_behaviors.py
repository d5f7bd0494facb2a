"""Faults in what behaviours decide by."""

from __future__ import annotations

from tests.planted.fault import Fault

FAULTS = (
    Fault(
        "room-without-hysteresis",
        "behaviors/chase/make_room.py",
        "room += user.beside.slack if again else 0.0",
        "room += 0.0",
        (
            "tests/behaviors/test_make_room.py::"
            "test_room_is_made_until_there_is_a_little_more_of_it_than_is_asked_for"
        ),
    ),
    Fault(
        "goal-under-way-forgotten",
        "behaviors/chase/make_room.py",
        "place_with_room(now, band, present)",
        "place_with_room(now, band, None)",
        (
            "tests/behaviors/test_make_room.py::"
            "test_the_place_that_it_drives_to_is_one_of_those_it_chooses_from_again"
        ),
    ),
    Fault(
        "caught-without-the-delay",
        "behaviors/escape/pursuit.py",
        "return user.walks.stops + user.window + now.environment.delay",
        "return user.walks.stops + user.window",
        (
            "tests/behaviors/test_dodge.py::"
            "test_who_walks_at_a_robot_is_warned_as_much_earlier_as_poses_and_commands_are_late"
        ),
    ),
    Fault(
        "bend-clamped-on-one-side",
        "behaviors/escape/pursuit.py",
        "max(-walks.bend_most, min(walks.bend_most, velocity.wz))",
        "min(walks.bend_most, velocity.wz)",
        (
            "tests/behaviors/test_dodge.py::"
            "test_a_bend_towards_the_robot_counts_for_half_a_second_at_1_2_radians_per_second_at_most"
        ),
    ),
    Fault(
        "calm-without-hysteresis",
        "behaviors/escape/danger.py",
        "reaction=rules.reaction + calm",
        "reaction=rules.reaction",
        (
            "tests/behaviors/test_escape.py::"
            "test_a_danger_is_over_a_tenth_of_a_second_after_it_would_begin"
        ),
    ),
    Fault(
        "zone-by-the-body",
        "behaviors/escape/zones.py",
        "bearing = wrap(math.atan2(dy, dx) - user.head_yaw)",
        "bearing = wrap(math.atan2(dy, dx) - user.body.yaw)",
        (
            "tests/behaviors/test_escape_states.py::"
            "test_the_zones_reach_farther_in_the_direction_of_view_of_the_head"
        ),
    ),
    Fault(
        "zone-across-pi",
        "behaviors/escape/zones.py",
        "bearing = wrap(math.atan2(dy, dx) - user.head_yaw)",
        "bearing = math.atan2(dy, dx) - user.head_yaw",
        (
            "tests/behaviors/test_escape_states.py::"
            "test_the_zones_reach_farther_in_the_direction_of_view_of_the_head"
        ),
    ),
    Fault(
        "drift-in-the-frame-of-the-base",
        "behaviors/escape/danger.py",
        "will_be_reached(rules, user.body, base, velocity, twist.rotated(base.yaw))",
        "will_be_reached(rules, user.body, base, velocity, twist)",
        "tests/behaviors/test_escape.py::test_the_robot_s_own_motion_counts_towards_a_contact",
    ),
    Fault(
        "long-side-the-longer-way-round",
        "behaviors/chase/chase_states.py",
        "key=lambda yaw: abs(wrap(yaw - now))",
        "key=lambda yaw: abs(yaw - now)",
        "tests/behaviors/test_chase.py::test_a_long_side_faces_the_user_with_the_smaller_turn",
    ),
    Fault(
        "cells-without-their-half",
        "behaviors/situation/chase_cells.py",
        "(np.arange(-reach, reach) + 0.5) * ring.cell",
        "np.arange(-reach, reach) * ring.cell",
        "tests/behaviors/test_chase.py::test_the_space_has_5998_cells_at_the_paper_s_values",
    ),
    Fault(
        "way-round-the-longer-side",
        "behaviors/situation/chase_cells.py",
        "    apart = np.minimum(apart, 2.0 * math.pi - apart)\n",
        "",
        (
            "tests/behaviors/test_chase.py::"
            "test_ways_around_the_user_are_by_tangents_wherever_start_and_goal_lie"
        ),
    ),
    Fault(
        "one-long-side-only",
        "behaviors/situation/chase_cells.py",
        "tangent + 0.5 * math.pi) % math.pi - 0.5 * math.pi)",
        "tangent + math.pi) % math.tau - math.pi)",
        (
            "tests/behaviors/test_chase.py::"
            "test_a_cell_weighs_by_the_time_from_it_to_the_soonest_haptic_pose_whichever_side_it_shows"
        ),
    ),
    Fault(
        "braking-way-doubled",
        "behaviors/person/margin.py",
        "braking * braking / (2.0 * stopping)",
        "braking * braking / stopping",
        (
            "tests/behaviors/person/test_margin.py::"
            "test_a_walker_meets_a_robot_that_brakes_if_the_integral_of_its_speed_leads_there"
        ),
    ),
    Fault(
        "other-side-of-a-line",
        "behaviors/person/margin.py",
        "2.0 * acceleration * (contact - side * lateral)",
        "2.0 * acceleration * (contact - lateral)",
        (
            "tests/behaviors/person/test_margin.py::"
            "test_the_time_aside_is_the_last_at_which_the_robot_is_too_near_to_the_line"
        ),
    ),
    Fault(
        "turn-before-setting-off-across-pi",
        "behaviors/person/waiting.py",
        "turn = abs((angles[j] - user[2] + math.pi) % math.tau - math.pi)",
        "turn = abs(angles[j] - user[2])",
        (
            "tests/behaviors/person/test_waiting.py::"
            "test_the_risk_is_lack_of_time_and_escapes_over_all_lines_of_walk"
        ),
    ),
    Fault(
        "beside-the-line-on-the-wrong-side",
        "behaviors/person/waiting.py",
        "away = rules.contact - lateral if side == 0 else rules.contact + lateral",
        "away = rules.contact + lateral if side == 0 else rules.contact - lateral",
        (
            "tests/behaviors/person/test_waiting.py::"
            "test_the_risk_is_lack_of_time_and_escapes_over_all_lines_of_walk"
        ),
    ),
    Fault(
        "haste-without-the-two",
        "behaviors/person/band.py",
        "math.sqrt(2.0 * acceleration * max(0.0, distance - keep))",
        "math.sqrt(acceleration * max(0.0, distance - keep))",
        (
            "tests/behaviors/test_dodge.py::"
            "test_haste_is_the_speed_from_which_the_robot_could_not_stop_at_the_distance_to_keep"
        ),
    ),
    Fault(
        "user-in-the-frame-of-the-base",
        "states/navigation/local/straight_planner.py",
        "return _turned((near.nx, near.ny), yaw)",
        "return near.nx, near.ny",
        (
            "tests/behaviors/test_straight_drive.py::"
            "test_a_command_is_that_of_the_plain_rule_to_the_last_bit"
        ),
    ),
    Fault(
        "rest-twice-as-far",
        "behaviors/person/drives.py",
        "stretch = math.hypot(vx, vy) / (2.0 * acceleration)",
        "stretch = math.hypot(vx, vy) / acceleration",
        "tests/behaviors/test_dodge.py::test_room_is_not_made_through_a_wall_even_with_momentum",
    ),
    Fault(
        "turns-of-the-circle-truncated",
        "behaviors/haptic.py",
        "range(math.ceil(math.tau / close.turn - 1e-9))",
        "range(int(math.tau / close.turn))",
        (
            "tests/behaviors/test_haptic.py::"
            "test_the_second_choice_is_all_round_the_deep_without_a_gap_or_a_place_twice"
        ),
    ),
)
