"""Where the outcomes of a state lead, and which level of autonomy they ask for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from cobodeck.flexbe.behaviour import Json
from cobodeck.flexbe.converting.told import ChartFindings
from cobodeck.flexbe.names import outcome_name

_LEVELS = ("off", "low", "high", "full")


def next_of(
    state: Json, path: str, names: Mapping[str, str], possible: Iterable[str], told: ChartFindings
) -> dict[str, str]:
    """Where the outcomes of a child of a sequence lead.

    `names`: the chart's names of the children; `possible`: how the child can end.
    """
    found = {}
    for outcome, target in state.get("transitions", {}).items():
        if outcome_name(outcome) not in possible:
            told.note(path, f"outcome {outcome!r} can never come; left out")
            continue
        if outcome_name(outcome) in found:
            told.left(path, f"outcome {outcome!r} is {outcome_name(outcome)!r} as another")
            continue
        leads_on = names.get(target)
        found[outcome_name(outcome)] = leads_on or f".{outcome_name(target)}"
    for outcome in possible:
        if outcome not in found:
            told.note(path, f"outcome {outcome!r} leads nowhere in FlexBE; it ends the chart")
            found[outcome] = f".{outcome}"
    return found


def levels_of(state: Json) -> dict[str, str]:
    """The levels of a state's outcomes, in small letters; without those that inherit it."""
    found = {o: level.rpartition(".")[2].lower() for o, level in state.get("autonomy", {}).items()}
    return {o: level for o, level in found.items() if level in _LEVELS}
