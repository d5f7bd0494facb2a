"""The person of a record, replayed beside a simulated robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cobodeck.record.format import TOPIC, SampleReader, truth_again
from cobodeck.record.read.reader import Group, Record
from cobodeck.terminal import Problem, behind_record
from engine import TickGrid
from engine.files import mistake
from hw import Truth, UserPose, wrap
from hw.people.recorded import Asked, Heading, Past, Recalled, Recording, SeenPerson, Stood, Up
from hw.scene import Room

POSE, REQUEST = "user.pose", "vr.haptic_request"


def recalled(
    source: str,
    room: Room,
    requests: int | None,
    stretch_m: float | None,
    seed: int,
    heading: Heading,
    up: Up | None,
) -> Recalled:
    """The person of a record, in a room.

    `requests`, `stretch_m` (m) and `up` must be None, and `heading` the default. The seed gives
    their reaction to the stop sign.

    Raises:
        Problem: an option is given that a recorded person does not have; FileError: the record
            cannot be read, has no person, or they would leave the free floor.
    """
    causal = None if heading == "centred" else heading
    given = {"--requests": requests, "--stretch": stretch_m, "--heading": causal, "--up": up}
    asked = (name for name, value in given.items() if value is not None)
    refused = behind_record(source) or next(asked, None)
    if refused is not None:
        raise Problem(
            f"--user {source}: the person of a record walks and asks where and when they did; "
            f"leave out {refused}"
        )
    return Recalled(past(Record(Path(source))), room, seed=seed)


def past(record: Record) -> Past:
    """The person's recorded motion and requests: true poses if the record has them, else measured.

    Raises:
        FileError: the record cannot be read, is damaged, or has no person.
    """
    record.require_intact()
    record.require_ticks()
    reading = _Reading(record)
    for group in record.groups():
        with record.understood(group):
            reading.add_tick(group)
    ways = reading.ways or _measured_ways(record.path, reading.seen)
    if not ways:
        told = "has no person in it"
        raise mistake(record.path, told, hint="take the record of a run beside a person")
    return Past(
        str(record.path), reading.until_ns, tuple(ways), tuple(reading.seen), tuple(reading.asked)
    )


class _Reading:
    """Collects the person's data of a record; samples that did not flow are made from the truth."""

    def __init__(self, record: Record) -> None:
        self.until_ns = 0
        self.ways: list[Stood] = []
        self.seen: list[SeenPerson] = []
        self.asked: list[Asked] = []
        self._sees = POSE in record.header["flowing"]
        self._hears = REQUEST in record.header["flowing"]
        self._readers = {TOPIC + name: SampleReader(name) for name in (POSE, REQUEST)}
        self._grid = TickGrid(record.header["tick_hz"])
        self._truth: Truth | None = None

    def add_tick(self, group: Group) -> None:
        """Take one tick; its truth belongs to its instant on the grid, however late it ran."""
        self.until_ns = max(self.until_ns, group.ticked.at_ns)
        for told in group.told:
            if told.topic in self._readers:
                _, stamp, value = self._readers[told.topic].read(told.schema, told.data)
                self._sample(stamp, value)
        if group.ticked.kind not in ("grid", "left_out"):
            return
        for found in group.messages("truth"):
            self._truth = truth_again(found, self._truth)
        if self._truth is not None and self._truth.body is not None:
            self._true(self._grid.instant(group.ticked.number), self._truth)

    def _sample(self, stamp: int, value: Any) -> None:
        if not isinstance(value, UserPose):
            self.asked.append(Asked(stamp, value))
        elif not self.seen or stamp > self.seen[-1].at_ns:
            self.seen.append(SeenPerson(stamp, value))

    def _true(self, at_ns: int, truth: Truth) -> None:
        assert truth.body is not None
        self.ways.append(Stood(at_ns, truth.body, truth.speed))
        if not self._hears and truth.request != (self.asked[-1].deep if self.asked else None):
            self.asked.append(Asked(at_ns, truth.request))
        if self._sees or truth.seen_ns is None:
            return
        if not self.seen or truth.seen_ns > self.seen[-1].at_ns:
            view = wrap(truth.body.yaw + truth.head_turn)
            self.seen.append(SeenPerson(truth.seen_ns, UserPose(truth.body, view)))


def _measured_ways(path: Path, seen: list[SeenPerson]) -> list[Stood]:
    if len(seen) < 2:
        return [Stood(at_ns, pose.body, 0.0) for at_ns, pose in seen]
    stamps, bodies = [row.at_ns for row in seen], [row.pose.body for row in seen]
    xs, ys = [body.x for body in bodies], [body.y for body in bodies]
    _, speeds = Recording(str(path), tuple(stamps), tuple(xs), tuple(ys)).motion()
    return [Stood(*row) for row in zip(stamps, bodies, speeds, strict=True)]
