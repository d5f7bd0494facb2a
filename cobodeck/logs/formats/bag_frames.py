"""The messages of a bag in the base frame: odometry, scans, inertial readings, corrected poses.

Mounts of sensors come from the tf frames. Of several odometry topics a raw one is used, not one
whose name says that it was filtered. If the bag has the robot's pose in a map frame, that gives
reference poses, unless the map never moves against the odometry: then nothing was corrected.
"""

from __future__ import annotations

from collections.abc import Sequence

from cobodeck.logs.formats.bag_messages import BagMessages, BagWheels, Framed
from cobodeck.logs.formats.drive_log import IMU, ODOMETRY, Gathered, RawScan, is_same, odometry_of
from cobodeck.logs.formats.stamps import straightened
from hw import ImuReading, Odometry, Pose2, Pose3, Twist2, unit_quaternion
from states.localization.frames import NoTransform, TransformBuffer

_TRUE = ("truth", "gt_", "mocap")
_ESTIMATED = ("filter", "ekf", "ukf", "amcl", "slam", "visual", "vio", "gps", "global", "map")
_MAPS = ("map", "world")
_ODOMS = ("odom", "odom_combined")
_BASES = ("base_footprint", "base_link", "base")
_FARTHEST = 100.0
"""Largest range if a scan does not state it, m."""
_LONGEST_SCAN = 0.5
"""Longest plausible duration of a scan, s; beam times beyond it are ignored."""
_CACHE_S = 1e8
"""History kept of the frames, s: more than any bag."""
_ODD_BEAMS = 2
"""Largest difference between the number of beams and that by their angles: of rounding."""


class BagFrames:
    """Transforms the bag's messages into the base frame, and puts them into the log."""

    def __init__(self, messages: BagMessages, gathered: Gathered) -> None:
        self._messages = messages
        self._gathered = gathered
        self._stamps = straightened(messages.stamps, gathered.remark)
        self._known = messages.known
        self._frames = self._buffer()
        self._wheels = self._best_odometry()
        child = self._wheels[0].child if self._wheels else ""
        found = (name for name in _BASES if name in self._known)
        self._base = child or next(found, _BASES[1])
        self._mounts: dict[str, Pose3] = {}

    def put_all(self) -> None:
        """Put everything into the log."""
        for found in self._messages.scans:
            stamp = self._stamps[found.number]
            if stamp is not None:
                self._scan(stamp, found)
        for found in self._messages.imu:
            stamp = self._stamps[found.number]
            if stamp is not None:
                self._gathered.add_sample(IMU, stamp, self._reading(stamp, found))
        for stamp, odometry in self._odometry():
            self._gathered.add_sample(ODOMETRY, stamp, odometry)
        self._reference()

    def _buffer(self) -> TransformBuffer:
        frames = TransformBuffer(_CACHE_S)
        for number, parent, child, pose in self._messages.transforms:
            stamp = None if number is None else self._stamps[number]
            try:
                if number is None:
                    frames.fix(parent, child, pose)
                elif stamp is not None:
                    frames.set_transform(parent, child, stamp, pose)
            except ValueError as error:  # NaN or infinite
                self._gathered.remark(f"a transform was left out: {error}")
        return frames

    def _best_odometry(self) -> Sequence[BagWheels]:
        def merit(topic: str) -> tuple[bool, int]:
            estimated = any(word in topic.lower() for word in _ESTIMATED)
            return not estimated, len(self._messages.odometry[topic])

        measured = [t for t in self._messages.odometry if not any(w in t.lower() for w in _TRUE)]
        if not measured:
            return ()
        best = max(measured, key=merit)
        for other in sorted(set(measured) - {best}):
            self._gathered.remark(f"odometry {other} was left out: {best} is taken")
        return self._messages.odometry[best]

    def _odometry(self) -> list[tuple[int, Odometry]]:
        """Odometry of the chosen topic, otherwise the base's poses in the frame `odom`."""
        wheels = self._stamped(self._wheels)
        if wheels:
            if all(one.twist == Twist2(0.0, 0.0, 0.0) for _, one in wheels):
                return odometry_of([(stamp, one.pose) for stamp, one in wheels])
            return [(stamp, Odometry(one.pose, one.twist)) for stamp, one in wheels]
        odom = self._odom
        return [] if odom is None else odometry_of(self._ways(odom))

    def _stamped(self, found: Sequence[BagWheels]) -> list[tuple[int, BagWheels]]:
        stamped = ((self._stamps[one.number], one) for one in found)
        return [(stamp, one) for stamp, one in stamped if stamp is not None]

    @property
    def _odom(self) -> str | None:
        return next((name for name in _ODOMS if name in self._known), None)

    def _ways(self, fixed: str, moving: str | None = None) -> list[tuple[int, Pose2]]:
        """Poses of a frame, or the base, in `fixed` where the frames cover them.

        They are looked up at each scan, or else inertial reading.
        """
        numbers = (found.number for found in self._messages.scans or self._messages.imu)
        stamps = sorted({at for n in numbers if (at := self._stamps[n]) is not None})
        looked_up = ((at, self._frames.lookup(fixed, moving or self._base, at)) for at in stamps)
        return [(at, pose.flat()) for at, pose in looked_up if isinstance(pose, Pose3)]

    def _reference(self) -> None:
        for topic, found in self._messages.odometry.items():
            if any(word in topic.lower() for word in _TRUE):
                for stamp, one in self._stamped(found):
                    self._gathered.refer(stamp, one.pose)
                return
        fixed, odom = next((name for name in _MAPS if name in self._known), None), self._odom
        if fixed is None:
            return
        between = [] if odom is None else self._ways(fixed, odom)
        if len(between) > 1 and all(is_same(between[0][1], pose) for _, pose in between):
            same = f"{fixed} never moves against {odom}"
            self._gathered.remark(f"{same}: poses in {fixed} are not corrected ones, and not used")
            return
        for stamp, pose in self._ways(fixed):
            self._gathered.refer(stamp, pose)

    def _mount(self, sensor: str, frame: str, stamp: int) -> Pose3:
        """base_from_frame, looked up once: sensors do not move on the base."""
        if frame in self._mounts:
            return self._mounts[frame]
        found: Pose3 | NoTransform = Pose3(0.0, 0.0, 0.0)
        if frame != self._base:
            found = self._frames.lookup(self._base, frame, stamp)
            if isinstance(found, NoTransform):
                found = self._frames.lookup(self._base, frame)
        if isinstance(found, NoTransform):
            known = f"the pose of {frame} is not in the bag: it is assumed to be at {self._base}"
            self._gathered.assume(sensor, known)
            found = Pose3(0.0, 0.0, 0.0)
        self._mounts[frame] = found
        return found

    def _scan(self, stamp: int, found: Framed) -> None:
        message, topic = found.message, found.topic
        count, most = len(message.ranges), float(message.range_max)
        beam_time = float(message.time_increment)
        if not 0.0 <= beam_time * count <= _LONGEST_SCAN:
            self._gathered.remark(f"beam times on {topic} are implausible: they are ignored")
            beam_time = 0.0
        start, step = float(message.angle_min), float(message.angle_increment)
        if step and abs((float(message.angle_max) - start) / step + 1.0 - count) > _ODD_BEAMS:
            odd = f"{count} beams do not fit angle_min, angle_max and angle_increment"
            self._gathered.remark(f"on {topic} {odd}: angle_max is ignored")
        label = topic.strip("/").replace("/", "_") or "scan"
        raw = RawScan(
            label,
            self._mount(label, found.frame, stamp),
            start,
            step,
            message.ranges.tolist(),
            most if 0.0 < most < 1e4 else _FARTHEST,
            max(0.0, float(message.range_min)),
            beam_time,
        )
        self._gathered.scan(stamp, raw)

    def _reading(self, stamp: int, found: Framed) -> ImuReading:
        """An inertial reading in the base frame."""
        message, mount = found.message, self._mount(IMU, found.frame, stamp)
        turn = Pose3(0.0, 0.0, 0.0, mount.qx, mount.qy, mount.qz, mount.qw)
        w, a = message.angular_velocity, message.linear_acceleration
        rates, accelerations = turn.transform(w.x, w.y, w.z), turn.transform(a.x, a.y, a.z)
        return ImuReading(rates, accelerations, self._attitude(found, turn))

    def _attitude(self, found: Framed, turn: Pose3) -> tuple[float, float, float, float] | None:
        """Attitude of the base; None if the sensor has none: its covariance begins with -1."""
        q = found.message.orientation
        if not found.message.orientation_covariance[0] >= 0.0:
            return None
        try:
            turned = unit_quaternion(q.x, q.y, q.z, q.w)
        except ValueError as error:
            self._gathered.remark(f"attitudes on {found.topic} were left out: {error}")
            return None
        pose = Pose3(0.0, 0.0, 0.0, *turned) @ turn.inverse()
        return pose.qx, pose.qy, pose.qz, pose.qw
