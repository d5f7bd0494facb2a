"""A small rosbridge server (protocol 2, JSON) with its own topics.

Like the real one it does not report a failed subscription (another type, or a topic that nobody
publishes), unless the client asked for warnings (`set_level`); it queues the newest message of a
topic for a client that does not read; NaN and infinity are sent as null.

Operations: subscribe, unsubscribe, advertise, unadvertise, publish, set_level, call_service (which
always fails: there are no services).
"""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from websockets.asyncio.server import Server as Listener, ServerConnection, serve
from websockets.exceptions import ConnectionClosed

Receive = Callable[[Mapping[str, Any]], None]
TALKATIVE = ("info", "warning")


@dataclass(slots=True)
class FakeTopic:
    """A topic: its type, its last message if latched, and its receiver here, if any."""

    kind: str
    latched: bool = False
    last: Mapping[str, Any] | None = None
    on_message: Receive | None = None


@dataclass(slots=True)
class _Client:
    socket: ServerConnection
    subscribed: set[str] = field(default_factory=set)
    waiting: dict[str, str] = field(default_factory=dict)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    level: str = "none"

    def queue(self, name: str, text: str) -> None:
        self.waiting[name] = text
        self.news.set()

    async def send(self) -> None:
        """Send what waits, the newest of each topic."""
        with suppress(ConnectionClosed):
            while True:
                await self.news.wait()
                self.news.clear()
                waiting, self.waiting = self.waiting, {}
                for text in waiting.values():
                    await self.socket.send(text)


class RosbridgeServer:
    """Topics by their full names, and the clients. All of it belongs to one event loop.

    `muted` topics send nothing; `refusing` closes each new client; `late` delays all messages, s.
    """

    def __init__(self, topics: Mapping[str, FakeTopic]) -> None:
        self.topics = dict(topics)
        self.muted: set[str] = set()
        self.refusing = False
        self.late = 0.0
        self.strange = 0
        self._clients: list[_Client] = []
        self._listener: Listener | None = None

    async def listen(self, host: str, port: int) -> None:
        """Serve clients from now on.

        Raises:
            OSError: the address is in use.
        """
        self._listener = await serve(self._serve, host, port, compression=None, close_timeout=0.2)

    async def close(self) -> None:
        """Close all connections."""
        if self._listener is not None:
            self._listener.close()
            await self._listener.wait_closed()

    def drop(self) -> None:
        """Cut off all clients."""
        for client in self._clients:
            client.socket.transport.abort()

    def mute(self, names: set[str]) -> None:
        """Send nothing on these topics; what is latched on others that were mute is sent now."""
        spoken, self.muted = self.muted - names, names
        for name in spoken:
            last = self.topics[name].last
            if self.topics[name].latched and last is not None:
                self.publish(name, last)

    def publish(self, name: str, message: Mapping[str, Any]) -> None:
        """Send a message to all subscribers of its topic."""
        topic = self.topics[name]
        if topic.latched:
            topic.last = message
        if name in self.muted:
            return
        text = _text(name, message)
        for client in self._clients:
            if name in client.subscribed:
                self._queue(client, name, text)

    def say(self, text: str) -> None:
        """Send a status to all clients, whatever they asked for."""
        for client in self._clients:
            client.queue("status", json.dumps({"op": "status", "level": "error", "msg": text}))

    def _queue(self, client: _Client, name: str, text: str) -> None:
        if self.late:
            asyncio.get_running_loop().call_later(self.late, client.queue, name, text)
        else:
            client.queue(name, text)

    async def _serve(self, socket: ServerConnection) -> None:
        if self.refusing:
            socket.transport.abort()
            return
        client = _Client(socket)
        self._clients.append(client)
        sending = asyncio.ensure_future(client.send())
        try:
            async for data in socket:
                self._on_message(client, data)
        except ConnectionClosed:
            pass
        finally:
            self._clients.remove(client)
            sending.cancel()

    def _on_message(self, client: _Client, data: str | bytes) -> None:
        try:
            message = json.loads(data)
            act = getattr(self, f"_op_{message['op']}")
            act(client, message)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            self.strange += 1
            self._say(client, f"{type(error).__name__}: {error}")

    def _say(self, client: _Client, text: str) -> None:
        if client.level in TALKATIVE:
            status = {"op": "status", "level": "error", "msg": text}
            client.queue(f"status {self.strange}", json.dumps(status))

    def _op_subscribe(self, client: _Client, message: Mapping[str, Any]) -> None:
        name = message["topic"]
        topic = self.topics.get(name)
        if topic is None or message.get("type", topic.kind) != topic.kind:
            self._say(client, f"cannot subscribe to {name} as {message.get('type')}")
            return
        client.subscribed.add(name)
        if topic.latched and topic.last is not None and name not in self.muted:
            self._queue(client, name, _text(name, topic.last))

    def _op_unsubscribe(self, client: _Client, message: Mapping[str, Any]) -> None:
        client.subscribed.discard(message["topic"])

    def _op_advertise(self, client: _Client, message: Mapping[str, Any]) -> None:
        topic = self.topics.get(message["topic"])
        if topic is None or topic.kind != message["type"]:
            self._say(client, f"{message['topic']} is no {message['type']}")

    def _op_unadvertise(self, client: _Client, message: Mapping[str, Any]) -> None:
        """Nothing to do."""

    def _op_set_level(self, client: _Client, message: Mapping[str, Any]) -> None:
        client.level = message["level"]

    def _op_publish(self, client: _Client, message: Mapping[str, Any]) -> None:  # noqa: ARG002
        topic = self.topics[message["topic"]]
        if topic.on_message is not None:
            topic.on_message(message["msg"])

    def _op_call_service(self, client: _Client, message: Mapping[str, Any]) -> None:
        answer = {"op": "service_response", "id": message.get("id"), "service": message["service"]}
        answer |= {"values": "there is no such service", "result": False}
        client.queue(f"service {message.get('id')}", json.dumps(answer))


def _text(name: str, message: Mapping[str, Any]) -> str:
    return json.dumps({"op": "publish", "topic": name, "msg": _finite(message)}, allow_nan=False)


def _finite(value: Any) -> Any:
    """The value with null for each number that JSON lacks."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return value
