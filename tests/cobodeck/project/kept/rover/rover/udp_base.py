"""The driver of a base behind a UDP port: velocities out, pose, velocity and battery in.

Out: {"vx", "vy", "wz"} in m/s and rad/s. In, about 50 times a second: {"x", "y", "yaw", "vx", "vy",
"wz", "battery"}. The driver raises nothing if the rover is silent: samples stop coming, and the
rover stops by its own time-out.
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
        self.wake: Callable[[], None] = lambda: None  # set by the loop; call it on new samples
        self._now, self._arrived = now, deque[Sample]()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect((address, port))
        self.stop()  # tells the rover our address
        threading.Thread(target=self._listen, daemon=True).start()

    def drive(self, command: Twist2) -> None:
        """Drive at this velocity, m/s and rad/s, in the base frame."""
        text = json.dumps({"vx": command.vx, "vy": command.vy, "wz": command.wz})
        try:
            self._socket.send(text.encode())
        except OSError:
            pass  # the rover is not there: its samples stop coming, which states notice

    def stop(self) -> None:
        """Stop the base."""
        self.drive(STILL)

    def use(self, mode: str) -> None:
        """Do nothing; this base has only one drive mode."""

    def samples(self, now_ns: int) -> list[Sample]:
        """The samples that have arrived since the last call."""
        return [self._arrived.popleft() for _ in range(len(self._arrived))]

    def close(self) -> None:
        """Stop and close the socket; the run is over."""
        self.stop()
        self._socket.close()

    def _listen(self) -> None:
        while True:
            try:
                datagram = self._socket.recv(1024)
            except OSError:
                if self._socket.fileno() < 0:
                    return  # closed
                continue  # the rover is unreachable, or not started yet
            try:
                told = json.loads(datagram)
                pose = Pose2.checked(told["x"], told["y"], told["yaw"])
                twist = Twist2.checked(told["vx"], told["vy"], told["wz"])
                level = float(told["battery"])
            except Exception:  # malformed in any way
                continue  # not from our rover
            values = (("base.pose", pose), ("base.twist", twist), ("battery.level", level))
            self._arrived.extend(Sample(name, self._now(), value) for name, value in values)
            self.wake()
