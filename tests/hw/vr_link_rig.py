"""The VR link in virtual time: its clients over lines in memory, the safety chain behind it.

`Headset` does what an unmodified Unity project does, by the description of its protocol: everything
is registered when a link is opened, a failed write is followed by a second of waiting, and so on.
"""

from __future__ import annotations

import json
import socket
import struct
from collections.abc import Callable
from typing import Any

from hw.drivers.unity.bridge import Bridged, UnityBridge
from hw.drivers.unity.clients import Clients
from hw.drivers.unity.inbox import Checks
from hw.drivers.unity.protocol.session import Session
from hw.drivers.unity.protocol.topics import Topics
from hw.fakes.unity.unity_client import FLAG, POSE, TIME, flag, moment, pose, read_time, text
from hw.geometry import STILL
from hw.model.tracking import Tracking
from hw.samples import UserPose
from tests.hw.drivers.chain.test_chain_cycle import Rig as ChainRig

MS, S = 1_000_000, 1_000_000_000
STEP_NS, FRAME = 10 * MS, 3
"""A headset shows a frame in each third step."""
RETRY_NS = S
FRESH_NS = 150 * MS
BODY = (40.0, 0.0, 1.0)
DEEP = (39.5, 0.0, 1.3)
ASKS_NS, LETS_GO_NS = 2 * S, 3500 * MS


def pack(name: str, body: bytes = b"") -> bytes:
    """A frame, written out by hand."""
    return struct.pack("<I", len(name)) + name.encode() + struct.pack("<I", len(body)) + body


def order(name: str, **fields: Any) -> bytes:
    return pack(f"__{name}", json.dumps(fields).encode())


class Line:
    """A TCP connection in memory, as its two ends see it; bytes arrive unless they are `held`."""

    def __init__(self) -> None:
        self.up, self.down = bytearray(), bytearray()
        self.arrived, self.shown = bytearray(), bytearray()
        self.gone = self.gone_arrived = False
        self.over = self.over_shown = self.reset = self.held = False

    def carry(self) -> None:
        """The network is up: what was sent arrives."""
        self.arrived += self.up
        self.shown += self.down
        self.reset = self.reset or (self.over and bool(self.up))
        self.up.clear()
        self.down.clear()
        self.gone_arrived, self.over_shown = self.gone, self.over

    @property
    def readable(self) -> bool:
        return bool(self.arrived) or self.gone_arrived

    # what a socket offers

    def setblocking(self, on: bool) -> None:
        assert on is False

    def setsockopt(self, *option: int) -> None:
        assert len(option) == 3

    def recv(self, size: int) -> bytes:
        if not self.readable:
            raise BlockingIOError
        data = bytes(self.arrived[:size])
        del self.arrived[:size]
        return data

    def send(self, data: memoryview) -> int:
        if self.gone_arrived:
            raise BrokenPipeError
        self.down += data
        return len(data)

    def shutdown(self, how: int) -> None:
        assert how in (socket.SHUT_WR, socket.SHUT_RDWR)

    def close(self) -> None:
        self.over = True


class Client:
    """Some client; `said` has all commands that it was sent, `link` is None while it has none."""

    def __init__(self, rig: Link, host: str = "10.0.0.7") -> None:
        self.rig, self.host = rig, host
        self.line: Line | None = None
        self.said: list[tuple[str, Any]] = []
        self.open()

    def open(self) -> None:
        """Connect."""
        self.line = Line()
        self.rig.connect(self.line, self.host)

    def write(self, *frames: bytes) -> None:
        if self.line is not None:
            self.line.up += b"".join(frames)

    def leave(self) -> None:
        """Close the link."""
        if self.line is not None:
            self.line.gone = True
        self.line = None

    def lose(self) -> None:
        """Lose the link without a word; nothing of what is on the way arrives."""
        if self.line is not None:
            self.line.up.clear()
        self.line = None

    def texts(self, level: str = "error") -> list[str]:
        return [fields["text"] for name, fields in self.said if name == f"__{level}"]

    @property
    def is_closed(self) -> bool:
        """True if the other side has closed the link."""
        return self.line is not None and self.line.over_shown

    def step(self, now_ns: int) -> None:
        for name, body in self.heard():
            if name.startswith("__"):
                self.said.append((name, json.loads(body)))

    def heard(self) -> list[tuple[str, bytes]]:
        if self.line is None:
            return []
        data, found = self.line.shown, []
        while len(data) >= 4:
            name_end = 4 + struct.unpack_from("<I", data)[0]
            if len(data) < name_end + 4:
                break
            end = name_end + 4 + struct.unpack_from("<I", data, name_end)[0]
            if len(data) < end:
                break
            found.append((data[4:name_end].decode(), bytes(data[name_end + 4 : end])))
            del data[:end]
        return found


class Headset(Client):
    """A Unity project with a person at `body`; `asks` is what it asks for now.

    `plays`: it asks at ASKS_NS and lets go at LETS_GO_NS. `answers` questions for its clock, which
    is `offset_ns` ahead. `stalls`: it writes keep-alives only.
    """

    def __init__(
        self,
        rig: Link,
        host: str = "10.0.0.7",
        body: tuple[float, float, float] = BODY,
        answers: bool = True,
        plays: bool = False,
        offset_ns: int = 1000 * S,
    ) -> None:
        self.body, self.answers, self.plays, self.offset_ns = body, answers, plays, offset_ns
        self.asks: tuple[float, float, float] | None = None
        self.stalls = self.is_away = False
        self._retry_ns: int | None = None
        self._steps = self._wrote_ns = 0
        super().__init__(rig, host)

    def open(self) -> None:
        super().open()
        kinds = dict.fromkeys(("head", "tailbone", "haptic_request"), POSE)
        kinds |= {"release": FLAG, "restart": FLAG, "clock_answer": TIME}
        self.write(bytes(8))
        for name, kind in kinds.items():
            self.write(order("publish", topic=f"vr/{name}", message_name=kind))
        self.write(order("subscribe", topic="robot/visible", message_name=FLAG))
        if self.answers:
            self.write(order("subscribe", topic="vr/clock_ask", message_name=TIME))

    def step(self, now_ns: int) -> None:
        self._steps += 1
        if self.line is not None and self.line.reset:
            self.line, self._retry_ns = None, now_ns + RETRY_NS
        if self.line is None and not self.is_away and now_ns >= (self._retry_ns or 0):
            self.open()
        for name, body in self.heard():
            if name.startswith("__"):
                self.said.append((name, json.loads(body)))
            elif name == "vr/clock_ask":
                _, token = read_time(body)
                now = moment(now_ns + self.offset_ns)
                answer = [struct.pack("<I", 1), *now, *text(""), *now, *text(token)]
                self.write(pack("vr/clock_answer", b"".join(answer)))
        if self.plays:
            self._play(now_ns - self.rig.begun_ns)
        if self._steps % FRAME == 0:
            self._show(now_ns)

    def _play(self, at_ns: int) -> None:
        if self.asks is not None and at_ns >= LETS_GO_NS:
            self.write(pack("vr/release", flag(True)[0]))
        self.asks = DEEP if ASKS_NS <= at_ns < LETS_GO_NS else None

    def _show(self, now_ns: int) -> None:
        if self.stalls:
            if now_ns - self._wrote_ns >= S:
                self._wrote_ns = now_ns
                self.write(bytes(8))
            return
        x, y, z = self.body
        tremor = 1e-5 * (self._steps % 7)
        self.write(
            self.posed("head", (x, y, z + 0.6 + tremor), now_ns),
            self.posed("tailbone", (x, y, z + tremor), now_ns),
        )
        if self.asks is not None and self._steps % (8 * FRAME) == 0:
            self.write(self.posed("haptic_request", self.asks, now_ns))

    def posed(self, name: str, at: tuple[float, float, float], now_ns: int) -> bytes:
        head = [struct.pack("<I", 1), *moment(now_ns + self.offset_ns), *text("map")]
        return pack(f"vr/{name}", b"".join([*head, *pose(at, (0.0, 0.0, 0.0, 1.0))]))


class Link:
    """The link with all its clients; `told` is what it tells: (name, stamp, value)."""

    def __init__(
        self, build: str = "ros1", peers: tuple[str, ...] = ("0.0.0.0/0",), chain: bool = False
    ) -> None:
        checks = Checks(Tracking())
        bridged = Bridged(build, Topics.of({}, {"front": "vr/front"}), checks, tuple("abcdef"))
        self.bridge = UnityBridge(bridged, self._tell)
        self.clients = Clients(self.bridge, peers, checks.one_way_ns)
        self.told: list[tuple[str, int, Any]] = []
        self.chain = ChainRig() if chain else None
        if self.chain is not None:
            self.chain.speaks -= {"vr", "user"}
        self.now_ns = self.begun_ns = 10**12 if self.chain is None else self.chain.now
        self.is_up = True
        self.people: list[Client] = []
        self.lines: dict[Session, Line] = {}
        self._waiting: list[tuple[Line, str]] = []
        self._lines: list[Line] = []
        self._ports = 0
        self.newest: dict[str, tuple[int, Any]] = {}

    def headset(self, *arguments: Any, **given: Any) -> Headset:
        made = Headset(self, *arguments, **given)
        self.people.append(made)
        return made

    def client(self, host: str = "10.0.0.7") -> Client:
        made = Client(self, host)
        self.people.append(made)
        return made

    def connect(self, line: Line, host: str) -> None:
        self._lines.append(line)
        self._waiting.append((line, host))

    def session(self, client: Client) -> Session:
        return next(session for session, line in self.lines.items() if line is client.line)

    def step(self) -> None:
        """Ten milliseconds."""
        self.now_ns += STEP_NS
        for one in self.people:
            one.step(self.now_ns)
        if self.is_up:
            for line, host in self._waiting:
                self._ports += 1
                arrived = self.clients.arrive(line, host, 50_000 + self._ports, self.now_ns)
                self.lines[arrived] = line
            self._waiting.clear()
            for line in self._lines:
                if not line.held:
                    line.carry()
        self._serve()
        if self.chain is not None:
            self.chain.now = self.now_ns - STEP_NS
            self.chain.go()

    def _serve(self) -> None:
        for session in self.clients.all:
            while self.lines[session].readable and not session.ended:
                self.clients.read(session, self.now_ns)
        for session in self.clients.tick(self.now_ns):
            session.close()
            del self.lines[session]

    def go(self, seconds: float) -> Link:
        for _ in range(round(seconds * S / STEP_NS)):
            self.step()
        return self

    def until(self, true: Callable[[], object], seconds: float = 20.0) -> float:
        """Seconds until something is true; inf: it was not."""
        for n in range(round(seconds * S / STEP_NS)):
            if true():
                return n * STEP_NS / S
            self.step()
        return float("inf")

    def values(self, name: str) -> list[Any]:
        return [value for known, _, value in self.told if known == name]

    @property
    def is_tracked(self) -> bool:
        """True while a fresh pose of the person is known."""
        at, _ = self.newest.get("user.pose", (0, None))
        return self.now_ns - at <= FRESH_NS

    @property
    def asked(self) -> Any:
        return self.newest.get("vr.haptic_request", (0, None))[1]

    @property
    def person(self) -> UserPose:
        return self.newest["user.pose"][1]

    @property
    def drives(self) -> bool:
        return self.chain is not None and self.chain.wheels.told != STILL

    def _tell(self, name: str, stamp_ns: int, value: Any) -> None:
        self.told.append((name, stamp_ns, value))
        self.newest[name] = stamp_ns, value
        if self.chain is not None:
            self.chain.now = self.now_ns
            self.chain.tell("vr", name, value, stamp_ns)
