"""The fake devices that a connection file can name under `peers`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hw.connection import RunInfo
from hw.fakes.peer import Peer
from hw.ipc import Hearer

UR10 = (0.0, -1.57, 1.57, -1.57, -1.57, 0.0)
"""Default joints of an arm, rad."""


class Cb3(Peer):
    """A UR controller of the CB3 series at `host`, on its usual ports.

    It starts at `joints` (rad), by default folded like the robot's body; it sends its joints to
    `tells`. A protective stop cannot be unlocked for `unlock` s. `hw.fakes.ur.cb3` has its faults.

    Args:
        host: the address to serve at.
        tells: the world that gets its joints.
        joints: where it starts, rad; by default folded.
        unlock: how long a protective stop cannot be unlocked, s.
        opening: of the run.
    """

    sources = ("cb3",)

    def __init__(
        self,
        host: str,
        tells: Hearer | None = None,
        joints: Sequence[float] | None = None,
        unlock: float = 5.0,
        opening: RunInfo | None = None,
    ) -> None:
        folded = None if opening is None else opening.body.parked
        settings: dict[str, Any] = {
            "host": host,
            "joints": tuple(joints or folded or UR10),
            "unlock": unlock,
        }
        super().__init__("hw.fakes.ur.cb3", settings, tells, "the fake UR controller")


class VrClient(Peer):
    """A VR application that connects to the VR link at host:port as soon as it can.

    Its user is hosted by the world `tells`. Its clock is `clock_offset`, s, ahead of ours;
    `answers`: it answers questions for its clock; `by_fields`: it writes field by field, as Unity
    does. `hw.fakes.unity.vr_application` has its faults; `faults` are those that come by
    themselves, each with the time in s since the robot was first shown: `[[6.0, lost], [8.0,
    none]]`.

    Args:
        host: the address of the VR link.
        port: of the VR link.
        tells: the world that hosts the user.
        opening: of the run.
        clock_offset: by how much its clock is ahead of ours, s.
        answers: whether it answers questions for its clock.
        by_fields: whether it writes field by field, as Unity does.
        faults: faults that come by themselves, each with the time since the robot was first shown,
            s.
    """

    sources = ("vr_client",)

    def __init__(  # noqa: PLR0913
        self,
        host: str,
        port: int,
        tells: Hearer,
        opening: RunInfo,
        clock_offset: float = 0.0,
        answers: bool = True,
        by_fields: bool = True,
        faults: Sequence[tuple[float, str]] = (),
    ) -> None:
        settings: dict[str, Any] = {
            "host": host,
            "port": port,
            "trackers": tuple(opening.tracking.mounts),
            "map_from_vive": opening.tracking.map_from_vive,
            "offset_ns": round(clock_offset * 1e9),
            "answers": answers,
            "by_fields": by_fields,
            "faults": [(float(at), str(name)) for at, name in faults],
        }
        super().__init__("hw.fakes.unity.vr_process", settings, tells, "the fake VR application")
