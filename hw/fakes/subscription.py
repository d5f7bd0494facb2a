"""A fake device's link to its world: what it sends as, and where it is told of the world."""

from __future__ import annotations

from collections.abc import Mapping

from hw.ipc import Door, Outlet

EVERY_NS = 200_000_000
"""Period of renewal; a world drops subscriptions after a second."""


def outlet_as(source: str, tells: Mapping[str, Door] | None) -> Outlet:
    """An outlet to the world as one of the sources of a peer, or to nobody without a world."""
    return Outlet([] if tells is None else [tells[source]])


class Subscription:
    """Sends by an outlet, whose source is the kind of peer, that `own` is its world's door."""

    def __init__(self, outlet: Outlet, own: Door) -> None:
        self._outlet, self._own = outlet, own
        self._told_ns = 0

    def subscribe(self, now_ns: int) -> None:
        """Subscribe now."""
        self._told_ns = now_ns
        self._outlet.send("subscribe", now_ns, tuple(self._own))

    def renew(self, now_ns: int) -> None:
        """Renew the subscription, if due."""
        if now_ns - self._told_ns >= EVERY_NS:
            self.subscribe(now_ns)
