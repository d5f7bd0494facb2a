"""Who may do what: anybody stops, who knows the token commands, one page at a time has control.

The token is printed in the terminal, and typed into the page. Who has control is shown to all;
another page with the token may take it over. The page that controls a run on real parts tells that
it is there each 0.2 s; 0.5 s without stop the robot (R55). That is a software stop, as the button
is, and no safety device (R54).
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple
from urllib.parse import urlsplit

ALONE = frozenset({"stop"})
"""Commands that need no token."""
CONTROL = frozenset({"take", "release"})
TRIES = 5
"""Wrong tokens after which a connection is closed."""
LOST_S = 0.5
"""Without a sign of life of the controlling page for longer than this, s, a run on parts stops."""
ITSELF = "live page"
"""Who stops a run whose operator is lost."""
LONGEST_NAME = 40
LOCAL = frozenset({"localhost", "127.0.0.1", "::1"})


@dataclass(frozen=True, slots=True)
class Rules:
    """What holds for a source of pages.

    Attributes:
        commands: whether there is anything to command.
        on_parts: it runs on parts that move by themselves, so that a lost page stops it.
        real: these are real ones: the stop is reset at the console.
        open: commands that need no token.
    """

    commands: bool = False
    on_parts: bool = False
    real: bool = False
    open: frozenset[str] = ALONE


class PageAddress(NamedTuple):
    """Where a server listens; port 0: a free one."""

    host: str = "127.0.0.1"
    port: int = 0

    @property
    def is_near(self) -> bool:
        """Whether only programs of this machine reach it."""
        return self.host in LOCAL


def new_token() -> str:
    """A token of 96 random bits: nobody guesses it, however often they come back to try."""
    return secrets.token_urlsafe(12)


def is_ours(host: str, port: int, at: PageAddress) -> bool:
    """Whether a header `Host` names this server: by a local name, an address, or as it was told.

    Names of others are refused, as they may be made to point here by whoever owns them.
    """
    try:
        found = urlsplit(f"//{host}")
        name, given = found.hostname, 80 if found.port is None else found.port
    except ValueError:
        return False
    if name is None or found.netloc != host or found.username is not None or given != port:
        return False
    if name in LOCAL or name == at.host.lower():
        return True
    if at.is_near:
        return False
    return _is_address(name) or name == socket.gethostname().lower()


def is_same_origin(origins: Sequence[str], host: str) -> bool:
    """Whether a page of this server asks; programs without a page name no origin."""
    return not origins or list(origins) == [f"http://{host}"]


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


class Access:
    """Who has given the token, and who has control.

    Args:
        rules: what holds here.
        token: what commands need.
        now: a clock, s.
    """

    def __init__(self, rules: Rules, token: str, now: Callable[[], float]) -> None:
        self.rules = rules
        self.holder: int | None = None
        self.name: str | None = None
        self._token, self._now = token.encode(), now
        self._names: dict[int, str] = {}
        self._wrong: dict[int, int] = {}
        self._heard = 0.0

    def name_of(self, page: int) -> str | None:
        """The name that a page gave with the token."""
        return self._names.get(page)

    def authorize(self, page: int, token: object, name: object) -> str | None:
        """Take a token; returns why it is refused."""
        given = token.encode(errors="replace") if isinstance(token, str) else b""
        if not hmac.compare_digest(given, self._token):
            self._wrong[page] = self._wrong.get(page, 0) + 1
            return "this is not the token that was printed in the terminal"
        shown = "".join(c for c in str(name or "operator") if c.isprintable()).strip()
        self._names[page] = shown[:LONGEST_NAME] or "operator"
        if self.holder == page:
            self.name = self._names[page]
        return None

    def tries_too_much(self, page: int) -> bool:
        """Whether a page has guessed tokens too often."""
        return self._wrong.get(page, 0) >= TRIES

    def refusal(self, page: int, do: str) -> str | None:
        """Why a page may not do this now; None if it may."""
        if not self.rules.commands:
            return "there is nothing to command here"
        if do in self.rules.open:
            return None
        if page not in self._names:
            return f"{do!r} needs the token, which is printed in the terminal"
        if do == "reset" and self.rules.real:
            return "real parts are reset at the console, by who sees the robot"
        if do in CONTROL:
            return None
        if self.holder is None:
            self.take(page)
        if self.holder != page:
            return f"{self.name} has control; take it over first"
        return None

    def take(self, page: int) -> str | None:
        """Give control to a page; returns the name of who had it."""
        before = None if self.holder == page else self.name
        self.holder, self.name, self._heard = page, self._names[page], self._now()
        return before

    def release(self, page: int) -> bool:
        """Take control from a page; whether it had it."""
        if self.holder != page:
            return False
        self.holder = self.name = None
        return True

    def beat(self, page: int) -> bool:
        """A page is there; whether it has control."""
        if page == self.holder:
            self._heard = self._now()
        return page == self.holder

    def left(self, page: int) -> None:
        """A page has gone. Of a run on parts it keeps control until it is missed."""
        self._names.pop(page, None)
        self._wrong.pop(page, None)
        if not self.rules.on_parts:
            self.release(page)

    def lost(self) -> str | None:
        """The name of who controls a run on parts and has not been heard; control is free then."""
        if self.holder is None or not self.rules.on_parts:
            return None
        if self._now() - self._heard <= LOST_S:
            return None
        name, self.holder, self.name = self.name, None, None
        return name
