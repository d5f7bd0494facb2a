"""The ring around the user in which Chase waits (R93, R97, R98)."""

from __future__ import annotations

from dataclasses import dataclass

from behaviors.profile import ChaseSettings


@dataclass(frozen=True, slots=True)
class ChaseRing:
    """Two arcs around the user: between two radii, m, without sectors ahead and behind, rad."""

    inner: float
    outer: float
    front: float
    rear: float
    cell: float

    @classmethod
    def of(
        cls,
        chase: ChaseSettings,
        inner: float | None = None,
        outer: float | None = None,
        front: float | None = None,
        rear: float | None = None,
    ) -> ChaseRing:
        """The ring of the settings, with the values that are given in place of theirs."""
        return cls(
            chase.inner if inner is None else inner,
            chase.outer if outer is None else outer,
            chase.front if front is None else front,
            chase.rear if rear is None else rear,
            chase.cell,
        )
