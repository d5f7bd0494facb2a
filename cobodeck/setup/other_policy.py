"""Whether a chart and a profile go together: the paper's decisions, or ours."""

from __future__ import annotations

from collections.abc import Iterator

from cobodeck.setup.setup import Setup, reachable


def of_other_policy(setup: Setup) -> Iterator[str]:
    """A remark if the chart can enter states of another policy than the profile's."""
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
