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

from hw.drivers.unity.bridge import Bridged, UnityBridge
from hw.drivers.unity.clients import Clients
from hw.drivers.unity.protocol import Session
from hw.ipc import SENSES, Door, Intake, Outlet, Parent, Ready, serve
from hw.samples import RobotView

WAIT_S = 0.05


@dataclass(frozen=True, slots=True)
class ServerSetup:
    """The address for clients, who may connect, the listeners' doors, and the bridge's settings."""

    host: str
    port: int
    peers: tuple[str, ...]
    listeners: tuple[Door, ...]
    bridged: Bridged


class UnityServer:
    """See the module."""

    def __init__(self, settings: ServerSetup) -> None:
        self._outlet = Outlet(settings.listeners)
        self._intake = Intake(("engine",))
        wall_ns = time.time_ns() - time.monotonic_ns()  # taken once: stamps must not jump
        self._bridge = UnityBridge(settings.bridged, self._outlet.send, wall_ns)
        self._clients = Clients(self._bridge, settings.peers, settings.bridged.checks.one_way_ns)
        self._listener = socket.create_server((settings.host, settings.port))
        self._listener.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._intake, selectors.EVENT_READ)

    @property
    def addresses(self) -> dict[str, Any]:
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
                    self._clients.read(key.data, time.monotonic_ns())
            for session in self._clients.tick(time.monotonic_ns()):
                self._selector.unregister(session)
                session.close()
            for session in self._clients.all:
                self._await(session)

    def close(self) -> None:
        """Close all links."""
        for session in self._clients.all:
            session.close()
        self._selector.close()
        self._listener.close()
        self._intake.close()
        self._outlet.close()

    def _accept(self) -> None:
        try:
            connection, (host, port, *_) = self._listener.accept()
            session = self._clients.arrive(connection, host, port, time.monotonic_ns())
        except OSError:  # the client has gone already, or there is no descriptor left for it
            return
        self._selector.register(session, selectors.EVENT_READ, session)

    def _show(self) -> None:
        newest = None
        for told in self._intake.poll():
            if told.name == "robot.view" and isinstance(told.value, RobotView):
                newest = told
        if newest is not None:
            self._bridge.show(newest.stamp_ns, newest.value)

    def _await(self, session: Session) -> None:
        """Wait for what a client sends, and for room for what it is sent, if anything is."""
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if session.waiting else 0)
        if self._selector.get_key(session).events != wanted:
            self._selector.modify(session, wanted, session)


def main(settings: ServerSetup, ready: Ready, parent: Parent) -> None:
    """Run the process."""
    server = UnityServer(settings)
    try:
        gc.collect()
        gc.freeze()
        ready(server.addresses)
        server.run(parent)
    finally:
        server.close()


if __name__ == "__main__":
    serve(main, SENSES)
