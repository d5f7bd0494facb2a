"""The driver of a base behind a UDP port: velocities out, pose, velocity and battery in.

Out: {"vx", "vy", "wz"} in m/s and rad/s. In, some 50 times a second: {"x", "y", "yaw", "vx", "vy",
"wz", "battery"}. It raises nothing when the rover is silent: its samples stop coming, and it stops
by its own time-out.
"""

import json
import socket
import threading
from collections import deque
from collections.abc import Callable

from hw.geometry import STILL, Pose2, Twist2
from hw.samples import Sample


class UdpBase:
    """Wheels. Gives `base.pose`, `base.twist` and `battery.level`."""

    signals = ("base.pose", "base.twist", "battery.level")
    mode = "omni"

    def __init__(self, address: str, port: int, now: Callable[[], int]) -> None:
        self.wake: Callable[[], None] = lambda: None  # set by the loop: a sample has come
        self._now, self._arrived = now, deque[Sample]()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect((address, port))
        self.stop()  # tells the rover where we are
        threading.Thread(target=self._listen, daemon=True).start()

    def drive(self, command: Twist2) -> None:
        """Go at this velocity, base frame."""
        text = json.dumps({"vx": command.vx, "vy": command.vy, "wz": command.wz})
        try:
            self._socket.send(text.encode())
        except OSError:
            pass  # nobody listens: shown by the samples that stop coming

    def stop(self) -> None:
        """Stand."""
        self.drive(STILL)

    def use(self, mode: str) -> None:
        """It drives in one way only."""

    def samples(self, now_ns: int) -> list[Sample]:
        """What has arrived since the last call."""
        return [self._arrived.popleft() for _ in range(len(self._arrived))]

    def close(self) -> None:
        """The run is over."""
        self.stop()
        self._socket.close()

    def _listen(self) -> None:
        while True:
            try:
                datagram = self._socket.recv(1024)
            except OSError:
                if self._socket.fileno() < 0:
                    return  # closed
                continue  # out of reach, or not started yet
            try:
                told = json.loads(datagram)
                pose = Pose2.checked(told["x"], told["y"], told["yaw"])
                twist = Twist2.checked(told["vx"], told["vy"], told["wz"])
                level = float(told["battery"])
            except Exception:  # whatever it holds
                continue  # it is not ours
            values = (("base.pose", pose), ("base.twist", twist), ("battery.level", level))
            self._arrived.extend(Sample(name, self._now(), value) for name, value in values)
            self.wake()
