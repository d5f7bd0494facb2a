"""The services of the VR link: the list of topics, and a description of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from hw.drivers.unity.protocol.ros_messages import Messages
from hw.drivers.unity.protocol.session import Session
from hw.drivers.unity.protocol.topics import Topics, plain_name
from hw.drivers.unity.protocol.wire import MalformedFrame, UnityFrame, command, frame, text_in

DESCRIBE, TRIGGER = "cobodeck/describe", "std_srvs/Trigger"
"""The service offered: it answers with all topics as JSON."""


class Services:
    """Carries out the commands that concern services; see the module."""

    def __init__(self, topics: Topics, messages: Messages) -> None:
        self._topics, self._messages = topics, messages

    def list_topics(self, session: Session, fields: Mapping[str, Any]) -> None:  # noqa: ARG002
        """Send the list of topics."""
        known = [*self._topics.inputs.values(), *self._topics.outputs.values()]
        names, kinds = [topic.name for topic in known], [topic.type for topic in known]
        session.send(command("topic_list", topics=names, types=kinds))

    def register(self, session: Session, fields: Mapping[str, Any]) -> None:
        """Note that a client is going to use a service."""
        name = text_in(fields, "topic")
        if plain_name(name) == DESCRIBE:
            session.services.add(DESCRIBE)
        else:
            session.warn("error", f"no service {name}; there is {DESCRIBE} ({TRIGGER})")

    def remove(self, session: Session, fields: Mapping[str, Any]) -> None:
        """Forget that."""
        session.services.discard(plain_name(text_in(fields, "topic")))

    def expect(self, kind: str, session: Session, fields: Mapping[str, Any]) -> None:
        """Note that the next frame is a request or a response."""
        number = fields.get("srv_id")
        if type(number) is not int:
            raise MalformedFrame(f"a {kind} without srv_id")
        session.awaited = (kind, number)

    def answer(self, session: Session, found: UnityFrame) -> None:
        """Take the awaited frame: answer a request."""
        assert session.awaited is not None
        (kind, number), session.awaited = session.awaited, None
        if kind == "response":
            session.warn("warn", f"{found.destination}: answer {number} was not requested")
        elif plain_name(found.destination) not in session.services:
            session.warn("error", f"no service {found.destination} was registered")
        else:
            known = {"reads": self._topics.inputs, "sends": self._topics.outputs}
            told = {
                side: {name: topic.type for name, topic in group.items()}
                for side, group in known.items()
            }
            body = self._messages.write(
                "std_srvs/Trigger_Response", self._messages.reply(True, json.dumps(told))
            )
            session.send(command("response", srv_id=number) + frame(found.destination, body))
