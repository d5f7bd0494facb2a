"""The conditions of concurrency containers, and what happens where none of them matches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import product
from math import prod
from typing import Any

from cobodeck.flexbe.names import outcome_name

NO_CONDITION = "no_condition"
"""How a container ends when all its states have ended and no condition matches."""
MOST = 256
"""Combinations that are looked at one by one."""

_Rule = dict[str, Any]


def rules_of(
    conditions: Iterable[Any],
    names: Mapping[str, str],
    can_end: Mapping[str, Iterable[str]],
    note: Callable[[str], None],
) -> list[_Rule]:
    """The conditions that can come true, in order, and a rule for all that they leave open.

    `names`: the chart's names of the children; `can_end`: how each can end.
    """
    rules: list[_Rule] = []
    for outcome, several in conditions:
        pairs = [(names.get(child, child), outcome_name(end)) for child, end in several]
        wanted = dict(pairs)
        never = [
            (name, end)
            for name, end in pairs
            if end not in can_end.get(name, ()) or wanted[name] != end
        ]
        if never:
            what = f"{never[0][0]} can never end with {never[0][1]!r}"
            what += " as well" if len(wanted) < len(pairs) else ""
            note(f"a condition for {outcome!r} is left out: {what}")
        elif any(rule["if"].items() <= wanted.items() for rule in rules):
            note(f"a condition for {outcome!r} never matches first; left out")
        elif wanted:
            rules.append({"outcome": outcome_name(outcome), "if": wanted})
    further = uncovered_rules(rules, can_end)
    for rule in further:
        shown = ", ".join(f"{child}: {end}" for child, end in rule["if"].items())
        note(f"no condition for {shown}: {NO_CONDITION!r} ends it")
    return [*rules, *further]


def uncovered_rules(rules: Sequence[_Rule], can_end: Mapping[str, Iterable[str]]) -> list[_Rule]:
    """Rules for the combinations of outcomes that no rule matches.

    FlexBE then waits for ever. Where there are more than `MOST` combinations, the rules are for
    each outcome of the first state alone, and end the container sooner.
    """
    ends = {name: list(outcomes) for name, outcomes in can_end.items()}
    ends = {name: outcomes for name, outcomes in ends.items() if outcomes}
    conditions = [rule["if"].items() for rule in rules]
    if not ends:
        return []
    if prod(map(len, ends.values())) > MOST:
        return _of_one_state(ends, conditions)
    found = []
    for combination in product(*ends.values()):
        together = dict(zip(ends, combination, strict=True))
        if not any(wanted <= together.items() for wanted in conditions):
            found.append({"outcome": NO_CONDITION, "if": together})
    return found


def _of_one_state(ends: Mapping[str, list[str]], conditions: Iterable[Any]) -> list[_Rule]:
    """Rules that cover everything: one state's outcomes, unless each has a condition alone."""
    alone = {pair for wanted in conditions if len(wanted) == 1 for pair in wanted}
    for name, outcomes in ends.items():
        if all((name, outcome) in alone for outcome in outcomes):
            return []
    name, outcomes = next(iter(ends.items()))
    return [
        {"outcome": NO_CONDITION, "if": {name: outcome}}
        for outcome in outcomes
        if (name, outcome) not in alone
    ]
