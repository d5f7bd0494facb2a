"""The world around fake devices: room, person, base and arm, moved by what the devices report.

It reads no clock and knows no sockets: whoever hosts it (`hw.fakes.world_process`) hands on what
was heard, lets it step, and delivers what it tells. Times are ns since it was made.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple

from hw.connection import HostedScene
from hw.geometry import Pose2, Pose3
from hw.people.live import LivePerson
from hw.people.person import Person
from hw.people.user import open_user
from hw.robot import MotionLimits, RobotModel
from hw.samples import Sample, UserPose
from hw.sim.hosted_base import HostedArm, HostedBase
from hw.sim.world import World
from hw.truth import Truth

STEP_NS = 10_000_000
"""The world steps on a grid of this period."""
LEVEL_NS = 100_000_000
"""What is a level is told anew this often."""
PUSH_NS = 300_000_000
"""An order of the operator to push the robot off holds so long."""
VR, DRIVES, SCANNERS, EVALUATOR = "vr_client", "drives", "scanners", "evaluator"
ROUTES = {
    "user.pose": VR,
    "rover.tracker": VR,
    "vr.haptic_request": VR,
    "vr.release": VR,
    "vr.restart": VR,
    "base.scan": SCANNERS,
}
"""Who is told of which samples."""


class PeerMessage(NamedTuple):
    """Something for one of the peers: a name, the instant it is of, ns, and a value."""

    to: str
    name: str
    stamp_ns: int
    value: Any


class Waiting:
    """A person who stands where they start, tracked, until a run begins."""

    def __init__(self, person: Person) -> None:
        self.body, self.speed = person.body, 0.0
        self.request: Pose3 | None = None
        self.measured: Sample | None = None
        self.finished = False
        self._person = person
        self._begun: int | None = None
        self._seen: Sample | None = None
        self._standing = UserPose(person.body, person.body.yaw)

    @property
    def begun(self) -> bool:
        """Has the run begun?"""
        return self._begun is not None

    def own(self, now_ns: int) -> int:
        """What it is in their own time, ns; 0 until that begins."""
        return 0 if self._begun is None else now_ns - self._begun

    def begin(self, now_ns: int) -> None:
        """Their own time begins now, if it has not yet."""
        if self._begun is None:
            self._begun = now_ns

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Go on to now_ns; see `Person`."""
        if self._begun is None:
            self.measured = Sample("user.pose", now_ns, self._standing)
            return
        person = self._person
        person.step(self.own(now_ns), robot, informed)
        self.body, self.speed = person.body, person.speed
        self.request, self.finished = person.request, person.finished
        seen = person.measured
        if seen is not self._seen:
            self._seen, self.measured = seen, None
            if seen is not None:
                self.measured = Sample(seen.name, seen.stamp_ns + self._begun, seen.value)


class HostedWorld:
    """A tier 2 world whose base and arm are moved by fakes, and whose operator is outside.

    Raises:
        FileError: the user's file is wrong, or the robot starts in a wall.
    """

    def __init__(self, play: HostedScene, robot: RobotModel, motion: MotionLimits) -> None:
        scene = play.scene
        self.person: Waiting | None = None
        self._live: LivePerson | None = None
        if play.user is not None:
            user = open_user(play.user, scene, play.requests, play.stretch_m, play.seed)
            self.person = Waiting(user)
            self._live = user if isinstance(user, LivePerson) else None
        self.base = HostedBase(robot, motion, scene.robot_start)
        self.arm = None if robot.arm is None else HostedArm(robot.arm.parked)
        self.now_ns = 0
        self._world = World(
            scene,
            robot,
            self.person,
            motion,
            self.base,
            self.arm,
            sensors=replace(play.sensors, seed=play.seed),
            sensing=play.sensing,
            operator=False,
        )
        sources = ("trackers", "rover_trackers", "vr", "lidar")
        self._sources = [self._world.parts[name] for name in sources if name in self._world.parts]
        self._bumper = self._world.parts["bumper"]
        self._foam_pressed = False
        self._request: Pose3 | None = None
        self._level_due = 0
        self._pushed_until = 0
        self._placed: UserPose | None = None

    @property
    def truth(self) -> Truth:
        """How everything is now."""
        return self._world.truth

    @property
    def finished(self) -> bool | None:
        """Has the person done what they were going to do? None: they have not begun."""
        if self.person is None:
            return False
        return self.person.finished if self.person.begun else None

    def hear(self, source: str, name: str, stamp_ns: int, value: Any) -> None:
        """A peer has told something.

        Raises:
            ValueError, TypeError: no such thing can be told.
        """
        if (source, name) == (DRIVES, "wheels"):
            self.base.turn(stamp_ns, value)
        elif (source, name) == ("cb3", "joints"):
            if self.arm is not None:
                self.arm.take(stamp_ns, value)
        elif (source, name) == (VR, "inform"):
            if self.person is not None:
                self._world.parts["vr"].inform(value is True)
        elif source == EVALUATOR:
            self._order(name, value)
        elif name != "subscribe":
            raise ValueError(f"nobody knows what {name!r} of {source!r} is")

    def _order(self, name: str, value: Any) -> None:
        """The evaluator has its way with the person and the robot."""
        live = self._live
        if name == "push_off":
            self._pushed_until = self.now_ns + PUSH_NS
        elif name == "begin":
            if self.person is not None:
                self.person.begin(self.now_ns)
        elif name == "place" and live is not None and isinstance(value, UserPose):
            self._placed = value
        elif name == "ask" and live is not None:
            if value is None:
                live.let_go()
            else:
                live.ask(value)
        else:
            raise ValueError(f"nobody can {name!r}")

    def step(self) -> list[PeerMessage]:
        """Go on to the next instant of the grid; what there is to tell then."""
        self.now_ns = now = self.now_ns + STEP_NS
        self._place_live(now)
        self._world.advance(now)
        if now <= self._pushed_until:
            self._world.push_off()
        told = [
            PeerMessage(ROUTES[sample.name], sample.name, sample.stamp_ns, sample.value)
            for source in self._sources
            for sample in source.samples(now)
        ]
        told += self._levels(now, told)
        told += self._foam(now)
        told.append(PeerMessage(EVALUATOR, "truth", now, self.truth))
        told.append(PeerMessage(EVALUATOR, "finished", now, self.finished))
        return told

    def _place_live(self, now: int) -> None:
        """Tracking goes on seeing a live person where they were placed."""
        live, there, person = self._live, self._placed, self.person
        if live is not None and there is not None and person is not None and person.begun:
            live.push(person.own(now), there)

    def _levels(self, now: int, told: Iterable[PeerMessage]) -> list[PeerMessage]:
        """The request, and whether the foam is free, anew."""
        for one in told:
            if one.name == "vr.haptic_request":
                self._request = one.value
        if now < self._level_due:
            return []
        self._level_due = now + LEVEL_NS
        found = [] if self._foam_pressed else [PeerMessage(DRIVES, "bumper", now, None)]
        if self.person is not None:
            found.append(PeerMessage(VR, "vr.haptic_request", now, self._request))
        return found

    def _foam(self, now: int) -> list[PeerMessage]:
        hits = [PeerMessage(DRIVES, "bumper", now, hit.value) for hit in self._bumper.samples(now)]
        pressed = self._world.pressed or self.base.held
        if self._foam_pressed and not pressed:
            hits.append(PeerMessage(DRIVES, "bumper", now, None))
        self._foam_pressed = pressed
        return hits
