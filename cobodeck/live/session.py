"""A run with a live page: the server as a child, the feed to it, commands from it."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
from collections.abc import Callable, Coroutine
from contextlib import suppress
from pathlib import Path
from typing import Any

from cobodeck.live.access import PageAddress, Rules, new_token
from cobodeck.live.clients import Source
from cobodeck.live.feed import Feed
from cobodeck.live.steering import PageOperator
from cobodeck.loop import Loop
from cobodeck.record.format import attachments, header_of_setup
from cobodeck.setup import Options, Setup
from cobodeck.terminal import Problem
from hw.ipc import Child

SERVER = "cobodeck.live.run_server"
STARTING_S = 60.0
"""How long it may take to start, s: it draws the charts, perhaps beside much else."""


def told_far(host: str, rules: Rules) -> str:
    """What it means that pages are served to others."""
    may = "sees this record"
    if rules.commands:
        may = "sees these charts; with the token they start runs"
    if rules.commands and rules.open:
        may = "sees this run, and can stop it; with the token they command it"
    near = "Nothing is encrypted: use it in a network of its own, or through `ssh -L`"
    return f"anybody who reaches {host} {may}. {near}"


def show_source(source: Source, address: PageAddress, say: Callable[[str], None]) -> None:
    """Serve a source in this process, until Ctrl-C; the first line said is the page's URL.

    Raises:
        Problem: it cannot be served there.
    """
    from cobodeck.live.server import PageServer, serve

    token = new_token()

    def announce(server: PageServer) -> None:
        say(f"page: {server.url}" + (f"  token: {token}" if source.rules.commands else ""))
        if not address.is_near:
            say(told_far(address.host, source.rules))

    try:
        with suppress(KeyboardInterrupt, asyncio.CancelledError):
            asyncio.run(_cancelled_by_signals(serve(source, address, token, announce)))
    except OSError as error:
        raise Problem(f"no page at {address.host}:{address.port}: {error}") from None


async def _cancelled_by_signals(serving: Coroutine[Any, Any, None]) -> None:
    """Serve; TERM and HUP, where they are as Ctrl-C, cancel it as asyncio has Ctrl-C do.

    If they were raised wherever the loop is, a task might never be woken, and the end be awaited
    for ever.
    """
    here = asyncio.current_task()
    assert here is not None
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.default_int_handler:
            asyncio.get_running_loop().add_signal_handler(number, here.cancel)
    await serving


class LivePage:
    """The page of one run; it ends with the run, and pages keep what they have.

    Args:
        setup: what is run.
        options: how.
        address: where the page is served.
        show: called with lines for the user, the first of which is the page's URL.

    Raises:
        Problem: the page cannot be served there.
    """

    def __init__(
        self, setup: Setup, options: Options, address: PageAddress, show: Callable[[str], None]
    ) -> None:
        connection = options.connection
        self._real = connection is not None and connection.real
        self._on_parts = connection is not None
        self._setup = setup
        rules = Rules(commands=True, on_parts=self._on_parts, real=self._real)
        token = new_token()
        ours, theirs = socket.socketpair()
        settings = {
            "feed": theirs.fileno(),
            "rules": rules,
            "address": tuple(address),
            "token": token,
            "header": {**header_of_setup(setup, options), "signals": []},
            "attachments": attachments(setup),
        }
        self._child = Child(SERVER, settings, "the server of the live page", [theirs.fileno()])
        theirs.close()
        try:
            told = self._child.wait(STARTING_S)
        except OSError as error:
            ours.close()
            raise Problem(f"no live page at {address.host}:{address.port}: {error}") from None
        self.url, self.token = told["url"], token
        show(f"live page: {self.url}  token: {token}")
        if not address.is_near:
            show(told_far(address.host, rules))
        self._operator: PageOperator | None = None
        self._commands = socket.socket(fileno=os.dup(ours.fileno()))
        self.feed = Feed(ours)

    def attend(self, loop: Loop) -> None:
        """Take commands for this loop, from its next tick on."""
        self.feed.attend(loop)
        self._operator = PageOperator(self._setup, loop, self.feed, self._commands, self._real)
        self._operator.attend(self._on_parts)

    def close(self, record: Path | None = None) -> None:
        """Tell pages that the run is over, and where its record is."""
        told = "the run is over"
        if record is not None:
            told += f"; its record: {record}, see `cobodeck watch {record}`"
        if self._operator is not None:
            self._operator.close()
        self.feed.tell("say", told)
        self.feed.close()
        self._commands.close()
        self._child.close()
