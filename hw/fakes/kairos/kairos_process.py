"""A fake RB-KAIROS behind a rosbridge server: a child process (`hw.ipc.processes`).

Settings: `host`, `port`, `ros` (1 or 2); `upside_down` for its scanners; `stop`, the topic of its
emergency stop; `tells`, the address of a world, or None; `radius` and `lever` of its wheels, m.
Ready: `control`, the address for datagrams:

- `base.scan` (`Scan`) of a world goes out as a LaserScan of the scanner of that name. Without a
  world it makes scans of its own, 541 beams 12.5 times a second.
- a fault (source `fault`, by its name) holds until the next: `drop` cuts all connections, also new
  ones; `mute` sends nothing; `silent` (value: its name) nothing on one topic; `freeze` repeats the
  last odometry with its stamp; `late` sends everything 0.3 s late; `nan` puts NaN into odometry and
  scans; `stop` engages its emergency stop; an empty name clears it.
- these hold beside: `clock` sets its clock (value: s ahead of what it should be); `unlatched` has
  the emergency stop told on changes only; `status` makes the server say something.

It sends its wheel rates to the world every 10 ms: source `drives`, name `wheels`.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Mapping
from typing import Any

from hw.fakes.kairos.kairos_robot import KairosWheels, Message, header, laser_scan, odometry
from hw.fakes.kairos.rosbridge_server import FakeTopic, RosbridgeServer
from hw.fakes.subscription import Subscription, outlet_as
from hw.ipc import DEVICES, Intake, Parent, Ready, serve
from hw.samples import Scan

PERIOD_S = 0.01
LATE_S = 0.3
SCANNERS = ("front_laser", "rear_laser")
SCAN_EVERY = 8
BEAMS, STEP = 541, math.radians(0.5)
FAULTS = ("", "drop", "mute", "freeze", "late", "nan", "silent", "stop")
BESIDE = ("clock", "unlatched", "status")


class FakeKairos:
    """The robot, its server, and its faults."""

    def __init__(self, settings: Mapping[str, Any]) -> None:
        self.intake = Intake(("fault", "world"), settings["host"])
        self.robot = KairosWheels()
        self._settings, self._version = settings, settings["ros"]
        self._fault, self._number, self._ahead_ns = "", 0, 0
        self._name = {
            "cmd_vel": self._full("robotnik_base_control/cmd_vel"),
            "odom": self._full("robotnik_base_control/odom"),
            "stop": self._full(settings["stop"]),
        }
        self.server = RosbridgeServer(self._topics())
        self._wheels = outlet_as("drives", settings["tells"])
        self._scans = outlet_as("scanners", settings["tells"])
        self._subscription = Subscription(self._scans, self.intake.door("world"))
        self._newest: Message | None = None

    def step(self, dt: float) -> None:
        """Advance by dt, and send what is due."""
        self.robot.step(dt)
        self._number += 1
        place, velocity = self.robot.place, self.robot.velocity
        if self._fault == "nan":
            place = (math.nan, math.nan, 0.0)
        if self._newest is None or self._fault != "freeze":
            self._newest = odometry(self._head("robot_odom"), place, velocity)
        self.server.publish(self._name["odom"], self._newest)
        now = time.monotonic_ns()
        settings = self._settings
        self._wheels.send("wheels", now, self.robot.wheels(settings["radius"], settings["lever"]))
        self._subscription.renew(now)
        if settings["tells"] is None and self._number % SCAN_EVERY == 0:
            for name in SCANNERS:
                ranges = (2.0 + 0.01 * (self._number % 100), math.inf, *[5.0] * (BEAMS - 2))
                self._send_scan(name, -math.radians(135.0), STEP, ranges, 1.0 / 9000.0)

    def receive(self) -> None:
        """Take the datagrams received."""
        for datagram in self.intake.poll():
            if datagram.name in FAULTS:
                self._have(datagram.name, datagram.value)
            elif datagram.source == "fault" and datagram.name in BESIDE:
                self._have_beside(datagram.name, datagram.value)
            elif datagram.name == "base.scan" and isinstance(datagram.value, Scan):
                scan = datagram.value
                self._send_scan(scan.sensor, scan.start, scan.step, scan.ranges, scan.beam_time)

    def close(self) -> None:
        """Close its sockets."""
        self.intake.close()
        self._wheels.close()
        self._scans.close()

    def _topics(self) -> dict[str, FakeTopic]:
        twist, odom = self._kind("geometry_msgs/Twist"), self._kind("nav_msgs/Odometry")
        scan, flag = self._kind("sensor_msgs/LaserScan"), self._kind("std_msgs/Bool")
        found = {self._full(f"{name}/scan"): FakeTopic(scan) for name in SCANNERS}
        found[self._name["cmd_vel"]] = FakeTopic(twist, on_message=self.robot.command)
        found[self._name["odom"]] = FakeTopic(odom)
        found[self._name["stop"]] = FakeTopic(flag, latched=True, last={"data": False})
        return found

    def _have(self, fault: str, value: object) -> None:
        self._fault, server = fault, self.server
        if fault == "silent":
            server.mute({self._full(str(value))})
        else:
            server.mute(set(server.topics) if fault == "mute" else set())
        server.late = LATE_S if fault == "late" else 0.0
        server.refusing = fault == "drop"
        if fault == "drop":
            server.drop()
        stopped, self.robot.stopped = self.robot.stopped, fault == "stop"
        if stopped != self.robot.stopped:
            server.publish(self._name["stop"], {"data": self.robot.stopped})

    def _have_beside(self, fault: str, value: object) -> None:
        if fault == "clock":
            self._ahead_ns = round(1e9 * float(str(value)))
        elif fault == "unlatched":
            self.server.topics[self._name["stop"]] = FakeTopic(self._kind("std_msgs/Bool"))
        else:
            self.server.say(str(value))

    def _send_scan(
        self, name: str, start: float, step: float, ranges: tuple[float, ...], beam_time: float
    ) -> None:
        if self._fault == "nan":
            ranges = (math.nan,) * len(ranges)
        topic = self._full(f"{name}/scan")
        if topic in self.server.topics:
            head = self._head(f"robot_{name}_link")
            side = -1.0 if self._settings["upside_down"] else 1.0
            message = laser_scan(head, side * start, side * step, ranges, beam_time)
            self.server.publish(topic, message)

    def _head(self, frame: str) -> Message:
        return header(time.time_ns() + self._ahead_ns, self._number, frame, self._version)

    def _full(self, name: str) -> str:
        return f"/robot/{name}"

    def _kind(self, name: str) -> str:
        return name if self._version == 1 else name.replace("/", "/msg/")


async def run(settings: Mapping[str, Any], ready: Ready, parent: Parent) -> None:
    """Run until the parent has gone."""
    fake, over = FakeKairos(settings), asyncio.Event()
    loop = asyncio.get_running_loop()
    loop.add_reader(parent.fileno(), over.set)
    loop.add_reader(fake.intake.fileno(), fake.receive)
    try:
        await fake.server.listen(settings["host"], settings["port"])
        ready({"control": fake.intake.door("fault")})
        due = before = loop.time()
        while not over.is_set():
            due += PERIOD_S
            try:
                await asyncio.wait_for(over.wait(), max(0.0, due - loop.time()))
            except TimeoutError:
                now = loop.time()
                fake.step(now - before)
                due, before = max(due, now - PERIOD_S), now
    finally:
        loop.remove_reader(fake.intake.fileno())
        loop.remove_reader(parent.fileno())
        fake.close()
        await fake.server.close()


def main(settings: Mapping[str, Any], ready: Ready, parent: Parent) -> None:
    """Run it in an event loop of its own."""
    asyncio.run(run(settings, ready, parent))


if __name__ == "__main__":
    serve(main, DEVICES)
