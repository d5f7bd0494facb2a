"""The operator's console: acknowledges faults, stops, resets, ends the run (R48, R49)."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TextIO

from hw import Sample, StopLine

HELP = "operator: ack (a fault), stop (software stop of base and arm), reset (the stop), end"


class ConsoleOperator:
    """Reads commands from a stream, one per line, and shows the faults that states report.

    Its stop is a software stop, not a safety device (R54).
    """

    signals: tuple[str, ...] = ("operator.acknowledge",)

    def __init__(self, stop_line: StopLine, show: Callable[[str], None]) -> None:
        self.faults: list[str] = []
        self.wake: Callable[[], None] = _nobody
        self._stop_line, self._show, self._end = stop_line, show, _nobody
        self._remark: Callable[[str], None] = _unrecorded
        self._acknowledged: deque[bool] = deque()

    def attend(
        self, stream: TextIO, end: Callable[[], None], remark: Callable[[str], None] | None = None
    ) -> None:
        """Read commands from a stream, in a daemon thread.

        `end` is called for the command `end`; `remark` is given each other command that was carried
        out, to be put on record.
        """
        self._end, self._remark = end, remark or _unrecorded
        self._show(HELP)
        threading.Thread(target=self._read, args=(stream,), daemon=True).start()

    def report(self, fault: str) -> None:
        """Show a fault that has to be acknowledged; see `Operator`."""
        self.faults.append(fault)
        self._show(f"fault: {fault}; type ack to acknowledge")

    def say(self, word: str) -> None:
        """Carry out one command, from any thread; a stop does not wait for a tick."""
        word = word.strip().lower()
        if word == "ack":
            self._acknowledged.append(True)
            self._remark(word)
            self.wake()
        elif word == "stop":
            self._stop_line.pull("operator")
            self._remark(word)
        elif word == "reset":
            self._reset()
        elif word == "end":
            self._end()
        elif word:
            self._show(f"{word!r} is not a command; {HELP}")

    def _reset(self) -> None:
        known = getattr(self._stop_line, "why", None)
        if self._stop_line.reset():
            self._show("reset")
            self._remark("reset")
            return
        self._remark("reset, refused")
        if getattr(self._stop_line, "why", None) == known:  # else the line has told the new one
            self._show(f"not reset: {known or 'the cause still holds'}")

    def samples(self, now_ns: int) -> list[Sample]:
        """Acknowledgements since the last call."""
        count = len(self._acknowledged)
        return [
            Sample("operator.acknowledge", now_ns, self._acknowledged.popleft())
            for _ in range(count)
        ]

    def _read(self, stream: TextIO) -> None:
        for line in stream:
            try:
                self.say(line)
            except Exception as error:  # noqa: BLE001  the next command may be a stop
                self._show(f"{line.strip()}: {type(error).__name__}: {error}")
        self._show("the operator's input has ended: nothing typed here stops the robot any more")


def _unrecorded(_what: str) -> None:
    """Nothing keeps a record of the operator."""


def _nobody() -> None:
    """Do nothing; no loop has been started yet."""
