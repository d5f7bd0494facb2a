"""A room, a drive through it and what sensors would see of it, for tests of localization.

Shares no code with what it tests: rays are cast against sides and discs in closed form, each from
where the base was at that beam's time.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from hw.geometry import Pose2, Pose3, Twist2
from hw.model.sensing import ImuModel, LidarModel, Mount, OdometryModel, Sensing, TrackerModel
from hw.samples import ImuReading, Odometry, Sample, Scan, TrackerPose
from hw.scene.room import Room

ROOM = Room(
    ((0.0, 0.0), (12.0, 0.0), (12.0, 10.0), (0.0, 10.0)),
    walls=(
        ((7.0, 0.0), (7.2, 0.0), (7.2, 2.5), (7.0, 2.5)),
        ((7.0, 7.5), (7.2, 7.5), (7.2, 10.0), (7.0, 10.0)),
        ((0.0, 6.2), (1.4, 6.2), (1.4, 6.4), (0.0, 6.4)),
    ),
    columns=(((4.0, 4.6), (4.4, 4.6), (4.4, 5.2), (4.0, 5.2)),),
)
STOPS = (
    (2.0, 2.0),
    (5.5, 2.2),
    (5.6, 5.0),
    (9.0, 5.0),
    (10.0, 2.0),
    (9.8, 8.0),
    (5.5, 7.8),
    (2.5, 8.2),
)
LINKS = {
    0: (1, 2),
    1: (0, 2),
    2: (0, 1, 3, 6),
    3: (2, 4, 5),
    4: (3, 5),
    5: (3, 4),
    6: (2, 7),
    7: (6,),
}
"""Stops between which the straight way is free for the base."""


def sensing(beams=181, rate=12.5):
    """The two scanners of the robot, with fewer beams."""

    def lidar(x, y, yaw):
        return LidarModel(Mount(x, y, 0.3, yaw), beams, math.radians(270.0), rate, 0.05, 30.0)

    return Sensing(
        lidars={
            "front_laser": lidar(0.2865, -0.2089, -0.25 * math.pi),
            "rear_laser": lidar(-0.2865, 0.2089, 0.75 * math.pi),
        },
        trackers={
            "front_tracker": TrackerModel(Mount(0.38, 0.27, 0.45)),
            "rear_tracker": TrackerModel(Mount(-0.38, -0.27, 0.45, math.pi)),
        },
        odometry=OdometryModel(50.0),
        imu=ImuModel(100.0),
    )


@dataclass
class Drive:
    """Where the base truly was: times, s, and x, y, yaw, not wrapped."""

    times: np.ndarray
    x: np.ndarray
    y: np.ndarray
    yaw: np.ndarray

    def at(self, times):
        return tuple(np.interp(times, self.times, values) for values in (self.x, self.y, self.yaw))

    def pose(self, time):
        x, y, yaw = self.at(time)
        return Pose2.checked(float(x), float(y), float(yaw))


def random_drive(seed, duration=60.0, speed=1.5, stand=0.0, start=0):
    """From stop to stop at up to `speed`, turning at up to 1 rad/s on the way; 1 m/s2."""
    rng = np.random.default_rng((seed, 1))
    dt = 0.01
    rows, here, yaw = [], start, float(rng.uniform(-math.pi, math.pi))
    rows += [(*STOPS[here], yaw)] * max(1, round(stand / dt))
    while len(rows) * dt < duration:
        there = int(rng.choice(LINKS[here]))
        way = math.dist(STOPS[here], STOPS[there])
        top = min(speed * rng.uniform(0.6, 1.0), math.sqrt(way))
        total = way / top + top
        turn = float(rng.uniform(-1.0, 1.0)) * min(total, math.pi)
        for time in np.arange(dt, total, dt):
            up, down = min(time, top), max(0.0, time - (total - top))
            gone = 0.5 * up**2 + top * (time - up) - 0.5 * down**2
            part = 0.5 - 0.5 * math.cos(math.pi * time / total)
            x, y = (
                a + (b - a) * gone / way for a, b in zip(STOPS[here], STOPS[there], strict=True)
            )
            rows.append((x, y, yaw + turn * part))
        yaw += turn
        here = there
    values = np.array(rows[: round(duration / dt) + 1])
    return Drive(np.arange(len(values)) * dt, *values.T)


def standing(pose, duration):
    times = np.arange(round(duration / 0.01) + 1) * 0.01
    return Drive(times, *(np.full(len(times), value) for value in (pose.x, pose.y, pose.yaw)))


def cast(x, y, angles, sides, discs):
    """Range of each ray from its own place, (n,), inf where it meets nothing."""
    ux, uy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y = np.broadcast_to(x, angles.shape)[:, None], np.broadcast_to(y, angles.shape)[:, None]
    found = np.full(len(angles), np.inf)
    if len(sides):
        ax, ay, bx, by = sides.T
        ex, ey = bx - ax, by - ay
        with np.errstate(divide="ignore", invalid="ignore"):
            across = ux * ey - uy * ex
            along = ((ax - x) * ey - (ay - y) * ex) / across
            part = ((ax - x) * uy - (ay - y) * ux) / across
        hit = (along > 0.0) & (part >= 0.0) & (part <= 1.0)
        found = np.minimum(found, np.where(hit, along, np.inf).min(axis=1))
    if len(discs):
        cx, cy, radius = discs[..., 0] - x, discs[..., 1] - y, discs[..., 2]
        along, aside = cx * ux + cy * uy, cx * uy - cy * ux
        with np.errstate(invalid="ignore"):
            near = along - np.sqrt(radius**2 - aside**2)
        found = np.minimum(found, np.where(near > 0.0, near, np.inf).min(axis=1))
    return found


@dataclass
class World:
    """A drive, what the sensors of `sensing` would measure on it, and what stands about.

    `noise` of ranges, m, `outliers` a share of beams that end anywhere before the wall. `discs`
    (n, 3) are posts that no map shows; with `walker` a person of 1 m walks through the room, too.
    `blocked` is a share of beams that end on something unknown, in sectors that stay for a while.
    """

    drive: Drive
    seed: int
    sensing: Sensing = field(default_factory=sensing)
    room: Room = ROOM
    noise: float = 0.02
    outliers: float = 0.03
    discs: tuple = ()
    walker: bool = True
    blocked: float = 0.0
    slip: float = 1.0
    covered: float = 6.0
    lost_trackers: tuple = ()

    def __post_init__(self):
        self.sides = np.array(self.room.segments)
        self.person = random_drive(self.seed + 1000, float(self.drive.times[-1]), 0.9, start=3)

    def scan(self, name, number):
        """The scan of a scanner, with the time of its first beam, s."""
        lidar = self.sensing.lidars[name]
        late = 0.0 if name.startswith("front") else 0.5
        start = (number + late) / lidar.rate
        times = start + np.arange(lidar.beams) * lidar.beam_time
        angles = lidar.start + np.arange(lidar.beams) * lidar.step
        x, y, yaw = self.drive.at(times)
        mount = lidar.mount
        c, s = np.cos(yaw), np.sin(yaw)
        sx, sy = x + c * mount.x - s * mount.y, y + s * mount.x + c * mount.y
        rng = np.random.default_rng((self.seed, 2, sorted(self.sensing.lidars).index(name), number))
        ranges = cast(sx, sy, angles + yaw + mount.yaw, self.sides, self._discs(start))
        ranges += rng.normal(0.0, self.noise, lidar.beams)
        odd = rng.random(lidar.beams) < self.outliers
        ranges[odd] *= rng.random(np.count_nonzero(odd))
        if self.blocked:
            self._block(ranges, angles + yaw + mount.yaw, start)
        return start, Scan(name, lidar.start, lidar.step, tuple(ranges.tolist()), lidar.beam_time)

    def _discs(self, time):
        rows = list(self.discs)
        if self.walker:
            x, y, _ = self.person.at(time)
            near = math.dist((x, y), self.drive.at(time)[:2])
            if near > 1.3:
                rows.append((x, y, 0.5))
        return np.array(rows, dtype=float).reshape(-1, 3)

    def _block(self, ranges, directions, time):
        """Sectors of 15 degrees of the map's directions, new ones every two seconds."""
        epoch = int(time // 2.0)
        rng = np.random.default_rng((self.seed, 3, epoch))
        chosen = rng.permutation(24) < round(24 * self.blocked)
        share = rng.uniform(0.3, 0.9, 24)
        sector = (np.mod(directions, 2.0 * math.pi) / (2.0 * math.pi) * 24).astype(int) % 24
        ranges *= np.where(chosen[sector], share[sector], 1.0)

    def odometry(self):
        """(stamp_ns, Odometry) at the wheels' rate; its wheels slip when it brakes and turns."""
        rng = np.random.default_rng((self.seed, 4))
        step = 1.0 / self.sensing.odometry.rate
        times = np.arange(0.0, self.drive.times[-1] + 1e-9, step)
        x, y, yaw = self.drive.at(times)
        scale = 1.0 + self.slip * rng.normal(0.0, 0.02, 3)
        found, pose, before = [], Pose2(0.0, 0.0), np.zeros(3)
        for i, time in enumerate(times):
            if i == 0:
                twist = np.zeros(3)
            else:
                dx, dy = x[i] - x[i - 1], y[i] - y[i - 1]
                middle = 0.5 * (yaw[i] + yaw[i - 1])
                c, s = math.cos(middle), math.sin(middle)
                true = np.array([c * dx + s * dy, -s * dx + c * dy, yaw[i] - yaw[i - 1]]) / step
                slow = (true - before) / step
                before = true
                moved = np.abs(true)
                twist = true * scale - self.slip * 0.03 * np.clip(slow, -2.0, 2.0) * (moved > 1e-6)
                twist[2] += self.slip * 0.02 * math.hypot(true[0], true[1])
                spread = np.array([0.02, 0.02, 0.02]) * np.minimum(1.0, moved.sum())
                twist = twist + self.slip * rng.normal(0.0, 1.0, 3) * spread
                pose = pose @ arc(twist * step)
            found.append((round(time * 1e9), Odometry(pose, Twist2(*map(float, twist)))))
        return found

    def imu(self):
        """(stamp_ns, ImuReading): rate of turn with a constant bias and white noise."""
        rng = np.random.default_rng((self.seed, 5))
        step = 1.0 / self.sensing.imu.rate
        times = np.arange(step, self.drive.times[-1] + 1e-9, step)
        yaw = self.drive.at(times)[2] - self.drive.at(times - step)[2]
        rates = yaw / step + rng.normal(0.0, 0.003) + rng.normal(0.0, 0.005, len(times))
        return [
            (round(time * 1e9), ImuReading((0.0, 0.0, float(rate)), (0.0, 0.0, 9.81)))
            for time, rate in zip(times, rates, strict=True)
        ]

    def trackers(self):
        """(stamp_ns, TrackerPose) of both where x is below `covered`, 30 times a second.

        0.5 mm of noise; each acquisition has an offset of its own of 15 to 47 mm and 1.3 to 1.8
        degrees; in the last 0.7 m before the edge up to 6 cm of bias. Both are lost now and then.
        """
        found = []
        for number, (name, model) in enumerate(sorted(self.sensing.trackers.items())):
            if name in self.lost_trackers:
                continue
            rng = np.random.default_rng((self.seed, 6, number))
            seen, gap_until, mount = False, 0.0, model.mount.flat
            for time in np.arange(0.0, self.drive.times[-1] + 1e-9, 1.0 / 30.0):
                true = self.drive.pose(float(time)) @ mount
                if rng.random() < 0.003:
                    gap_until = time + rng.uniform(0.3, 2.0)
                if true.x > self.covered or time < gap_until:
                    seen = False
                    continue
                if not seen:
                    seen = True
                    size, angle = rng.uniform(0.015, 0.047), rng.uniform(0.0, 2.0 * math.pi)
                    turn = math.radians(rng.uniform(1.3, 1.8)) * rng.choice([-1.0, 1.0])
                edge = 0.06 * max(0.0, 1.0 - (self.covered - true.x) / 0.7)
                x, y = true.x + size * math.cos(angle) + edge, true.y + size * math.sin(angle)
                noise = rng.normal(0.0, 5e-4, 2)
                pose = Pose3.from_yaw(x + noise[0], y + noise[1], model.mount.z, true.yaw + turn)
                found.append((round(time * 1e9), TrackerPose(name, pose)))
        return found

    def samples(self, *names):
        """Those of these names in the order of arrival: scans come after their last beam."""
        found = []
        if "base.odometry" in names:
            found += [
                (stamp, Sample("base.odometry", stamp, value)) for stamp, value in self.odometry()
            ]
        if "base.imu" in names:
            found += [(stamp, Sample("base.imu", stamp, value)) for stamp, value in self.imu()]
        if "rover.tracker" in names:
            late = 20_000_000
            found += [
                (stamp + late, Sample("rover.tracker", stamp, value))
                for stamp, value in self.trackers()
            ]
        if "base.scan" in names:
            for name, lidar in self.sensing.lidars.items():
                for number in range(int(self.drive.times[-1] * lidar.rate) - 1):
                    start, scan = self.scan(name, number)
                    stamp = round(start * 1e9)
                    arrival = stamp + round(lidar.beams * lidar.beam_time * 1e9)
                    found.append((arrival, Sample("base.scan", stamp, scan)))
        return [sample for _, sample in sorted(found, key=lambda one: one[0])]


def arc(way):
    """The pose after a steady turn and way, by its complex form."""
    turn = float(way[2])
    step = complex(way[0], way[1])
    if abs(turn) > 1e-100:
        step *= np.expm1(1j * turn) / (1j * turn)
    return Pose2(step.real, step.imag, turn)
