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


OLD_KEYS: Mapping[str, OldKey] = {}


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
        raise found.error(f"{value!r} is gone", old.instead)
    found.note(f"is gone; the policy {policy} does so anyway", old.instead)
    section, _, name = key.rpartition(".")
    del own.inner(section).value[name]
