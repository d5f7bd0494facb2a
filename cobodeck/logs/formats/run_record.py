"""Our own records as sensor logs, with the recorded truth as reference."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cobodeck.logs.formats.drive_log import IMU, ODOMETRY, SCAN, TRACKER, Gathered, SensorLog
from cobodeck.logs.formats.log_content import head, plain_file
from cobodeck.record.format import TOPIC, SampleReader, truth_again
from engine import TickGrid
from engine.files import instead
from hw import Truth
from hw.model import RobotModel, load_robot
from hw.scene import Room, load_scene

if TYPE_CHECKING:
    from cobodeck.record.read import Group, Record

MAGIC = b"\x89MCAP0\r\n"
"""First bytes of an MCAP file, be it a record of ours or a bag of ROS 2."""
_OURS = b"cobodeck"
_PROFILE_AT = len(MAGIC) + 13
"""Offset of the profile in an MCAP file: after the header record's kind, its length (8 bytes), and
that of the profile (4)."""
_WORTH = (ODOMETRY, IMU, TRACKER, SCAN)


def is_record(path: Path) -> bool:
    """True if the file begins like an MCAP file with our profile."""
    begins = head(path, _PROFILE_AT + len(_OURS))
    return begins.startswith(MAGIC) and begins[_PROFILE_AT:] == _OURS


def read_record(path: Path) -> SensorLog:
    """Read the record of a run.

    Raises:
        FileError: it cannot be read, or holds nothing usable.
    """
    from cobodeck.record.read import Record

    gathered = Gathered(path, "record")
    with plain_file(path, ".mcap") as (plain, broken):
        if broken is not None:
            gathered.remark(broken)
        record = Record(plain)
        robot, gathered.room = surroundings_of(record)
        gathered.sensing = robot.sensing
        taking = _Taking(record, gathered)
        for group in record.groups():
            with record.understood(group):
                taking.add_tick(group)
        if record.broken is not None:
            gathered.remark(record.broken)
    return gathered.finished()


def surroundings_of(record: Record) -> tuple[RobotModel, Room | None]:
    """Robot and room of a run, from the files stored in its record.

    Raises:
        FileError: one of them is malformed.
    """
    from cobodeck.record.read import texts_of

    given = record.header["given"]
    with instead(texts_of(record)):
        scene = None if given["scene"] is None else load_scene(given["scene"])
        named = given["robot"] or (record.header["robot"] if scene is None else scene.robot)
        return load_robot(named), None if scene is None else scene.room


class _Taking:
    def __init__(self, record: Record, gathered: Gathered) -> None:
        self._gathered = gathered
        self._readers = {TOPIC + name: SampleReader(name) for name in _WORTH}
        self._grid = TickGrid(record.header["tick_hz"])
        self._truth: Truth | None = None

    def add_tick(self, group: Group) -> None:
        """Take the messages of one tick."""
        for told in group.told:
            if told.topic in self._readers:
                name, stamp, value = self._readers[told.topic].read(told.schema, told.data)
                self._gathered.add_sample(name, stamp, value)
        self._refer(group)

    def _refer(self, group: Group) -> None:
        found: Any = None
        for found in group.messages("truth"):
            self._truth = truth_again(found, self._truth)
        if found is None or group.ticked.kind not in ("grid", "left_out"):
            return
        if self._truth is not None and self._truth.base is not None:
            self._gathered.refer(self._grid.instant(group.ticked.number), self._truth.base)
