"""Checks the items of `when` against all combinations of outcomes (S06, S07, S12)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from engine.chart import Rule
from engine.check.checked_chart import CheckedChart, PlacedNode

MOST_STEPS = 20_000  # conditions examined, on top of 20 per condition, before giving up
MOST_COMPARED = 300  # earlier items that each item is compared with, at most
MOST_SHOWN = 8  # children of a combination named in a message

Conditions = Mapping[str, str]  # child -> outcome


def check_rules(checked: CheckedChart) -> None:
    """Check all containers that keep outcomes."""
    for placed in checked.nodes:
        if placed.node.keeps and placed.children:
            kept = {child.node.name: child.kept() for child in placed.children}
            ends = {child.node.name: child.ends for child in placed.children}
            known = all(
                name in ends and outcome in ends[name]
                for rule in placed.node.when
                for name, outcome in rule.conditions.items()
            )
            if known:
                placed.rules = _matching(checked, placed, kept)
                _check_covered(checked, placed, kept)


def _matching(
    checked: CheckedChart, placed: PlacedNode, kept: Mapping[str, Sequence[str]]
) -> list[Rule]:
    """The items that can match before all others; S07 for the rest."""
    found: list[Rule] = []
    for rule in placed.node.rules:
        conditions = rule.conditions.items()
        lost = [name for name, outcome in conditions if outcome not in kept[name]]
        earlier = (
            other for other in found[:MOST_COMPARED] if other.conditions.items() <= conditions
        )
        first = next(earlier, None)
        if lost:
            message = f"this can never match: {lost[0]!r} ends the container with it"
            checked.warning("S07", message, rule.at, "leave it out")
        elif first is not None:
            message, related = "this can never match", (first.at, "this matches first")
            checked.warning("S07", message, rule.at, "leave it out, or put it above", related)
        else:
            found.append(rule)
    return found


def _check_covered(
    checked: CheckedChart, placed: PlacedNode, kept: Mapping[str, Sequence[str]]
) -> None:
    """S06: an item matches for every combination of the children's outcomes."""
    domains = {name: list(outcomes) for name, outcomes in kept.items() if outcomes}
    rules = [rule.conditions for rule in placed.rules]
    if not domains or not all(rules):  # `all` alone waits for every child
        never = [name for name, outcomes in kept.items() if not outcomes]
        if domains and never:
            message = f"'all' never ends: the outcome of {never[0]!r} is never kept"
            checked.error("S06", message, placed.node.at, "add a `when` that says what ends it")
        return
    try:
        missed = uncovered(domains, rules)
    except TooLarge:
        message = "too many items and children to check whether every combination is covered"
        checked.error("S12", message, placed.node.at, "split the container")
        return
    if missed is not None:
        pairs = [f"{name}: {outcome}" for name, outcome in missed.items()]
        shown = ", ".join(pairs[:MOST_SHOWN]) + (", …" if len(pairs) > MOST_SHOWN else "")
        message = "no item of 'when' matches if all have ended with this"
        at = placed.node.raw.keys_at.get("when", placed.node.at)
        checked.error("S06", f"{message}: {shown}", at, f"`- {{outcome: …, if: {{{shown}}}}}`")


class TooLarge(Exception):
    """More than `MOST_STEPS` steps would be needed."""


def uncovered(
    domains: Mapping[str, Sequence[str]], rules: Sequence[Conditions]
) -> dict[str, str] | None:
    """A combination with one outcome of each child that no rule matches; `None` if there is none.

    Raises:
        TooLarge: it cannot be decided in reasonable time. The problem is as hard as telling whether
            a formula in disjunctive normal form is a tautology (co-NP-complete).
    """
    search = _Search(MOST_STEPS + 20 * sum(map(len, rules)))
    found = search.split({name: list(outcomes) for name, outcomes in domains.items()}, rules)
    if found is None:
        return None
    return {name: found.get(name, domains[name][0]) for name in domains}


class _Search:
    """Case analysis over one child at a time, keeping only the rules that can still match."""

    def __init__(self, steps: int) -> None:
        self.steps_left = steps

    def split(
        self, domains: dict[str, list[str]], rules: Sequence[Conditions], depth: int = 0
    ) -> dict[str, str] | None:
        """A combination of `domains` that none of `rules` matches."""
        simple = self._simplify(domains, rules)
        if simple is None:
            return None
        if not simple:
            return {name: outcomes[0] for name, outcomes in domains.items()}
        self.steps_left -= len(domains)
        if depth > 200:
            raise TooLarge
        name, outcome = next(iter(min(simple, key=len).items()))
        others = [other for other in domains[name] if other != outcome]
        for part in (others, [outcome]):
            found = self.split({**domains, name: part}, simple, depth + 1)
            if found is not None:
                return found
        return None

    def _simplify(
        self, domains: dict[str, list[str]], rules: Sequence[Conditions]
    ) -> list[Conditions] | None:
        """The rules without the conditions that are certain to hold; `None` if one always matches.

        A rule with a single open condition removes that outcome from its child's domain.
        """
        while True:
            left: list[Conditions] = []
            narrowed = False
            for rule in rules:
                self.steps_left -= len(rule)
                if self.steps_left < 0:
                    raise TooLarge
                open_conditions = _open(rule, domains)
                if open_conditions is None:
                    continue
                if not open_conditions:
                    return None
                if len(open_conditions) == 1:
                    ((name, outcome),) = open_conditions.items()
                    domains[name] = [other for other in domains[name] if other != outcome]
                    narrowed = True
                else:
                    left.append(open_conditions)
            if not narrowed:
                return left
            rules = left


def _open(rule: Conditions, domains: Mapping[str, Sequence[str]]) -> Conditions | None:
    """The conditions of a rule that may or may not hold; `None` if one of them cannot hold."""
    found = {}
    for name, outcome in rule.items():
        if outcome not in domains[name]:
            return None
        if len(domains[name]) > 1:
            found[name] = outcome
    return found
