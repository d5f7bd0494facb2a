"""Faults in maps, planners and the prediction of people."""

from __future__ import annotations

from tests.planted.fault import Fault

FAULTS = (
    Fault(
        "cells-truncated",
        "states/maps/cells.py",
        "row = math.floor((y - self.y) / self.resolution)",
        "row = int((y - self.y) / self.resolution)",
        (
            "tests/states/maps/test_cells_filled.py::"
            "test_a_place_beyond_any_side_of_a_grid_is_in_none_of_its_cells"
        ),
    ),
    Fault(
        "envelope-begins-a-cell-early",
        "states/maps/distance.py",
        "begin = 1 + gain // (2 * (x - other))",
        "begin = gain // (2 * (x - other))",
        (
            "tests/states/navigation/grid/test_costmap.py::"
            "test_distances_are_those_of_scipy_to_the_last_bit"
        ),
    ),
    Fault(
        "map-in-a-corner-of-its-own",
        "states/maps/mapping.py",
        "x = (self._corner[0] + first_column) * self._cell",
        "x = (self._corner[0] - first_column) * self._cell",
        "tests/states/maps/test_mapping.py::test_a_map_grows_to_all_sides_and_stays_where_it_is",
    ),
    Fault(
        "bend-shorter-than-it-is",
        "states/navigation/local/speed_profile.py",
        "share, turned = min(1.0, speed * speed / top), 2.0 * step / radius",
        "share, turned = min(1.0, speed * speed / top), step / radius",
        (
            "tests/states/navigation/local/test_speed_profile.py::"
            "test_the_speed_after_a_stretch_of_a_bend_is_that_by_the_sine_to_the_last_bit"
        ),
    ),
    Fault(
        "cruise-shorter-than-it-is",
        "states/navigation/local/speed_profile.py",
        "(2.0 * top * top - start * start - end * end) / (2.0 * a)",
        "(2.0 * top * top - start * start - end * end) / a",
        (
            "tests/states/navigation/local/test_speed_profile.py::"
            "test_the_time_of_a_straight_is_that_of_its_speed_profile"
        ),
    ),
    Fault(
        "a-period-without-its-half",
        "states/navigation/local/speed_profile.py",
        "    half = 0.5 * pace.acceleration * period\n",
        "    half = 0.0 * pace.acceleration * period\n",
        (
            "tests/states/navigation/local/test_speed_profile.py::"
            "test_half_a_period_at_the_speed_sent_and_the_braking_after_it_use_up_what_is_left"
        ),
    ),
    Fault(
        "delay-by-a-product-of-another-sign",
        "states/navigation/local/reckoning.py",
        "dt * (mx * cx + my * cy)",
        "dt * (mx * cx - my * cy)",
        (
            "tests/states/navigation/local/test_reckoning.py::"
            "test_a_robot_is_where_the_plain_rule_has_it_to_the_last_bit"
        ),
    ),
    Fault(
        "correction-across-pi",
        "states/navigation/local/reckoning.py",
        "turn = wrapped(wrapped(measured[2] + late * twist[2]) - yaw)",
        "turn = measured[2] + late * twist[2] - yaw",
        (
            "tests/states/navigation/local/test_reckoning.py::"
            "test_a_robot_is_where_the_plain_rule_has_it_to_the_last_bit"
        ),
    ),
    Fault(
        "walker-at-the-horizon",
        "states/navigation/local/predicted_gap.py",
        "rest = 1.0 - (time - HORIZON) / lasts",
        "rest = (time - HORIZON) / lasts",
        (
            "tests/states/navigation/local/test_predicted_gap.py::"
            "test_the_least_gap_on_a_straight_is_that_of_small_steps_in_time"
        ),
    ),
    Fault(
        "disc-that-does-not-grow",
        "states/navigation/local/predicted_gap.py",
        "least = min(least, nearest_between(before, after) - time * walker[5])\n            before",
        "least = min(least, nearest_between(before, after))\n            before",
        (
            "tests/states/navigation/local/test_predicted_gap.py::"
            "test_the_least_gap_on_a_straight_is_that_of_small_steps_in_time"
        ),
    ),
    Fault(
        "costs-rounded",
        "states/navigation/grid/inflation.py",
        "cost = int(252.0 * min(1.0, math.exp(factor * (inscribed - metres))))",
        "cost = round(252.0 * min(1.0, math.exp(factor * (inscribed - metres))))",
        "tests/states/navigation/grid/test_costmap.py::test_inflation_gives_costmap_2ds_values",
    ),
    Fault(
        "line-downwards-from-the-wrong-edge",
        "states/navigation/grid/theta_star.py",
        "next_row = (row + (dy > 0.0) - py) / dy",
        "next_row = (row + 1 - py) / dy",
        (
            "tests/states/navigation/grid/test_grid_planners.py::"
            "test_a_line_is_free_if_and_only_if_all_cells_that_it_enters_are"
        ),
    ),
    Fault(
        "way-between-two-blocked-corners",
        "states/navigation/grid/theta_star.py",
        "    if not (free[row, to_column] and free[to_row, column]):\n        return -1\n",
        "",
        (
            "tests/states/navigation/grid/test_grid_planners.py::"
            "test_among_many_blocked_cells_theta_star_finds_what_eight_neighbours_connect"
        ),
    ),
    Fault(
        "chord-of-a-bend-not-shortened",
        "states/signals/prediction.py",
        "STRAIGHT = 1e-9",
        "STRAIGHT = 1e-2",
        (
            "tests/states/signals/test_prediction.py::"
            "test_the_chord_of_a_slight_bend_is_that_of_a_circle"
        ),
    ),
    Fault(
        "walker-without-hysteresis",
        "states/signals/user_motion.py",
        "(STANDS if self._walks else WALKS)",
        "WALKS",
        (
            "tests/states/signals/test_user_motion.py::"
            "test_who_is_slower_than_a_walk_stands_and_may_turn"
        ),
    ),
    Fault(
        "still-while-turning",
        "states/signals/user_motion.py",
        "velocity.speed >= self._speed or abs(velocity.wz) >= self._turn",
        "velocity.speed >= self._speed or velocity.wz >= self._turn",
        "tests/states/signals/test_user_motion.py::test_at_the_limit_one_is_not_still",
    ),
    Fault(
        "square-root-of-less-than-nothing",
        "states/navigation/beside_user.py",
        "math.sqrt(max(0.0, along * along - square * outside))",
        "math.sqrt(along * along - square * outside)",
        (
            "tests/states/navigation/test_follow.py::"
            "test_a_way_that_only_touches_the_circle_ends_there"
        ),
    ),
)
