"""Simulated devices around the robot: tracking, virtual reality, bumper, operator."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from hw.geometry import Pose3, wrap
from hw.model import WhiteNoise
from hw.motion import PoseHistory, wrapped
from hw.people.walking import Person
from hw.safety import StopLatch
from hw.samples import BumperHit, Sample, UserPose
from hw.scene import Room
from hw.sign import StopSign

if TYPE_CHECKING:
    from hw.sim.sensors.person_view import PersonView

STILL_SPEED = 0.1
"""Below this speed a person counts as standing still, m/s."""
STILL_NS = 500_000_000
"""Time of standing still after which a person who is shown the robot is ready again, ns (R115)."""
UNSEEN_NS = 100_000_000
"""Longest gap between poses of a person to interpolate across, ns."""
PATIENCE_NS = 5_000_000_000
"""Time after which the operator frees by hand a robot whose stop line cannot be reset, ns."""


class SimTrackers:
    """Passes on the measured poses of the person `delay_ns` later; nothing during drop-outs.

    With a room, nothing while the person is outside its tracked area, too (R6). A sample keeps the
    stamp of its measurement. `view` models tracking faults; with it poses are interpolated between
    the world's steps, so that what arrives is exactly `delay_ns` old, however long the steps.
    """

    signals: tuple[str, ...] = ("user.pose",)

    def __init__(
        self,
        person: Person,
        room: Room | None = None,
        delay_ns: int = 0,
        noise: WhiteNoise | None = None,
        view: PersonView | None = None,
    ) -> None:
        self._person, self._room, self._view = person, room, view
        self._delay_ns, self._noise = delay_ns, noise
        self._seen: Sample | None = None
        self._walk = PoseHistory(_between, delay_ns)
        self._pending: deque[Sample] = deque()
        if view is not None:
            self._delay_ns, self._behind_ns = 0, delay_ns

    def step(self) -> Sample | None:
        """Look at the person; returns the true pose if tracking has a new one."""
        true, body = self._person.measured, self._person.body
        if true is None or true is self._seen:
            return None
        if self._room is not None and not self._room.is_tracked(body.x, body.y):
            return None
        self._seen = true
        seen: Sample | None = true
        if self._view is not None and isinstance(true.value, UserPose):
            self._walk.insert(true.stamp_ns, true.value)
            stamp = true.stamp_ns - self._behind_ns
            pose = self._walk.at(stamp, UNSEEN_NS)
            seen = None if pose is None else self._view.seen(Sample(true.name, stamp, pose))
        if seen is None:
            return None
        name, stamp, value = seen
        if self._noise is not None and isinstance(value, UserPose):
            seen = Sample(name, stamp, self._noise.user(value, stamp))
        self._pending.append(seen)
        return true

    @property
    def exact(self) -> bool:
        """True if poses pass as they are and at once, without delay, noise or tracking faults."""
        return self._delay_ns == 0 and self._noise is None and self._view is None

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples that have arrived since the last call."""
        arrived, pending = [], self._pending
        while pending and pending[0].stamp_ns + self._delay_ns <= now_ns:
            arrived.append(pending.popleft())
        return arrived


def _between(a: UserPose, b: UserPose, share: float) -> UserPose:
    turned = wrap(a.head_yaw + share * wrap(b.head_yaw - a.head_yaw))
    body = wrapped(a.body, b.body, share)
    return UserPose(body, turned, b.head, b.left_hand, b.right_hand)


class SimVr:
    """The virtual world: passes requests on and shows the robot to the person.

    `shown`: with the stop sign, at which people stop; a robot without it is only `visible`.
    A person who stands while it is shown is ready, and says so every half second.
    """

    signals: tuple[str, ...] = ("vr.haptic_request", "vr.release", "vr.restart")

    def __init__(self, person: Person, view: PersonView | None = None) -> None:
        self.shown = self.visible = False
        self._sign, self._now_ns = StopSign(), 0
        self._person, self._view = person, view
        self._request: Pose3 | None = None
        self._still_since: int | None = None
        self._pending = [Sample("vr.haptic_request", 0, None)]

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        """Show the robot, with or without the stop sign, or hide it; see `Vr`."""
        self.visible = show
        self._sign.want(show and sign, least)
        self._see_sign()

    def _see_sign(self) -> None:
        shown = self._sign.shown(self._now_ns)
        if shown != self.shown:
            self.shown, self._still_since = shown, None

    @property
    def still(self) -> bool:
        """True while the sign is hidden, and not on its way."""
        return not (self.shown or self._sign.wanted)

    def step(self, now_ns: int) -> None:
        """Look at the person at now_ns."""
        self._now_ns = now_ns
        if self._sign.wanted != self.shown:
            self._see_sign()
        request = self._person.request
        if request is not self._request:
            if request is None:
                self._pending.append(Sample("vr.release", now_ns, True))
            view = self._view
            seen = request if request is None or view is None else view.reported(request)
            self._pending.append(Sample("vr.haptic_request", now_ns, seen))
            self._request = request
        if self.shown:
            self._watch_standing(now_ns)

    def samples(self, now_ns: int) -> list[Sample]:  # noqa: ARG002
        """Events and changes since the last call."""
        pending, self._pending = self._pending, []
        return pending

    def _watch_standing(self, now_ns: int) -> None:
        """A person who stands before the sign is ready, and says so again and again."""
        if self._person.speed >= STILL_SPEED:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = now_ns
        elif now_ns - self._still_since >= STILL_NS:
            self._still_since = now_ns
            self._pending.append(Sample("vr.restart", now_ns, True))


class SimBumper:
    """The foam: each new touch is one event and pulls the stop line (R4, R5)."""

    signals: tuple[str, ...] = ("bumper.hit",)

    def __init__(self, stop_line: StopLatch) -> None:
        self._stop_line = stop_line
        self._pending: list[Sample] = []

    def touch(self, now_ns: int, bearing: float, what: str) -> None:
        """The foam was touched from this bearing (rad, base frame)."""
        self._stop_line.pull(f"bumper: {what}")
        self._pending.append(Sample("bumper.hit", now_ns, BumperHit(bearing)))

    def samples(self, now_ns: int) -> list[Sample]:  # noqa: ARG002
        """Touches since the last call."""
        pending, self._pending = self._pending, []
        return pending


def _nobody(_: str) -> None:
    """Nobody looks at what is shown."""


class Latched(Protocol):
    """A stop line with a reason."""

    @property
    def reason(self) -> str | None:
        """Why it is pulled; None if it is not."""
        ...

    def pull(self, reason: str) -> None:
        """See `StopLine`."""
        ...

    def reset(self) -> bool:
        """See `StopLine`."""
        ...


class ScriptedOperator:
    """Acknowledges each fault after a delay, and resets the stop line as soon as it can be.

    A reported fault and a pulled stop line are handled alike; while the cause persists the operator
    tries again after the same delay. `show`, if set, gets what is reported. After PATIENCE_NS they
    intervene: `by_hand` is called in each step until the line can be reset. While `away`, they do
    nothing: somebody else has stopped the robot, and lets it go on.
    """

    signals: tuple[str, ...] = ("operator.acknowledge",)

    def __init__(
        self,
        stop_line: Latched,
        delay_ns: int = 1_000_000_000,
        by_hand: Callable[[], None] | None = None,
    ) -> None:
        self.faults: list[str] = []
        self.show: Callable[[str], None] = _nobody
        self.away = False
        self._stop_line = stop_line
        self._delay_ns = delay_ns
        self._by_hand = by_hand
        self._since: int | None = None
        self._reported = False
        self._due: int | None = None
        self._pending: list[Sample] = []

    def report(self, fault: str) -> None:
        """Report a fault that has to be acknowledged; see `RemoteOperator`."""
        self.faults.append(fault)
        self._reported = True
        self.show(f"fault: {fault}")

    @property
    def still(self) -> bool:
        """True while there is nothing to do."""
        return self._stop_line.reason is None and not self._reported

    def step(self, now_ns: int) -> None:
        """Look after the robot at now_ns."""
        if self.away or (self._stop_line.reason is None and not self._reported):
            return
        if self._since is None:
            self._since = now_ns
        if self._by_hand is not None and now_ns - self._since >= PATIENCE_NS:
            self._by_hand()
        if self._due is None:
            self._due = now_ns + self._delay_ns
        if now_ns < self._due:
            return
        self._due = None
        if self._stop_line.reset():
            if self.away:  # somebody has stopped it in this moment, which may be undone by that
                self._stop_line.pull("stopped while it was reset")
                return
            self._reported = False
            self._since = None
            self._pending.append(Sample("operator.acknowledge", now_ns, True))

    def samples(self, now_ns: int) -> list[Sample]:  # noqa: ARG002
        """Acknowledgements since the last call."""
        pending, self._pending = self._pending, []
        return pending
