"""Who may be a client of the VR link, and who has to go if there are too many.

An unmodified Unity client has no password, so its address is all that is asked for. A link at a
loopback address takes clients of this machine, any other the addresses named by `peer`, or without
that anybody. Sources of topics, and who waits to become one, keep their places while they live; all
others make room for who comes, those that have registered nothing first.
"""

from __future__ import annotations

from collections.abc import Sequence
from ipaddress import ip_address, ip_network

from hw.drivers.unity.protocol import Session
from hw.ipc import is_loopback

MOST_CLIENTS, MOST_OF_ONE = 8, 4
"""Clients at a time, and of one address."""
LOOPBACK, ANYBODY = "127.0.0.0/8", "0.0.0.0/0"
FULL = "there are too many clients"


def peers_of(peer: str | Sequence[str] | None, host: str) -> tuple[str, ...]:
    """The addresses or networks that may connect to a link that serves at `host`.

    Raises:
        ValueError: one of them is no address.
    """
    if peer is None:
        return (LOOPBACK if is_loopback(host) else ANYBODY,)
    named = (peer,) if isinstance(peer, str) else tuple(peer)
    if not named:
        raise ValueError("peer: an empty list lets nobody connect; name the headset's address")
    return tuple(_network(one) for one in named)


def is_peer(host: str, peers: Sequence[str]) -> bool:
    """True if an address may connect."""
    return any(ip_address(host) in ip_network(peer) for peer in peers)


def is_crowded(host: str, sessions: Sequence[Session]) -> bool:
    """True if somebody has to go before another client of this address can come."""
    return len(sessions) >= MOST_CLIENTS or len(_sessions_of(host, sessions)) >= MOST_OF_ONE


def first_to_go(host: str, sessions: Sequence[Session], now_ns: int) -> Session | None:
    """Whose place another client of this address may have; None: all are needed."""
    own = _sessions_of(host, sessions)
    among = own if len(own) >= MOST_OF_ONE else sessions
    loose = [one for one in among if not one.published or one.is_quiet(now_ns)]
    return min(loose, key=lambda one: (one.registered, one.joined_ns), default=None)


def _sessions_of(host: str, sessions: Sequence[Session]) -> list[Session]:
    return [one for one in sessions if one.host == host]


def _network(one: object) -> str:
    try:
        return str(ip_network(one if isinstance(one, str) else "", strict=False))
    except ValueError:
        raise ValueError(
            f"peer: {one!r} is no address; write the headset's, such as 192.168.0.30"
        ) from None
