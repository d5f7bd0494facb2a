"""Faults in what judges and evaluates runs."""

from __future__ import annotations

from tests.planted.fault import Fault

FAULTS = (
    Fault(
        "head-turned-the-other-way",
        "cobodeck/evaluate/metrics.py",
        "body.bearing_to(base) - truth.head_turn",
        "body.bearing_to(base) + truth.head_turn",
        (
            "tests/cobodeck/evaluate/test_metrics.py::"
            "test_an_escape_situation_is_a_moving_user_with_the_robot_in_a_zone"
        ),
    ),
    Fault(
        "served-at-any-angle",
        "cobodeck/evaluate/requests.py",
        "away <= SERVED_M and turned <= SERVED_RAD",
        "away <= SERVED_M",
        (
            "tests/cobodeck/evaluate/test_metrics.py::"
            "test_served_is_the_prop_within_2_cm_and_a_tenth_rad"
        ),
    ),
    Fault(
        "rest-between-drives-counts",
        "cobodeck/evaluate/separation_figures.py",
        "lasted = min(LONGEST_NS, row.stamp_ns - now.stamp_ns)",
        "lasted = row.stamp_ns - now.stamp_ns",
        (
            "tests/cobodeck/evaluate/test_separation_figures.py::"
            "test_time_below_the_separation_needed_is_counted_apart_from_granted_touches"
        ),
    ),
    Fault(
        "last-of-equal-records",
        "cobodeck/real/release_stages.py",
        "len(why) < len(best.why)",
        "len(why) <= len(best.why)",
        (
            "tests/cobodeck/real/test_release_stages.py::"
            "test_of_records_that_come_as_near_the_newest_is_named"
        ),
    ),
    Fault(
        "person-looks-the-longer-way",
        "cobodeck/avoidable/motion_search.py",
        "views = np.unwrap(self.places[:, 2])",
        "views = self.places[:, 2]",
        (
            "tests/cobodeck/avoidable/test_motion_search.py::"
            "test_a_person_turns_from_row_to_row_by_the_shorter_way"
        ),
    ),
    Fault(
        "rotation-braked-one-way",
        "cobodeck/avoidable/motion_search.py",
        "math.copysign(0.5 * braking, robot.wz) * until**2",
        "0.5 * braking * until**2",
        (
            "tests/cobodeck/avoidable/test_motion_search.py::"
            "test_a_rotation_is_braked_evenly_to_a_stop_whichever_way_it_goes"
        ),
    ),
    Fault(
        "clear-a-step-early",
        "cobodeck/avoidable/motion_search.py",
        "(last + 1) * step_s",
        "last * step_s",
        "tests/cobodeck/avoidable/test_envelope.py::test_out_of_the_zones_for_good_is_told",
    ),
    Fault(
        "faster-than-the-limit-is-stopped-at-once",
        "cobodeck/avoidable/motions.py",
        "scale = max(fastest, speed) / max(math.hypot(wx, wy), 1e-9)",
        "scale = fastest / max(math.hypot(wx, wy), 1e-9)",
        (
            "tests/cobodeck/avoidable/test_motion_search.py::"
            "test_a_robot_that_is_too_fast_gets_no_faster_and_slows_no_harder_than_it_may"
        ),
    ),
    Fault(
        "brakes-with-the-acceleration",
        "cobodeck/avoidable/motions.py",
        "span = 0.5 * math.hypot(vx, vy) / task.limits[1]",
        "span = 0.5 * math.hypot(vx, vy) / task.limits[0]",
        (
            "tests/cobodeck/avoidable/test_motion_search.py::"
            "test_a_motion_may_end_where_the_brakes_still_stop_it_before_a_wall"
        ),
    ),
)
