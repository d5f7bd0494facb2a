"""Campaign files: runs over all combinations of values.

    campaign: small
    about: what it is good for
    scene: [lab_a, lab_b]            # each key holds one value or a list of them
    user: random
    set: {chase.risk: [3, 6]}        # of the profile, by dotted key
    in: {goal: [{x: 1 m, y: 2 m}]}   # inputs of the chart
    requests: 1
    seeds: 6                         # runs of each combination that differ by chance alone
    expect: {contacts_by_robot: 0, escape_failures: 5 %}

The cells are the product of all values, in the order of the keys of `CampaignFile`, the last one
varying fastest, and then of the seeds. A list is always a list of values: a value that is a list
itself stands in another one, `[[1, 2]]`. `expect` limits totals, or shares in percent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from engine.files import Duration, Seq, plain, written_text
from engine.files.declared import (
    Count,
    Fault,
    Item,
    Mismatch,
    Name,
    Range,
    Written,
    above_0,
    find_file,
    gather,
    known_files,
    load_yaml,
    number,
    reader_of,
    record,
    whole,
)

FOLDER = Path(__file__).parent / "files"
MOST = 1_000_000
"""Cells of a campaign at most."""
SHARE_OF: Mapping[str, str] = {
    "unserved": "requests",
    "contacts": "requests",
    "contacts_by_robot": "requests",
    "escape_failures": "escapes",
}
"""Totals that are told as a share of another one, too."""


@dataclass(frozen=True, slots=True)
class AxisValue:
    """A value of a key, and where it is written."""

    value: Any
    item: Item = field(repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class Limit:
    """The highest total that is expected, or the highest share, 0 to 1."""

    value: float
    is_share: bool = False

    def __str__(self) -> str:
        return f"{100.0 * self.value:g} %" if self.is_share else f"{self.value:g}"


def _either(read: Callable[[Item], Any]) -> Callable[[Item], tuple[AxisValue, ...]]:
    """The reader of one value or of a list of values."""

    def read_choices(item: Item) -> tuple[AxisValue, ...]:
        items = item.items() if isinstance(item.value, Seq) else [item]
        if not items:
            raise item.error("is an empty list; at least one value is needed")
        values = gather(partial(read, each) for each in items)
        seen: set[str] = set()
        for value, each in zip(map(written_text, values), items, strict=True):
            if value in seen:
                raise each.error(f"{value} is given twice; keep one of them")
            seen.add(value)
        return tuple(map(AxisValue, values, items))

    return read_choices


def _limit(item: Item) -> Limit:
    try:
        if isinstance(item.value, str):
            share = number(item.value, "ratio")
            Range(0.0, 1.0).require(share, "ratio")
            return Limit(share, is_share=True)
        total = whole(item.value)
        Range(0, math.inf).require(total)
    except Mismatch as mismatch:
        raise item.error(f"{mismatch}; 3 is a total, 5 % a share") from None
    return Limit(total)


_ONE = Count(1)
_Count = Annotated[int, Range(1, MOST)]
_Tier = Literal[0, 1, 2, 3]
_Span = Annotated[Duration, above_0(1e7)]
_NAMES, _COUNTS = _either(Item.target), _either(reader_of(_Count))
_TIERS, _SPANS = _either(reader_of(_Tier)), _either(reader_of(_Span))
_ANY = _either(lambda item: plain(item.value))

AxisValues = tuple[AxisValue, ...]
Names = Annotated[AxisValues, _NAMES, Written(str | Annotated[tuple[str, ...], _ONE])]
Counts = Annotated[AxisValues, _COUNTS, Written(_Count | Annotated[tuple[_Count, ...], _ONE])]
Tiers = Annotated[
    AxisValues,
    _TIERS,
    Written(
        {
            "type": ["integer", "array"],
            "minimum": 0,
            "maximum": 3,
            "minItems": 1,
            "items": {"enum": [0, 1, 2, 3]},
        }
    ),
]
Spans = Annotated[AxisValues, _SPANS, Written(_Span | Annotated[tuple[_Span, ...], _ONE])]
Values = Mapping[str, Annotated[AxisValues, _ANY, Written(Item)]]
Most = Annotated[Limit, _limit, Written(Annotated[int, Range(0.0, math.inf)] | str)]


@dataclass(frozen=True, slots=True)
class Expected:
    """The highest totals of a campaign, 3, or shares, 5 %; of requests if nothing else is said."""

    contacts: Most | None = None
    """Contacts of robot and person; a share is of all requests."""
    contacts_avoidable: Most | None = None
    """Contacts that a search of motions avoids (`judge: true`)."""
    contacts_by_robot: Most | None = None
    """Contacts into which the robot moved; a share is of all requests."""
    unserved: Most | None = None
    """Requests that were not served; a share is of all requests."""
    escape_failures: Most | None = None
    """Escapes that failed; a share is of all Escapes."""
    hits: Most | None = None
    """Walls and objects that held the robot."""
    errors: Most | None = None
    """Errors of states and parts."""
    stuck_s: Most | None = None
    """Seconds for which drives came to nothing at one place, one after the other."""

    def faults(self) -> Iterator[Fault]:
        """Shares of what there is no share of, by key."""
        for name, limit in self.limits().items():
            if limit.is_share and name not in SHARE_OF:
                yield name, f"{limit} is a share; give a total, such as 0"

    def limits(self) -> dict[str, Limit]:
        """What is expected, by name."""
        found = {name: getattr(self, name) for name in self.__slots__}
        return {name: limit for name, limit in found.items() if limit is not None}


@dataclass(frozen=True, slots=True)
class CampaignAxis:
    """The values of a field of cells; `key`: of one of its `sets` or `inputs`."""

    field: str
    key: str | None
    choices: AxisValues

    @property
    def name(self) -> str:
        """What tables call it."""
        return self.key or self.field


FIELDS: Mapping[str, str] = {
    "chart": "chart",
    "scene": "scene",
    "robot": "robot",
    "profile": "profile",
    "set": "sets",
    "in_": "inputs",
    "tick_hz": "tick_hz",
    "user": "user",
    "tier": "tier",
    "requests": "requests",
    "duration": "duration_s",
}
"""The fields of a cell by those of a file."""


@dataclass(frozen=True, slots=True)
class CampaignFile:
    """Many runs over all combinations of values: most keys hold one value or a list of them."""

    campaign: Name
    """Its name."""
    about: str = ""
    """What it is good for."""
    chart: Names = ()
    """Charts by name or file; by default the profile's."""
    scene: Names = ()
    """Scenes by name or file; by default lab_a."""
    robot: Names = ()
    """Robots by name or file; by default the scene's."""
    profile: Names = ()
    """Profiles by name or file; by default tuned."""
    set: Values = field(default_factory=dict)
    """Values of the profile by dotted key, as in {chase.risk: [3, 6]}."""
    in_: Values = field(default_factory=dict)
    """Values of the chart's inputs."""
    tick_hz: Counts = ()
    """Ticks per second; by default 30."""
    user: Names = ()
    """Persons as `simulate --user` takes them; by default the scene's."""
    tier: Tiers = ()
    """0: logic alone; 1: reduced; 2: with all sensors; 3: with physics, too; by default 1."""
    requests: Counts = ()
    """A run ends after so many requests; by default with its chart or its duration."""
    duration: Spans = ()
    """Longest simulated time; by default an hour, or three minutes per request if that is more."""
    judge: bool = False
    """Find out how many contacts could have been avoided: runs with contacts are judged."""
    seeds: _Count = 1
    """Runs of each combination, which differ by chance alone."""
    first_seed: Annotated[int, Range(0, MOST)] = 0
    """The number of the first of them, to go on where another campaign has ended."""
    expect: Expected = Expected()
    """The highest totals, `0`, or shares, `5 %`, of all runs; beyond them the exit code is 1."""

    def faults(self) -> Iterator[Fault]:
        """More cells than anybody can run, expectations that nothing can meet, by key."""
        cells = self.seeds * math.prod(len(axis.choices) for axis in self.axes())
        if cells > MOST:
            yield "campaign", f"has {cells:,} cells; {MOST:,} are allowed"
        if self.expect.contacts_avoidable is not None and not self.judge:
            yield "expect.contacts_avoidable", "is found out only with judge: true"

    def axes(self) -> tuple[CampaignAxis, ...]:
        """The keys with values, in their order; those of `set` and `in` one by one."""
        found = []
        for name, of_cells in FIELDS.items():
            values = getattr(self, name)
            keyed = values if isinstance(values, Mapping) else {None: values}
            found += [CampaignAxis(of_cells, key, choices) for key, choices in keyed.items()]
        return tuple(axis for axis in found if axis.choices)


def load_campaign(name_or_path: str | Path) -> CampaignFile:
    """A campaign by name or by file; that its values exist is checked by `check_campaign`.

    Raises:
        FileError: every mistake in it.
    """
    path = find_file(str(name_or_path), FOLDER, "campaign")
    return load_yaml(path, lambda item: record(item, CampaignFile))


def campaign_names() -> tuple[str, ...]:
    """Names of the shipped campaigns and of the project's own."""
    return tuple(known_files(FOLDER, "campaign"))
