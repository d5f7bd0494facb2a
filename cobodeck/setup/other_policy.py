"""Whether a chart and a profile go together: the paper's decisions, or ours."""

from __future__ import annotations

from collections.abc import Iterator

from cobodeck.project import reached
from cobodeck.setup.setup import Setup, reachable


def of_other_policy(setup: Setup) -> Iterator[str]:
    """A remark if the chart can enter states of another policy than the profile's.

    And one for each chart that the profile has values for and that has a twin of its policy, which
    is the one that is used.
    """
    yield from _states(setup)
    used = reached({setup.chart.name}, setup.library)
    for name in setup.profile.charts:
        twin = f"{setup.profile.policy}_{name}"
        if name not in used and twin in used:
            at = setup.profile.places[f"charts.{name}"]
            yield f"{at}: charts.{name}: is not used, but {twin}; write charts.{twin}"


def _states(setup: Setup) -> Iterator[str]:
    profile, classes = setup.profile, setup.catalogue.classes
    others: dict[str, str] = {}
    for leaf in reachable(setup.machine()):
        name = leaf.interface.name
        policy = getattr(classes.get(name), "policy", profile.policy)
        if policy != profile.policy:
            others[name] = policy
    if others:
        policy = next(iter(others.values()))
        yield (
            f"chart {setup.chart.name} decides as the policy {policy} does ({', '.join(others)}), "
            f"but the values of profile {profile.name} are for the policy {profile.policy}: add "
            f"--profile {policy}, or run its chart, {profile.chart}"
        )
