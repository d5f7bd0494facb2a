"""The layers that a profile is merged from: its base, its own file, single values on top.

    profile: mine
    base: tuned              # by name, or a path from this file's folder; may have a base itself
    chase: {inner: 2.6 m}    # what differs

A profile that names no base rests on the shipped one of its policy, and so one that was complete
once still is; the shipped profiles rest on `base.yaml`.

Mappings are merged key by key; lists and plain values are replaced. `KEY=VALUE`, as in
`chase.inner=2.6 m`, is one more layer on top; VALUE is YAML.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any

from behaviors.profile.old_keys import drop_old_keys
from behaviors.profile.settings import POLICIES
from engine.files import ANYWHERE, Map, Place, assignment, instead, mistake, noting
from engine.files.declared import Item, find_file, load_yaml, merged, single

FOLDER = Path(__file__).parent.parent.parent / "charts" / "profiles"
BASE = FOLDER / "base.yaml"
"""What the shipped profiles share: the base of each, and no profile to run."""
NO_PROFILE = (
    "is what they share, and no profile to run",
    "choose one of paper, tuned, or one of your own with 'base: tuned'",
)
HEAD = ("profile", "about", "base")
"""Keys that describe one file; they are not inherited."""
FIXED = (*HEAD, "policy", "chart")
"""Keys that say what a profile is; `KEY=VALUE` cannot set them, and charts cannot pick them."""
SET = "--set "
"""What the places of single values on top begin with, in place of a file."""


@dataclass(frozen=True)
class Layers:
    """The values of a profile as one mapping, `item`; `texts` are those it was made from.

    `about`: how the file differs from its base.
    """

    item: Item
    about: str
    texts: tuple[str, ...]

    @property
    def sha256(self) -> str:
        """Hash of all the texts."""
        return hashlib.sha256("\0".join(self.texts).encode()).hexdigest()

    @property
    def values(self) -> dict[str, Any]:
        """Every plain value and list as written, by its dotted key, without the keys of `FIXED`."""
        return {key: value for key, value in _leaves(self.item) if key not in FIXED}

    @property
    def places(self) -> dict[str, Place]:
        """The position of each key in its file, by its dotted name."""
        return dict(_places(self.item))


def layered(own: Item, sets: Sequence[str] = ()) -> Layers:
    """A profile's file merged with its base, and with single values on top; not yet checked.

    Raises:
        FileError: the base does not exist, is not YAML, or leads back to a profile above it; a
            text is not KEY=VALUE.
    """
    found = _on_base(own, ())
    policy = str(found.item.mapping()["policy"].value)
    item = reduce(merged, (_setting(text, policy) for text in sets), found.item)
    # keys missing in all layers are reported for the file, not for the last value set
    item = dataclasses.replace(item, source=own.source, at=own.at)
    return dataclasses.replace(found, item=item, texts=(*found.texts, *sets))


def _on_base(own: Item, above: tuple[Path, ...]) -> Layers:
    file = Path(own.source.file).resolve()
    if file == BASE.resolve():
        return Layers(own, "", (own.source.text,))
    if "base" in own.mapping():
        name, base = _named_base(own, (*above, file))
    elif file.parent == FOLDER.resolve():
        name, base = BASE.stem, _beneath_shipped(own, file)
    else:
        name = _policy_of_own(own)
        base = load_yaml(FOLDER / f"{name}.yaml", lambda item: _on_base(item, ()))
    for key in HEAD:
        base.item.value.pop(key, None)
    drop_old_keys(own, _policy(own, base.item))
    about = f"as {name}, but for {', '.join(_own_keys(own))}"
    return Layers(merged(base.item, own), about, (*base.texts, own.source.text))


def _named_base(own: Item, here: tuple[Path, ...]) -> tuple[str, Layers]:
    named = own.mapping()["base"]
    file = named.refer(lambda: find_file(named.target(), FOLDER, "profile"))
    if file.resolve() == BASE.resolve():
        raise named.error(*NO_PROFILE)
    if file.resolve() in here:
        chain = " -> ".join(path.name for path in (*here, file))
        raise named.error(f"the bases lead back to this profile: {chain}")
    return str(named.value), named.refer(lambda: load_yaml(file, lambda item: _on_base(item, here)))


def _beneath_shipped(own: Item, file: Path) -> Layers:
    """The base of a shipped profile; if a record has it in other words, on what it says today."""
    base = load_yaml(BASE, lambda item: _on_base(item, ()))
    with instead({}), noting():
        today = load_yaml(file, lambda item: item)
        if today.source.text == own.source.text:
            return base
        now = load_yaml(file, lambda item: _on_base(item, ()))
    return dataclasses.replace(base, item=merged(now.item, base.item))


def _policy_of_own(own: Item) -> str:
    """The policy of a profile that names no base: as it says, or of its name; else the first."""
    content = own.mapping()
    said = (content[key].value for key in ("policy", "profile") if key in content)
    return next((str(name) for name in said if name in POLICIES), POLICIES[0])


def _policy(own: Item, base: Item) -> str:
    """The policy that a layer says, or its base does."""
    content = own.mapping()
    said = content.get("policy") or base.mapping()["policy"]
    return str(said.value)


def _own_keys(own: Item) -> list[str]:
    return [key for key, _ in _leaves(own) if key not in HEAD] or ["nothing"]


def _setting(text: str, policy: str) -> Item:
    """`KEY=VALUE` as a mapping; its mistakes are reported for the text as a whole."""
    key, source = assignment(text, "--set", "chase.inner=2.6 m")
    if key in FIXED:
        hint = "choose another file with --profile"
        raise mistake(source.file, f"{key!r} cannot be set", hint=hint)
    found = single(key, Item(source, source.value, ANYWHERE))
    drop_old_keys(found, policy)
    return found


def _leaves(item: Item) -> Iterator[tuple[str, Any]]:
    for inner in item.mapping().values():
        if isinstance(inner.value, Map):
            yield from _leaves(inner)
        else:
            yield inner.key, inner.value


def _places(item: Item) -> Iterator[tuple[str, Place]]:
    for inner in item.mapping().values():
        yield inner.key, inner.place
        if isinstance(inner.value, Map):
            yield from _places(inner)
