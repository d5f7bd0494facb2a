"""A program that kills itself: KILL FILE ARGUMENTS…, where KILL says at which call (see `Kill`).

The instant of each tick goes to FILE, ns, so that one knows how far the run had got.
"""

from __future__ import annotations

import importlib
import json
import os
import signal
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

CLOSE = "cobodeck.record.write.mcap_file:McapFile.close"
TICK = "cobodeck.record.write.mcap_file:McapFile.end_tick"
WRITE = "cobodeck.record.format.sink:Sink.write"
LINK, SYNC, UNLINK = "os:link", "os:fsync", "pathlib:Path.unlink"


@dataclass(frozen=True)
class Kill:
    """At the `nth` call of a function, before it, after it, or amid it: half of it is written.

    Calls are counted from the first one of `since` on, if that is given.
    """

    at: str
    nth: int = 1
    when: str = "before"
    since: str | None = None

    def argument(self) -> str:
        return json.dumps(asdict(self))


def patch(place: str, made: Callable[[Callable[..., Any]], Callable[..., Any]]) -> None:
    module, _, name = place.partition(":")
    owner: Any = importlib.import_module(module)
    *path, last = name.split(".")
    for part in path:
        owner = getattr(owner, part)
    setattr(owner, last, made(getattr(owner, last)))


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def lie_in_wait(kill: Kill) -> None:
    counted = {"on": kill.since is None, "calls": 0}

    def begin(original: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **named: Any) -> Any:
            counted["on"] = True
            return original(*args, **named)

        return call

    def count(original: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **named: Any) -> Any:
            counted["calls"] += counted["on"]
            if not counted["on"] or counted["calls"] != kill.nth:
                return original(*args, **named)
            if kill.when == "amid":
                sink, data = args
                original(sink, data[: len(data) // 2])
            if kill.when == "after":
                original(*args, **named)
            return die()

        return call

    patch(kill.at, count)
    if kill.since is not None:
        patch(kill.since, begin)


def main() -> int:
    kill, file, *argv = sys.argv[1:]
    reached = os.open(file, os.O_CREAT | os.O_WRONLY)

    def note(original: Callable[..., Any]) -> Callable[..., Any]:
        def call(self: Any, now_ns: int) -> Any:
            os.pwrite(reached, f"{now_ns:020}".encode(), 0)
            return original(self, now_ns)

        return call

    patch(TICK, note)
    lie_in_wait(Kill(**json.loads(kill)))
    from cobodeck.__main__ import main as cobodeck

    return cobodeck(argv)


if __name__ == "__main__":
    sys.exit(main())
