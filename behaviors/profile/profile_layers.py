"""The layers that a profile is merged from: its base, its own file, single values on top.

    profile: mine
    base: tuned              # by name, or a path from this file's folder; may have a base itself
    chase: {inner: 2.6 m}    # what differs

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
from engine.files import ANYWHERE, Map, Place, assignment, mistake
from engine.files.declared import Item, find_file, load_yaml, merged, single

FOLDER = Path(__file__).parent.parent.parent / "charts" / "profiles"
BASE = FOLDER / "base.yaml"
"""What the shipped profiles share: the base of each, and no profile to run."""
HEAD = ("profile", "about", "base")
"""Keys that describe one file; they are not inherited."""
FIXED = (*HEAD, "policy", "chart")
"""Keys that say what a profile is; `KEY=VALUE` cannot set them, and charts cannot pick them."""
SET = "--set "
"""What the places of single values on top begin with, in place of a file."""


@dataclass(frozen=True)
class Layers:
    """The values of a profile as one mapping, `item`; `texts` are those it was made from.

    `about`: how the file differs from its base; empty without a base.
    """

    item: Item
    about: str
    texts: tuple[str, ...]

    @property
    def sha256(self) -> str:
        """Hash of all the texts; without other layers, the hash of the file's text."""
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
    policy = _policy(found.item)
    item = reduce(merged, (_setting(text, policy) for text in sets), found.item)
    # keys missing in all layers are reported for the file, not for the last value set
    item = dataclasses.replace(item, source=own.source, at=own.at)
    return dataclasses.replace(found, item=item, texts=(*found.texts, *sets))


def _on_base(own: Item, above: tuple[Path, ...]) -> Layers:
    content = own.mapping()
    text = own.source.text
    if "base" not in content:
        drop_old_keys(own, _policy(own))
        return Layers(own, "", (text,))
    named = content["base"]
    here = (*above, Path(own.source.file).resolve())
    file = named.refer(lambda: _base_file(own, named.target()))
    if file.resolve() in here:
        chain = " -> ".join(path.name for path in (*here, file))
        raise named.error(f"the bases lead back to this profile: {chain}")
    base = named.refer(lambda: load_yaml(file, lambda item: _on_base(item, here)))
    for key in HEAD:
        base.item.value.pop(key, None)
    drop_old_keys(own, _policy(own, base.item))
    about = f"as {named.value}, but for {', '.join(_own_keys(own))}"
    return Layers(merged(base.item, own), about, (*base.texts, text))


def _base_file(own: Item, name: str) -> Path:
    """The file that is named as the base; that of a shipped profile is never a project's own."""
    shipped = Path(own.source.file).resolve().parent == FOLDER.resolve()
    return BASE if shipped and name == BASE.stem else find_file(name, FOLDER, "profile")


def _policy(own: Item, base: Item | None = None) -> str:
    """The policy that a layer says, or its base does."""
    said = own.mapping().get("policy")
    if said is None:
        return POLICIES[0] if base is None else _policy(base)
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
