"""One YAML mapping on top of another; every key keeps its place in the file that it comes from."""

from __future__ import annotations

import dataclasses

from engine.files.declared.item import Item
from engine.files.source import Map


def merged(base: Item, own: Item) -> Item:
    """`base` with its values replaced by those of `own`, key by key, in nested mappings too.

    Lists and plain values are replaced as a whole.

    Raises:
        FileError: one of the two is not a mapping.
    """
    below, above = base.mapping(), own.mapping()
    made, files = Map(own.value.at), {}
    for key in dict.fromkeys((*below, *above)):
        item, origin = (above[key], own.value) if key in above else (below[key], base.value)
        nested = isinstance(item.value, Map) and key in below and key in above
        if nested and isinstance(below[key].value, Map):
            item = merged(below[key], item)
        made[key] = item.value
        made.keys_at[key], made.values_at[key] = origin.keys_at[key], origin.values_at[key]
        files[key] = item.source
    made.files = files
    return dataclasses.replace(own, value=made)


def single(dotted: str, value: Item) -> Item:
    """Nested mappings with a single value under a dotted key; all have the place of `value`."""
    outer, _, inner = dotted.rpartition(".")
    made = Map(value.at)
    made[inner] = value.value
    made.keys_at[inner] = made.values_at[inner] = value.at
    item = Item(value.source, made, value.at)
    return single(outer, item) if outer else item
