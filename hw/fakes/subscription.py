"""How a fake device goes on hearing of its world: it tells again and again where it listens."""

from __future__ import annotations

from hw.links.datagrams import Address, Outlet

EVERY_NS = 200_000_000
"""A world forgets who has not subscribed anew for a second."""


class Subscription:
    """Tells by an outlet, whose source says what is wanted, that `own` is the address for it."""

    def __init__(self, outlet: Outlet, own: Address) -> None:
        self._outlet, self._own = outlet, own
        self._told_ns = 0

    def tell(self, now_ns: int) -> None:
        """Subscribe now."""
        self._told_ns = now_ns
        self._outlet.send("subscribe", now_ns, self._own)

    def renew(self, now_ns: int) -> None:
        """Subscribe anew, if it is time."""
        if now_ns - self._told_ns >= EVERY_NS:
            self.tell(now_ns)
