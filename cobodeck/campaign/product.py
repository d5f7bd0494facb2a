"""The cells of a campaign, and the check that all its values exist."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

from behaviors.profile import load_profile
from cobodeck.campaign.campaign_file import AxisValue, CampaignAxis, CampaignFile
from cobodeck.campaign.cell import CampaignCell
from cobodeck.campaign.cell_run import CellRunner
from cobodeck.project import open_chart
from cobodeck.setup import open_place
from cobodeck.terminal import Problem
from engine.files import written_text
from engine.files.declared import Item, gather, record
from hw.model import load_robot

Axes = tuple[CampaignAxis, ...]


def cells_of(campaign: CampaignFile, most: int | None = None) -> list[CampaignCell]:
    """All cells, or `most` of them, evenly chosen."""
    numbers = range(campaign.first_seed, campaign.first_seed + campaign.seeds)
    axes = campaign.axes()
    found = [
        replace(_cell(axes, chosen), repetition=number, judge=campaign.judge)
        for chosen in product(*(axis.choices for axis in axes))
        for number in numbers
    ]
    if most is None or most >= len(found):
        return found
    return [found[n * len(found) // most] for n in range(most)]


def value_of(cell: CampaignCell, axis: CampaignAxis) -> Any:
    """The value that a cell has on an axis; of `sets` and `inputs` as text."""
    found = getattr(cell, axis.field)
    if axis.key is None:
        return found
    pairs = (text.partition("=") for text in found)
    return next(value for key, _, value in pairs if key == axis.key)


def check_campaign(item: Item, runner: CellRunner) -> CampaignFile:
    """A campaign whose values all exist: each is tried alone, and in a run beside first values.

    Raises:
        FileError: every mistake in it, at the value.
    """
    campaign = record(item, CampaignFile)
    axes = campaign.axes()
    for fields in (("chart", "scene", "robot", "profile"), ("sets", "user")):  # these need those
        gather(
            partial(_refer, choice.item, partial(_open, axis, choice, axes, runner))
            for axis in axes
            for choice in axis.choices
            if axis.field in fields
        )
    first = [axis.choices[0] for axis in axes]
    _refer(item, partial(runner.check, _cell(axes, first)))
    gather(
        partial(_refer, choice.item, partial(runner.check, cell))
        for choice, cell in _neighbours(axes, first)
    )
    return campaign


def _cell(axes: Axes, chosen: Iterable[AxisValue]) -> CampaignCell:
    values: dict[str, Any] = {}
    for axis, choice in zip(axes, chosen, strict=True):
        if axis.key is None:
            values[axis.field] = choice.value
        else:
            text = f"{axis.key}={written_text(choice.value)}"
            values[axis.field] = (*values.get(axis.field, ()), text)
    return CampaignCell(**values)


def _neighbours(axes: Axes, first: list[AxisValue]) -> Iterator[tuple[AxisValue, CampaignCell]]:
    """The cells that differ from the first one in one value."""
    for n, axis in enumerate(axes):
        for choice in axis.choices[1:]:
            yield choice, _cell(axes, [*first[:n], choice, *first[n + 1 :]])


def _open(axis: CampaignAxis, choice: AxisValue, axes: Axes, runner: CellRunner) -> None:
    """Open what a value names; a person in the first scene, a `set` on the first profile."""
    if axis.field == "chart":
        open_chart(choice.value, runner.known)
    elif axis.field == "scene":
        open_place(choice.value)
    elif axis.field == "robot":
        load_robot(choice.value)
    elif axis.field == "profile":
        load_profile(choice.value)
    else:
        beside = tuple(found for found in axes if found.field in ("scene", "profile"))
        chosen = [*(found.choices[0] for found in beside), choice]
        runner.address(_cell((*beside, axis), chosen))


def _refer(item: Item, load: Callable[[], object]) -> None:
    try:
        item.refer(load)
    except Problem as problem:
        raise item.error(str(problem)) from None
