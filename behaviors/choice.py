"""The one chooser: of candidates with costs, the cheapest that can be reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar


class Comparable(Protocol):
    """A cost: a number, or a tuple of numbers, of which an earlier one goes first."""

    def __lt__(self, other: Any, /) -> bool: ...


C = TypeVar("C", bound=Comparable)


def cheapest(
    bounds: Sequence[C],
    total: Callable[[int], C | None],
    below: C | None = None,
    tries: int | None = None,
) -> int | None:
    """Index of the candidate of the least total cost; of equal ones the first; None without one.

    `bounds` are the costs that the candidates have at least, and `total(i)` the whole cost of one,
    with the way to it; None: it cannot be reached. Totals are asked for in the order of the bounds,
    as long as one may still be less than the least so far, which begins with `below`. Without any
    that can be reached among the first `tries`, there is none.
    """
    best, least = None, below
    for asked, i in enumerate(sorted(range(len(bounds)), key=bounds.__getitem__)):
        if least is not None and not bounds[i] < least:
            break
        if best is None and tries is not None and asked >= tries:
            break
        cost = total(i)
        if cost is not None and (least is None or cost < least):
            best, least = i, cost
    return best
