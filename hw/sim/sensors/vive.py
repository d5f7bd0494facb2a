"""Trackers of the VR system: exact to a millimetre while visible, with an offset after a loss.

A device that is found again is re-localized by the tracking system: unless another device was in
view meanwhile, it has a constant offset until it is lost again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from hw.geometry import Pose2, Pose3
from hw.model import RobotModel, TrackerModel, Tracking, ViveErrors
from hw.samples import Sample, TrackerPose
from hw.sim.sensors.coverage import Coverage
from hw.sim.sensors.streams import Normals, Rhythm, Stream
from hw.sim.sensors.track import Track

ARM_RADIUS, ARM_HEIGHT = 0.2, 0.6
"""The folded arm as a cylinder about base_link, m; its height is above the mount. It may hide a
tracker."""
EXACT = Pose2(0.0, 0.0)


class Device:
    """One tracked device: its random losses, and its offset since it was last found."""

    def __init__(self, errors: ViveErrors, seed: int, source: str) -> None:
        self.tracked = True
        self.off = EXACT
        self._errors = errors
        self._losses = Stream(seed, f"{source}/lost")
        self._jumps = Stream(seed, f"{source}/jump")
        self._slot, self._gaps = -1, [(0.0, 0.0), (0.0, 0.0)]
        self._found = 0
        angle = Stream(seed, f"{source}/edge").at(0).random() * 2.0 * math.pi
        self._side = math.cos(angle), math.sin(angle)

    def seen(self, time_ns: int, *, covered: bool, alone: bool) -> bool:
        """True if it is tracked at this instant; call in the order of time.

        `covered`: enough base stations see it. `alone`: no other device is in view.
        """
        tracked = covered and not self._is_lost(time_ns * 1e-9)
        if tracked and not self.tracked:
            self._found += 1
            self.off = self._jump() if alone else EXACT
        self.tracked = tracked
        return tracked

    def bias(self, to_border: float) -> tuple[float, float]:
        """Position error at this distance from the border of the tracked area, m."""
        errors = self._errors
        near = 1.0 - to_border / errors.edge
        size = errors.edge_bias * near if near > 0.0 else 0.0
        return size * self._side[0], size * self._side[1]

    def _is_lost(self, time: float) -> bool:
        """True in a random gap: one per slot of `lost_every`, which may reach into the next one."""
        slot = int(time / self._errors.lost_every)
        if slot != self._slot:
            self._slot, self._gaps = slot, [self._gap(slot - 1), self._gap(slot)]
        (start, end), (later, its_end) = self._gaps
        return start <= time < end or later <= time < its_end

    def _gap(self, slot: int) -> tuple[float, float]:
        if slot < 0:
            return 0.0, 0.0
        when, how_long = self._losses.at(slot).random(2).tolist()
        start = (slot + when) * self._errors.lost_every
        return start, start + how_long * self._errors.lost_for

    def _jump(self) -> Pose2:
        """The random offset after this re-acquisition."""
        length, turn, direction, sense = self._jumps.at(self._found).random(4).tolist()
        (near, far), (least, most) = self._errors.jump, self._errors.jump_turn
        size, angle = near + length * (far - near), 2.0 * math.pi * direction
        yaw = math.copysign(least + turn * (most - least), sense - 0.5)
        return Pose2(size * math.cos(angle), size * math.sin(angle), yaw)


class SimulatedTrackers:
    """The trackers on the rover, each sampled on its own and only while visible (R8, R31)."""

    signals: tuple[str, ...] = ("rover.tracker",)

    def __init__(
        self,
        robot: RobotModel,
        track: Track,
        coverage: Coverage,
        errors: ViveErrors,
        seed: int,
        tracking: Tracking | None = None,
    ) -> None:
        trackers: Mapping[str, TrackerModel] = robot.sensing.trackers
        self._track, self._coverage, self._errors = track, coverage, errors
        arm = 0.0 if robot.arm is None else robot.arm.mount.xyz[2] + ARM_HEIGHT
        self._arm = ARM_RADIUS, arm
        tracking = tracking or Tracking.of(robot.sensing)
        self._vive_from_map = (tracking.map_from_vive.flat() @ errors.restart).inverse()
        self._next_ns = 0
        lag = round(errors.delay * 1e9)
        self._rhythms: dict[str, Rhythm] = {}
        self._devices, self._mounts, self._noise = {}, {}, {}
        for name in trackers.keys() & tracking.mounts.keys():
            model = trackers[name]
            source = f"rover.tracker/{name}"
            self._rhythms[name] = Rhythm(model.rate, seed, source, lag)
            self._devices[name] = Device(errors, seed, source)
            mount = tracking.mounts[name]
            self._mounts[name] = mount.x, mount.y, mount.z, mount.yaw
            self._noise[name] = Normals(seed, source, 6)

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples that have arrived since the last call, by stamps."""
        if now_ns < self._next_ns:
            return []
        due = []
        for name, rhythm in self._rhythms.items():
            for number, stamp in rhythm.due(now_ns):
                due.append((stamp, name, number))
        due.sort()
        self._next_ns = min([rhythm.next_ns for rhythm in self._rhythms.values()], default=now_ns)
        found = []
        for stamp, name, number in due:
            pose = self._look(name, number, stamp)
            if pose is not None:
                found.append(Sample("rover.tracker", stamp, TrackerPose(name, pose)))
        return found

    def _look(self, name: str, number: int, stamp_ns: int) -> Pose3 | None:
        """vive_from_tracker at an instant; None while it is not tracked."""
        device, mount = self._devices[name], self._mounts[name]
        x, y, yaw, stations, to_border = self._coverage.looked(
            self._track.past, stamp_ns, mount, self._arm
        )
        if stations < 0:
            device.tracked = False
            return None
        covered = stations >= self._coverage.least
        alone = not any(other.tracked for other in self._devices.values() if other is not device)
        if not device.seen(stamp_ns, covered=covered, alone=alone):
            return None
        dx, dy = device.bias(to_border)
        x, y = self._vive_from_map.transform(x + dx, y + dy)
        yaw = yaw + mount[3] + self._vive_from_map.yaw
        return self._noisy(name, number, (x, y, mount[2]), yaw)

    def _noisy(
        self, name: str, number: int, place: tuple[float, float, float], yaw: float
    ) -> Pose3:
        """The pose with the device's offset and white noise.

        Its quaternion, here with qw first, is that of the yaw, (w, 0, 0, z), times that of a small
        tilt, (1, p, q, 0).
        """
        off, sigma, half = self._devices[name].off, self._errors.noise, self._errors.turn_noise / 2
        a, b, c, roll, pitch, turn = self._noise[name].row(number).tolist()
        angle = 0.5 * (yaw + off.yaw) + half * turn
        w, z, p, q = math.cos(angle), math.sin(angle), half * roll, half * pitch
        unit = 1.0 / math.sqrt(1.0 + p * p + q * q)  # upright, then tilted by the small (p, q)
        return Pose3(
            place[0] + off.x + sigma * a,
            place[1] + off.y + sigma * b,
            place[2] + sigma * c,
            unit * (w * p - z * q),
            unit * (w * q + z * p),
            unit * z,
            unit * w,
        )
