"""The VR link's process: serves clients of the ROS-TCP-Connector, reports to engine and chain.

A single thread waits for all sockets at once. Datagrams go out as source `vr`; the robot's state
comes in as `robot.view` from the engine. The process ends with its parent.
"""

from __future__ import annotations

import gc
import selectors
import socket
import time
from dataclasses import dataclass
from typing import Any

from hw.drivers import gates
from hw.drivers.clocks import PeerClock
from hw.drivers.unity.bridge import Bridged, UnityBridge
from hw.drivers.unity.session import Session
from hw.drivers.unity.wire import KEEPALIVE, MalformedFrame
from hw.links.datagrams import Door, Intake, Outlet
from hw.links.processes import Parent, Ready, serve
from hw.samples import RobotView

WAIT_S = 0.05
MOST_CLIENTS = 8


@dataclass(frozen=True, slots=True)
class ServerSetup:
    """The address for clients, the doors of the listeners, and the settings of the bridge."""

    host: str
    port: int
    listeners: tuple[Door, ...]
    bridged: Bridged


class UnityServer:
    """See the module."""

    def __init__(self, settings: ServerSetup) -> None:
        self._settings = settings
        self._outlet = Outlet(settings.listeners)
        self._intake = Intake(("engine",))
        wall_ns = time.time_ns() - time.monotonic_ns()  # taken once: stamps must not jump
        self._bridge = UnityBridge(settings.bridged, self._outlet.send, wall_ns)
        self._listener = socket.create_server((settings.host, settings.port))
        self._listener.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._intake, selectors.EVENT_READ)
        self._alive_ns = 0

    @property
    def told(self) -> dict[str, Any]:
        """`port` for clients, and `intake`, the engine's door."""
        return {"port": self._listener.getsockname()[1], "intake": self._intake.door("engine")}

    def run(self, parent: Parent) -> None:
        """Serve until the parent has gone."""
        self._selector.register(parent, selectors.EVENT_READ)
        while True:
            for key, events in self._selector.select(WAIT_S):
                if key.fileobj is parent:
                    return
                if key.fileobj is self._listener:
                    self._accept()
                elif key.fileobj is self._intake:
                    self._show()
                elif events & selectors.EVENT_READ:
                    self._read(key.data)
            now = time.monotonic_ns()
            self._keep_alive(now)
            self._bridge.tick(now)
            for session in list(self._bridge.sessions):
                self._send(session, now)

    def close(self) -> None:
        """Close all links."""
        for session in list(self._bridge.sessions):
            self._end(session)
        self._selector.close()
        self._listener.close()
        self._intake.close()
        self._outlet.close()

    def _accept(self) -> None:
        try:
            connection, (host, port, *_) = self._listener.accept()
        except OSError:  # the client has gone already
            return
        if len(self._bridge.sessions) >= MOST_CLIENTS:
            connection.close()
            return
        clock = PeerClock(self._settings.bridged.checks.one_way_ns)
        session = Session(connection, f"{host}:{port}", time.monotonic_ns(), clock)
        self._bridge.join(session)
        self._selector.register(session, selectors.EVENT_READ, session)

    def _read(self, session: Session) -> None:
        now = time.monotonic_ns()
        try:
            for frame in session.read(now):
                self._bridge.take(session, frame, now)
        except MalformedFrame as error:
            self._bridge.blame(f"{session.name}: {error}")
            session.broken = str(error)

    def _show(self) -> None:
        newest = None
        for told in self._intake.poll():
            if told.name == "robot.view" and isinstance(told.value, RobotView):
                newest = told
        if newest is not None:
            self._bridge.show(newest.stamp_ns, newest.value)

    def _keep_alive(self, now_ns: int) -> None:
        if now_ns - self._alive_ns < gates.KEEPALIVE_NS:
            return
        self._alive_ns = now_ns
        for session in self._bridge.sessions:
            session.put("", KEEPALIVE)
            if now_ns - session.heard_ns > gates.CLIENT_SILENT_NS:
                session.broken = "it is silent"

    def _send(self, session: Session, now_ns: int) -> None:
        session.flush()
        if session.broken is not None:
            self._end(session, now_ns)
            return
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if session.waiting else 0)
        if self._selector.get_key(session).events != wanted:
            self._selector.modify(session, wanted, session)

    def _end(self, session: Session, now_ns: int | None = None) -> None:
        self._selector.unregister(session)
        self._bridge.leave(session, time.monotonic_ns() if now_ns is None else now_ns)
        session.close()


def main(settings: ServerSetup, ready: Ready, parent: Parent) -> None:
    """Run the process."""
    server = UnityServer(settings)
    try:
        gc.collect()
        gc.freeze()
        ready(server.told)
        server.run(parent)
    finally:
        server.close()


if __name__ == "__main__":
    serve(main)
