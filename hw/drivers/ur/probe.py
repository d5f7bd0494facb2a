"""Checks that a UR controller answers, with time-outs of our own, before its client opens.

The client library waits two minutes for a host that drops packets, and forever, with its whole
process, for one that accepts a connection and does not answer.
"""

from __future__ import annotations

import socket
import struct

TIMEOUT_S = 1.0
DASHBOARD, SCRIPT, RTDE = 29999, 30003, 30004
LEAST = (3, 4)
"""The oldest PolyScope whose registers the client library can use."""
OTHER_DRIVER = (
    "if the robot's own bring-up drives the arm, too, as that of an RB-KAIROS does, start it "
    "without the arm's driver"
)
_STOPPED = {
    "PROTECTIVE_STOP": "the arm is in a protective stop",
    "SAFEGUARD_STOP": "the arm's safeguard input is open",
}


class DashboardClient:
    """Queries the controller's dashboard, line by line.

    Raises:
        OSError: it does not answer within the time-out.
    """

    def __init__(self, host: str, timeout: float = TIMEOUT_S) -> None:
        self._link = socket.create_connection((host, DASHBOARD), timeout)
        try:
            self._answers = self._link.makefile("rb")
            self._line()
        except OSError:
            self.close()
            raise

    def ask(self, line: str) -> str:
        """The answer to a line.

        Raises:
            OSError: there is none within the time-out.
        """
        self._link.sendall(line.encode() + b"\n")
        return self._line()

    def order(self, line: str) -> None:
        """Send a line without waiting; errors are ignored."""
        try:
            self._link.setblocking(False)
            self._link.send(line.encode() + b"\n")
        except OSError:
            return

    def close(self) -> None:
        """Close the connection."""
        self._answers.close()
        self._link.close()

    def _line(self) -> str:
        line = self._answers.readline()
        if not line:
            raise ConnectionError("the dashboard closed the connection")
        return line.decode(errors="replace").strip()


def probe(host: str, timeout: float = TIMEOUT_S) -> str:
    """The version of the controller at this host, if it answers on all ports.

    Raises:
        OSError: a port does not answer, and is named; or PolyScope is too old.
    """
    for port in (DASHBOARD, SCRIPT, RTDE):
        try:
            with socket.create_connection((host, port), timeout) as link:
                version = _version(link) if port == RTDE else ""
        except OSError as error:
            told = str(error) or type(error).__name__
            raise OSError(f"no UR controller at {host}: port {port}: {told}") from None
    if tuple(map(int, version.split(".")[:2])) < LEAST:
        least = ".".join(map(str, LEAST))
        raise OSError(f"{host} has PolyScope {version}; {least} is needed at least: update it")
    return version


def require_running(dashboard: DashboardClient, acknowledged: bool) -> None:
    """Check that the arm may move; unlock a protective stop if acknowledged.

    Raises:
        OSError: it may not, with the cause.
    """
    mode = dashboard.ask("safetymode").partition(": ")[2]
    if mode == "PROTECTIVE_STOP" and acknowledged:
        dashboard.ask("close safety popup")
        answer = dashboard.ask("unlock protective stop")
        if answer != "Protective stop releasing":
            raise OSError(answer)
    elif mode not in ("NORMAL", "REDUCED", "RECOVERY"):
        raise OSError(_STOPPED.get(mode, f"the arm's safety mode is {mode}"))
    running = dashboard.ask("robotmode").partition(": ")[2]
    if running != "RUNNING":
        raise OSError(f"the arm's mode is {running}; switch it on and release its brakes")
    if dashboard.ask("running").partition(": ")[2] == "true":
        program = dashboard.ask("programState")
        raise OSError(f"another program drives the arm ({program}): end it; {OTHER_DRIVER}")


def _version(link: socket.socket) -> str:
    """The version that the controller reports over RTDE."""
    link.sendall(struct.pack(">HBH", 5, ord("V"), 2))
    size, kind, accepted = struct.unpack(">HBB", _exactly(link, 4))
    if (size, kind, accepted) != (4, ord("V"), 1):
        raise OSError("it does not speak RTDE 2")
    link.sendall(struct.pack(">HB", 3, ord("v")))
    size, kind, *numbers = struct.unpack(">HB4I", _exactly(link, 19))
    if (size, kind) != (19, ord("v")):
        raise OSError("it does not report its version")
    return ".".join(map(str, numbers))


def _exactly(link: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        piece = link.recv(size - len(data))
        if not piece:
            raise ConnectionError("it closed the connection")
        data += piece
    return data
