"""The profile names the chart that is run, and is told when a chart is of the other policy."""

from __future__ import annotations

from dataclasses import replace

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.setup.other_policy import of_other_policy
from cobodeck.setup.setup import Setup, open_setup
from engine.files.finding import FileError


@pytest.mark.parametrize(("profile", "chart"), [("tuned", "cobodeck"), ("paper", "paper_cobodeck")])
def test_without_a_chart_it_is_the_one_of_the_profile(profile: str, chart: str) -> None:
    assert load_profile(profile).policy == profile
    assert open_setup(profile=profile).chart.name == chart


@pytest.mark.parametrize("key", ["policy=paper", "chart=paper_cobodeck"])
def test_policy_and_chart_are_no_values_to_set(key: str) -> None:
    with pytest.raises(FileError, match="cannot be set; choose another file with --profile"):
        load_profile("tuned", [key])


def marked(setup: Setup, policy: str, *states: str) -> Setup:
    """The setup with these state classes marked as those of a policy alone."""
    classes = dict(setup.catalogue.classes)
    for name in states:
        classes[name] = type(name, (classes[name],), {"policy": policy})
    return replace(setup, catalogue=replace(setup.catalogue, classes=classes))


def test_a_chart_of_the_other_policy_is_told_once_with_what_would_be_right() -> None:
    setup = marked(open_setup("cobodeck"), "paper", "UserLost", "ChooseHapticPose")

    (told,) = of_other_policy(setup)

    assert "chart cobodeck decides as the policy paper does (" in told
    assert "UserLost" in told
    assert "ChooseHapticPose" in told
    assert told.endswith(
        "profile tuned are for the policy tuned: add --profile paper, or run its chart, cobodeck"
    )


def test_states_of_both_policies_and_of_ones_own_are_told_nothing_of() -> None:
    assert not list(of_other_policy(open_setup("cobodeck")))
    assert not list(of_other_policy(marked(open_setup("cobodeck"), "tuned", "UserLost")))
    away = marked(open_setup("inform"), "paper", "ReachDeep")
    assert not list(of_other_policy(away))  # of states that cannot be entered


def test_values_for_a_chart_whose_twin_is_used_are_told() -> None:
    sets = ["charts.chase.far=5 m", "charts.paper_chase.near=2 m"]

    (told,) = of_other_policy(open_setup(profile="paper", sets=sets))

    assert told.endswith("charts.chase: is not used, but paper_chase; write charts.paper_chase")
    assert not list(of_other_policy(open_setup(profile="tuned", sets=sets[:1])))
