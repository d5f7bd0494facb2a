"""Registrations, publications and services of the clients of the VR link; one source per topic.

Bytes are handled by `clients.py`; here is the meaning of frames. A client's mistake is reported to
that client and to the engine, and affects no other client; what cannot be read is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from hw.drivers import gates
from hw.drivers.unity.asking import ClockQuestions, clock_state
from hw.drivers.unity.inbox import Checks, Inbox, TellUser
from hw.drivers.unity.protocol import (
    BUILDS,
    MalformedFrame,
    Messages,
    Services,
    Session,
    Topics,
    UnityFrame,
    UnityTopic,
    frame,
    handshake,
    legible,
    plain_name,
    plain_type,
    stamp_of,
    text_in,
    too_long,
)
from hw.drivers.unity.sources import TopicSources
from hw.drivers.unity.view import shown
from hw.samples import RobotView

TOLD_EVERY_NS = 1_000 * gates.MS
"""Least interval between reports of the same mistake to a client."""
LEVELS_EVERY_NS = 100 * gates.MS
FAULT_NS = 2_000 * gates.MS
"""Time after which a fault that does not recur is over."""
CLOCK = "clock_answer"
"""The role of answers for a client's clock: each client gives its own, so nobody has to wait."""
NOBODY = "no VR application is connected"
_NAMES = {"ros1": "ROS 1", "ros2": "ROS 2"}


@dataclass(frozen=True, slots=True)
class Bridged:
    """The settings of a bridge; `joints` are the names of the arm's joints."""

    build: str
    topics: Topics
    checks: Checks
    joints: tuple[str, ...] = ()
    definitions: Mapping[str, str] = field(default_factory=dict)


class UnityBridge:
    """See the module.

    Args:
        settings: of the bridge.
        tell: receives the values made of the clients' messages.
        wall_ns: offset of the stamps of messages to clients from our clock, ns.

    Raises:
        ValueError: a message of a topic is not known.
    """

    def __init__(self, settings: Bridged, tell: TellUser, wall_ns: int = 0) -> None:
        self.sessions: list[Session] = []
        self._settings, self._tell, self._wall_ns = settings, tell, wall_ns
        self._messages = Messages(settings.build, settings.definitions)
        self._inbox = Inbox(settings.checks, tell)
        self._sources = TopicSources()
        self._now_ns, self._told_ns = 0, -LEVELS_EVERY_NS
        self._fault: tuple[int, str] | None = None
        topics = settings.topics
        self._services = Services(topics, self._messages)
        self._questions = ClockQuestions(topics.output("clock_ask"), self._messages, wall_ns)
        for topic in (*topics.inputs.values(), *topics.outputs.values()):
            self._messages.check(topic.type)
        self._commands: Mapping[str, Callable[[Session, Mapping[str, Any]], None]] = {
            "__publish": self._publish,
            "__subscribe": self._subscribe,
            "__ros_service": self._services.register,
            "__unity_service": _nothing,
            "__topic_list": self._services.list_topics,
            "__request": partial(self._services.expect, "request"),
            "__response": partial(self._services.expect, "response"),
            "__remove_publisher": self._unpublish,
            "__remove_subscriber": self._unsubscribe,
            "__remove_ros_service": self._services.remove,
            "__remove_unity_service": _nothing,
        }

    def greet(self, session: Session) -> None:
        """Send the handshake: the first message that a client gets."""
        session.send(handshake(self._settings.build))

    def join(self, session: Session) -> None:
        """Add a client."""
        self.greet(session)
        self.sessions.append(session)

    def blame(self, text: str, now_ns: int) -> None:
        """Report a fault for FAULT_NS from now on."""
        self._fault = (now_ns, legible(text))

    def is_source(self, session: Session) -> bool:
        """True if any topic comes from this client."""
        return session in self._sources.all.values()

    def leave(self, session: Session, now_ns: int) -> None:
        """Remove a client; its topics go to those who wait for them."""
        self._now_ns = now_ns
        self.sessions.remove(session)
        for name in list(session.published):
            self._drop(name, session)
        self._told_ns = -LEVELS_EVERY_NS

    def on_frame(self, session: Session, found: UnityFrame, now_ns: int) -> None:
        """Take a frame of a client."""
        self._now_ns = now_ns
        if not found.destination:
            return
        if found.ros2 and self._settings.build != "ros2":
            self._misbuilt(session, "ros2")
        elif found.is_command:
            self._obey(session, found, now_ns)
        elif session.awaited is not None:
            self._services.answer(session, found)
        else:
            self._receive(session, found, now_ns)

    def tick(self, now_ns: int) -> None:
        """Repeat levels, ask for the clients' time, and see who has come back after a drop."""
        self._now_ns = now_ns
        for name in self._sources.succeed(now_ns):
            self._hand_over(name)
        if now_ns - self._told_ns >= LEVELS_EVERY_NS:
            self._told_ns = now_ns
            self._tell("vr.link", now_ns, "up" if self._sources.all else NOBODY)
            if self._fault is not None and now_ns - self._fault[0] > FAULT_NS:
                self._fault = None
            self._tell("vr.fault", now_ns, None if self._fault is None else self._fault[1])
            self._inbox.repeat(now_ns)
            self._tell_clocks(now_ns)
        self._questions.ask(self.sessions, now_ns)

    def _tell_clocks(self, now_ns: int) -> None:
        for session in dict.fromkeys(self._sources.all.values()):
            state = clock_state(session)
            if state is not None:
                self._tell("vr.clock", now_ns, state)

    def show(self, stamp_ns: int, view: RobotView) -> None:
        """Send the robot's state at an instant of our clock to all subscribers."""
        if not any(session.subscribed for session in self.sessions):
            return
        made, checks = self._messages, self._settings.checks
        place = self._settings.joints, checks.tracking.map_from_vive
        for role, message in shown(made, stamp_ns + self._wall_ns, view, *place):
            topic = self._settings.topics.output(role)
            body: bytes | None = None
            for session in self.sessions:
                if topic.name in session.subscribed:
                    body = body or self._messages.write(topic.type, message)
                    session.send_latest(topic.name, frame(session.subscribed[topic.name], body))

    # ---- registrations

    def _obey(self, session: Session, found: UnityFrame, now_ns: int) -> None:
        """Carry out a command; one that cannot be read is left out."""
        act = self._commands.get(found.destination)
        if act is None:
            session.warn("warn", f"{found.destination} is not known here; it is ignored")
            return
        try:
            act(session, found.fields())
        except MalformedFrame as error:
            self._refuse(session, found.destination, f"{error}; it is ignored", now_ns)

    def _misbuilt(self, session: Session, build: str) -> None:
        """Close the link of a project that was built for the other ROS."""
        session.broken = (
            f"this Unity project is built for {_NAMES[build]}, and the robot expects "
            f"{_NAMES[self._settings.build]}: write `build: {build}` at the robot's VR link, or "
            f"choose {self._settings.build.upper()} under Robotics, ROS Settings"
        )

    def _publish(self, session: Session, fields: Mapping[str, Any]) -> None:
        name, kind = text_in(fields, "topic"), plain_type(text_in(fields, "message_name"))
        topic = self._settings.topics.inputs.get(plain_name(name))
        if topic is None:
            known = ", ".join(self._settings.topics.inputs)
            session.warn("warn", f"{name} is not read here; topics read: {known}")
            return
        if kind != topic.type:
            session.warn("error", f"{name} is a {topic.type} here, no {kind}; it is refused")
            return
        self._sources.add(topic.name, session)
        source = self._sources.source(topic.name)
        if source is not session and source is not None and topic.role != CLOCK:
            told = f"{name} comes from {source.name} already; it waits until that one leaves"
            self.blame(f"{session.name} wants to be a second source: {told}", self._now_ns)
            session.warn("error", told)

    def _unpublish(self, session: Session, fields: Mapping[str, Any]) -> None:
        self._drop(plain_name(text_in(fields, "topic")), session)

    def _drop(self, name: str, session: Session) -> None:
        """Remove a publisher of a topic; if it was the source, who waits first is it now."""
        if self._sources.remove(name, session):
            self._hand_over(name)

    def _hand_over(self, name: str) -> None:
        """The source of a topic has changed: nothing of the one before counts any more."""
        topic, source = self._settings.topics.inputs[name], self._sources.source(name)
        if topic.role == CLOCK:
            return
        self._inbox.drop(topic.role, self._now_ns)
        if source is not None:
            if topic.role == "tailbone":
                self.blame(f"the person is tracked by {source.name} from now on", self._now_ns)
            source.warn("log", f"{name} is read from this client from now on")

    def _subscribe(self, session: Session, fields: Mapping[str, Any]) -> None:
        name, kind = text_in(fields, "topic"), plain_type(text_in(fields, "message_name"))
        topic = self._settings.topics.outputs.get(plain_name(name))
        if topic is None:
            known = ", ".join(self._settings.topics.outputs)
            session.warn("warn", f"{name} is not sent here; topics sent: {known}")
        elif kind != topic.type:
            session.warn("error", f"{name} is a {topic.type} here, no {kind}; it is refused")
        else:
            session.subscribed[topic.name] = name

    def _unsubscribe(self, session: Session, fields: Mapping[str, Any]) -> None:
        session.subscribed.pop(plain_name(text_in(fields, "topic")), None)

    # ---- publications

    def _receive(self, session: Session, found: UnityFrame, now_ns: int) -> None:
        topic = self._settings.topics.inputs.get(plain_name(found.destination))
        if topic is None or topic.name not in session.published:
            reason: str | None = "this client is no source of it; it is ignored"
        else:
            reason = self._read(session, topic, found, now_ns)
        if reason is not None:
            self._refuse(session, found.destination, reason, now_ns)

    def _read(
        self, session: Session, topic: UnityTopic, found: UnityFrame, now_ns: int
    ) -> str | None:
        """Take a message of a publisher of its topic; why it is refused, or None."""
        source = self._sources.source(topic.name)
        try:
            if found.skipped:
                raise ValueError(f"{too_long(found.skipped)}; it is left out")
            message = self._messages.read(topic.type, found.body)
            if topic.role == CLOCK:
                return self._questions.answered(session, message, now_ns)
            if source is not session and source is not None:
                self._get_to_know(session, message, now_ns)
                return f"this client is a second source beside {source.name}, and waits"
        except ValueError as error:
            if topic.role == "haptic_request" and source is session:
                self._inbox.drop(topic.role, now_ns)  # the present request is unknown
            if self._messages.is_of_other_build(found.body, found.ros2):
                self._misbuilt(session, next(one for one in BUILDS if one != self._settings.build))
                return None
            return str(error)
        reason = self._inbox.on_message(topic.role, message, now_ns, session.clock)
        if session.clock.backlogged:
            session.broken = f"its data is {session.clock.age_ns * 1e-6:.0f} ms old"
        return reason

    def _get_to_know(self, session: Session, message: Any, now_ns: int) -> None:
        """Learn the clock of a client that waits, so that it need not once it is the source."""
        stamp = stamp_of(message)
        if stamp is not None:
            session.clock.instant(stamp, now_ns)

    def _refuse(self, session: Session, name: str, reason: str, now_ns: int) -> None:
        if now_ns - session.warned.get(name, -TOLD_EVERY_NS) < TOLD_EVERY_NS:
            return
        if len(session.warned) > len(self._settings.topics.inputs) + 8:
            session.warned.clear()  # a client may send any names
        session.warned[name] = now_ns
        self.blame(f"{name} of {session.name}: {reason}", now_ns)
        session.warn("error", f"{name}: {reason}")


def _nothing(session: Session, fields: Mapping[str, Any]) -> None:
    """Ignore services of Unity's own: they are never called."""
