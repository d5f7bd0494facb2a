"""Runs the evaluation, and puts together all that it says, by names in JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict
from typing import Any

from cobodeck.campaign import CampaignCell, CellResult, execute
from cobodeck.paper.arm_times import arm_times
from cobodeck.paper.claims import claims
from cobodeck.paper.comparison import on_routes, on_study
from cobodeck.paper.conditions import CONDITIONS, PARTS, SCENE, EvaluationPlan, varied_values
from cobodeck.paper.rooms import rooms
from cobodeck.setup import FULL, profile_with
from cobodeck.terminal import FAILED, Problem

Progress = Callable[[str, float | None], None]
Figures = Mapping[str, Any]


def evaluate(
    plan: EvaluationPlan,
    execution: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    varied: Sequence[tuple[str, ...]] | None = None,
) -> dict[str, Any]:
    """All of section 5; the same for the same `plan`, however it is executed.

    Args:
        plan: what to evaluate.
        execution: arguments of `campaign.execute`, such as the number of workers, or the store.
        progress: called with text and the share done, 0 to 1.
        varied: sets of values of the profile, to see what differences depend on; None: those
            of the profile's policy.

    Raises:
        Problem: a run failed, or cannot run.
    """
    varied = varied_values(plan.profile) if varied is None else varied
    found = _figures(plan.cells(varied), execution or {}, progress)
    conditions = {name: _condition(plan.cell(name), found[plan.cell(name)]) for name in CONDITIONS}
    routes = {
        name: [found[plan.route(name, number)] for number in range(plan.seeds)]
        for name in CONDITIONS
    }
    result: dict[str, Any] = {
        "plan": asdict(plan),
        "conditions": conditions,
        "statistics": {"study": on_study(conditions), "routes": on_routes(routes)},
        "rooms": rooms(SCENE),
        "causes": [_varied(plan, sets, found) for sets in varied],
        "arm_times": arm_times(SCENE, plan.profile),
        "parts": _parts(plan, found),
    }
    return result | {"claims": claims(result)}


def _figures(
    cells: Iterable[CampaignCell], execution: Mapping[str, Any], progress: Progress | None
) -> dict[CampaignCell, dict[str, Any]]:
    """The figures of all cells; without those of signals, which are not about the person."""
    wanted = list(dict.fromkeys(cells))
    found: dict[CampaignCell, dict[str, Any]] = {}
    with closing(execute(wanted, **execution)) as results:
        for result in results:
            found[result.cell] = _succeeded(result)
            if progress is not None:
                progress(f"{len(found)} of {len(wanted)} runs", len(found) / len(wanted))
    return found


def _succeeded(result: CellResult) -> dict[str, Any]:
    if result.figures is None:
        run = result.cell.chart or result.cell.profile
        raise Problem(f"{run} failed: {result.failure}", FAILED)
    return {name: value for name, value in result.figures.items() if name != "signals"}


def _condition(cell: CampaignCell, figures: Figures) -> dict[str, Any]:
    """The figures of a run, with the parts that it was run with."""
    profile = profile_with(cell.profile, cell.sets)
    drives = profile.navigation.haptic
    return {
        **figures,
        "planner": drives.planner,
        "local_planner": drives.local_planner,
        "localizer": profile.localization if cell.tier >= FULL else "ideal pose",
    }


SHORT = ("requests", "served", "response_s", "arm_s", "distance_m", "escapes", "escape_failures",
         "escape_time_s", "contacts", "contacts_by_robot")  # fmt: skip
"""The figures of runs that only explain others."""


def _varied(
    plan: EvaluationPlan, sets: tuple[str, ...], found: Mapping[CampaignCell, Figures]
) -> dict[str, Any]:
    runs = {name: found[plan.varied(name, sets)] for name in CONDITIONS}
    return {
        "sets": list(sets),
        "conditions": {name: {key: run[key] for key in SHORT} for name, run in runs.items()},
    }


def _parts(plan: EvaluationPlan, found: Mapping[CampaignCell, Figures]) -> list[dict[str, Any]]:
    """The conditions once more with other parts; empty if that was not asked for."""
    if not plan.parts_requests:
        return []
    return [
        {
            "name": name,
            "conditions": {
                condition: _explained(cell, found[cell])
                for condition in CONDITIONS
                for cell in (plan.other_parts(condition, name),)
            },
        }
        for name in PARTS
    ]


def _explained(cell: CampaignCell, figures: Figures) -> dict[str, Any]:
    kept = ("tier", "planner", "local_planner", "localizer", "localization", *SHORT, "refusals")
    all_figures = _condition(cell, figures)
    return {key: all_figures[key] for key in kept}
