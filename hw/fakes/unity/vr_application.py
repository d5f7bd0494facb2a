"""A VR application as the robot sees it: it tracks its user, requests touches, shows the robot.

Its user's actions come from a `UserPlay`; this turns them into messages at 90 Hz, by its own clock.
Its faults are those of real applications:
| fault | effect |
|---|---|
| `gone` / `drop` | closes the link for good / once |
| `lost` | the link is lost without a word, as by radio; a new one is opened when the fault ends |
| `silent` / `mute` | sends no poses / nothing at all |
| `frozen` | repeats the same poses |
| `late` | sends poses 200 ms after they were measured |
| `future` | stamps poses 200 ms ahead |
| `back` | stamps poses a second back |
| `jump` | the person's poses are two metres aside |
| `nan` | requests a touch at NaN |
| `none` | ends all faults |
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any, Protocol

from hw.fakes.unity.unity_client import (
    FLAG,
    JOINTS,
    ODOMETRY,
    POSE,
    TIME,
    Client,
    ShownRobot,
    flag,
    moment,
    pose,
    read_joints,
    read_odometry,
    read_time,
    text,
)
from hw.geometry import Pose2, Pose3
from hw.samples import TrackerPose, UserPose

FAULTS = (
    "none", "gone", "drop", "lost", "silent", "mute", "frozen", "late", "future", "back", "jump",
    "nan",
)  # fmt: skip
HERE = Pose3(0.0, 0.0, 0.0)
FRAME_NS = 10**9 // 90
LATE_NS, STEP_NS = 200_000_000, 1_000_000_000
AGAIN_NS = 250_000_000
"""Period at which a request is repeated while it lasts, so that it outlasts a lost link."""
WAIST, EYES, HAND = 1.0, 1.65, 0.25
"""Heights of waist and eyes, and distance of the hands to the side, m."""
TREMOR = 1e-5
"""Noise, m, so that no pose repeats bit by bit."""
ROBOT, ARM, VISIBLE, SIGN, ASKED, ANSWER = (
    "robot/pose", "joint_states", "robot/visible", "robot/stop_sign", "vr/clock_ask",
    "vr/clock_answer",
)  # fmt: skip
PERSON = ("vr/head", "vr/left_hand", "vr/right_hand", "vr/tailbone")
"""The tailbone last: it completes the person."""


class UserEvent(Protocol):
    """An event of the user, named as in `hw.samples`; stamped by the monotonic clock, ns."""

    name: str
    stamp_ns: int
    value: Any


class UserPlay(Protocol):
    """The actions of the user."""

    def step(self, now_ns: int, robot: Pose2 | None, shown: bool) -> list[Any]:
        """Events since the last step, as `UserEvent`; `robot` is its pose in the map."""
        ...


@dataclass(slots=True)
class Application:
    """See the module.

    `offset_ns` is its clock less the machine's monotonic one; `answers`: it answers questions for
    its clock. `changes` lists changes of what it shows.
    """

    host: str
    port: int
    play: UserPlay
    trackers: tuple[str, ...] = ()
    map_from_vive: Pose3 = HERE
    offset_ns: int = 0
    answers: bool = True
    by_fields: bool = True
    fault: str = "none"
    robot: ShownRobot | None = None
    joints: tuple[float, ...] = ()
    changes: list[str] = field(default_factory=list)
    asks: Pose3 | None = None
    _shown: dict[str, bool] = field(default_factory=dict)
    _held: deque[tuple[int, str, Pose3, int]] = field(default_factory=deque)
    _newest: dict[str, tuple[Pose3, int]] = field(default_factory=dict)
    _sent: dict[str, Pose3] = field(default_factory=dict)
    _vive_from_map: Pose3 = HERE
    _frames: int = 0
    _asked_ns: int = 0
    _client: Client | None = None

    def __post_init__(self) -> None:
        self._vive_from_map = self.map_from_vive.inverse()
        poses = [*PERSON, *(f"vr/{name}" for name in self.trackers), "vr/haptic_request"]
        published = dict.fromkeys(poses, POSE)
        published |= {"vr/release": FLAG, "vr/restart": FLAG, ANSWER: TIME}
        subscribed = {ROBOT: ODOMETRY, ARM: JOINTS, VISIBLE: FLAG, SIGN: FLAG}
        subscribed |= {"/tf": "tf2_msgs/TFMessage"}
        if self.answers:
            subscribed[ASKED] = TIME
        self._client = Client(self.host, self.port, published, subscribed, self.by_fields)

    @property
    def client(self) -> Client:
        """Its link."""
        assert self._client is not None
        return self._client

    @property
    def informed(self) -> bool:
        """True while the stop sign is shown."""
        return self._shown.get(SIGN, False)

    def step(self, now_ns: int) -> None:
        """Run one frame of the application: receive, step the user, send."""
        self._frames += 1
        if self.fault == "gone":
            self.client.close()
            return
        if self.fault == "lost":
            self.client.lose()
        if self.fault == "drop":
            self.client.close()
            self.fault = "none"
        for topic, body in () if self.fault == "lost" else self.client.poll():
            self._on_message(topic, body, now_ns)
        for told in self.play.step(now_ns, self._robot_in_map(), self.informed):
            self._happen(told, now_ns)
        if self.asks is not None and now_ns - self._asked_ns >= AGAIN_NS:
            self._ask(self.asks, now_ns)
        if self.fault not in ("silent", "mute"):
            self._send_poses(now_ns)

    def _on_message(self, topic: str, body: bytes, now_ns: int) -> None:
        if topic == ROBOT:
            self.robot = read_odometry(body)
        elif topic == ARM:
            self.joints = read_joints(body)
        elif topic in (VISIBLE, SIGN):
            if self._shown.get(topic) != bool(body[0]):
                self._shown[topic] = bool(body[0])
                self.changes.append(f"{topic} {'on' if body[0] else 'off'}")
        elif topic == ASKED and self.fault != "mute":
            _, token = read_time(body)
            now = now_ns + self.offset_ns
            answer = [*self.client.header(now, ""), *moment(now), *text(token)]
            self.client.send(ANSWER, answer)

    def _robot_in_map(self) -> Pose2 | None:
        if self.robot is None:
            return None
        seen = Pose3(*self.robot.position, *self.robot.quaternion)
        return (self.map_from_vive @ seen).flat()

    def _happen(self, told: UserEvent, now_ns: int) -> None:
        value = told.value
        if isinstance(value, UserPose):
            for topic, at in zip(PERSON, tracked(value), strict=True):
                self._newest[topic] = (self._vive_from_map @ at, told.stamp_ns)
        elif isinstance(value, TrackerPose):
            self._newest[f"vr/{value.tracker}"] = (value.pose, told.stamp_ns)
        elif told.name == "vr.haptic_request":
            self._ask(value, now_ns)
        elif told.name in ("vr.release", "vr.restart") and self.fault != "mute":
            self.changes.append(told.name)
            self.client.send(told.name.replace(".", "/"), flag(True))

    def _ask(self, deep: Pose3 | None, now_ns: int) -> None:
        if self.fault == "mute":
            return
        if deep is not None:
            if self.asks is None:
                self.changes.append(f"asks at ({deep.x:.2f}, {deep.y:.2f}, {deep.z:.2f})")
            at = self._vive_from_map @ deep
            if self.fault == "nan":
                at = Pose3(math.nan, at.y, at.z, at.qx, at.qy, at.qz, at.qw)
            self._asked_ns = now_ns
            self._send("vr/haptic_request", at, now_ns)
        self.asks = deep

    def _send_poses(self, now_ns: int) -> None:
        if self.fault == "frozen":
            self._newest.clear()
            for topic, at in self._sent.items():
                self._send(topic, at, now_ns)
            return
        self._held += [(now_ns, topic, *seen) for topic, seen in self._newest.items()]
        self._newest.clear()
        due_ns = now_ns - (LATE_NS if self.fault == "late" else 0)
        while self._held and self._held[0][0] <= due_ns:
            _, topic, at, stamp_ns = self._held.popleft()
            self._sent[topic] = self._shaken(topic, at)
            self._send(topic, self._sent[topic], stamp_ns)

    def _shaken(self, topic: str, at: Pose3) -> Pose3:
        aside = 2.0 if self.fault == "jump" and topic in PERSON else 0.0
        tremor = TREMOR * math.sin(self._frames)
        return Pose3(at.x + aside, at.y, at.z + tremor, at.qx, at.qy, at.qz, at.qw)

    def _send(self, topic: str, at: Pose3, stamp_ns: int) -> None:
        shift = {"future": LATE_NS, "back": -STEP_NS}.get(self.fault, 0)
        head = self.client.header(stamp_ns + self.offset_ns + shift, "vive")
        turned = (at.qx, at.qy, at.qz, at.qw)
        self.client.send(topic, [*head, *pose((at.x, at.y, at.z), turned)])


def tracked(user: UserPose) -> tuple[Pose3, Pose3, Pose3, Pose3]:
    """Head, hands and tailbone of a person in the map; unknown ones at plausible places."""
    body = Pose3.from_yaw(user.body.x, user.body.y, WAIST, user.body.yaw)
    head = user.head or Pose3.from_yaw(user.body.x, user.body.y, EYES, user.head_yaw)
    left = user.left_hand or body @ Pose3(0.1, HAND, 0.0)
    right = user.right_hand or body @ Pose3(0.1, -HAND, 0.0)
    return head, left, right, body
