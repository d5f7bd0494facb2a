"""All nodes of a base's CAN bus: four drives, and the bumper's board with its line to them.

Faults, by name and value; `node` is the number of a drive:

| name | value | effect |
|---|---|---|
| `kill`, `revive` | node | loses power: no frames, the wheel coasts; boots again |
| `boot` | node | restarts without its settings |
| `emcy` | node, or (node, code) | reports an error, by default 0x7500, and brakes |
| `silence`, `stick` | node | its status and velocity are missing; repeat |
| `cut` | number | of the next velocity frames, each a byte short |
| `drop` | share | of all frames, lost |
| `quiet` | True or False | no frames at all |
| `error` | class, or (class, data) | an error frame, as a controller under Linux reports it |
| `touch` | bearing, rad | the foam is pressed |
| `release`, `unlatch` | | the foam is free; the line is closed by hand at the relay |
| `line` | | the wire of the line breaks |
| `welded` | True or False | a touch does not open the line |
| `bad_check`, `stalled`, `mute`, `untested` | True or False | of the board's frames |
| `jump` | number | of steps that its counter skips |
| `well` | | ends all of these, but not their consequences |
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from hw.fakes.can.bumper_node import Errors, FakeBumper
from hw.fakes.can.can_network import FakeNetwork, Faults, Wire
from hw.fakes.can.drive import FakeDrive, Traits


class Nodes:
    """The nodes on one wire. Call `step` after `on_frames`."""

    def __init__(
        self,
        wire: Wire,
        numbers: Sequence[int] = (1, 2, 3, 4),
        by_hand_ns: int | None = None,
        bumper: bool = True,
        traits: Traits | None = None,
    ) -> None:
        self.network = FakeNetwork(wire)
        self.drives = {number: FakeDrive(self.network, number, traits) for number in numbers}
        self.board = FakeBumper(self.network.send, self._relay, by_hand_ns) if bumper else None

    def on_frames(self, frames: Iterable[tuple[int, bytes]], now_ns: int) -> None:
        """Take the frames received."""
        dead = self.network.faults.dead
        for identifier, data in frames:
            self.network.notify(identifier, bytearray(data), 1e-9 * now_ns)
            for drive in self.drives.values():
                if drive.number not in dead:
                    drive.on_frame(identifier, data, now_ns)
            if self.board is not None:
                self.board.on_frame(identifier, data)

    def step(self, now_ns: int) -> None:
        """Advance to now_ns."""
        for drive in self.drives.values():
            drive.step(now_ns)
        if self.board is not None:
            self.board.step(now_ns)
        self.network.step(now_ns)

    def velocities(self) -> list[float]:
        """Velocities of the motors, units/s, in the order of the nodes."""
        return [drive.velocity for drive in self.drives.values()]

    def fault(self, name: str, value: Any = None) -> None:
        """Inject a fault.

        Raises:
            ValueError: an unknown fault.
        """
        known = self._of_drives(name, value) or self._of_bus(name, value)
        if not known and self.board is not None:
            known = self._of_board(self.board, name, value)
        if not known:
            raise ValueError(f"no fault is named {name!r}; see hw.fakes.can.nodes")

    def _of_drives(self, name: str, value: Any) -> bool:
        number, code = value if isinstance(value, tuple) else (value, 0x7500)
        if name not in ("kill", "revive", "boot", "emcy", "silence", "stick"):
            return False
        drive = self.drives[number]
        if name == "kill":
            self.network.faults.dead.add(number)
            drive.state = "disabled"
        elif name in ("revive", "boot"):
            self.network.faults.dead.discard(number)
            drive.boot()
        elif name == "emcy":
            drive.fail(code)
        else:
            drive.silent, drive.stuck = name == "silence", name == "stick"
        return True

    def _of_bus(self, name: str, value: Any) -> bool:
        faults = self.network.faults
        if name == "well":
            self._mend()
        elif name == "cut":
            faults.cut = int(value)
        elif name == "drop":
            faults.drop = float(value)
        elif name == "quiet":
            faults.quiet = bool(value)
        elif name == "error":
            self.network.send_error(*(value if isinstance(value, tuple) else (value,)))
        else:
            return False
        return True

    def _of_board(self, board: FakeBumper, name: str, value: Any) -> bool:
        errors = {
            "bad_check": "check", "stalled": "stalled", "mute": "mute", "untested": "untested",
            "welded": "welded", "jump": "jump",
        }  # fmt: skip
        if name == "touch":
            board.touch(float(value))
        elif name in ("release", "unlatch"):
            getattr(board, name)()
        elif name == "line":
            board.cut()
        elif name in errors:
            setattr(board.errors, errors[name], value)
        else:
            return False
        return True

    def _mend(self) -> None:
        dead = self.network.faults.dead
        self.network.faults = Faults()
        for number in dead:
            self.drives[number].boot()
        for drive in self.drives.values():
            drive.silent = drive.stuck = False
        if self.board is not None:
            self.board.errors = Errors()

    def _relay(self, opened: bool) -> None:
        for drive in self.drives.values():
            drive.relay_open = opened
