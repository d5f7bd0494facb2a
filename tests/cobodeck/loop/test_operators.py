"""The operator's console: what was typed is on record."""

from __future__ import annotations

import io

from cobodeck.loop.operators import ConsoleOperator
from hw.safety.stop_line import StopLatch
from tests.waiting import until


def test_each_command_but_the_end_is_remarked_and_a_stop_comes_first() -> None:
    line = StopLatch(lambda: True)
    remarks: list[tuple[str, bool]] = []
    console = ConsoleOperator(line, lambda _: None)
    ended: list[int] = []

    console.attend(
        io.StringIO("stop\nhello\nack\nreset\n\nend\n"),
        lambda: ended.append(len(remarks)),
        lambda what: remarks.append((what, line.reason is not None)),
    )

    until(lambda: ended)
    assert remarks == [("stop", True), ("ack", True), ("reset", False)]
    assert ended == [3]
    assert len(console.samples(0)) == 1
