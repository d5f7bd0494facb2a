"""Registrations, publications and services of the clients of the VR link; one source per topic.

Sockets are handled by `server.py`; here is the meaning of frames. A client's mistake is reported to
that client and to the engine, and affects no other client.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hw.drivers import gates
from hw.drivers.unity.inbox import MAP, VIVE, Checks, Inbox, TellUser
from hw.drivers.unity.messages import SECOND, Messages, time_of
from hw.drivers.unity.session import Session
from hw.drivers.unity.topics import Topics, UnityTopic, plain_name, plain_type
from hw.drivers.unity.wire import MalformedFrame, UnityFrame, command, frame, handshake
from hw.geometry import Pose3
from hw.samples import ClockState, RobotView

DESCRIBE, TRIGGER = "cobodeck/describe", "std_srvs/Trigger"
"""The service offered: it answers with all topics as JSON."""
TOLD_EVERY_NS = 1_000 * gates.MS
"""Least interval between reports of the same mistake to a client."""
LEVELS_EVERY_NS = 100 * gates.MS
FAULT_NS = 2_000 * gates.MS
"""Time after which a fault that does not recur is over."""
ASKED_EVERY_NS, ASKED_FIRST = 1_000 * gates.MS, 20
"""The clock is asked once a second, and ten times as often for the first ASKED_FIRST times."""
NOBODY = "no VR application is connected"


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
        self._owners: dict[str, Session] = {}
        self._now_ns, self._told_ns = 0, -LEVELS_EVERY_NS
        self._fault: tuple[int, str] | None = None
        self._asked, self._due = 0, dict[int, int]()
        topics = settings.topics
        for topic in (*topics.inputs.values(), *topics.outputs.values()):
            self._messages.check(topic.type)
        self._commands: Mapping[str, Callable[[Session, Mapping[str, Any]], None]] = {
            "__publish": self._publish,
            "__subscribe": self._subscribe,
            "__ros_service": self._serve,
            "__unity_service": _nothing,
            "__topic_list": self._list,
            "__request": lambda session, fields: self._await(session, "request", fields),
            "__response": lambda session, fields: self._await(session, "response", fields),
            "__remove_publisher": self._unpublish,
            "__remove_subscriber": self._unsubscribe,
            "__remove_ros_service": self._unserve,
            "__remove_unity_service": _nothing,
        }

    def join(self, session: Session) -> None:
        """Add a client; the handshake is the first message it gets."""
        session.send(handshake(self._settings.build))
        self.sessions.append(session)

    def blame(self, text: str) -> None:
        """Report a fault for FAULT_NS from now on."""
        self._fault = (self._now_ns, text)

    def leave(self, session: Session, now_ns: int) -> None:
        """Remove a client with its sources."""
        self._now_ns = now_ns
        self.sessions.remove(session)
        self._due.pop(id(session), None)
        for name in [name for name, owner in self._owners.items() if owner is session]:
            self._drop(name, now_ns)
        self._told_ns = -LEVELS_EVERY_NS

    def take(self, session: Session, found: UnityFrame, now_ns: int) -> None:
        """Take a frame of a client.

        Raises:
            MalformedFrame: the client's link is no longer usable.
        """
        self._now_ns = now_ns
        if found.is_command:
            act = self._commands.get(found.destination)
            if act is None:
                session.warn("warn", f"{found.destination} is not known here; it is ignored")
            else:
                act(session, found.fields())
        elif found.destination and session.awaited is not None:
            self._answer(session, found)
        elif found.destination:
            self._receive(session, found, now_ns)

    def tick(self, now_ns: int) -> None:
        """Repeat levels, and ask for the clients' time."""
        self._now_ns = now_ns
        if now_ns - self._told_ns >= LEVELS_EVERY_NS:
            self._told_ns = now_ns
            self._tell("vr.link", now_ns, "up" if self._owners else NOBODY)
            if self._fault is not None and now_ns - self._fault[0] > FAULT_NS:
                self._fault = None
            self._tell("vr.fault", now_ns, None if self._fault is None else self._fault[1])
            self._inbox.repeat(now_ns)
            self._tell_clock(now_ns)
        asked = self._settings.topics.output("clock_ask")
        for session in self.sessions:
            if asked.name in session.subscribed and now_ns >= self._due.get(id(session), 0):
                self._ask(session, asked, now_ns)

    def show(self, stamp_ns: int, view: RobotView) -> None:
        """Send the robot's state at an instant of our clock to all subscribers."""
        if not any(session.subscribed for session in self.sessions):
            return
        for role, message in self._shown(stamp_ns + self._wall_ns, view):
            topic = self._settings.topics.output(role)
            body: bytes | None = None
            for session in self.sessions:
                if topic.name in session.subscribed:
                    body = body or self._messages.write(topic.type, message)
                    session.put(topic.name, frame(session.subscribed[topic.name], body))

    def _shown(self, stamp_ns: int, view: RobotView) -> list[tuple[str, Any]]:
        made, vive_from_map = self._messages, self._settings.checks.tracking.map_from_vive.inverse()
        found = [("visible", made.flag(view.visible)), ("stop_sign", made.flag(view.stop_sign))]
        if view.joints is not None:
            found.append(("joints", made.joint_state(stamp_ns, self._settings.joints, view.joints)))
        if view.pose is not None and view.twist is not None:
            base = Pose3.from_yaw(view.pose.x, view.pose.y, 0.0, view.pose.yaw)
            seen = vive_from_map @ base
            found.append(("robot", made.odometry(stamp_ns, VIVE, seen, view.twist)))
            frames = [(VIVE, MAP, vive_from_map), (MAP, "base_link", base)]
            found.append(("tf", made.transforms(stamp_ns, frames)))
        return found

    # ---- registrations

    def _publish(self, session: Session, fields: Mapping[str, Any]) -> None:
        name, kind = _text(fields, "topic"), plain_type(_text(fields, "message_name"))
        topic = self._settings.topics.inputs.get(plain_name(name))
        if topic is None:
            known = ", ".join(self._settings.topics.inputs)
            session.warn("warn", f"{name} is not read here; topics read: {known}")
            return
        if kind != topic.type:
            session.warn("error", f"{name} is a {topic.type} here, no {kind}; it is refused")
            return
        owner = self._owners.setdefault(topic.name, session)
        if owner is not session:
            self.blame(f"{session.name} wants to be a second source of {name}; it is refused")
            session.warn("error", f"{name} comes from {owner.name} already; it is refused")

    def _unpublish(self, session: Session, fields: Mapping[str, Any]) -> None:
        name = plain_name(_text(fields, "topic"))
        if self._owners.get(name) is session:
            self._drop(name, self._now_ns)

    def _drop(self, name: str, now_ns: int) -> None:
        del self._owners[name]
        self._inbox.drop(self._settings.topics.inputs[name].role, now_ns)

    def _subscribe(self, session: Session, fields: Mapping[str, Any]) -> None:
        name, kind = _text(fields, "topic"), plain_type(_text(fields, "message_name"))
        topic = self._settings.topics.outputs.get(plain_name(name))
        if topic is None:
            session.warn("warn", f"{name} is not sent here; topics sent: {self._sent()}")
        elif kind != topic.type:
            session.warn("error", f"{name} is a {topic.type} here, no {kind}; it is refused")
        else:
            session.subscribed[topic.name] = name

    def _unsubscribe(self, session: Session, fields: Mapping[str, Any]) -> None:
        session.subscribed.pop(plain_name(_text(fields, "topic")), None)

    def _sent(self) -> str:
        return ", ".join(self._settings.topics.outputs)

    def _list(self, session: Session, fields: Mapping[str, Any]) -> None:  # noqa: ARG002
        topics = self._settings.topics
        known = [*topics.inputs.values(), *topics.outputs.values()]
        names, kinds = [topic.name for topic in known], [topic.type for topic in known]
        session.send(command("topic_list", topics=names, types=kinds))

    # ---- services

    def _serve(self, session: Session, fields: Mapping[str, Any]) -> None:
        name = _text(fields, "topic")
        if plain_name(name) == DESCRIBE:
            session.services.add(name)
        else:
            session.warn("error", f"no service {name}; there is {DESCRIBE} ({TRIGGER})")

    def _unserve(self, session: Session, fields: Mapping[str, Any]) -> None:
        session.services.discard(_text(fields, "topic"))

    def _await(self, session: Session, kind: str, fields: Mapping[str, Any]) -> None:
        """Note that the next frame is a request or a response."""
        number = fields.get("srv_id")
        if type(number) is not int:
            raise MalformedFrame(f"__{kind} without srv_id")
        session.awaited = (kind, number)

    def _answer(self, session: Session, found: UnityFrame) -> None:
        assert session.awaited is not None
        (kind, number), session.awaited = session.awaited, None
        if kind == "response":
            session.warn("warn", f"{found.destination}: answer {number} was not requested")
        elif found.destination not in session.services:
            session.warn("error", f"no service {found.destination} was registered")
        else:
            topics = self._settings.topics
            known = {"reads": topics.inputs, "sends": topics.outputs}
            told = {
                side: {name: topic.type for name, topic in group.items()}
                for side, group in known.items()
            }
            body = self._messages.write(
                "std_srvs/Trigger_Response", self._messages.reply(True, json.dumps(told))
            )
            session.send(command("response", srv_id=number) + frame(found.destination, body))

    # ---- publications

    def _receive(self, session: Session, found: UnityFrame, now_ns: int) -> None:
        name = plain_name(found.destination)
        topic = self._settings.topics.inputs.get(name)
        reason: str | None
        owner = self._owners.get(name)
        if topic is None or owner is not session:
            reason = "no source of it" if owner is None else f"a second source beside {owner.name}"
            reason = f"this client is {reason}; it is ignored"
        else:
            reason = self._read(session, topic, found.body, now_ns)
        if reason is not None:
            self._refuse(session, found.destination, reason, now_ns)

    def _read(self, session: Session, topic: UnityTopic, body: bytes, now_ns: int) -> str | None:
        try:
            message = self._messages.read(topic.type, body)
            if topic.role == "clock_answer":
                return self._clock(session, message, now_ns)
        except ValueError as error:
            if topic.role == "haptic_request":
                self._inbox.drop(topic.role, now_ns)  # the present request is unknown
            return str(error)
        reason = self._inbox.take(topic.role, message, now_ns, session.clock)
        if session.clock.backlogged:
            session.broken = f"its data is {session.clock.age_ns * 1e-6:.0f} ms old"
        return reason

    def _refuse(self, session: Session, name: str, reason: str, now_ns: int) -> None:
        if now_ns - session.warned.get(name, -TOLD_EVERY_NS) < TOLD_EVERY_NS:
            return
        if len(session.warned) > len(self._settings.topics.inputs) + 8:
            session.warned.clear()  # a client may send any names
        session.warned[name] = now_ns
        self.blame(f"{name} of {session.name}: {reason}")
        session.warn("error", f"{name}: {reason}")

    # ---- clocks

    def _ask(self, session: Session, topic: UnityTopic, now_ns: int) -> None:
        self._asked += 1
        soon = len(session.asked) < ASKED_FIRST
        self._due[id(session)] = now_ns + (ASKED_EVERY_NS // 10 if soon else ASKED_EVERY_NS)
        token = str(self._asked)
        session.asked.append((token, now_ns))
        wall = now_ns + self._wall_ns
        body = self._messages.write(topic.type, self._messages.time_reference(wall, wall, token))
        session.put(topic.name, frame(session.subscribed[topic.name], body))

    def _clock(self, session: Session, message: Any, now_ns: int) -> str | None:
        token = str(message.source).rstrip("\0")
        asked = next((when for known, when in session.asked if known == token), None)
        if asked is None:
            return f"an answer to {token!r}, which was not asked"
        came, answered = time_of(message.time_ref), time_of(message.header.stamp)
        session.clock.trips.take(asked, came, answered, now_ns)
        return None

    def _tell_clock(self, now_ns: int) -> None:
        for session in dict.fromkeys(self._owners.values()):
            offset, clock = session.clock.offset, session.clock
            if offset is not None:
                answers = clock.trips.best is not None
                state = ClockState(
                    offset.ns / SECOND, offset.error_ns / SECOND, clock.age_ns / SECOND, answers
                )
                self._tell("vr.clock", now_ns, state)


def _nothing(session: Session, fields: Mapping[str, Any]) -> None:
    """Ignore services of Unity's own: they are never called."""


def _text(fields: Mapping[str, Any], key: str) -> str:
    found = fields.get(key)
    if not isinstance(found, str):
        raise MalformedFrame(f"a command without {key!r}")
    return found.rstrip("\0")
