"""What the commands of pages do to a run, and why they are refused.

A command is JSON as a page sent it, with `who`: nothing in it has its right type before it is
looked at here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from cobodeck.live.charts import changed_machine
from cobodeck.live.clients import FASTEST, SLOWEST
from cobodeck.loop import Loop, Paced
from cobodeck.setup import Setup
from cobodeck.terminal import Problem
from engine import convert
from engine.chart import chart_value
from engine.files import FileError, assignment, did_you_mean, plain
from engine.files.declared import Mismatch
from engine.operator import Operator, output_types
from hw import Sample
from hw.sim.sensors import ScriptedOperator

REMARK_S = 1.0
"""Between two stops of the same that are put on record, s."""
SHOWN = 60
"""So much of a wrong value is told again, characters."""

Order = Mapping[str, Any]
Act = Callable[[], str | None]
"""Does something to the run, between two ticks; returns why not, None if it is done."""


class Refused(ValueError):
    """Why a command is not carried out, and what would be right."""


class Orders:
    """What commands do.

    Args:
        setup: what is run.
        loop: the run.
        real: these are real parts, whose stop is reset at the console.
    """

    def __init__(self, setup: Setup, loop: Loop, real: bool) -> None:
        self._setup, self._loop, self._real = setup, loop, real
        self._remarked: dict[str, float] = {}  # who stopped it, and when that was put on record

    def stop(self, by: str, why: str = "") -> None:
        """Pull the stop line, from any thread; without one the run ends.

        That is on record after the end of the chart, too, while parts are closed; whoever stops it
        again and again is on record once a second.
        """
        self.pull(by, why)
        now = time.monotonic()
        self._remarked = {who: at for who, at in self._remarked.items() if now - at < REMARK_S}
        if by not in self._remarked:
            self._remarked[by] = now
            Operator(self._loop.wired.run, by).remark(f"stop: {why}" if why else "stop")

    def pull(self, by: str, why: str = "") -> None:
        """As `stop`, and nothing is on record."""
        line = self._loop.plant.parts.get("stop_line")
        if line is None:
            self._loop.stop(by)
        else:
            self._scripted_away(True)
            line.pull(why or f"stop by {by}")
            self._loop.clock.wake()

    def act(self, order: Order) -> Act:
        """What does a command; making it ready may take a while, doing it does not.

        Raises:
            Refused: nothing does, whatever the run is doing.
        """
        operator, do = operator_of(self._loop, order), str(order["do"])
        simple: dict[str, Act] = {
            "pause": operator.pause,
            "resume": operator.resume,
            "step": operator.step,
            "preempt": operator.preempt,
            "end": operator.stop,
            "ack": self._acknowledge,
            "reset": self._reset,
        }
        at: dict[str, Callable[[str], str | None]] = {
            "consent": operator.consent,
            "refuse": operator.refuse,
            "lock": operator.lock,
            "unlock": operator.unlock,
            "break": operator.break_at,
            "unbreak": operator.unbreak,
        }
        made: dict[str, Callable[[Operator, Order], Act]] = {
            "level": _level,
            "force": self._forced,
            "replace": self._replaced,
            "speed": self._paced,
        }
        if do in simple:
            return simple[do]
        if do in at:
            return partial(at[do], _text(order, "path", "the path of a node"))
        if do in made:
            return made[do](operator, order)
        raise Refused(f"no command {do!r}; {did_you_mean(do, ['stop', *simple, *at, *made])}")

    def _acknowledge(self) -> None:
        inlet, now_ns = self._loop.wired.inlet, max(0, self._loop.now_ns)
        inlet.deliver(Sample("operator.acknowledge", now_ns, True), now_ns)

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

    def _scripted_away(self, away: bool) -> None:
        """The operator of a simulation does not undo what a page has stopped."""
        operator = self._loop.plant.parts.get("operator")
        if isinstance(operator, ScriptedOperator):
            operator.away = away

    def _forced(self, operator: Operator, order: Order) -> Act:
        run = self._loop.wired.run
        path = _text(order, "path", "the path of a node")
        outcome = _text(order, "outcome", "one of the node's outcomes")
        node = run.nodes.get(path)
        if node is None:
            raise Refused(f"no node {path!r}; {did_you_mean(path, list(run.nodes))}")
        types = output_types(run.machine, node.vertex, outcome)
        given = order.get("outputs") or {}
        if not isinstance(given, dict) or given.keys() - types.keys():
            raise Refused(f"{outcome!r} comes with {sorted(types)}, given: {_shown(given)}")
        try:
            outputs = {name: _converted(name, given[name], types[name]) for name in given}
        except (FileError, Mismatch) as error:
            raise Refused(str(error)) from None
        return partial(operator.force, path, outcome, outputs)

    def _replaced(self, operator: Operator, order: Order) -> Act:
        written = _text(order, "text", "a chart in YAML")
        try:
            machine = changed_machine(self._loop.wired.run.machine, written, self._setup)
        except (Mismatch, Problem, FileError) as error:
            raise Refused(str(error)) from None
        if isinstance(machine, str):
            raise Refused(machine)
        return lambda: "; ".join(operator.replace(machine)) or None

    def _paced(self, _operator: Operator, order: Order) -> Act:
        clock, speed = self._loop.clock, order.get("speed")
        if not isinstance(clock, Paced):
            raise Refused("this run is in real time")
        if isinstance(speed, bool) or not isinstance(speed, int | float):
            raise Refused(f"a speed is a number, as 2 or 0.5, not {_shown(speed)}")
        if not SLOWEST <= speed <= FASTEST:
            raise Refused(f"a speed is from {SLOWEST:g} to {FASTEST:g}, not {_shown(speed)}")

        def go() -> None:
            clock.speed = float(speed)
            clock.wake()

        return go


def operator_of(loop: Loop, order: Order) -> Operator:
    """The engine's operator, who is on record as the one who gave this order."""
    return Operator(loop.wired.run, str(order.get("who") or "page"))


def _level(operator: Operator, order: Order) -> Act:
    level = order.get("level")
    if level is not None:
        level = _text(order, "level", "off, low, high or full, or null for none")
    return partial(operator.set_level, level)


def _text(order: Order, key: str, what: str) -> str:
    found = order.get(key)
    if isinstance(found, str):
        return found
    raise Refused(f"{str(order['do'])!r} needs {key!r}, {what}; given: {_shown(found)}")


def _converted(name: str, written: object, kind: Any) -> Any:
    """An output from its text.

    Raises:
        FileError, Mismatch: it is not YAML, or not of this type.
    """
    if not isinstance(written, str):
        raise Refused(f"output {name!r}: a value is text as in YAML, not {_shown(written)}")
    _, source = assignment(f"{name}={written}", "output", f"{name}=1.5")
    return convert(chart_value(plain(source.value)), kind)


def _shown(value: object) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, int) and value.bit_length() > SHOWN:
        return "a number far too large"
    shown = repr(value)
    return shown if len(shown) <= SHOWN else f"{shown[:SHOWN]}…"
