"""Records that lack something."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from cobodeck.record.read.reader import Group, Record


class WithoutTruth(Record):
    """As of a run on real parts."""

    def groups(self) -> Iterator[Group]:
        for group in super().groups():
            yield replace(group, told=tuple(t for t in group.told if t.topic != "truth"))
