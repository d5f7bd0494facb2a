"""Observe a real robot: while this runs, the safety chain knows that an observer is there (R55).

A chain whose connection requires an observer stops the robot after half a second without one.
Enter stops it at once, and so do Ctrl-C, a closed terminal and a failing network. This is a
software stop, not a safety device: it can come late or not at all, so the observer holds the
hardware's own stop. See it stop once before you rely on it.

The chain believes only who has its key. On the robot's own machine nothing has to be given for
that; from another one, --key names the file that the connection names (`observer: {key: FILE}`).
--new-key makes such a file, once: carry it to the other machine, and keep it from others.
"""

from __future__ import annotations

import argparse
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.terminal import FAILED, OK, USAGE, Problem, complain, show

if TYPE_CHECKING:
    from hw.drivers import ObserverLink

TEXT = """observing {host}:{port}. Stay here and look at the robot.
Enter: software stop. Ctrl-C: software stop, and the end of this.
It is no safety device and may fail: have the hardware's own stop in your hand."""
HEARD = "the robot hears you"
UNHEARD = "the robot does not answer: nothing that you do here stops it"
NEVER_HEARD = "no robot answers yet; is a run going on there, and is it the same key at both ends?"
ENDS = ("SIGTERM", "SIGHUP")
"""Signals that end it in order, where the system has them."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "chain",
        type=_address,
        nargs="?",
        metavar="HOST:PORT",
        help="where the safety chain listens for an observer",
    )
    parser.add_argument(
        "--key", type=Path, metavar="FILE", help="the key, for a robot that is another machine"
    )
    parser.add_argument(
        "--new-key", type=Path, metavar="FILE", help="make a key, for both machines, and end"
    )


def run(args: argparse.Namespace) -> int:
    """Report the observer's presence until they leave."""
    if args.new_key is not None:
        return _make_key(args.new_key)
    if args.chain is None:
        raise Problem("HOST:PORT is missing: where the safety chain listens", USAGE)
    observer, (host, port) = _link(args), args.chain
    show(TEXT.format(host=host, port=port))
    sys.stdout.flush()
    try:
        with _ending_on_signals():
            _watch(observer, sys.stdin.fileno())
    except KeyboardInterrupt:
        complain("the observer leaves: software stop")
    finally:
        observer.pull("the observer has left")
        observer.close()
    return OK


def _make_key(path: Path) -> int:
    from hw.drivers import make_key

    try:
        make_key(path)
    except OSError as error:
        raise Problem(f"{path}: {error.strerror or error}", FAILED) from None
    show(
        f"{path}: carry a copy to the other machine, readable by you alone, and name it at both: "
        f"`observer: {{…, key: FILE}}` in the connection, `cobodeck observe HOST:PORT --key FILE`"
    )
    return OK


def _link(args: argparse.Namespace) -> ObserverLink:
    from hw.drivers import ObserverLink, key_in
    from hw.ipc import is_loopback

    host, port = args.chain
    try:
        address = socket.gethostbyname(host)
    except OSError as error:
        raise Problem(f"{host}: {error.strerror or error}", FAILED) from None
    if args.key is None and not is_loopback(address):
        raise Problem(f"{host} is another machine: --key FILE, the key of its robot", USAGE)
    try:
        return ObserverLink((address, port), key_in(args.key))
    except OSError as error:
        where = error.filename or f"{host}:{port}"
        raise Problem(f"{where}: {error.strerror or error}", FAILED) from None
    except ValueError as error:
        raise Problem(str(error), FAILED) from None


def _watch(observer: ObserverLink, terminal: int) -> None:
    """Run until the terminal is closed; a line typed there stops the robot."""
    from hw.drivers import PERIOD_S

    due, news = 0.0, _News(observer)
    while True:
        if time.monotonic() >= due:
            due = time.monotonic() + PERIOD_S
            observer.here()
            news.report()
        left = max(0.0, due - time.monotonic())
        readable, _, _ = select.select([terminal, observer.fileno()], [], [], left)
        if observer.fileno() in readable:
            observer.receive()
        if terminal not in readable:
            continue
        if not os.read(terminal, 4096):
            complain("nothing can be typed here any more: software stop")
            return
        observer.pull("the observer")
        if observer.heard:
            show("software stop sent; only the operator resets it")
        else:
            complain(UNHEARD)
        sys.stdout.flush()


class _News:
    """Says when the robot begins to answer, and when it does not answer any more."""

    def __init__(self, observer: ObserverLink) -> None:
        self._observer, self._heard = observer, False
        self._until: float | None = time.monotonic() + 1.0

    def report(self) -> None:
        heard = self._observer.heard
        if heard != self._heard:
            self._heard, self._until = heard, None
            complain(HEARD if heard else UNHEARD)
        elif self._until is not None and time.monotonic() > self._until:
            self._until = None
            complain(NEVER_HEARD)


@contextmanager
def _ending_on_signals() -> Iterator[None]:
    known = [getattr(signal, name) for name in ENDS if hasattr(signal, name)]
    before = {number: signal.signal(number, signal.default_int_handler) for number in known}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
        raise argparse.ArgumentTypeError(f"{text!r} is no HOST:PORT, as 192.168.0.10:7401")
    return host, int(port)
