"""A fake device's subscription to its world: it periodically sends its address."""

from __future__ import annotations

from hw.links.datagrams import Address, Outlet

EVERY_NS = 200_000_000
"""Period of renewal; a world drops subscriptions after a second."""


class Subscription:
    """Sends by an outlet, whose source names the kind of peer, that `own` is its address."""

    def __init__(self, outlet: Outlet, own: Address) -> None:
        self._outlet, self._own = outlet, own
        self._told_ns = 0

    def tell(self, now_ns: int) -> None:
        """Subscribe now."""
        self._told_ns = now_ns
        self._outlet.send("subscribe", now_ns, self._own)

    def renew(self, now_ns: int) -> None:
        """Renew the subscription, if due."""
        if now_ns - self._told_ns >= EVERY_NS:
            self.tell(now_ns)
