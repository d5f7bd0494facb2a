"""The time of one decision: which rows there are, and what is timed."""

from __future__ import annotations

import math

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.bench.navigation import decisions
from hw.model.robot import load_robot
from hw.scene.scene import load_scene
from states.navigation.exact.visibility import ExactPlanner


@pytest.fixture(scope="module", params=["paper", "tuned"])
def place(request):
    profile = load_profile(request.param)
    return profile, profile.environment(load_scene("lab_a").room, load_robot("rbkairos_ur10"))


@pytest.mark.requirement(40, 109)
@pytest.mark.slow
def test_every_behaviour_has_a_row_by_profile_and_escape_a_goal():
    rows = list(decisions.rows(rounds=1, count=4))
    names = [
        f"{behaviour} decision{late}"
        for behaviour in ("chase", "haptic", "escape")
        for late in ("", ", 95% quantile")
    ]
    assert [(row.name, row.variant) for row in rows] == [
        (name, profile) for profile in ("paper", "tuned") for name in names
    ]
    assert [row.goal for row in rows] == [None] * 5 + [0.1] + [None] * 5 + [0.1]
    assert all(row.time_us > 0.0 for row in rows)


def test_in_every_situation_the_user_walks_up_to_a_robot_that_stands_free(place):
    profile, environment = place
    found = decisions.situations(environment, profile.settings, 30)
    assert [(s.pose, s.user) for s in found] == [
        (s.pose, s.user) for s in decisions.situations(environment, profile.settings, 30)
    ]
    for now in found:
        assert environment.static_planners["escape"].is_free((now.pose.x, now.pose.y))
        dx, dy = now.pose.x - now.user.body.x, now.pose.y - now.user.body.y
        assert 1.3 <= math.hypot(dx, dy) <= 2.5
        assert now.velocity.vx * dx + now.velocity.vy * dy == pytest.approx(math.hypot(dx, dy))


@pytest.mark.requirement(40)
def test_escape_asks_for_fewer_ways_than_chase(place, monkeypatch):
    profile, environment = place
    asked = {"chase": 0, "haptic": 0, "escape": 0}
    plan = ExactPlanner.plan

    def counted(self, *query):
        asked[behaviour] += 1
        return plan(self, *query)

    monkeypatch.setattr(ExactPlanner, "plan", counted)
    decide = decisions.decisions(environment, profile)
    for now in decisions.situations(environment, profile.settings, 20):
        for behaviour in asked:
            decide[behaviour](now)
    assert asked["escape"] < asked["chase"]
    assert asked["chase"] > 0
    if profile.name == "tuned":
        assert asked["escape"] == 0  # by forecasts of straight drives alone
