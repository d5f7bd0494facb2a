"""Observe a real robot: while this runs, the safety chain knows that an observer is there (R55).

A chain whose connection requires an observer stops the robot after half a second without one.
Enter stops it at once, and so do Ctrl-C, a closed terminal and a failing network. This is a
software stop, not a safety device: it can come late or not at all, so the observer holds the
hardware's own stop. The robot does not answer; see it stop once before you rely on it.
"""

from __future__ import annotations

import argparse
import os
import select
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cobodeck.console import FAILED, OK, Problem, complain, show

if TYPE_CHECKING:
    from hw.drivers.observer import ObserverLink

TEXT = """observing {host}:{port}. Stay here and look at the robot.
Enter: software stop. Ctrl-C: software stop, and the end of this.
It is no safety device and may fail: have the hardware's own stop in your hand."""
ENDS = ("SIGTERM", "SIGHUP")
"""Signals that end it in order, where the system has them."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "chain", type=_address, metavar="HOST:PORT", help="where the safety chain listens"
    )


def run(args: argparse.Namespace) -> int:
    """Report the observer's presence until they leave."""
    from hw.drivers.observer import ObserverLink

    host, port = args.chain
    try:
        observer = ObserverLink((socket.gethostbyname(host), port))
    except OSError as error:
        raise Problem(f"{host}: {error.strerror or error}", FAILED) from None
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


def _watch(observer: ObserverLink, terminal: int) -> None:
    """Run until the terminal is closed; a line typed there stops the robot."""
    from hw.drivers.observer import PERIOD_S

    while True:
        observer.here()
        if not select.select([terminal], [], [], PERIOD_S)[0]:
            continue
        if not os.read(terminal, 4096):
            complain("nothing can be typed here any more: software stop")
            return
        observer.pull("the observer")
        show("software stop sent; only the operator resets it")
        sys.stdout.flush()


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
