"""Who may do what on pages, and that bad clients disturb nobody."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
from collections.abc import AsyncIterator, Coroutine, Iterable
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus
from websockets.http11 import Response

from cobodeck.live import server as live_server
from cobodeck.live.access import Access, PageAddress, Rules, is_ours
from cobodeck.live.clients import (
    BOUND,
    LARGEST_MESSAGE,
    MOST_QUESTIONS,
    Page,
    PageMessage,
    Pages,
    parsed,
)
from cobodeck.live.conversation import ANSWERED_AT_ONCE
from cobodeck.live.server import (
    BURST,
    MOST_CONNECTIONS,
    MOST_PAGES,
    UNREAD,
    PageServer,
    serve,
)
from cobodeck.live.session import show_source, told_far
from tests.cobodeck.live.pages import PATIENCE_S, TOKEN, Client, Shown, client, run, serving, until

COMMANDS = ["reset", "ack", "pause", "resume", "step", "preempt", "end", "force", "consent",
            "refuse", "lock", "unlock", "level", "break", "unbreak", "speed", "replace", "start",
            "take", "release", "nonsense"]  # fmt: skip
ON_PARTS = Rules(commands=True, on_parts=True)


@pytest.mark.requirement(48, 54)
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
            assert [order["who"] for order in source.orders if order.get("do") == "pause"] == ["me"]

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
            assert (await second.authorize("ann"))["ok"]
            assert await first.hear("ev", operator={"name": "ann", "you": False})
            await until(lambda: source.orders[-1] == {"t": "held", "name": "ann"})
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
            assert (await page.hear("hello"))["on_parts"]  # so that it says to keep it in front
            await page.authorize("me")
            await page.command("take")
            for _ in range(5):
                now += 0.4
                await page.tell(t="beat")
                await until(lambda: source.orders.pop()["t"] == "beat" if source.orders else False)
            await asyncio.sleep(0)
            assert "stop" not in source.done
            now += 0.6
            await until(lambda: "stop" in source.done)
            assert server.access.holder is None

    run(main())


@pytest.mark.requirement(55)
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


@pytest.mark.requirement(49)
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


HOSTS = ("evil.example:PORT", "127.0.0.1.evil.example:PORT", "127.0.0.1:1", "127.0.0.1", "",
         "evil@127.0.0.1:PORT", "127.0.0.1:PORT/x", "127.0.0.1:PORT?x", "127.0.0.1:PORT#x",
         "127.0.0.1:", "127.0.0.1:x", "[::1", "127.0.0.1:PORT\r\nHost: evil.example:PORT",
         "127.0.0.1:PORT\r\nHost: 127.0.0.1:PORT")  # fmt: skip


def test_names_that_were_made_to_point_here_are_refused(capfd: pytest.CaptureFixture[str]) -> None:
    """With what would be right; and not a word of it goes to the terminal of a run."""

    async def main() -> None:
        async with serving(Shown()) as server:
            for host in (f"Host: {host}\r\n".replace("PORT", str(server.port)) for host in HOSTS):
                told = await asked(server, f"GET / HTTP/1.1\r\n{host}\r\n".encode())
                assert told.startswith(b"HTTP/1.1 421 "), (host, told)
            assert f"port {server.port} at both ends".encode() in told
            told = await asked(server, b"GET / HTTP/1.1\r\n\r\n")
            assert b"421" in told.splitlines()[0]
            for junk in (b"GET\r\n\r\n", b"POST / HTTP/1.1\r\n\r\n", b"\x16\x03\x01\r\n\r\n"):
                assert b"200" not in (await asked(server, junk))[:20]

    run(main())
    assert capfd.readouterr() == ("", "")


def test_hosts_that_are_ours() -> None:
    near, far = PageAddress(), PageAddress("0.0.0.0")
    assert is_ours("localhost", 80, near)
    assert is_ours("LOCALHOST:81", 81, near)
    assert not is_ours("localhost:0", 80, near)
    assert not is_ours("", 80, near)
    assert is_ours("localhost:80", 80, near)
    assert is_ours("[::1]:80", 80, near)
    assert not is_ours("192.168.0.7:80", 80, near)
    assert is_ours("192.168.0.7:80", 80, far)
    assert is_ours("[fe80::1]:80", 80, far)
    assert not is_ours("rebound.example:80", 80, far)
    assert is_ours("lab.example:80", 80, PageAddress("Lab.example"))


def test_a_token_is_text_and_told_to_nobody() -> None:
    access = Access(Rules(commands=True), "right", float)
    for number, token in enumerate(("", "Right", "right ", "\ud800", 5, None, ["right"], {}), 1):
        told = access.authorize(1, token, "me")
        assert told is not None
        assert "right" not in told
        assert access.tries_too_much(1) is (number >= 5)
    assert access.authorize(2, "right", "\ud800\u202e\x1b[2J" + "x" * 100) is None
    assert access.name_of(2) == "[2J" + "x" * 37


MESSAGES = ("[]", "5", '"x"', "null", "{}", '{"t": 5}', '{"t": "x", "at": NaN}', b"\xff",
            '{"t": "x", "at": 1e999}', '{"t": "x", "at": ' + "9" * 5000 + "}", '{"t": "x"',
            '{"t": "x", "at": 99999999999999999999}', '{"t": "x", "a": [[[1]]]}', "[" * 60_000,
            '{"t": "x", "id": [1]}', '{"t": "x", "id": "' + "i" * 50 + '"}', '{"t": "x"} {}',
            '{"t": "x", "at": ' + "9" * 400 + "}", '{"t": "x", "a": "\\ud800"}',
            '{"t": "x", "a": ' + '{"a":' * 900 + "1" + "}" * 901)  # fmt: skip


@pytest.mark.parametrize(
    ("rules", "told"),
    [
        (Rules(), "sees this record. N"),
        (Rules(commands=True, open=frozenset()), "sees these charts; with the token they start"),
        (Rules(commands=True), "sees this run, and can stop it; with the token they command it. N"),
    ],
)
def test_what_others_may_do_is_said(rules: Rules, told: str) -> None:
    assert told in told_far("0.0.0.0", rules)


def test_messages_are_small_objects() -> None:
    for text in MESSAGES:
        assert parsed(text) is None, text[:40]
    for text in ('{"t":"x"}', '{"t":"x","id":1,"o":{"k":"v"}}', '{"t":"a","t":"b","a":"\\u1f00"}'):
        assert parsed(text) is not None


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
    await refused(page, 1009)


async def _garbage(server: PageServer, page: Client) -> None:
    await page.socket.send("[1, 2")
    await refused(page, 1003)


async def _deep(server: PageServer, page: Client) -> None:
    await page.socket.send("[" * 30_000)
    await refused(page, 1003)


async def _wrong_kinds(server: PageServer, page: Client) -> None:
    wrong = ({"t": "layers", "on": 5}, {"t": "layers", "on": [{}]}, {"t": "auth", "token": 5},
             {"t": "auth", "token": "é"}, {"t": "cmd", "do": []}, {"t": "cmd"})  # fmt: skip
    for message in wrong:
        await page.tell(id=1, **message)
        told = await page.hear("say" if message["t"] == "layers" else "ack")
        assert told.get("ok", False) is False
    await page.tell(t="nonsense")
    assert not (await page.command("pause"))["ok"]


async def _foreign(server: PageServer, page: Client) -> None:
    with pytest.raises(InvalidStatus):
        await client(server, origin="http://evil.example")


async def closed_by(doing: Coroutine[Any, Any, None]) -> None:
    """Do something for which the server ends the connection."""
    with pytest.raises((ConnectionClosed, ConnectionError)):
        await doing


async def refused(page: Client, code: int) -> None:
    """The server closes the connection, and says why."""
    with pytest.raises(ConnectionClosed) as closed:
        await page.hear("never")
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == code


async def _guesses(server: PageServer, page: Client) -> None:
    async def guess() -> None:
        for number in range(50):
            await page.authorize("me", f"guess {number}")

    await closed_by(guess())
    assert server.access.holder is None


async def _flood(server: PageServer, page: Client) -> None:
    async def flood() -> None:
        for _ in range(5 * int(BURST)):
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
    async with asyncio.timeout(PATIENCE_S):
        with suppress(ConnectionError):
            assert await reader.read() == b""
    writer.close()


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


BAD = [_huge, _garbage, _deep, _wrong_kinds, _guesses, _foreign, _flood, _fragments,
       _pings, _half_open, _thousand]  # fmt: skip


@pytest.mark.requirement(54)
@pytest.mark.parametrize(
    "bad",
    [
        pytest.param(one, id=one.__name__, marks=[pytest.mark.slow] * (one in (_pings, _thousand)))
        for one in BAD
    ],
)
def test_a_bad_client_disturbs_nobody(bad: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_server, "OPENING_S", 0.2)

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
            assert [json.loads(text)["n"] for text in slow._newest.values()] == [number]
            server.pages.tell({"t": "say", "text": "still here"})
            await page.hear("say", text="still here")
            raw.close()

    run(main())


@asynccontextmanager
async def sent_to(page: Page) -> AsyncIterator[list[str]]:
    """The kinds of the messages that a page gets from now on; its snapshot is a `state`."""
    kinds: list[str] = []

    async def send(text: str) -> None:
        kinds.append(json.loads(text)["t"])

    sending = asyncio.create_task(page.send_all(send, lambda _page: [{"t": "state"}]))
    yield kinds
    sending.cancel()


def test_a_message_larger_than_all_that_may_wait_is_sent_all_the_same() -> None:
    async def main() -> None:
        page = Page(1, bound=100)
        async with sent_to(page) as sent:
            await until(lambda: sent)
            page.tell({"t": "plot", "values": [1.5] * 100})
            await until(lambda: not page.waiting)
            assert sent == ["state", "plot"]

    run(main())


class Slow(Shown):
    """A source whose answers take as long as the test wants."""

    def __init__(self) -> None:
        super().__init__(ON_PARTS)
        self.go_on = asyncio.Event()

    async def asked(self, page: Page, message: PageMessage) -> Iterable[PageMessage]:
        self.questions.append(message)
        await self.go_on.wait()
        return [{"t": "say", "text": str(message.get("at", message["t"]))}]


@pytest.mark.requirement(48, 55)
def test_neither_a_stop_nor_signs_of_life_wait_for_an_answer() -> None:
    async def main() -> None:
        source = Slow()
        async with serving(source) as server, client(server) as socket:
            page = Client(socket)
            await page.authorize("me")
            await page.command("take")
            await page.tell(t="range", **{"from": 0.0, "to": 9.0})
            await until(lambda: source.questions)
            for at in range(5):
                await page.tell(t="seek", at=at)
            source.orders.clear()

            await page.tell(t="beat")
            assert (await page.command("stop"))["ok"]

            assert [order["t"] for order in source.orders] == ["beat", "cmd"]
            source.go_on.set()
            assert [(await page.hear("say"))["text"] for _ in range(2)] == ["range", "4"]
            assert len(source.questions) == 2  # of instants sought meanwhile only the last

    run(main())


def test_questions_that_wait_are_bounded_and_go_with_their_page() -> None:
    async def main() -> None:
        source = Slow()
        async with serving(source) as server:
            for _ in range(2 * ANSWERED_AT_ONCE):
                async with client(server) as socket:
                    page = Client(socket)
                    await page.hear("state")
                    for _ in range(3):
                        await page.tell(t="range")
                    await page.command("stop")
            await until(lambda: not server.pages)
            assert len(source.questions) == ANSWERED_AT_ONCE
            source.go_on.set()
            async with client(server) as socket:
                page = Client(socket)
                await page.tell(t="plot")
                await page.hear("say", text="plot")
            assert len(source.questions) == ANSWERED_AT_ONCE + 1
        page_alone = Page(1)
        assert all(page_alone.ask({"t": "range"}) for _ in range(MOST_QUESTIONS))
        assert not page_alone.ask({"t": "range"})

    run(main())


def test_an_answer_outlives_a_new_snapshot() -> None:
    async def main() -> None:
        page = Page(1)
        page.tell({"t": "ev"})  # before the first snapshot, which has it
        page.answer({"t": "ack", "id": 1})
        page.renew()
        async with sent_to(page) as sent:
            await until(lambda: not page.waiting)
            assert sent == ["state", "ack"]

    run(main())


def test_the_sixty_fifth_page_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a bound that is soon reached."""
    assert MOST_PAGES == 64
    monkeypatch.setattr(live_server, "MOST_PAGES", 3)

    async def main() -> None:
        async with serving(Shown()) as server:
            held = [await client(server) for _ in range(3)]
            with pytest.raises((InvalidStatus, ConnectionClosed)) as refused:
                await client(server)
            response: Response = refused.value.response  # type: ignore[union-attr]
            assert response.status_code == 503
            await asyncio.gather(*(one.close() for one in held))

    run(main())


def test_pages_may_come_while_a_run_ends() -> None:
    class Ending(Shown):
        async def run(self, pages: Pages) -> None:
            self.pages = pages
            await over.wait()

    over = asyncio.Event()

    async def come(server: PageServer) -> None:
        """Connect again and again, until nothing is there any more."""
        while True:
            try:
                async with client(server) as link:
                    await link.wait_closed()
            except ConnectionRefusedError:
                return
            except (InvalidHandshake, ConnectionError, EOFError):
                continue

    async def main() -> None:
        servers: list[PageServer] = []
        serving_it = asyncio.create_task(serve(Ending(), PageAddress(), TOKEN, servers.append))
        await until(lambda: servers)
        coming = [asyncio.create_task(come(servers[0])) for _ in range(8)]
        await until(lambda: len(servers[0].pages) == 8)
        over.set()
        await serving_it
        await asyncio.gather(*coming)
        assert not servers[0].pages

    run(main())


def test_an_error_of_the_program_is_told_and_other_pages_go_on(
    capfd: pytest.CaptureFixture[str],
) -> None:
    class Wrong(Shown):
        def snapshot(self, page: Page) -> Iterable[PageMessage]:
            return [{"t": "state", "at": 1 / (page.number - 2)}]

        async def asked(self, page: Page, message: PageMessage) -> Iterable[PageMessage]:
            raise ZeroDivisionError("oh")

    async def main() -> None:
        async with serving(Wrong()) as server, client(server) as good:
            page = Client(good)
            await page.hear("state")
            async with client(server) as other:
                await refused(Client(other), 1011)
            await page.tell(t="seek", at=1.0)
            while "ZeroDivisionError: oh" not in (await page.hear("say"))["text"]:
                pass
            assert (await page.command("stop"))["ok"]

    run(main())
    assert "ZeroDivisionError: oh" in capfd.readouterr().err


@pytest.mark.requirement(19)
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


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_page_where_it_waits_and_not_wherever_the_loop_is(number: int) -> None:
    seen = []

    class Signalled(Shown):
        async def run(self, pages: Pages) -> None:
            os.kill(os.getpid(), number)
            seen.append("goes on")
            try:
                await asyncio.sleep(PATIENCE_S)
            except asyncio.CancelledError:
                seen.append("ends in order")
                raise

    before = signal.signal(number, signal.default_int_handler)
    try:
        show_source(Signalled(), PageAddress("127.0.0.1", 0), seen.append)
    finally:
        signal.signal(number, before)

    assert seen[0].startswith("page: http://")
    assert seen[1:] == ["goes on", "ends in order"]
