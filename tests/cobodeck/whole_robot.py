"""The whole robot of the fakes with its engine in a process that a test can kill.

The peers belong to the test, so that they outlive the engine; the truth comes to the test alone.
"""

import math
import select
import subprocess
import sys
import time
from pathlib import Path

from cobodeck.real.open_connection import open_all, own_host
from cobodeck.run.build_run import opening_of
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from hw.connection.connection import FOLDER, load_connection
from hw.ipc.datagrams import Intake, Outlet

PATIENCE_NS = 90 * 10**9


class WholeRobot:
    """`peers` by name; `engine` is the process of `cobodeck run`; `truths()` yields each step."""

    def __init__(self, folder: Path, seed: int = 0) -> None:
        self.host = own_host()
        text = (FOLDER / "fakes.yaml").read_text().replace("loopback", self.host)
        connection = load_connection(self._write(folder / "peers.yaml", text))
        alone = text[: text.index("peers:")] + text[text.index("links:") :]
        self.file = self._write(folder / "robot.yaml", alone)
        setup = open_setup("cobodeck", None, None, robot=connection)
        self._base = setup.robot.base
        options = Options(user="brief", requests=1, seed=seed, connection=connection)
        opening = opening_of(setup, setup.uses(), options, connection, time.monotonic_ns)
        self.peers = {}
        self.engine = None
        try:
            open_all("peer", connection.peers, connection.peers, opening, self.peers, self.peers)
            self._intake = Intake(("world",), self.host)
            self._outlet = Outlet([self.peers["world"].door("evaluator")])
            self._ask("subscribe", tuple(self._intake.door("world")))
            with (folder / "told.txt").open("w") as told:
                self.engine = subprocess.Popen(
                    [sys.executable, "-m", "cobodeck", "run", "cobodeck", "--robot", str(self.file),
                     "--scene", "lab_a", "--duration", "60", "--record", str(folder / "run.mcap")],
                    stdin=subprocess.DEVNULL, stdout=told, stderr=told,
                )  # fmt: skip
        except BaseException:
            self.close()
            raise

    def truths(self):
        """The truth at each step of the world (10 ms), with its number; ends after a while."""
        begun = told = time.monotonic_ns()
        begin = False
        while (now := time.monotonic_ns()) - begun < PATIENCE_NS:
            if now - told > 200_000_000:
                told = now
                self._ask("subscribe", tuple(self._intake.door("world")))
                if not begin and self.children():
                    self._ask("begin", None)
            select.select([self._intake], [], [], 0.1)
            for datagram in self._intake.poll():
                if datagram.name == "truth":
                    yield datagram.stamp_ns, datagram.value
                elif datagram.name == "finished":
                    begin = datagram.value is not None
        raise AssertionError("nothing has happened for too long")

    def moving(self, faster_than: float):
        """Wait until the base goes faster than this, m/s; when that was seen, ns."""
        before = None
        for stamp, truth in self.truths():
            if before is not None and speed(before, (stamp, truth)) > faster_than:
                return stamp
            before = stamp, truth
        return None

    def steps_until_standing(self, since_ns: int) -> tuple[int, int]:
        """World steps from an instant until the base goes on standing for a second.

        With the most that its brakes need, of the speeds since: all wheels brake with the same
        ramp, sqrt(2) times `brake_deceleration` at the rim, so the fastest one stops last.
        """
        before, standing_since, rim = None, None, 0.0
        brakes = math.sqrt(2.0) * self._base.brake_deceleration
        for stamp, truth in self.truths():
            if before is not None and stamp > since_ns:
                rim = max(rim, self._rim_speed(before, (stamp, truth)))
                if speed(before, (stamp, truth)) > 0.02:
                    standing_since = None
                else:
                    standing_since = standing_since or stamp
                    if stamp - standing_since > 10**9:
                        steps = (standing_since - since_ns) // 10_000_000
                        return steps, math.ceil(rim / brakes * 100.0)
            before = stamp, truth
        raise AssertionError("the base does not come to a stand")

    def _rim_speed(self, before, after) -> float:
        """Of the fastest wheel between two truths, m/s: |vx| + |vy| + lever |wz| of the base."""
        (t0, a), (t1, b) = before, after
        if t1 <= t0:
            return 0.0
        moved = a.base.inverse() @ b.base
        lever = self._base.half_wheelbase + self._base.half_track
        return (abs(moved.x) + abs(moved.y) + lever * abs(moved.yaw)) / ((t1 - t0) * 1e-9)

    def children(self) -> dict[str, int]:
        """The engine's own processes by module."""
        found = {}
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            try:
                words = (entry / "cmdline").read_bytes().decode().split("\0")
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except (OSError, ValueError):
                continue
            if parent == self.engine.pid and "-m" in words:
                found[words[words.index("-m") + 1]] = int(entry.name)
        return found

    def close(self) -> None:
        """End everything."""
        if self.engine is not None:
            self.engine.kill()
            self.engine.wait()
        for peer in reversed(self.peers.values()):
            peer.close()
        for opened in ("_intake", "_outlet"):
            if hasattr(self, opened):
                getattr(self, opened).close()

    def _ask(self, name: str, value: object) -> None:
        self._outlet.send(name, time.monotonic_ns(), value)

    @staticmethod
    def _write(file: Path, text: str) -> Path:
        file.write_text(text)
        return file


def speed(before, after) -> float:
    """Of the base between two truths, m/s."""
    (t0, a), (t1, b) = before, after
    return 0.0 if t1 <= t0 else a.base.distance_to(b.base) / ((t1 - t0) * 1e-9)
