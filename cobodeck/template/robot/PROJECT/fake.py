"""A fake rover that speaks the real one's protocol, and shares no code with its driver.

python -m PROJECT.fake --port 47101 --battery 20
"""

import argparse
import json
import math
import socket
import time


class FakeRover:
    """Moves at the velocity last received until its own time-out, and reports its state."""

    def __init__(self, port: int, battery_s: float, address: str = "127.0.0.1") -> None:
        self.x = self.y = self.yaw = 0.0
        self.farthest = 0.0  # the largest x so far, m
        self.velocity = (0.0, 0.0, 0.0)
        self.over = False
        self._battery_s, self._driven_s = battery_s, 0.0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((address, port))
        self._socket.settimeout(0.02)
        self.port = self._socket.getsockname()[1]

    def run(self, timeout_s: float = 0.3) -> None:
        """Serve until `over`."""
        heard, before, peer = -math.inf, time.monotonic(), None
        while not self.over:
            try:
                data, peer = self._socket.recvfrom(1024)
                told = json.loads(data)
                vx, vy, wz = (float(told[name]) for name in ("vx", "vy", "wz"))
                if math.isfinite(vx + vy + wz):
                    self.velocity, heard = (vx, vy, wz), time.monotonic()
            except TimeoutError:
                pass
            except (ValueError, TypeError, LookupError, OverflowError, RecursionError):
                pass  # not from our driver
            now = time.monotonic()
            if now - heard > timeout_s:
                self.velocity = (0.0, 0.0, 0.0)
            self._move(min(now - before, timeout_s))  # no command counts for longer
            before = now
            if peer is not None:
                self._socket.sendto(json.dumps(self.state()).encode(), peer)
        self._socket.close()

    def state(self) -> dict[str, float]:
        """The state that it reports; only driving takes from the battery."""
        vx, vy, wz = self.velocity
        level = max(0.0, 1.0 - self._driven_s / self._battery_s)
        pose = {"x": self.x, "y": self.y, "yaw": self.yaw}
        return {**pose, "vx": vx, "vy": vy, "wz": wz, "battery": level}

    def _move(self, span: float) -> None:
        vx, vy, wz = self.velocity
        if any(self.velocity):
            self._driven_s += span
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        self.x += (c * vx - s * vy) * span
        self.y += (s * vx + c * vy) * span
        self.farthest = max(self.farthest, self.x)
        self.yaw = math.remainder(self.yaw + wz * span, math.tau)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--port", type=int, default=47101)
    parser.add_argument("--battery", type=float, default=20.0, help="s of driving")
    args = parser.parse_args()
    FakeRover(args.port, args.battery).run()
