"""A server of the page that plays a script: made-up frames of a room, the real picture of a chart.

`python -m tests.cobodeck.live.fake_page_server live|record|charts` serves it to look at.
"""

from __future__ import annotations

import asyncio
import json
import math
import re
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from itertools import pairwise
from pathlib import Path
from typing import Any, Self

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from tests.cobodeck.live.pictures import drawn

PAGE = Path(__file__).parents[3] / "cobodeck" / "live" / "page"
KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:"
)
TOKEN = "let-me-in"
UNTIL, HZ = 60.0, 20
LAYERS = [
    *("room", "inflations", "objects", "places", "tracked", "robot", "arm", "user", "zones"),
    *("path", "goal", "scan", "costmap", "chase", "escape", "haptic", "deep", "trails"),
]
OFF = {"costmap", "haptic", "trails"}
SIGNALS = {"user.pose": "UserPose", "base.twist": "Twist2", "base.pose": "Pose2", "scan": "Scan"}
Message = dict[str, Any]
Course = list[tuple[float, str, str]]

GUARDS = ("fault", "tracking", "danger", "request", "cornered")
COURSE: Course = [
    (0.0, "chase/follow/park", "parked"),
    (3.0, "chase/follow/leave", "away"),
    (6.5, "chase/follow/wait", "settled"),
    (14.0, "chase/follow/choose", "chosen"),
    (14.2, "chase/follow/drive/go", "arrived"),
    (24.0, "chase/follow/wait", "settled"),
    (30.0, "haptic/serve/choose", "chosen"),
    (30.3, "haptic/serve/drive", "arrived"),
    (38.0, "haptic/serve/reach", "reached"),
    (41.0, "haptic/serve/hold", "released"),
    (50.0, "escape/away/drive/go", "reached"),
    (56.0, "chase/follow/choose", "chosen"),
]
"""When each action begins, and the outcome that ends it."""


def nodes_of(svg: str) -> dict[str, Message]:
    """The nodes that a picture shows, with kinds by their colours."""
    found: dict[str, Message] = {}
    for match in re.finditer(
        r'<g id="a_s:([^"]*)"><a xlink:title="([^"]*)">\n<\w+ fill="([^"]*)"', svg
    ):
        path, about, fill = match.groups()
        kind = {"#eaf5ea": "do", "#fff6e0": "watch", "#e8f1fb": "use"}.get(fill, "states")
        outcomes = {o: {} for o in re.findall(rf'"(?:a_)?o:{re.escape(path)}:([^"|]+)', svg)}
        found[path] = {
            "kind": kind,
            "about": about,
            "values": {},
            "outcomes": outcomes,
            "break": False,
        }
    found["chase/follow/drive/go"] |= {
        "values": {"subsystem": "chase", "goal": "← goal"},
        "outcomes": {"arrived": {}, "no_path": {}, "stuck": {}, "lost": {}},
    }
    found["chase/follow/choose"]["outcomes"] = {"chosen": {"pose": "Pose2"}, "none": {}}
    return found


def active_at(at: float) -> dict[str, float]:
    """All active paths and since when."""
    number = max(n for n, (since, _, _) in enumerate(COURSE) if since <= at)
    path, active = COURSE[number][1], {"": 0.0}
    parts = path.split("/")
    for length in range(1, len(parts) + 1):
        box, first = "/".join(parts[:length]), number
        while first and (COURSE[first - 1][1] + "/").startswith(box + "/"):
            first -= 1
        active[box] = COURSE[first][0]
    if parts[0] == "chase":
        active |= {f"chase/{guard}": active["chase"] for guard in GUARDS}
    return active


def transitions(start: float, to: float) -> list[Message]:
    """What is told of each step: the box, and which child ended how and led where."""
    split = [
        (at, *before.rsplit("/", 1), outcome, path)
        for (_, before, outcome), (at, path, _) in pairwise(COURSE)
    ]
    return [
        {
            "at": at,
            "kind": "move",
            "path": box,
            "text": f"{child}.{outcome} → {path}",
            "child": child,
            "outcome": outcome,
        }
        for at, box, child, outcome, path in split
        if start < at <= to
    ]


def room() -> Message:
    outer = [0.0, 0.0, 9.0, 0.0, 9.0, 7.0, 0.0, 7.0]
    tracked, table = [1, 1, 8, 1, 8, 6, 1, 6], [6, 0.2, 7.4, 0.2, 7.4, 0.9, 6, 0.9]
    inner = [0.4, 0.4, 8.6, 0.4, 8.6, 6.6, 0.4, 6.6]
    return {
        "t": "room",
        "bounds": [0, 0, 9, 7],
        "shapes": [
            {"l": "inflations", "k": "poly", "c": "inflation-1", "p": inner},
            {"l": "tracked", "k": "poly", "c": "tracked", "p": tracked, "fill": True, "a": 0.25},
            {"l": "room", "k": "poly", "c": "wall", "p": outer},
            {"l": "objects", "k": "poly", "c": "object", "p": table, "fill": True},
            {"l": "objects", "k": "text", "c": "object", "p": [6.05, 1.0], "s": "table"},
            {"l": "places", "k": "disc", "c": "place", "p": [1.0, 6.0], "r": 0.15, "s": "dock"},
        ],
    }  # fmt: skip


def frame(at: float) -> Message:
    """The moving shapes: a robot that circles about a user who turns."""
    ux, uy, turn = 4.5 + 0.8 * math.sin(at / 9), 3.4 + 0.5 * math.cos(at / 7), at / 6
    rx, ry, yaw = 4.5 + 2.4 * math.cos(at / 8), 3.4 + 2.1 * math.sin(at / 8), at / 8 + math.pi / 2
    corner = [(0.45, 0.35), (-0.45, 0.35), (-0.45, -0.35), (0.45, -0.35)]
    body = [v for x, y in corner for v in turned(rx, ry, yaw, x, y)]
    cells, weights = [], []
    for i in range(-20, 21):
        for j in range(-20, 21):
            if 1.5 < (r := math.hypot(i, j) / 8) < 2.5:
                cells += turned(ux, uy, turn, i / 8, j / 8)
                weights.append(max(0.0, math.cos(math.atan2(j, i) / 2)) * (2.5 - r))
    wedge = [ux, uy]
    for k in range(-36, 37, 6):
        wedge += turned(
            ux, uy, turn, 2.5 * math.cos(math.radians(k)), 2.5 * math.sin(math.radians(k))
        )
    scan = []
    for k in range(240):
        a = k * math.tau / 240
        far = min(
            ((9 - rx) if math.cos(a) > 0 else -rx) / (math.cos(a) or 1e-9),
            ((7 - ry) if math.sin(a) > 0 else -ry) / (math.sin(a) or 1e-9),
        )
        scan += [round(rx + far * math.cos(a), 3), round(ry + far * math.sin(a), 3)]
    path = [
        v
        for k in range(12)
        for v in (4.5 + 2.4 * math.cos(at / 8 + k / 12), 3.4 + 2.1 * math.sin(at / 8 + k / 12))
    ]
    goal = {"p": path[-2:], "yaw": at / 8 + 1 + math.pi / 2, "r": 0.4}
    arm = [rx, ry, *turned(rx, ry, yaw, 0.5, 0), *(tip := turned(rx, ry, yaw, 0.7, 0.25))]
    ways = [k * math.pi / 6 for k in range(12)]
    poses = [(k, [ux + 2 * math.cos(k), uy + 2 * math.sin(k)]) for k in ways]
    deep = turned(ux, uy, turn, 0.6, -0.2)
    chase = {"p": cells, "w": weights, "cell": 0.125, "yaw": turn, "a": 0.75}
    return {
        "t": "frame",
        "at": at,
        "shapes": [
            {"l": "chase", "k": "cells", "c": "chase", **chase},
            {"l": "user", "k": "poly", "c": "view", "p": wedge, "fill": True, "a": 0.3},
            {"l": "zones", "k": "disc", "c": "ring", "p": [ux, uy], "r": 1.5},
            {"l": "scan", "k": "dots", "c": "scan", "p": scan},
            {"l": "path", "k": "line", "c": "path", "p": path},
            {"l": "goal", "k": "arrow", "c": "goal", **goal},
            *({"l": "escape", "k": "arrow", "c": "escape", "p": p, "yaw": k} for k, p in poses),
            {"l": "robot", "k": "poly", "c": "robot", "p": body, "fill": True, "a": 0.35},
            {"l": "robot", "k": "poly", "c": "robot", "p": body},
            {"l": "arm", "k": "line", "c": "arm", "p": arm},
            {"l": "arm", "k": "disc", "c": "held", "p": tip, "r": 0.08, "fill": True},
            {"l": "user", "k": "disc", "c": "user", "p": [ux, uy], "r": 0.25, "fill": True},
            {"l": "deep", "k": "disc", "c": "deep", "p": deep, "r": 0.06, "fill": True},
        ],
    }


def turned(x: float, y: float, yaw: float, dx: float, dy: float) -> list[float]:
    c, s = math.cos(yaw), math.sin(yaw)
    return [round(x + c * dx - s * dy, 3), round(y + s * dx + c * dy, 3)]


def lanes(at: float) -> Message:
    """A lane for each box of the first level, and for each action."""
    spans: dict[str, list[list[Any]]] = {}
    ends = [since for since, _, _ in COURSE[1:]] + [UNTIL]
    for (since, path, outcome), end in zip(COURSE, ends, strict=True):
        if since > at:
            break
        top = path.split("/")[0]
        over = end <= at
        if spans.get(top) and spans[top][-1][1] == since:
            spans[top][-1][1:] = [end if over else None, None]
        else:
            spans.setdefault(top, []).append([since, end if over else None, None])
        spans.setdefault(path, []).append([since, end if over else None, outcome if over else None])
    marks = [m for m in MARKS if m["at"] <= at]
    listed = [
        {"path": p, "name": p.rsplit("/", 1)[-1], "spans": s} for p, s in sorted(spans.items())
    ]
    return {"t": "lanes", "lanes": listed, "marks": marks, "to": at}


MARKS = [
    {"at": 12.0, "kind": "command", "text": "anna: stop"},
    {"at": 16.0, "kind": "command", "text": "anna: SetLevel"},
    {"at": 30.0, "kind": "request", "text": "asked for a prop"},
    {"at": 50.0, "kind": "escape", "text": "the user comes near"},
    {"at": 52.4, "kind": "missed", "text": "a tick was missed"},
]


def plot(signal: str, until: float) -> Message:
    at = [k / 50 for k in range(int(until * 50))]
    values = [[math.sin(t / 3 + k) + 0.1 * math.sin(17 * t) for t in at] for k in range(3)]
    return {"t": "plot", "signal": signal, "fields": ["x", "y", "yaw"], "at": at, "values": values}


def running(chart: str) -> Message:
    """The text of a chart, as it runs."""
    text = f"chart: {chart}  # runs"
    return {"t": "text", "chart": chart, "text": text, "charts": ["chase", "cobodeck"]}


class FakePageServer:
    """Serves the page on a port of its own; `received` is what pages sent, newest last."""

    def __init__(self, svg: str, mode: str = "live", port: int = 0) -> None:
        self.svg, self.port = svg, port
        self.received: list[Message] = []
        self.pages: dict[ServerConnection, str] = {}
        self._turns = 0
        self.begin(mode)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def begin(self, mode: str, at: float = 20.0, speed: float = 0.0) -> None:
        """Another run, record or folder of charts, with a token of its own; nobody is told yet."""
        self.mode, self.at, self.speed = mode, at, speed
        self._turns += 1
        self._run = self._turns
        self.token = f"{TOKEN}-{self._run}"
        self.received = []
        self.form: list[Message] = []
        self.pages = dict.fromkeys(self.pages, "")
        self.holder: Any = None
        self.stopped = self.real = self.parts = False

    def renew(self) -> None:
        """Tell all pages anew what there is."""
        for page in list(self.pages):
            self._now(self._show(page))

    def marked(self) -> str:
        """A line in the log, after all that was sent before."""
        self._turns += 1
        self.tell({"t": "say", "text": (text := f"mark {self._turns}")})
        return text

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    def _now(self, job: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(job, self._loop).result(60)

    def start(self) -> None:
        """Listens, after `close` on the same port again."""
        self._server = self._now(self._listen())
        self.port = next(iter(self._server.sockets)).getsockname()[1]
        self.listens = True
        self._clock = asyncio.run_coroutine_threadsafe(self._play(), self._loop)

    async def _listen(self) -> Server:
        # no pings: pages of a busy machine are late, not gone
        return await serve(
            self._talk, "127.0.0.1", self.port, process_request=self._file, ping_interval=None
        )

    def close(self) -> None:
        """Breaks all connections and listens no more."""
        self._clock.cancel()
        self.listens = False
        self._server.close()
        self._now(self._server.wait_closed())

    def tell(self, message: Message) -> None:
        """To all pages."""
        self._now(self._tell(message))

    async def _tell(self, message: Message) -> None:
        for page in list(self.pages):
            with suppress(ConnectionClosed):
                await page.send(json.dumps(message))

    def _file(self, _: ServerConnection, request: Request) -> Response | None:
        if request.path == "/ws":
            return None
        if request.path == "/elsewhere":  # a page that no policy binds
            return Response(HTTPStatus.OK, "OK", Headers({"Content-Type": "text/html"}), b"<p>")
        name = "index.html" if request.path == "/" else request.path.removeprefix("/page/")
        if name not in {file.name for file in PAGE.iterdir()}:
            return Response(HTTPStatus.NOT_FOUND, "Not Found", Headers(), b"")
        headers = Headers()
        headers["Content-Type"] = f"{KINDS[Path(name).suffix]}; charset=utf-8"
        headers["Content-Security-Policy"] = POLICY
        body = (PAGE / name).read_bytes()
        headers["Content-Length"] = str(len(body))
        return Response(HTTPStatus.OK, "OK", headers, body)

    async def _play(self) -> None:
        """Frames at 20 Hz; the time of a record stands still until it is played."""
        last = self.at
        while True:
            await asyncio.sleep(1 / HZ)
            if not self.pages or self.mode == "charts":
                continue
            if not self.stopped:
                self.at = min(self.at + self.speed / HZ, UNTIL)
            if self.at == last:
                continue
            await self._tell(frame(self.at))
            if new := transitions(last, self.at):
                await self._tell(
                    {"t": "ev", "at": self.at, "active": active_at(self.at), "last": new}
                )
                if self.mode == "live":
                    await self._tell(lanes(self.at) | {"t": "lanes+", "marks": []})
            last = self.at

    def hello(self) -> Message:
        return {
            "t": "hello",
            "mode": self.mode,
            "title": "cobodeck",
            "real": self.real,
            "about": ["lab_a", "demo", f"began 2026-11-28T04:40:56.{490 + self._run}+00:00"],
            "on_parts": self.parts,
            "paced": not self.parts,
            "commands": self.mode != "record",
            "until": UNTIL,
            "moves": [at for at, _, _ in COURSE[1:]],
            "signals": [{"name": n, "type": t} for n, t in SIGNALS.items()],
            "layers": [{"name": n, "on": n not in OFF} for n in LAYERS],
            "profiles": ["tuned", "base", "paper"],
            "stop_is": "a software stop, not a safety device",
        }

    def chart(self, **more: Any) -> Message:
        return {
            "t": "chart",
            "name": "cobodeck",
            "svg": self.svg,
            "nodes": nodes_of(self.svg),
            "findings": [],
            "stale": False,
            "slot": 0,
            "form": self.form,
            **more,
        }

    def state(self, page: ServerConnection | None = None) -> Message:
        name = self.pages.get(self.holder, "ben") if self.holder else None
        return {
            "t": "state",
            "at": self.at,
            "active": active_at(self.at),
            "last": transitions(self.at - 30, self.at)[-3:],
            "data": {"": {"deep": "none", "since": "none"}, "chase": {"shown": "none"}},
            "waiting": {},
            "locks": [],
            "level": None,
            "paused": False,
            "breaks": [],
            "operator": {"name": name, "you": page is not None and page is self.holder},
            "stop": self.stopped,
            "faults": [],
            "ended": None,
            "speed": self.speed,
        }

    async def _show(self, page: ServerConnection) -> None:
        begin = [self.hello(), self.chart()]
        if self.mode != "charts":
            begin.append(self.state(page))
            whole = UNTIL if self.mode == "record" else self.at
            begin += [room(), frame(self.at), lanes(whole), self.figures(None), HEALTH]
        for message in begin:
            await page.send(json.dumps(message))

    async def _talk(self, page: ServerConnection) -> None:
        self.pages[page] = ""
        try:
            await self._show(page)
            async for text in page:
                message = json.loads(text)
                self.received.append(message)
                for answer in await self.answers(page, message):
                    await page.send(json.dumps(answer))
        except ConnectionClosed:
            pass
        finally:
            del self.pages[page]
            if self.holder is page:
                self.holder = None

    def figures(self, range_: list[float] | None) -> Message:
        rows = [
            ["Chases", "3"], ["time in Chase", "46.2 s"], ["mean distance to the user", "2.31 m"],
            ["haptic requests served", "1 of 1"], ["Escapes", "1"],
            ["nearest to the user", "0.84 m"],
        ]  # fmt: skip
        final = self.mode == "record" and self.at >= UNTIL
        return {"t": "figures", "rows": rows, "range": range_, "final": final}

    async def answers(self, page: ServerConnection, message: Message) -> list[Message]:
        kind = message["t"]
        by_kind: dict[str, Callable[[], list[Message]]] = {
            "seek": lambda: self._seek(page, message["at"]),
            "play": lambda: self._speed(message["speed"]),
            "plot": lambda: [plot(message["signal"], self.at)] if message["on"] else [],
            "range": lambda: [self.figures([message["from"], message["to"]])],
            "auth": lambda: self._auth(page, message),
            "text": lambda: [running(message.get("chart", "cobodeck"))],
        }
        if kind == "cmd":
            return await self._command(page, message)
        return by_kind[kind]() if kind in by_kind else []

    def _seek(self, page: ServerConnection, at: float) -> list[Message]:
        self.at = at
        return [self.state(page), frame(at)]

    def _speed(self, speed: float) -> list[Message]:
        self.speed = speed
        return [{"t": "ev", "at": self.at, "speed": speed}]

    def _auth(self, page: ServerConnection, message: Message) -> list[Message]:
        if message["token"] != self.token:
            return [{"t": "ack", "id": 0, "ok": False, "text": "wrong token"}]
        self.pages[page] = message["name"]
        return [{"t": "ack", "id": 0, "ok": True, "text": f"let in as {message['name']}"}]

    async def _command(self, page: ServerConnection, message: Message) -> list[Message]:
        def ack(ok: bool, text: str) -> Message:
            return {"t": "ack", "id": message["id"], "ok": ok, "text": text}

        if message["do"] == "stop":
            self.stopped = True
            await self._tell({"t": "ev", "at": self.at, "stop": True})
            return [ack(True, "stopped")]
        if not self.pages[page]:
            return [ack(False, "needs the token that the terminal shows")]
        if message["do"] in ("take", "release"):
            self.holder = page if message["do"] == "take" else None
            for other in list(self.pages):
                await other.send(json.dumps({"t": "ev", "operator": self.state(other)["operator"]}))
            return [ack(True, "you hold control" if self.holder else "given back")]
        self.holder = self.holder or page
        if page is not self.holder:
            return [ack(False, "somebody else holds control")]
        if message["do"] == "reset":
            self.stopped = False
            await self._tell({"t": "ev", "at": self.at, "stop": False})
        if message["do"] == "start":
            return [ack(True, "begun") | {"url": "http://0.0.0.0:1/"}]
        return [ack(True, "done")]


HEALTH = {
    "t": "health", "late": 0, "missed": 1, "tick_p99_ms": 3.4, "dropped": 0, "pages": 1,
    "ages": {"user.pose": 0.011, "base.pose": 0.02, "scan": 0.061},
    "children": [{"name": "localization", "state": "runs"}, {"name": "server", "state": "runs"}],
    "gates": {"speed gate": "open"},
}  # fmt: skip


def main() -> None:
    mode = sys.argv[1] if len(sys.argv) > 1 else "live"
    with FakePageServer(drawn("cobodeck", -1), mode, port=8765) as server:
        server.begin(mode, speed=float(mode == "live"))
        sys.stdout.write(f"{server.url}\ntoken {server.token}\n")
        threading.Event().wait()


if __name__ == "__main__":
    main()
