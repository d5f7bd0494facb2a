"""The process of the safety chain: it owns wheels and bumper, and cycles at 100 Hz or more.

A single thread waits for datagrams until the next cycle is due. Garbage is collected only while the
wheels stand. It ends with its engine: the wheels are stopped and, at standstill, switched off. Its
address can be bound only once, so that a second engine for the same base is refused.
"""

from __future__ import annotations

import gc
import importlib
import select
import signal
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from typing import Any, NoReturn, Protocol

from hw.drivers.chain.chain_settings import SOURCES, ChainSettings
from hw.drivers.chain.cycle import ChainCycle
from hw.drivers.gates import MS
from hw.drivers.hardware import Hardware
from hw.drivers.observer import ObserverPort
from hw.extras import missing
from hw.ipc import CHAIN, Address, Datagram, Intake, Outlet, Parent, Ready, serve
from hw.safety import ChainStatus

STATUS_NS, LEVEL_NS = 20 * MS, 100 * MS
"""Periods of the status, and of the reason of a stop."""
ENDING_NS = 2000 * MS
"""Time after which wheels are switched off even if they have not stopped."""
COLLECT_NS = 1000 * MS


class Pollable(Protocol):
    """An `Intake`, or the observer's port."""

    def fileno(self) -> int:
        """For `select`."""
        ...

    def poll(self) -> list[Datagram]:
        """Datagrams since the last call."""
        ...

    def close(self) -> None:
        """Close the socket."""
        ...


class ChainProcess:
    """The loop around a `ChainCycle`: sockets, timing, and reports."""

    def __init__(
        self, settings: ChainSettings, hardware: Hardware, intakes: list[Pollable]
    ) -> None:
        self._intakes = intakes
        self._period_ns = round(1e9 / settings.rate)
        self._outlet = Outlet([settings.engine])
        self._cycle = ChainCycle(settings, hardware, self._outlet)
        self._records = self._cycle.chain.cycles.reader()
        self._reported: str | None = "nothing yet"
        self._level_ns = self._status_ns = self._collected_ns = 0
        self._cycles = self._missed = self._longest_ns = 0

    def run(self, parent: Parent) -> None:
        """Cycle until the engine is gone and the wheels stand."""
        due = before = time.monotonic_ns()
        end: int | None = None
        while end is None or (before < end and not self._cycle.stands):
            if self._wait(due, parent if end is None else None):
                end = time.monotonic_ns() + ENDING_NS
                self._cycle.pull("the engine is gone")
            now = time.monotonic_ns()
            self._cycle.cycle(now)
            self._count(now - before)
            self._report(now)
            before, due = now, self._next_due(due)
            self._tidy(now)

    def close(self) -> None:
        """Close the sockets; nothing is sent any more."""
        self._outlet.close()

    def _wait(self, due_ns: int, parent: Parent | None) -> bool:
        """Take what arrives until a cycle is due; True if the engine is gone."""
        waiting: list[Any] = [*self._intakes, *([] if parent is None else [parent])]
        while True:
            left = max(0, due_ns - time.monotonic_ns())
            readable, _, _ = select.select(waiting, [], [], left * 1e-9)
            for intake in self._intakes:
                if intake in readable:
                    arrived = intake.poll()
                    now = time.monotonic_ns()
                    for datagram in arrived:
                        self._cycle.receive(datagram, now)
            if parent is not None and parent in readable:
                orders = parent.receive()
                if orders is None:
                    return True
                for name, value in orders:
                    self._cycle.order(time.monotonic_ns(), name, value)
            if left == 0:
                return False

    def _next_due(self, due_ns: int) -> int:
        """When the next cycle is due; missed cycles are skipped."""
        due_ns += self._period_ns
        late = time.monotonic_ns() - due_ns
        if late > self._period_ns:
            self._missed += late // self._period_ns
            due_ns += late
        return due_ns

    def _count(self, since_last_ns: int) -> None:
        self._cycles += 1
        self._longest_ns = max(self._longest_ns, since_last_ns)

    def _report(self, now_ns: int) -> None:
        cycle, chain = self._cycle, self._cycle.chain
        records = self._records.read_new()
        if records:
            self._outlet.send("chain.cycles", now_ns, tuple(records))
        if cycle.stopped != self._reported or now_ns - self._level_ns >= LEVEL_NS:
            self._reported, self._level_ns = cycle.stopped, now_ns
            self._outlet.send("stop.engaged", now_ns, cycle.stopped)
        if now_ns - self._status_ns < STATUS_NS - self._period_ns // 2:
            return
        awaited = None if cycle.stopped is not None else cycle.awaited
        refused = (awaited,) if chain.refused and awaited else chain.refused
        status = ChainStatus(
            chain.latched,
            refused,
            chain.admitted,
            cycle.mode,
            self._cycles,
            self._missed,
            chain.cycles.written,
            self._longest_ns / 1e6,
        )
        self._outlet.send("chain.status", now_ns, status)
        self._status_ns, self._longest_ns = now_ns, 0

    def _tidy(self, now_ns: int) -> None:
        """Collect garbage while nothing moves."""
        if now_ns - self._collected_ns >= COLLECT_NS and self._cycle.stands:
            self._collected_ns = now_ns
            gc.collect()


def main(settings: ChainSettings, ready: Ready, parent: Parent) -> None:
    """Open the wheels, and guard them until the engine is gone."""
    signal.signal(signal.SIGTERM, _end)
    with ExitStack() as opened:
        intakes: list[Pollable] = [
            _bound(settings.address, partial(Intake, SOURCES, *settings.address, settings.secret))
        ]
        opened.callback(intakes[0].close)
        if settings.observer is not None:
            address, key = settings.observer.address, settings.observer.key
            intakes.append(_bound(address, partial(ObserverPort, address, key)))
            opened.callback(intakes[1].close)
        hardware = _hardware(settings)
        opened.callback(hardware.close)
        process = ChainProcess(settings, hardware, intakes)
        opened.callback(process.close)
        gc.collect()
        gc.freeze()
        gc.disable()
        ready({})
        process.run(parent)


def _bound(address: Address, bind: Callable[[], Pollable]) -> Pollable:
    try:
        return bind()
    except OSError as error:
        host, port = address
        raise OSError(
            f"{host}:{port}: {error.strerror or error}; is this base in the hands of another "
            "engine? One at a time"
        ) from None


def _hardware(settings: ChainSettings) -> Hardware:
    module, name, values = settings.hardware
    try:
        opened: Hardware = getattr(importlib.import_module(module), name)(
            model=settings.model, **values
        )
    except Exception as error:
        told = missing(error) or f"{type(error).__name__}: {error}"
        raise OSError(f"{module}:{name}: {told}") from error
    return opened


def _end(*_: object) -> NoReturn:
    raise SystemExit(0)


if __name__ == "__main__":
    serve(main, CHAIN, locked=True)
