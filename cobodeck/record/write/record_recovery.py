"""Recovers a record that was cut off or damaged, up to the last intact tick."""

from __future__ import annotations

from dataclasses import dataclass

from cobodeck.record.format import Sink, sha256
from cobodeck.record.read import Record, RecordedMessage
from cobodeck.record.write.mcap_file import McapFile
from cobodeck.record.write.run_file import WriteBytes


@dataclass(frozen=True, slots=True)
class Extent:
    """How much of a record can be relied on.

    Attributes:
        groups: number of intact groups of messages; `ticks` of them are ticks, as the group that
            ends a run is none.
        end_ns: time in the run of the last intact group, ns; None if there is none.
        broken: why there are no more, in words; None if nothing is missing.
        damaged: names of attachments whose hash differs from that of the file that was read.
    """

    groups: int
    ticks: int
    end_ns: int | None
    broken: str | None
    damaged: tuple[str, ...]


def extent(record: Record) -> Extent:
    """Read a record to its end, or to the first tick whose messages are not complete."""
    groups, ticks, end_ns, altered = 0, 0, None, None
    for group in record.groups():
        if group.altered:
            altered = f"messages before {group.ticked.at_ns / 1e9:.3f} s are missing or altered"
            break
        groups, end_ns = groups + 1, group.ticked.at_ns
        ticks += group.ticked.kind != "end"
    files = record.header.get("files", {})
    damaged = (name for name, data in record.attachments.items() if files.get(name) != sha256(data))
    return Extent(groups, ticks, end_ns, altered or record.broken, tuple(damaged))


def recover(record: Record, found: Extent, sink: Sink) -> None:
    """Write the intact messages unchanged, byte by byte, and a note that they were recovered.

    A failure to write is noted in `sink.error`.
    """
    file = McapFile(sink)
    file.begin(record.header, record.attachments)
    channels: dict[tuple[str, str], WriteBytes] = {}

    def write(told: RecordedMessage) -> None:
        key = told.topic, told.schema
        if key not in channels:
            channels[key] = file.channel(told.topic, record.schemas[told.schema])
        channels[key](told.data, told.log_ns)

    for _, group in zip(range(found.groups), record.groups(), strict=False):
        for told in group.told:
            write(told)
        write(group.closing)
        file.end_tick(group.closing.log_ns)
    if record.result is not None:
        file.write_metadata("result", record.result)
    about = {"of": str(record.path), "end_ns": found.end_ns, "why": found.broken}
    file.write_metadata("recovered", about)
    file.close()
