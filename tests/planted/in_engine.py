"""Faults in ticks, time-outs, ages and events."""

from __future__ import annotations

from tests.planted.fault import Fault

FAULTS = (
    Fault(
        "durations-truncated",
        "engine/run/context.py",
        "return self.now + round(seconds * 1e9)",
        "return self.now + int(seconds * 1e9)",
        "tests/engine/test_clock.py::test_rule_1_what_a_state_plans_is_rounded",
    ),
    Fault(
        "ages-truncated",
        "engine/run/context.py",
        "NEVER_NS if age is None else round(age * 1e9)",
        "NEVER_NS if age is None else int(age * 1e9)",
        "tests/engine/test_clock.py::test_rule_1_the_greatest_age_of_a_value_is_rounded",
    ),
    Fault(
        "too-old-a-nanosecond-early",
        "engine/run/context.py",
        "if newest is None or board.now - newest.stamp > age:",
        "if newest is None or board.now - newest.stamp >= age:",
        (
            "tests/engine/signals/test_signal_kinds.py::"
            "test_a_value_exactly_as_old_as_a_reader_accepts_is_accepted"
        ),
    ),
    Fault(
        "ages-stand-still-in-a-pause",
        "engine/run/context.py",
        "if newest is None or board.now - newest.stamp > age:",
        "if newest is None or self.now - newest.stamp > age:",
        "tests/engine/rules/test_rule_11_operator.py::test_rule_11_values_grow_older_in_a_pause",
    ),
    Fault(
        "ticks-in-floats",
        "engine/clock.py",
        "return number * SECOND_NS // self.hz",
        "return int(number * (SECOND_NS / self.hz))",
        "tests/engine/test_clock.py::test_rule_1_an_instant_is_exact_for_thousands_of_years",
    ),
    Fault(
        "first-tick-before-its-instant",
        "engine/clock.py",
        "return max(0, -(-at * self.hz // SECOND_NS))",
        "return max(0, at * self.hz // SECOND_NS)",
        "tests/engine/test_clock.py::test_rule_1_the_ticks_next_to_an_instant_are_on_its_two_sides",
    ),
    Fault(
        "retry-woken-by-old-news",
        "engine/run/run_queue.py",
        "node.mask, node.silence = 0, None",
        "node.silence = None",
        (
            "tests/engine/signals/test_news.py::"
            "test_rule_12_news_of_what_the_last_try_waited_for_does_not_shorten_the_wait"
        ),
    ),
    Fault(
        "error-of-a-child-taken",
        "engine/run/life.py",
        "own = isinstance(top, LeafNode) and top.path in raised_now",
        "own = bool(raised_now)",
        (
            "tests/engine/operator/test_commands.py::"
            "test_rule_7_a_clean_up_that_raises_inside_does_not_turn_the_outcome_of_a_forced_box"
        ),
    ),
    Fault(
        "due-a-nanosecond-late",
        "engine/run/life.py",
        "if node.deadline <= now]",
        "if node.deadline < now]",
        (
            "tests/engine/rules/test_rule_05_timeouts.py::"
            "test_rule_5_in_the_due_tick_monitors_are_stepped_and_actions_are_not"
        ),
    ),
    Fault(
        "timeout-in-run-time",
        "engine/run/life.py",
        "node.since = now - board.paused_ns",
        "node.since = now",
        (
            "tests/engine/rules/test_rule_11_operator.py::"
            "test_rule_11_a_timeout_that_begins_after_a_pause_is_as_long_as_any"
        ),
    ),
    Fault(
        "samples-of-this-tick-trimmed",
        "engine/signals/event_log.py",
        "default=self._before)",
        "default=self.end)",
        (
            "tests/engine/signals/test_event_log.py::"
            "test_who_is_entered_gets_all_of_a_tick_in_which_so_much_came_that_the_log_was_trimmed"
        ),
    ),
    Fault(
        "impossible-outcomes-forced",
        "engine/operator/commands.py",
        "outcomes_of(child) - set(child.go) - set(child.leave)",
        "outcomes_of(child) - set(child.go)",
        (
            "tests/engine/operator/test_commands.py::"
            "test_rule_11_a_box_is_forced_to_what_it_can_end_with_alone"
        ),
    ),
    Fault(
        "derived-as-old-as-its-last-input",
        "engine/signals/slots.py",
        "oldest = sample.stamp if sample.stamp < oldest else oldest",
        "oldest = sample.stamp",
        "tests/engine/signals/test_signal_kinds.py::test_a_value_is_as_old_as_its_oldest_input",
    ),
    Fault(
        "late-sample-replaces-a-newer-one",
        "engine/signals/slots.py",
        "if newest is None or held.stamp >= newest.stamp:",
        "if newest is None or held.stamp != newest.stamp:",
        (
            "tests/engine/signals/test_signal_kinds.py::"
            "test_a_late_sample_does_not_replace_a_newer_one_but_reaches_estimators"
        ),
    ),
)
