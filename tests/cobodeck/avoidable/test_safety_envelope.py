"""The safety envelope: closed forms by hand, the search beside them, recorded Escapes, the page."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from behaviors.profile import load_profile
from cobodeck.avoidable.envelope import Oncoming, asked, least_distance
from cobodeck.avoidable.escape_report import JudgedRun, text
from cobodeck.avoidable.motion_search import RobotLimits, is_avoidable
from cobodeck.avoidable.motions import GAP
from cobodeck.avoidable.recorded_escapes import EscapeProfile, EscapeVisit
from cobodeck.avoidable.safety_envelope import (
    boundary,
    escape_points,
    separation,
)
from cobodeck.pictures import envelope_picture as picture
from tests.cobodeck.avoidable.test_envelope_record import walked

TOUCH = 0.565 + 0.5
"""Distance of centres at which somebody before the robot touches it, m."""


def straight_away(speed: float, acceleration: float, delay_s: float, contact: float) -> float:
    """The least distance of centres from which a robot at rest gets away straight, m.

    The robot is nearest once it is as fast as the person, v / a after its start: the person has
    gained v delay + v^2 / a - v^2 / 2a. `contact`: the distance at a touch, m.
    """
    return contact + speed * delay_s + speed**2 / (2.0 * acceleration)


def acceleration_needed(speed: float, distance: float, delay_s: float, contact: float) -> float:
    """The least acceleration with which it gets away from there, m/s2: `straight_away` solved."""
    left = distance - contact - speed * delay_s
    return speed**2 / (2.0 * left) if left > 0.0 else math.inf


@pytest.mark.parametrize(("distance", "needed"), [(2.5, 0.88), (1.5, 4.0)])
def test_the_anchors_of_somebody_at_full_pace(distance: float, needed: float) -> None:
    """1.5 m/s straight at the robot, 0.1 s until it moves, a touch at 1.07 m."""
    assert acceleration_needed(1.5, distance, 0.1, 1.07) == pytest.approx(needed, abs=0.025)
    found = acceleration_needed(1.5, distance, 0.1, TOUCH)

    for share, free in ((1.02, True), (0.97, False)):
        approach = Oncoming(1.5, found * share, 0.1)
        assert is_avoidable(asked(approach, distance)) is free


def test_no_acceleration_is_enough_where_the_delay_alone_brings_a_touch() -> None:
    assert acceleration_needed(1.5, TOUCH + 0.3, 0.2, TOUCH) == math.inf
    assert acceleration_needed(1.5, 1.0, 0.0, TOUCH) == math.inf


@given(st.floats(0.2, 2.5), st.floats(0.5, 6.0), st.floats(0.0, 0.3))
def test_straight_away_is_the_motion_in_small_steps(
    speed: float, acceleration: float, delay_s: float
) -> None:
    distance = straight_away(speed, acceleration, delay_s, TOUCH)
    assert acceleration_needed(speed, distance, delay_s, TOUCH) == pytest.approx(acceleration)

    times = np.linspace(0.0, delay_s + speed / acceleration + 1.0, 20_001)
    gone = 0.5 * acceleration * np.maximum(0.0, times - delay_s) ** 2
    assert (distance + gone - speed * times).min() == pytest.approx(TOUCH, abs=1e-6)


@given(st.floats(0.0, 2.5), st.floats(0.0, 1.5), st.floats(0.0, 0.3), st.floats(1.0, 6.0))
def test_from_the_separation_both_stop_with_what_is_kept_for_hands_and_errors(
    walking: float, driving: float, reaction_s: float, braking: float
) -> None:
    times = np.linspace(0.0, reaction_s + driving / braking, 20_001)
    braked = np.maximum(0.0, driving - braking * np.maximum(0.0, times - reaction_s))
    closed = np.trapezoid(braked + walking, times)

    found = separation(walking, driving, reaction_s, braking)

    assert found == pytest.approx(closed + 0.2 + 0.15, abs=1e-6)


def test_the_boundary_is_below_the_closed_form_where_it_pays_to_step_aside() -> None:
    """With a corner ahead a touch is up to 0.15 m farther off; it is whatever the yaw."""
    (slow,), fast = boundary((2.5,), 0.6), boundary((1.5, 2.5), 3.0)
    delayed = least_distance(Oncoming(2.5, 3.0, 0.3), GAP)

    assert None not in (slow, *fast, delayed)
    assert slow < straight_away(2.5, 0.6, 0.0, TOUCH) - 1.0  # type: ignore[operator]
    for speed, found in zip((1.5, 2.5), fast, strict=True):
        assert -0.01 <= found - straight_away(speed, 3.0, 0.0, TOUCH) <= 0.16  # type: ignore[operator]
    assert delayed == pytest.approx(fast[1] + 0.3 * 2.5, abs=0.01)  # type: ignore[operator]


def test_escapes_are_points_at_their_entry() -> None:
    """Somebody sets off at 1 s from 3.4 m; 1.5 m/s at a robot of 1 m/s2 needs 2.2 m."""
    visits = EscapeVisit(1.5, 1.9, "safe"), EscapeVisit(2.2, 2.3, "failed"), EscapeVisit(2.5)

    early, late, cut = escape_points(walked(-3.4, escapes=visits))

    assert [p.outcome for p in (early, late, cut)] == ["safe", "failed", None]
    assert [p.speed for p in (early, late, cut)] == pytest.approx([1.5] * 3, abs=0.01)
    assert early.distance == pytest.approx(3.4 - 1.5 * 0.5, abs=0.01)
    assert late.distance == pytest.approx(3.4 - 1.5 * 1.2, abs=0.01)
    assert early.least == late.least == pytest.approx(straight_away(1.5, 1.0, 0.0, TOUCH), abs=0.01)
    assert [(p.inside, p.free) for p in (early, late, cut)] == [(True, True), *[(False, False)] * 2]


def test_a_point_is_judged_by_the_limits_and_the_latency_of_its_run() -> None:
    visit = (EscapeVisit(1.9, 2.0, "safe"),)
    small = RobotLimits(1.0, 3.0, 2.5, 0.25, 0.25)
    slow = EscapeProfile("late", 1.0, 2.5, 1.5, 0.15, 0.3)

    (plain,), (little,), (late,) = (
        escape_points(walked(-3.4, escapes=visit, **more))
        for more in ({}, {"limits": small}, {"profile": slow})
    )

    assert little.least is not None
    assert late.least is not None
    assert plain.least is not None
    side, corner = (straight_away(1.5, 1.0, 0.0, 0.5 + ahead) for ahead in (0.25, 0.36))
    assert side - 0.01 <= little.least <= corner + 0.01
    assert plain.least > little.least + 0.2
    assert late.least == pytest.approx(plain.least + 0.3 * 1.5, abs=0.01)
    assert (little.inside, late.inside) == (True, False)


def test_what_lies_outside_is_told() -> None:
    visits = EscapeVisit(1.2, 1.9, "safe"), EscapeVisit(2.2, 2.3, "failed")
    run = walked(-3.4, escapes=visits)
    found = JudgedRun(Path("x.mcap"), run, (), tuple(escape_points(run)))

    shown = text([found])

    (row,) = (line.split() for line in shown.splitlines() if line.startswith("x  "))
    assert row[1:5] == ["2.20", "s", "Escape:", "failed"]
    assert row[-2:] == ["no", "no"]
    assert "2, outside of the envelope 1 (1 failed), without a way out 1" in shown
    told = found.plain()["escapes"]
    assert [(one["at_s"], one["inside"]) for one in told] == [(1.2, True), (2.2, False)]
    assert told[0].keys() >= {"speed_m_s", "distance_m", "least_m", "free", "outcome"}


def test_the_page_has_a_row_per_profile_and_the_points_of_its_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(picture, "SPEEDS", (0.5, 1.5))
    monkeypatch.setattr(picture, "ACCELERATIONS", ())
    monkeypatch.setattr(picture, "DELAYS_S", (0.0, 0.1))
    own = EscapeProfile("own", 3.0, 2.2, 1.1, 0.2, 0.1)
    run = walked(-3.4, profile=own, escapes=(EscapeVisit(1.2, 1.9, "safe"),))
    runs = [JudgedRun(Path("x.mcap"), run, (), tuple(escape_points(run)))]
    shares: list[float] = []

    picture.draw_envelope(tmp_path / "x.svg", lambda _, done: shares.append(done), runs)

    drawn = (tmp_path / "x.svg").read_text()
    assert len(shares) == 3
    assert shares == sorted(shares)
    for title in ("paper: 1.5 m/s²", "tuned: 1 m/s²", "own: 3 m/s²", "not conformity"):
        assert title in drawn
    least = picture.delayed(boundary((0.5, 1.5), 3.0), 0.1)
    speed = float(np.interp(1.1, least, (0.5, 1.5)))
    assert f"1.1 m: up to {speed:.2f} m/s" in drawn


def test_shipped_profiles_are_told_apart_and_runs_of_them_are_not() -> None:
    tuned = EscapeProfile.of("tuned", load_profile("tuned").values)
    like = JudgedRun(Path("x.mcap"), walked(-3.4, profile=tuned), ())

    names = [profile.name for profile in picture.profiles_of([like, like])]

    assert names == ["paper", "tuned"]
    assert tuned == EscapeProfile("tuned", 1.0, 2.5, 1.5, 0.15, 0.0)
