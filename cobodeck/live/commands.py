"""The operator on pages, in the process of the run: commands come as lines of JSON.

A thread reads them. It pulls the stop line at once, whatever the run is doing, and prepares all
else, such as another chart; what changes the run is carried out at the start of the next tick.
Whatever comes of a command goes back to its page.
"""

from __future__ import annotations

import json
import select
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from threading import Thread
from typing import Any

import yaml

from cobodeck.live.access import LOST_S
from cobodeck.live.charts import changed_machine
from cobodeck.live.feed import Feed
from cobodeck.loop import Loop, Paced
from cobodeck.setup import Setup
from engine import convert
from engine.chart import chart_value
from engine.files import did_you_mean
from engine.operator import Operator, output_types
from hw import Sample
from hw.sim.sensors import ScriptedOperator

SLOWEST, FASTEST = 0.1, 100.0
LARGEST = 1 << 20
"""Of a line, bytes."""
CHUNK = 1 << 16
LOOK_S = 0.1
STATUS_S = 1.0
BESIDE = frozenset({"reset", "ack", "speed"})
"""Commands that the run itself does not know: they are put on record as remarks, as a stop is."""
ITSELF = "live page"
"""Who stops a run whose operator is lost."""
OVER = "the run has ended"
KEPT_TIMES = 600
"""Ticks of whose times the 99th percentile is told."""

Act = Callable[[], str | None]
"""Does something to the run; returns why not, None if it is done."""


class PageOperator:
    """Carries out the commands of pages; an observer of the loop, and a tap of it.

    Args:
        setup: what is run.
        loop: the run.
        feed: takes the answers.
        commands: the lines.
        real: these are real parts, whose stop is reset at the console.
    """

    leaps = False

    def __init__(
        self, setup: Setup, loop: Loop, feed: Feed, commands: socket.socket, real: bool
    ) -> None:
        self._setup, self._loop, self._feed, self._socket = setup, loop, feed, commands
        self._real = real
        self._queue: deque[tuple[Mapping[str, Any], Act]] = deque()
        self._told: dict[str, Any] = {}
        self._times: deque[int] = deque(maxlen=KEPT_TIMES)
        self._told_at = 0.0
        self._breaks: list[str] = []
        self._broken = False
        self._acknowledged_ns, self._past_faults = -1, 0
        self._holder: str | None = None
        self._heard = time.monotonic()

    def attend(self, on_parts: bool) -> None:
        """Take commands from now on; `on_parts`: who has control must be heard all the time."""
        operator = Operator(self._loop.wired.run)
        operator.attend()
        self._breaks = operator.breaks()
        self._loop.observers = (self, *self._loop.observers)
        self._loop.taps = (*self._loop.taps, self)
        Thread(target=self._read, args=(on_parts,), daemon=True, name="page operator").start()

    # in the run's thread

    def watch(self, now_ns: int) -> None:  # noqa: ARG002
        """Carry out what waits."""
        while self._queue:
            order, act = self._queue.popleft()
            try:
                wrong = act()
            except Exception as error:  # noqa: BLE001  the next one may be an end
                wrong = f"{type(error).__name__}: {error}"
            self._answer(order, wrong)
            self._broken |= order["do"] in ("break", "unbreak", "replace")
            if wrong is None and order["do"] in BESIDE:
                self._operator(order).remark(_said(order))

    def failed(self, part: str, error: BaseException) -> None:
        """Do nothing; it is on record."""

    def tick(self, ticked: object) -> None:  # noqa: ARG002
        """Tell what is not on record: stop and faults as they change, health once a second."""
        parts, clock = self._loop.plant.parts, self._loop.clock
        line, operator = parts.get("stop_line"), parts.get("operator")
        if self._broken:  # such a command is carried out in the tick after it was taken
            self._broken, self._breaks = False, Operator(self._loop.wired.run).breaks()
        told = {
            "breaks": self._breaks,
            "stop": getattr(line, "reason", None) is not None,
            "faults": self._open_faults(list(getattr(operator, "faults", ()))),
            "speed": clock.speed if isinstance(clock, Paced) else 1.0,
        }
        if told != self._told:
            self._told = told
            self._feed.tell("status", told)
        if self._loop.stopwatch is not None:
            self._times.append(self._loop.stopwatch.last_ns)
        now = time.monotonic()
        if now - self._told_at >= STATUS_S:
            self._told_at = now
            self._feed.tell("health", self._health())

    def _open_faults(self, faults: list[str]) -> list[str]:
        """Those that nobody has acknowledged yet."""
        slot = self._loop.wired.board.slots.get("operator.acknowledge")
        newest = None if slot is None else slot.newest
        stamp_ns = -1 if newest is None else newest.stamp
        if stamp_ns != self._acknowledged_ns:
            self._acknowledged_ns, self._past_faults = stamp_ns, len(faults)
        return faults[self._past_faults :]

    def _scripted_away(self, away: bool) -> None:
        """The operator of a simulation does not undo what a page has stopped."""
        operator = self._loop.plant.parts.get("operator")
        if isinstance(operator, ScriptedOperator):
            operator.away = away

    def _health(self) -> dict[str, Any]:
        loop, times = self._loop, sorted(self._times)
        p99 = times[min(len(times) - 1, len(times) * 99 // 100)] / 1e6 if times else None
        children = [
            {"name": name, "state": "runs" if child.alive else "has ended"}
            for name, part in loop.plant.parts.items()
            if (child := getattr(part, "child", None)) is not None and hasattr(child, "alive")
        ]
        return {
            "tick_p99_ms": p99,
            "dropped": self._feed.dropped,
            "missed": loop.missed,
            "children": children,
            "gates": dict(loop.wired.inlet.refused),
        }

    def _operator(self, order: Mapping[str, Any]) -> Operator:
        return Operator(self._loop.wired.run, str(order.get("who") or "page"))

    def _answer(self, order: Mapping[str, Any], wrong: str | None, done: str = "done") -> None:
        told = {"page": order.get("page"), "id": order.get("id")}
        self._feed.tell("ack", {**told, "ok": wrong is None, "text": wrong or done})

    # in the reading thread

    def _read(self, on_parts: bool) -> None:
        begun = b""
        while (data := self._received()) is None or data:
            self._miss(on_parts)
            if data is None:
                continue
            *lines, begun = (begun + data).split(b"\n")
            for line in lines:
                self._take(line)
            if len(begun) > LARGEST:
                begun = b""
        if on_parts and self._holder is not None:
            self._stop(ITSELF, "the server of the live page has ended")
        self._socket.close()

    def _received(self) -> bytes | None:
        """What has come; None: nothing yet; empty: nothing comes any more."""
        try:
            ready, _, _ = select.select([self._socket], [], [], LOOK_S)
            return self._socket.recv(CHUNK) if ready else None
        except (OSError, ValueError):
            return b""

    def close(self) -> None:
        """Nobody is missed any more: the run is over, and what waits is refused."""
        self._holder = None
        while self._queue:
            self._answer(self._queue.popleft()[0], OVER)

    def _miss(self, on_parts: bool) -> None:
        """Stop the robot if who has control has not been heard (R55)."""
        if on_parts and self._holder is not None and time.monotonic() - self._heard > LOST_S:
            name, self._holder = self._holder, None
            self._stop(ITSELF, f"the page of {name} is not heard any more")

    def _take(self, line: bytes) -> None:
        try:
            order = json.loads(line)
            do = order["do"]
        except (ValueError, KeyError, TypeError, RecursionError):
            return
        self._heard = time.monotonic()
        if do == "held":
            self._holder = order.get("name")
        elif do == "stop":
            self._stop(str(order.get("who")))
            self._scripted_away(True)
            self._answer(order, None)
        elif do != "beat":
            self._prepare(do, order)

    def _stop(self, by: str, why: str = "") -> None:
        """Stop at once; that is on record after the end of the chart, too, while parts close."""
        line = self._loop.plant.parts.get("stop_line")
        if line is None:
            self._loop.stop(by)
        else:
            line.pull(why or f"stop by {by}")
            self._loop.clock.wake()
        Operator(self._loop.wired.run, by).remark(f"stop: {why}" if why else "stop")

    def _prepare(self, do: str, order: Mapping[str, Any]) -> None:
        """Make ready what does a command, and queue it."""
        if self._loop.wired.run.over:
            self._answer(order, OVER)
            return
        try:
            act = self._act(do, order)
        except Exception as error:  # noqa: BLE001  the next one may be a stop
            self._answer(order, str(error) or type(error).__name__)
            return
        if isinstance(act, str):
            self._answer(order, act)
            return
        self._queue.append((order, act))
        self._loop.clock.wake()

    def _act(self, do: str, order: Mapping[str, Any]) -> Act | str:
        """What does a command; a text: why it is refused at once."""
        operator = self._operator(order)
        path = str(order.get("path", ""))
        simple: dict[str, Act] = {
            "pause": operator.pause,
            "resume": operator.resume,
            "preempt": operator.preempt,
            "end": operator.stop,
            "consent": lambda: operator.consent(path),
            "refuse": lambda: operator.refuse(path),
            "lock": lambda: operator.lock(path),
            "unlock": lambda: operator.unlock(path),
            "level": lambda: operator.set_level(order.get("level")),
            "step": operator.step,
            "break": lambda: operator.break_at(path),
            "unbreak": lambda: operator.unbreak(path),
            "ack": self._acknowledge,
            "reset": self._reset,
        }
        if do in simple:
            return simple[do]
        if do == "force":
            return self._forced(operator, path, order)
        if do == "replace":
            return self._replaced(operator, str(order["text"]))
        if do == "speed":
            return self._paced(float(order["speed"]))
        return f"no command {do!r}; {did_you_mean(do, [*simple, 'stop', 'force', 'replace'])}"

    def _acknowledge(self) -> None:
        inlet, now_ns = self._loop.wired.inlet, self._loop.now_ns
        inlet.deliver(Sample("operator.acknowledge", max(0, now_ns), True), max(0, now_ns))

    def _forced(self, operator: Operator, path: str, order: Mapping[str, Any]) -> Act | str:
        run, outcome = self._loop.wired.run, str(order["outcome"])
        node = run.nodes.get(path)
        if node is None:
            return f"no node {path!r}; {did_you_mean(path, run.nodes)}"
        types = output_types(run.machine, node.vertex, outcome)
        given = dict(order.get("outputs") or {})
        outputs = {
            name: convert(chart_value(yaml.safe_load(str(written))), types[name])
            for name, written in given.items()
            if name in types
        }
        unknown = given.keys() - types.keys()
        if unknown:
            return f"{outcome!r} comes with {sorted(types)}, given: {sorted(given)}"
        return lambda: operator.force(path, outcome, outputs)

    def _replaced(self, operator: Operator, written: str) -> Act | str:
        machine = changed_machine(self._loop.wired.run.machine, written, self._setup)
        if isinstance(machine, str):
            return machine
        return lambda: "; ".join(operator.replace(machine)) or None

    def _paced(self, speed: float) -> Act | str:
        clock = self._loop.clock
        if not isinstance(clock, Paced):
            return "this run is in real time"
        if not SLOWEST <= speed <= FASTEST:
            return f"speed {speed:g} is not from {SLOWEST:g} to {FASTEST:g}"
        clock.speed = speed
        clock.wake()
        return _done

    def _reset(self) -> str | None:
        line = self._loop.plant.parts.get("stop_line")
        if self._real:
            return "real parts are reset at the console"
        if line is None:
            return "there is no stop to reset"
        if line.reset():
            self._scripted_away(False)
            return None
        return f"not reset: {getattr(line, 'why', None) or 'the cause still holds'}"


def _done() -> None:
    """Nothing is left to do."""


def _said(order: Mapping[str, Any]) -> str:
    told = [str(order["do"])]
    told += [f"{k} {order[k]}" for k in ("path", "outcome", "level", "speed") if order.get(k)]
    return " ".join(told)
