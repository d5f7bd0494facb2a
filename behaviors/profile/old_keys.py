"""Keys and values of profiles that are gone.

They are read with a remark where the policy does what they say, and refused with what there is in
their place where it does not.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from engine.files import plain
from engine.files.declared import Item, gather


@dataclass(frozen=True, slots=True)
class OldKey:
    """A key that is gone, or, with `values`, such values of a key that there still is.

    `said`: by policy what it may say, since that is what the policy does; None: anything, nobody
    reads it.
    """

    instead: str
    said: Mapping[str, Collection[Any]] | None = field(default_factory=dict)
    values: Collection[Any] | None = None


def _switch(paper: Any, tuned: Any) -> OldKey:
    """A switch between the two policies, which say this."""
    return OldKey(
        "the profile's policy and chart choose: paper and paper_cobodeck, or tuned and cobodeck",
        {"paper": (paper,), "tuned": (tuned,)},
    )


def _off(instead: str, *values: Any) -> OldKey:
    """Values that switched something off which the paper's policy does not have."""
    return OldKey(instead, {"paper": values}, values)


_MUST_REACH = "charts.escape.must_reach or charts.paper_escape.must_reach: an Escape ends at a pose"
_SAMPLE = "charts.paper_chase.sample: the seed of a random choice among the cells"
OLD_KEYS: Mapping[str, OldKey] = {
    "escape.view": OldKey(
        "the zones lie ahead of the head", {"paper": ("head",), "tuned": ("head",)}
    ),
    "escape.trigger": _switch("zones", "contact"),
    "escape.predict": _switch(paper=False, tuned=True),
    "escape.order": _switch("given", "earliest"),
    "escape.safe_on_the_way": OldKey(_MUST_REACH, {"paper": (True,), "tuned": (True,)}),
    "chase.view": OldKey(
        "the Chase space lies about the body", {"paper": ("body",), "tuned": ("body",)}
    ),
    "chase.weight": _switch("angle_radius", "time_to_haptic"),
    "chase.pick": OldKey(_SAMPLE, {"paper": ("largest",), "tuned": ("largest",)}),
    "chase.seed": OldKey(_SAMPLE, None),
    "chase.stays": _switch(paper=False, tuned=True),
    "chase.margin": _off("give a length", None),
    "chase.margin_angle": _off("give an angle", None),
    "chase.risk": _off("give one above 0", 0),
    "chase.room": _off("give a length above 0", 0, "0 m"),
    "chase.cornered": _off("give a time above 0", 0, "0 s"),
    "haptic.order": _switch("given", "time"),
    "haptic.close": _off("give the poses", None),
}


def drop_old_keys(own: Item, policy: str, old: Mapping[str, OldKey] = OLD_KEYS) -> None:
    """Drop what is gone from one layer of a profile of this policy, each with a remark.

    Raises:
        FileError: a key says something else than the policy does.
    """
    gather(partial(_drop, own, key, about, policy) for key, about in old.items())


def _drop(own: Item, key: str, old: OldKey, policy: str) -> None:
    found = own.inner(key)
    value = plain(found.value)
    if found.key != key or (old.values is not None and value not in old.values):
        return
    if old.said is not None and value not in old.said.get(policy, ()):
        raise found.error(f"{_shown(value)} is gone", old.instead)
    read = "nobody reads it" if old.said is None else f"the policy {policy} does so anyway"
    found.note(f"{_shown(value)} is gone; {read}", old.instead)
    section, _, name = key.rpartition(".")
    del own.inner(section).value[name]


def _shown(value: Any) -> str:
    """A value as messages show it."""
    return "null" if value is None else repr(value)
