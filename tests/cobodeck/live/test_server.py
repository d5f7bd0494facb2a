"""Who may do what on pages, and that bad clients disturb nobody."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Coroutine
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.http11 import Response

from cobodeck.live.access import PageAddress, Rules, is_ours
from cobodeck.live.clients import BOUND
from cobodeck.live.server import (
    LARGEST_MESSAGE,
    MOST_CONNECTIONS,
    MOST_PAGES,
    UNREAD,
    PageServer,
)
from tests.cobodeck.live.pages import Client, Shown, client, run, serving, until

COMMANDS = ["reset", "ack", "pause", "resume", "step", "preempt", "end", "force", "consent",
            "refuse", "lock", "unlock", "level", "break", "unbreak", "speed", "replace", "start",
            "take", "release", "nonsense"]  # fmt: skip
ON_PARTS = Rules(commands=True, on_parts=True)


@pytest.mark.requirement(54)
def test_anybody_stops_and_all_else_needs_the_token() -> None:
    async def main() -> None:
        source = Shown()
        async with serving(source) as server, client(server) as socket:
            page = Client(socket)
            assert (await page.hear("hello"))["stop_is"] == "a software stop, not a safety device"
            for do in COMMANDS:
                assert not (await page.command(do))["ok"], do
            assert not (await page.authorize("me", "wrong"))["ok"]
            assert source.done == []
            assert (await page.command("stop"))["ok"]
            assert source.done == ["stop"]
            assert (await page.authorize("me"))["ok"]
            assert (await page.command("pause"))["ok"]
            assert [order["who"] for order in source.orders if order["do"] == "pause"] == ["me"]

    run(main())


def test_one_page_has_control_and_another_takes_it_over_as_both_see() -> None:
    async def main() -> None:
        source = Shown()
        async with serving(source) as server, client(server) as one, client(server) as two:
            first, second = Client(one), Client(two)
            await first.authorize("first")
            await second.authorize("second")
            await first.command("take")
            assert not (await second.command("pause"))["ok"]
            assert (await second.command("stop"))["ok"]
            assert (await second.command("take"))["ok"]
            told = await first.hear("say")
            while "second" not in told["text"]:
                told = await first.hear("say")
            assert not (await first.command("pause"))["ok"]
            assert (await second.command("pause"))["ok"]
            await one.close()
            await second.command("release")
            shown = await second.hear("ev", operator={"name": None, "you": False})
            assert shown
            assert source.done == ["stop", "pause"]

    run(main())


@pytest.mark.requirement(55)
def test_a_controlling_page_that_is_not_heard_stops_a_run_on_parts() -> None:
    async def main() -> None:
        now = 0.0
        source = Shown(ON_PARTS)
        async with serving(source, lambda: now) as server, client(server) as socket:
            page = Client(socket)
            await page.authorize("me")
            await page.command("take")
            for _ in range(5):
                now += 0.4
                await page.tell(t="beat")
                await until(lambda: source.orders.pop()["do"] == "beat" if source.orders else False)
            await asyncio.sleep(0)
            assert "stop" not in source.done
            now += 0.6
            await until(lambda: "stop" in source.done)
            assert server.access.holder is None

    run(main())


def test_a_page_in_control_that_closes_is_missed_on_parts_and_nowhere_else() -> None:
    async def main(rules: Rules, stops: bool) -> None:
        now = 0.0
        source = Shown(rules)
        async with serving(source, lambda: now) as server:
            async with client(server) as socket:
                page = Client(socket)
                await page.authorize("me")
                await page.command("take")
            await until(lambda: not server.pages)
            now += 0.6
            await until(lambda: server.access.holder is None)
            assert ("stop" in source.done) is stops

    run(main(ON_PARTS, True))
    run(main(Rules(commands=True), False))


def test_real_parts_are_reset_at_the_console() -> None:
    async def main() -> None:
        source = Shown(Rules(commands=True, on_parts=True, real=True))
        async with serving(source) as server, client(server) as socket:
            page = Client(socket)
            await page.authorize("me")
            assert "console" in (await page.command("reset"))["text"]
            assert (await page.command("pause"))["ok"]

    run(main())


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"]
)
def test_pages_of_others_are_refused(origin: str) -> None:
    async def main() -> None:
        async with serving(Shown()) as server:
            with pytest.raises(InvalidStatus) as refused:
                async with client(server, origin=origin):
                    pass
            assert refused.value.response.status_code == 403

    run(main())


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "127.0.0.1:1", ""])
def test_names_that_were_made_to_point_here_are_refused(host: str) -> None:
    async def main() -> None:
        async with serving(Shown()) as server:
            told = await asked(server, f"GET / HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            assert b"200" not in told.splitlines()[0]

    run(main())


def test_hosts_that_are_ours() -> None:
    near, far = PageAddress(), PageAddress("0.0.0.0")
    assert is_ours("localhost:80", 80, near)
    assert is_ours("[::1]:80", 80, near)
    assert not is_ours("192.168.0.7:80", 80, near)
    assert is_ours("192.168.0.7:80", 80, far)
    assert not is_ours("rebound.example:80", 80, far)
    assert not is_ours(None, 80, far)


async def asked(server: PageServer, data: bytes) -> bytes:
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    writer.write(data)
    async with asyncio.timeout(20.0):
        told = await reader.read()
    writer.close()
    return told


@pytest.mark.parametrize(
    "path",
    ["/page/../server.py", "/page/%2e%2e/server.py", "/page//etc/passwd", "/../../etc/passwd",
     "/page/", "/page/.", "//etc/passwd", "/page/..%5cserver.py", "/page/index.html/../x"],
)  # fmt: skip
def test_no_path_leads_out_of_the_page(path: str) -> None:
    async def main() -> None:
        async with serving(Shown()) as server:
            host = f"Host: 127.0.0.1:{server.port}\r\n"
            told = await asked(server, f"GET {path} HTTP/1.1\r\n{host}\r\n".encode())
            assert b"404" in told.splitlines()[0]
            told = await asked(server, f"GET / HTTP/1.1\r\n{host}\r\n".encode())
            assert b"200" in told.splitlines()[0]
            assert b"Content-Security-Policy" in told

    run(main())


async def _huge(server: PageServer, page: Client) -> None:
    await page.socket.send("x" * (LARGEST_MESSAGE + 1))
    with pytest.raises(ConnectionClosed):
        await page.hear("never")


async def _garbage(server: PageServer, page: Client) -> None:
    await page.socket.send("[1, 2")
    with pytest.raises(ConnectionClosed):
        await page.hear("never")


async def _deep(server: PageServer, page: Client) -> None:
    await page.socket.send("[" * 30_000)
    with pytest.raises(ConnectionClosed):
        await page.hear("never")


async def _wrong_kinds(server: PageServer, page: Client) -> None:
    for message in ({"t": "layers", "on": 5}, {"t": "auth", "token": 5}, {"t": "cmd", "do": []}):
        await page.tell(**message)
    await page.hear("ack")


async def closed_by(doing: Coroutine[Any, Any, None]) -> None:
    """Do something for which the server ends the connection."""
    with pytest.raises((ConnectionClosed, ConnectionError)):
        await doing


async def _guesses(server: PageServer, page: Client) -> None:
    async def guess() -> None:
        for number in range(50):
            await page.authorize("me", f"guess {number}")

    await closed_by(guess())
    assert server.access.holder is None


async def _flood(server: PageServer, page: Client) -> None:
    async def flood() -> None:
        for _ in range(5000):
            await page.tell(t="beat")
        await page.hear("never")

    await closed_by(flood())


async def _fragments(server: PageServer, page: Client) -> None:
    async def send() -> None:
        await page.socket.send("x" * 1000 for _ in range(1000))
        await page.hear("never")

    await closed_by(send())


async def _pings(server: PageServer, page: Client) -> None:
    raw = await raw_socket(server)
    pings = (b"\x89\xfd" + bytes(4) + bytes(125)) * 64

    async def flood() -> None:
        while True:
            await asyncio.get_running_loop().sock_sendall(raw, pings)
            waiting = [one.transport.get_write_buffer_size() for one in server._open]
            assert max(waiting, default=0) < UNREAD + (1 << 20)

    await closed_by(flood())
    raw.close()


async def _half_open(server: PageServer, page: Client) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    writer.write(b"GET /ws HTTP/1.1\r\nHost: ")
    await writer.drain()
    writer.transport.abort()
    del reader


async def _thousand(server: PageServer, page: Client) -> None:
    held: list[Any] = []
    for _ in range(1000):
        raw = socket.socket()
        raw.setblocking(False)
        held.append(raw)
        await asyncio.get_running_loop().sock_connect(raw, ("127.0.0.1", server.port))
    assert len(server._open) <= MOST_CONNECTIONS + 1
    for raw in held:
        raw.close()
    await until(lambda: len(server._open) < MOST_PAGES)


async def raw_socket(server: PageServer) -> socket.socket:
    """A WebSocket that reads no more once it is open."""
    raw = socket.create_connection(("127.0.0.1", server.port))
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    host = f"127.0.0.1:{server.port}"
    raw.sendall(
        f"GET /ws HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
    )
    raw.setblocking(False)
    return raw


BAD = [_huge, _garbage, _deep, _wrong_kinds, _guesses, _flood, _fragments, _pings, _half_open,
       _thousand]  # fmt: skip


@pytest.mark.requirement(54)
@pytest.mark.parametrize(
    "bad",
    [
        pytest.param(one, id=one.__name__, marks=[pytest.mark.slow] * (one in (_pings, _thousand)))
        for one in BAD
    ],
)
def test_a_bad_client_disturbs_nobody(bad: Any) -> None:
    async def main() -> None:
        source = Shown()
        async with serving(source) as server, client(server) as good:
            page = Client(good)
            await page.hear("state")
            async with client(server) as other:
                await bad(server, Client(other))
            assert (await page.command("stop"))["ok"]
            assert "stop" in source.done

    run(main())


def test_a_page_that_does_not_read_loses_frames_and_gets_a_snapshot_for_its_events() -> None:
    async def main() -> None:
        source = Shown()
        async with serving(source) as server, client(server) as good:
            page = Client(good)
            await page.hear("state")
            raw = await raw_socket(server)
            await until(lambda: len(server.pages) == 2)
            slow = max(server.pages, key=lambda one: one.number)
            event = {"t": "ev", "filling": "x" * 10_000}
            for number in range(2 * BOUND // 10_000):
                slow.tell({**event, "n": number})
                slow.tell({"t": "frame", "n": number}, "frame")
                assert slow.waiting <= BOUND + 100_000
                await asyncio.sleep(0)
            assert slow.skipped > 0
            server.pages.tell({"t": "say", "text": "still here"})
            await page.hear("say", text="still here")
            raw.close()

    run(main())


def test_the_sixty_fifth_page_is_refused() -> None:
    async def main() -> None:
        async with serving(Shown()) as server:
            held = [await client(server) for _ in range(MOST_PAGES)]
            with pytest.raises((InvalidStatus, ConnectionClosed)) as refused:
                await client(server)
            response: Response = refused.value.response  # type: ignore[union-attr]
            assert response.status_code == 503
            await asyncio.gather(*(one.close() for one in held))

    run(main())


def test_what_a_page_asks_is_answered_to_it_alone() -> None:
    async def main() -> None:
        source = Shown()
        async with serving(source) as server, client(server) as one, client(server) as two:
            first, second = Client(one), Client(two)
            await second.hear("state")
            await first.tell(t="seek", at=1.0)
            await first.hear("say", text="asked")
            server.pages.tell({"t": "say", "text": "all"})
            assert (await second.hear("say"))["text"] == "all"
            assert json.loads(json.dumps(source.questions)) == [{"t": "seek", "at": 1.0}]

    run(main())
