"""The simulated world around fake devices, which move its base and arm.

It reads no clock and uses no sockets: its host (`hw.fakes.world_process`) passes received messages
in, steps it, and delivers its messages. Times are ns since it was made.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple

from hw.connection import HostedScene
from hw.geometry import Pose2, Pose3
from hw.model import MotionLimits, RobotModel
from hw.people import LivePerson, open_user
from hw.people.walking import Person
from hw.samples import Sample, UserPose
from hw.sim.external_base import HostedArm, HostedBase
from hw.sim.world import World
from hw.truth import Truth

STEP_NS = 10_000_000
"""Period of the world's steps, ns."""
LEVEL_NS = 100_000_000
"""Period at which levels are repeated, ns."""
PUSH_NS = 300_000_000
"""Time for which an order to push the robot off holds, ns."""
VR, DRIVES, SCANNERS, EVALUATOR = "vr_client", "drives", "scanners", "evaluator"
ROUTES = {
    "user.pose": VR,
    "rover.tracker": VR,
    "vr.haptic_request": VR,
    "vr.release": VR,
    "vr.restart": VR,
    "base.scan": SCANNERS,
}
"""The receiver of each sample."""


class PeerMessage(NamedTuple):
    """A message to one of the peers: a name, its instant, ns, and a value."""

    to: str
    name: str
    stamp_ns: int
    value: Any


class Waiting:
    """A person who stands at their start, tracked, until the run begins."""

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
        """True once the run has begun."""
        return self._begun is not None

    def own(self, now_ns: int) -> int:
        """The person's own time, ns; 0 before the run begins."""
        return 0 if self._begun is None else now_ns - self._begun

    def begin(self, now_ns: int) -> None:
        """Begin their own time now, if it has not begun."""
        if self._begun is None:
            self._begun = now_ns

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Advance to now_ns; see `Person`."""
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
    """A tier 2 world whose base and arm are moved by fakes, with an external operator.

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
        self.arm = None if robot.parked is None else HostedArm(robot.parked)
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
        """The ground truth now."""
        return self._world.truth

    @property
    def finished(self) -> bool | None:
        """True once the person has finished; None while they have not begun."""
        if self.person is None:
            return False
        return self.person.finished if self.person.begun else None

    def on_message(self, source: str, name: str, stamp_ns: int, value: Any) -> None:
        """Take a message of a peer.

        Raises:
            ValueError, TypeError: it is unknown or malformed.
        """
        if (source, name) == (DRIVES, "wheels"):
            self.base.turn(stamp_ns, value)
        elif (source, name) == ("cb3", "joints"):
            if self.arm is not None:
                self.arm.on_joints(stamp_ns, value)
        elif (source, name) == (VR, "inform"):
            if self.person is not None:
                self._world.parts["vr"].inform(value is True)
        elif source == EVALUATOR:
            self._order(name, value)
        elif name != "subscribe":
            raise ValueError(f"unknown message {name!r} of {source!r}")

    def _order(self, name: str, value: Any) -> None:
        """Carry out an order of the evaluator concerning person or robot."""
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
            raise ValueError(f"unknown order {name!r}")

    def step(self) -> list[PeerMessage]:
        """Advance to the next instant of the grid; returns the messages of that instant."""
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
        """Keep tracking a live person where they were placed."""
        live, there, person = self._live, self._placed, self.person
        if live is not None and there is not None and person is not None and person.begun:
            live.push(person.own(now), there)

    def _levels(self, now: int, told: Iterable[PeerMessage]) -> list[PeerMessage]:
        """Repeat the request, and that the foam is free."""
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
