"""What the robot's outline touches in the simulation: walls, objects, the user and bystanders.

Walls and objects hold the base where it was; a touch of a person is a contact. Both count as a hit
of the bumper.
"""

from __future__ import annotations

import math
from dataclasses import replace

from engine.files import mistake
from hw.geometry import Pose2, wrap
from hw.model import RobotModel
from hw.people.walking import Person
from hw.scene import Scene
from hw.sim.contact.meeting import Bystanders, Meeting
from hw.sim.contact.moving import MovingBase
from hw.sim.contact.nearby import Nearby
from hw.sim.contact.walls import Walls
from hw.sim.sensors import SimBumper
from hw.truth import USER, Contact, Hit

PUSHED_OFF, PUSHING = 0.3, 0.3
"""The operator pushes a robot that touches a person to this gap, m, at this speed, m/s."""
SAME_M = 0.3
"""Touches of a wall, or of a thing that moves, within this distance are one hit, m."""
_PUSHES = tuple(math.radians(angle) for angle in (0, 20, -20, 40, -40, 60, -60, 80, -80))
"""Directions of a push, relative to straight away from the person, rad; of two alike the first."""


class Collisions:
    """Contacts and hits so far, in the step of the world from `since_ns` to `now_ns`.

    `contacts` are the touches of the outline and people, swept between steps; `wall_hits` and
    `object_hits` count touches of the room and of chairs and the like; `hits` has which.
    """

    def __init__(
        self,
        robot: RobotModel,
        scene: Scene | None,
        person: Person | None,
        base: MovingBase,
        bumper: SimBumper,
    ) -> None:
        self.contacts: tuple[Contact, ...] = ()
        self.hits: tuple[Hit, ...] = ()
        self.wall_hits = self.object_hits = 0
        self.user = Meeting(robot.footprint, USER)
        self.others = Bystanders(() if scene is None else scene.objects, robot.footprint)
        self._walls = None if scene is None else Walls(scene.room, robot)
        self._turning_room = robot.footprint.half_diagonal - robot.footprint.half_width
        self._person, self._base, self._bumper = person, base, bumper
        self.since_ns = self.now_ns = 0
        self._touched = False
        if person is not None:
            start = Pose2(0.0, 0.0) if scene is None else scene.robot_start
            self.user.least = self.user.gap(start, person.body)

    @property
    def min_gap(self) -> float:
        """The least gap of footprint and user so far, m; infinite without a user."""
        return self.user.least

    @property
    def touching(self) -> bool:
        """True while footprint and user touch."""
        return self.user.touching

    @property
    def pressed(self) -> bool:
        """True while anybody touches the foam."""
        return self.user.touching or self.others.touching(self.now_ns) is not None

    def check_start(self, scene: Scene) -> None:
        """Refuse a start in a touch.

        Raises:
            FileError: the outline touches a wall or the person.
        """
        start = self._base.pose
        place = f"robot.start ({start.x:g}, {start.y:g}, {start.yaw:g})"
        if self._hits_wall(start):
            raise mistake(scene.name, f"{place}: the robot would touch a wall")
        if self._person is not None and self.user.least <= 0.0:
            body = self._person.body
            raise mistake(
                scene.name,
                f"{place}: the robot would touch the person, who starts at "
                f"({body.x:.2f}, {body.y:.2f}); start one of them elsewhere",
            )

    def collide(self, before: Pose2) -> None:
        """The base has moved from `before`: hold it there if it has run into something solid."""
        if self._walls is not None and self._hits_wall(self._base.pose):
            self.wall_hits += 1
            self._note(self._walls.nearest(before))
            self._hit("wall", before)
        elif thing := self.others.in_the_way((before, self._base.pose), self.now_ns):
            self.object_hits += 1
            self._note(thing)
            self._hit("object", before)

    def watch_user(self, robot_before: Pose2, body_before: Pose2) -> None:
        """Base and user have moved from these poses: note the gap and a new contact."""
        if self._person is None:
            return
        body, span_s = self._person.body, (self.now_ns - self.since_ns) * 1e-9
        robot, walked = (robot_before, self._base.pose), (body_before, body)
        granted = self._person.request is not None
        contact = self.user.watch(robot, walked, self.now_ns, span_s, granted)
        if contact is not None:
            self._touch(contact, body)
        self._touched = self._touched or self.user.touching

    def watch_others(self, robot_before: Pose2) -> None:
        """The base has moved from this pose: note new contacts with bystanders."""
        robot = robot_before, self._base.pose
        for contact, there in self.others.watch(robot, self.since_ns, self.now_ns):
            self._touch(contact, there)

    def release(self, freed: bool) -> None:
        """Note a reset of the stop line: if it was `freed`, a touch of the user is over."""
        self._touched = self._touched and not freed

    def push_off(self) -> None:
        """Push a robot that has touched somebody one step away from them, where there is room.

        Of the pushes that hit no wall, one that opens the gap, and of these, one that leaves the
        robot where it can drive off in any direction.
        """
        robot, body = self._base.pose, self.others.touching(self.now_ns)
        if body is None and self._touched and self._person is not None:
            body = self._person.body
        if body is None or (gap := self.user.gap(robot, body)) >= PUSHED_OFF:
            return
        away = math.atan2(robot.y - body.y, robot.x - body.x)
        step = PUSHING * (self.now_ns - self.since_ns) * 1e-9
        pushes = [
            Pose2(robot.x + step * math.cos(angle), robot.y + step * math.sin(angle), robot.yaw)
            for angle in (away + aside for aside in _PUSHES)
        ]
        free = (pose for pose in pushes if not self._hits_wall(pose))
        pushed = min(
            free,
            key=lambda pose: (
                self.user.gap(pose, body) <= gap,
                self._hits_wall(pose, self._turning_room),
            ),
            default=None,
        )
        if pushed is not None:
            self._base.block(pushed)
            if self._person is not None:
                self.watch_user(robot, self._person.body)

    def _hits_wall(self, pose: Pose2, margin: float = 0.0) -> bool:
        return self._walls is not None and self._walls.hit_by(pose, margin)

    def _touch(self, contact: Contact, body: Pose2) -> None:
        self.contacts = (*self.contacts, contact)
        self._bumper.touch(self.now_ns, self._base.pose.bearing_to(body), "person")

    def _note(self, found: Nearby) -> None:
        """Note a touch; it belongs to the last hit if that was of the same, at the same place."""
        last, now = self.hits[-1] if self.hits else None, self.now_ns
        same = last is not None and last.what == found.what
        if last is None or not same or math.dist((last.x, last.y), (found.x, found.y)) > SAME_M:
            self.hits = (*self.hits, Hit(now, now, found.what, found.x, found.y))
        else:
            again = replace(last, until_ns=now, count=last.count + 1)
            self.hits = (*self.hits[:-1], again)

    def _hit(self, what: str, before: Pose2) -> None:
        pose = self._base.pose
        moved = math.atan2(pose.y - before.y, pose.x - before.x)
        self._bumper.touch(self.now_ns, wrap(moved - before.yaw), what)
        self._base.block(before)
