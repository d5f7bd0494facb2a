"""The clients of the VR link from their arrival to their last byte; without a clock of its own.

Whatever a client sends is data: what cannot be read is left out, an error in here ends the link of
that client, and no other. A client that has to go is told why; its link stays half open for
PARTING_NS, because a link that is closed at once takes back what was not read yet.
"""

from __future__ import annotations

import socket

from hw.drivers import gates
from hw.drivers.clock_offsets import PeerClock
from hw.drivers.unity.bridge import UnityBridge
from hw.drivers.unity.client_slots import FULL, first_to_go, is_crowded, is_peer
from hw.drivers.unity.protocol import KEEPALIVE, MalformedFrame, Session

MOST_PARTING = 16
"""So many links are half open at most; of more, the oldest are closed at once."""


class Clients:
    """See the module.

    Args:
        bridge: takes their frames.
        peers: addresses and networks that may connect (`places.peers_of`).
        one_way_ns: least transmission time, ns.
    """

    def __init__(self, bridge: UnityBridge, peers: tuple[str, ...], one_way_ns: int) -> None:
        self.bridge = bridge
        self._peers, self._one_way_ns = peers, one_way_ns
        self._parting: dict[Session, int] = {}
        self._alive_ns = 0

    @property
    def all(self) -> list[Session]:
        """All whose links are open, also those that are being closed."""
        return [*self.bridge.sessions, *self._parting]

    def arrive(self, connection: socket.socket, host: str, port: int, now_ns: int) -> Session:
        """Take a client that has connected; who may not stay is told so."""
        session = Session(connection, f"{host}:{port}", now_ns, PeerClock(self._one_way_ns))
        why = self._why_not(host, now_ns)
        if why is None:
            self.bridge.join(session)
        else:
            self.bridge.greet(session)
            self._part(session, why, now_ns)
        return session

    def read(self, session: Session, now_ns: int) -> None:
        """Take what has come from a client."""
        try:
            for frame in session.read(now_ns):
                if session.broken is None:
                    self.bridge.on_frame(session, frame, now_ns)
        except MalformedFrame as error:
            session.broken = str(error)
        except Exception as error:  # noqa: BLE001  any bytes may come, and others go on
            session.broken = f"{type(error).__name__}: {error}"

    def tick(self, now_ns: int) -> list[Session]:
        """Send what waits, and let go who has to; returns those whose links are to be closed."""
        self._keep(now_ns)
        self.bridge.tick(now_ns)
        for session in self.all:
            session.flush()
        for session in list(self.bridge.sessions):
            if session.broken is not None:
                self._leave(session, session.broken, now_ns)
        for session, until_ns in self._parting.items():
            session.ended = session.ended or now_ns >= until_ns
        spare = len(self._parting) - MOST_PARTING
        gone = [one for n, one in enumerate(self._parting) if one.ended or n < spare]
        for session in gone:
            del self._parting[session]
        return gone

    def _why_not(self, host: str, now_ns: int) -> str | None:
        """Why a client must not stay; None if it may. Another one may have to go for it."""
        if not is_peer(host, self._peers):
            return f"{host} is not the `peer` of this link: {', '.join(self._peers)}"
        if is_crowded(host, self.bridge.sessions):
            gone = first_to_go(host, self.bridge.sessions, now_ns)
            if gone is None:
                return FULL
            self._leave(gone, f"{FULL}, and this one is not needed", now_ns)
        return None

    def _keep(self, now_ns: int) -> None:
        """Show who is there that the robot is, too; find those who are not."""
        if now_ns - self._alive_ns < gates.KEEPALIVE_NS:
            return
        self._alive_ns = now_ns
        for session in self.bridge.sessions:
            session.send_latest("", KEEPALIVE)
            if now_ns - session.heard_ns > gates.CLIENT_SILENT_NS:
                session.broken = "it is silent"
            elif not session.registered and now_ns - session.joined_ns > gates.UNREGISTERED_NS:
                session.broken = "it has registered nothing"

    def _leave(self, session: Session, why: str, now_ns: int) -> None:
        is_missed = self.bridge.is_source(session) or not session.is_quiet(now_ns)
        self.bridge.leave(session, now_ns)
        self._part(session, why, now_ns, is_missed)

    def _part(self, session: Session, why: str, now_ns: int, is_missed: bool = True) -> None:
        """Close a link with a word, to the operator, too, unless its successor is there."""
        if not session.ended:
            session.dismiss(why)
            session.flush()
            if is_missed:
                self.bridge.blame(f"the link of {session.name} is closed: {why}", now_ns)
        self._parting[session] = now_ns + gates.PARTING_NS
