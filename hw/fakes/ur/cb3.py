"""A fake UR controller of the CB3 series: RTDE, dashboard and script ports at one address.

A child process (`hw.ipc.processes`), because a client that waits for it may block its own
process. Clients move it by the control script of ur_rtde, see `cb3_controller`. Faults are
datagrams, by their name:

| fault | effect |
|---|---|
| `protective_stop`, `safeguard_stop`, `emergency_stop` | the safety system stops the arm |
| `release` | safeguard and emergency stop end; what was paused continues |
| `freeze` | packages continue, but time stamp and joints stand still |
| `mute` | links stay open, nothing is sent or read; new ones are accepted and not answered |
| `drop` | all links are closed; new ones are served |
| `close` | all links are closed, and the ports too |
| `refuse` | RTDE does not know the output of this name, or another client has this input |
| `program` | the program of this name of another client takes the arm, and moves it |
| `slow` | the speed slider is at this share |
| `version` | it has the PolyScope of these four numbers |
| `place` | the arm is at these joints (rad), switched on, without a program or a stop |
| `press` | its TCP is at the first six (m, rad) and feels the last six (N, Nm), axes of the base |
| `well` | ends `freeze`, `mute`, `close`, `refuse`, `slow` and `press` |

Dynamics, limits, kinematics (without a `press` TCP poses are 0) and script errors are not modelled.
"""

from __future__ import annotations

import select
import socket
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from hw.fakes.subscription import outlet_as
from hw.fakes.ur.cb3_controller import (
    EMERGENCY,
    NOTHING6,
    PLAYING,
    PROTECTIVE,
    SAFEGUARD,
    FakeController,
)
from hw.fakes.ur.cb3_rtde import Rtde
from hw.ipc import DEVICES, Intake, Parent, Ready, serve

DASHBOARD, SCRIPTS, RTDE = 29999, (30001, 30002, 30003), 30004
CYCLE_NS = 8_000_000
STOPS = {
    "protective_stop": PROTECTIVE,
    "safeguard_stop": SAFEGUARD,
    "emergency_stop": EMERGENCY,
}


class FakeDashboard:
    """The dashboard: one answer per line."""

    def __init__(self, arm: FakeController) -> None:
        self._arm, self._buffer = arm, b""

    def taken(self, data: bytes) -> bytes:
        """Take bytes; returns the answers."""
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        return b"".join(self._answer(line.decode(errors="replace").strip()) for line in lines)

    def _answer(self, line: str) -> bytes:
        arm = self._arm
        running = arm.runtime == PLAYING
        if line == "stop":
            arm.end()
        answers: dict[str, Callable[[], str]] = {
            "stop": lambda: "Stopped",
            "play": lambda: "Failed to execute: play",
            "pause": lambda: "Failed to execute: pause",
            "running": lambda: f"Program running: {str(running).lower()}",
            "robotmode": lambda: f"Robotmode: {'RUNNING' if arm.powered else 'POWER_OFF'}",
            "programState": lambda: (
                f"{'PLAYING' if running else 'STOPPED'} {arm.program or 'control.urp'}"
            ),
            "safetymode": lambda: f"Safetymode: {arm.safety}",
            "PolyscopeVersion": lambda: "URSoftware " + ".".join(map(str, arm.version)),
            "unlock protective stop": arm.unlock,
            "close safety popup": lambda: "closing safety popup",
            "close popup": lambda: "closing popup",
            "quit": lambda: "Disconnected",
        }
        answer = answers.get(line, lambda: f"could not understand: '{line}'")
        return answer().encode() + b"\n"


class Scripts:
    """Takes URScript; anything but a whole program ends the running one."""

    def __init__(self, arm: FakeController) -> None:
        self._arm, self._buffer = arm, b""

    def taken(self, data: bytes) -> bytes:
        """Take bytes; there are no answers."""
        self._buffer += data
        if self._buffer.startswith(b"def "):
            if self._buffer.endswith(b"\nend\n"):
                self._buffer = b""
                self._arm.upload()
        elif b"\n" in self._buffer:
            self._buffer = b""
            self._arm.end()
        return b""


class Cb3Server:
    """All ports and their connections."""

    def __init__(self, host: str, arm: FakeController) -> None:
        self._host, self._arm = host, arm
        self._refused: set[str] = set()
        self._frozen = self._mute = False
        self._talks: dict[socket.socket, Any] = {}
        self._doors: dict[socket.socket, Callable[[], Any]] = {}
        self.open()

    def open(self) -> None:
        """Listen on all ports.

        Raises:
            OSError: one of them is in use.
        """
        kinds: dict[int, Callable[[], Any]] = {
            DASHBOARD: lambda: FakeDashboard(self._arm),
            RTDE: lambda: Rtde(self._arm, self._refused),
            **{port: lambda: Scripts(self._arm) for port in SCRIPTS},
        }
        for port, talk in kinds.items():
            self._doors[_listening(self._host, port)] = talk

    def sources(self) -> list[socket.socket]:
        """The sockets to wait for."""
        return [*self._doors, *([] if self._mute else self._talks)]

    def serve(self, source: socket.socket) -> None:
        """Handle a readable socket."""
        if source in self._doors:
            self._accept(source)
        elif source in self._talks:
            self._serve(source)

    def cycle(self) -> None:
        """Run one cycle of the controller, and send its package to all that have started."""
        if not self._frozen:
            self._arm.step()
        if self._mute:
            return
        for link, talk in list(self._talks.items()):
            if isinstance(talk, Rtde):
                self._send(link, talk.package())

    def misbehave(self, name: str, value: Any) -> None:
        """Begin or end a fault."""
        acts: dict[str, Callable[[], object]] = {
            "release": self._arm.release,
            "place": lambda: self._arm.place(tuple(value)),
            "press": lambda: self._arm.press(tuple(value[:6]), tuple(value[6:])),
            "slow": lambda: setattr(self._arm, "scaling", float(value)),
            "version": lambda: setattr(self._arm, "version", tuple(value)),
            "program": lambda: self._arm.other(str(value)),
            "refuse": lambda: self._refused.add(str(value)),
            "drop": lambda: self.hang_up(doors=False),
            "close": self.hang_up,
            "well": self._well,
        }
        if name in STOPS:
            self._arm.halt(STOPS[name])
        elif name in ("freeze", "mute"):
            self._frozen, self._mute = name == "freeze", name == "mute"
            if self._frozen:
                self._arm.velocities = (0.0,) * 6
        elif name in acts:
            acts[name]()

    def hang_up(self, doors: bool = True) -> None:
        """Close all links, and the ports if asked."""
        for link in [*(self._doors if doors else ()), *self._talks]:
            link.close()
        self._talks.clear()
        if doors:
            self._doors.clear()

    def _well(self) -> None:
        if self._mute:
            self.hang_up(doors=False)
        self._frozen = self._mute = False
        self._refused.clear()
        self._arm.scaling = 1.0
        self._arm.press(NOTHING6, NOTHING6)
        if not self._doors:
            self.open()

    def _accept(self, door: socket.socket) -> None:
        with suppress(OSError):
            link, _ = door.accept()
            link.setblocking(False)
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            talk = self._talks[link] = self._doors[door]()
            if isinstance(talk, FakeDashboard) and not self._mute:
                self._send(link, b"Connected: Universal Robots Dashboard Server\n")

    def _serve(self, link: socket.socket) -> None:
        try:
            data = link.recv(1 << 16)
            answer = self._talks[link].taken(data)
        except BlockingIOError:
            return
        except (OSError, ValueError, LookupError, struct.error):  # an unknown client
            data = answer = b""
        if data:
            self._send(link, answer)
        else:
            self._lose(link)

    def _send(self, link: socket.socket, data: bytes) -> None:
        """Send, and drop a client that does not read, as a real controller does."""
        try:
            if data and link.send(data) < len(data):
                self._lose(link)
        except OSError:
            self._lose(link)

    def _lose(self, link: socket.socket) -> None:
        self._talks.pop(link, None)
        link.close()


def _listening(host: str, port: int) -> socket.socket:
    door = socket.create_server((host, port), backlog=8)
    door.setblocking(False)
    return door


def main(settings: Any, ready: Ready, parent: Parent) -> None:
    """Run until the parent has gone; settings: host, joints (rad), unlock (s), tells (address)."""
    arm = FakeController(tuple(settings["joints"]), settings["unlock"])
    server, control = Cb3Server(settings["host"], arm), Intake(("fault",), settings["host"])
    joints = outlet_as("cb3", settings["tells"])
    ready({"control": control.door("fault")})
    due = time.monotonic_ns()
    while True:
        left = max(0.0, (due - time.monotonic_ns()) * 1e-9)
        waited: list[Any] = [parent, control, *server.sources()]
        found, _, _ = select.select(waited, [], [], left)
        if parent in found:
            break
        for datagram in control.poll():
            server.misbehave(datagram.name, datagram.value)
        for source in found:
            if isinstance(source, socket.socket):
                server.serve(source)
        now = time.monotonic_ns()
        if now >= due:
            server.cycle()
            joints.send("joints", now, arm.joints)
            due = max(due + CYCLE_NS, now - CYCLE_NS)
    server.hang_up()


if __name__ == "__main__":
    serve(main, DEVICES)
