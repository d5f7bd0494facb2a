"""A part of a record, small enough to stand beside a test: what flowed in a span of time.

It has no texts of charts and profiles: a test is of those that there are. Its first tick begins
with the newest older sample of each signal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cobodeck.record.format import TOPIC, Sink
from cobodeck.record.read import CASE, Group, Record, RecordedMessage
from cobodeck.record.write.mcap_file import McapFile
from cobodeck.record.write.run_file import WriteBytes

OTHERS = ("operator", "parts", "failures")
"""The topics that a part of a run needs beside its samples."""


def write_excerpt(
    record: Record, sink: Sink, start_ns: int, end_ns: int, case: Mapping[str, Any]
) -> None:
    """Write the ticks from `start_ns` to `end_ns`, both inclusive, and the metadata `case`.

    A failure to write is noted in `sink.error`.
    """
    file = McapFile(sink)
    file.begin(record.header, {})
    file.write_metadata(CASE, case)
    channels: dict[tuple[str, str], WriteBytes] = {}
    for group, told in _told(record, start_ns, end_ns):
        for one in (*told, group.closing):
            key = one.topic, one.schema
            if key not in channels:
                channels[key] = file.channel(one.topic, record.schemas[one.schema])
            channels[key](one.data, group.closing.log_ns)
        file.end_tick(group.closing.log_ns)
    file.close()


def _told(
    record: Record, start_ns: int, end_ns: int
) -> Iterator[tuple[Group, list[RecordedMessage]]]:
    """The ticks of the span, with their messages that count."""
    before: dict[str, RecordedMessage] = {}
    for group in record.groups():
        if group.ticked.at_ns > end_ns or group.ticked.kind == "end":
            return
        told = [m for m in group.told if m.topic.startswith(TOPIC) or m.topic in OTHERS]
        if group.ticked.at_ns < start_ns:
            before |= {m.topic: m for m in told if m.topic.startswith(TOPIC)}
            continue
        yield group, [*before.values(), *told]
        before.clear()
