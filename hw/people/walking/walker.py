"""A person who follows a script."""

from __future__ import annotations

from collections.abc import Iterator

from engine.files import CODE, FileError, Finding, mistake
from hw.geometry import Pose2
from hw.people.walking.manner import ATTENTIVE, Manner
from hw.people.walking.pedestrian import Pedestrian
from hw.people.walking.person import Touch
from hw.people.walking.script import (
    ApproachStep,
    LookStep,
    LoseTracking,
    RequestStep,
    Script,
    ScriptStep,
    Stand,
    Turn,
    WalkStep,
)
from hw.scene import Room


class Walker(Pedestrian):
    """Follows a script; ends after its rounds, or after `requests` and the stand after the last.

    Raises:
        FileError: a walk leaves the free floor, or there is no start.
    """

    def __init__(
        self,
        script: Script,
        room: Room,
        start: Pose2 | None = None,
        requests: int | None = None,
        manner: Manner = ATTENTIVE,
        seed: int = 0,
    ) -> None:
        begin = script.start or start
        if begin is None:
            raise mistake(script.path, "no start, neither here nor as user.start in the scene")
        _check_walks(script, room, begin)
        self._script, self._left = script, requests
        super().__init__(room, begin, script.turn_rate, manner, seed)

    def _run(self) -> Iterator[bool]:
        if not any(isinstance(step, RequestStep) for step in self._script.steps):
            self._left = None
        rounds, let_go = 0, False
        while self._script.rounds is None or rounds < self._script.rounds or self._left:
            rounds += 1
            started = self._now, self._budget
            for step in self._script.steps:
                if self._left == 0 and not isinstance(step, Stand):
                    return
                if let_go and self.manner.hurries and isinstance(step, Stand):
                    continue
                yield from self._perform(step)
                let_go = isinstance(step, RequestStep)
            if (self._now, self._budget) == started:
                yield True  # a round without duration must not stall the world

    def _perform(self, step: ScriptStep) -> Iterator[bool]:
        if isinstance(step, WalkStep):
            yield from self._walk(step)
        elif isinstance(step, Stand):
            yield from self._stand(step.span_ns)
        elif isinstance(step, Turn):
            yield from self._turn(step.yaw)
        elif isinstance(step, RequestStep):
            touch = Touch(0, step.hold_ns, 0, step.ahead, step.height)
            yield from self._ask(touch)
            self._left = None if self._left is None else self._left - 1
        elif isinstance(step, ApproachStep):
            yield from self._approach(step.speed, step.stop_at, step.span_ns)
        elif isinstance(step, LookStep):
            self._head_turn = step.turn
        elif isinstance(step, LoseTracking):
            self._blind_until = self._now - self._budget + step.span_ns


def _check_walks(script: Script, room: Room, start: Pose2) -> None:
    x, y = start.x, start.y
    if not room.is_free(x, y):
        raise mistake(script.path, f"the start ({x:g}, {y:g}) is not on the free floor")
    findings = []
    for step, place in zip(script.steps, script.places, strict=True):
        if isinstance(step, ApproachStep):
            break  # from here on the person's place depends on the robot
        if not isinstance(step, WalkStep):
            continue
        if not room.sees(x, y, step.x, step.y):
            way = f"the path from ({x:g}, {y:g}) to ({step.x:g}, {step.y:g}) leaves the free floor"
            findings.append(Finding(CODE, way, place, "walk around the wall in several steps"))
        x, y = step.x, step.y
    if findings:
        raise FileError(findings)
