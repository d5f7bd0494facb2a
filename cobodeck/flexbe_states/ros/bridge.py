"""What one FlexBE state has of its run: time, notes, and the topics that it uses.

While a hook of the state runs, its bridge is the current one of this thread; time, loggers and
proxies ask that. Where there is none, as while a module is imported, time is 0 and no topic has
anything.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from cobodeck.flexbe_states.ros.messages import RosMessage, full
from cobodeck.flexbe_states.ros.plain_values import as_command, as_message
from cobodeck.flexbe_states.ros.topic_table import TopicTable, plain_topic
from engine import Context, Stamped

_thread = threading.local()
LONGEST_SLEEP_S = 1.0
"""Longest sleep in one hook, s: it is waited out after the hook, which a loop would not see."""


@dataclass(slots=True)
class _Heard:
    """A subscription: what was removed, what was delivered, and to whom."""

    signal: str
    kind: type[RosMessage] | None
    removed: Stamped | None = None
    delivered: Stamped | None = None
    callback: Callable[..., Any] | None = None
    arguments: tuple[Any, ...] = ()
    buffer: list[Any] | None = None


@dataclass(slots=True)
class _Goal:
    """A goal that was sent, and what its signals had before."""

    before: Stamped | None
    feedback_before: Stamped | None
    cancelled: bool = False
    taken: bool = False


@dataclass(eq=False)
class Bridge:
    """The run of one state; `run` gives its context, or None where there is no run.

    `answers` are those of services that the state has not fetched yet.
    """

    run: Callable[[], Context | None] = lambda: None
    table: TopicTable = field(default_factory=TopicTable)
    name: str = ""
    is_ros_2: bool = False
    asleep_s: float = 0.0
    answers: dict[str, Any] = field(default_factory=dict)
    _heard: dict[str, _Heard] = field(default_factory=dict)
    _goals: dict[str, _Goal] = field(default_factory=dict)

    @property
    def ctx(self) -> Context | None:
        """What the state has of its run; None before and after it."""
        return self.run()

    @contextmanager
    def current(self) -> Iterator[None]:
        """Within the block it is the current one of this thread."""
        before = getattr(_thread, "bridge", None)
        _thread.bridge = self
        try:
            yield
        finally:
            _thread.bridge = before

    def note(self, text: str) -> None:
        """Put a note in the trace."""
        if self.ctx is not None:
            self.ctx.note(text)

    def sleep(self, seconds: float) -> None:
        """Let this time, s, pass once the hook has returned.

        Raises:
            Blocks: it would be more than `LONGEST_SLEEP_S` in one hook.
        """
        self.asleep_s += max(float(seconds), 1e-3)
        if self.asleep_s > LONGEST_SLEEP_S:
            refuse_to_wait(f"sleeping for more than {LONGEST_SLEEP_S:g} s")

    def waited(self) -> float:
        """The time, s, for which the last hook wanted to sleep; it counts as past then."""
        found, self.asleep_s = self.asleep_s, 0.0
        return found

    # -- subscriptions -------------------------------------------------------------------------

    def subscribe(
        self,
        topic: str,
        kind: Any = None,
        callback: Callable[..., Any] | None = None,
        arguments: tuple[Any, ...] = (),
    ) -> None:
        """Hear a topic from now on.

        Raises:
            LookupError: it is not in the table.
        """
        entry = self.table.entry("hears", topic)
        is_message = isinstance(kind, type) and issubclass(kind, RosMessage)
        heard = self._heard.setdefault(
            plain_topic(topic), _Heard(entry.signal, kind if is_message else None)
        )
        if callback is not None:
            heard.callback, heard.arguments = callback, arguments

    def unsubscribe(self, topic: str) -> None:
        """Hear a topic no more."""
        self._heard.pop(plain_topic(topic), None)

    def set_callback(self, topic: str, callback: Callable[..., Any] | None) -> None:
        """Deliver what comes to a function; None: to none."""
        self._subscribed(topic).callback = callback

    def buffer(self, topic: str, on: bool) -> None:
        """Keep all that comes, or only the newest."""
        self._subscribed(topic).buffer = [] if on else None

    def from_buffer(self, topic: str) -> Any:
        """The oldest message kept; None if there is none."""
        kept = self._subscribed(topic).buffer
        return kept.pop(0) if kept else None

    def has_buffer(self, topic: str) -> bool:
        """Whether a message is kept."""
        return bool(self._subscribed(topic).buffer)

    def has_message(self, topic: str) -> bool:
        """Whether there is a message that was not removed."""
        return self._newest(self._subscribed(topic)) is not None

    def last_message(self, topic: str) -> Any:
        """The newest message that was not removed; None without one."""
        heard = self._subscribed(topic)
        newest = self._newest(heard)
        return None if newest is None else self._message(topic, heard, newest)

    def remove_message(self, topic: str) -> None:
        """Count the newest message as old."""
        heard = self._subscribed(topic)
        heard.removed = self._sample(heard.signal)

    def deliver(self) -> None:
        """Give what has come since the last time to the callbacks and buffers."""
        for topic, heard in list(self._heard.items()):
            if heard.callback is None and heard.buffer is None:
                continue
            for sample in self._news(heard):
                message = self._message(topic, heard, sample)
                if heard.buffer is not None:
                    heard.buffer.append(message)
                if heard.callback is not None:
                    heard.callback(message, *heard.arguments)

    def _subscribed(self, topic: str) -> _Heard:
        if plain_topic(topic) not in self._heard:
            self.subscribe(topic)
        return self._heard[plain_topic(topic)]

    def _news(self, heard: _Heard) -> tuple[Stamped, ...]:
        ctx = self.ctx
        if ctx is None:
            return ()
        if ctx.is_event(heard.signal):
            return ctx.events(heard.signal)
        newest = self._sample(heard.signal)
        if newest is None or newest is heard.delivered:
            return ()
        heard.delivered = newest
        return (newest,)

    def _newest(self, heard: _Heard) -> Stamped | None:
        newest = self._sample(heard.signal)
        return None if newest is heard.removed else newest

    def _sample(self, signal: str) -> Stamped | None:
        return None if self.ctx is None else self.ctx.sample(signal)

    def _message(self, topic: str, heard: _Heard, sample: Stamped) -> Any:
        fields = self.table.entry("hears", topic).fields
        if not fields:
            return as_message(sample.value, heard.kind)
        message = (heard.kind or RosMessage)()
        for path, source in fields.items():
            *steps, last = path.split(".")
            inner: Any = message
            for step in steps:
                inner = getattr(inner, step)
            setattr(inner, last, _at(sample.value, source))
        return message

    # -- commands ------------------------------------------------------------------------------

    def publish(self, topic: str, message: Any) -> None:
        """Command the part of a topic.

        Raises:
            LookupError: it is not in the table.
        """
        self._command(self.table.entry("publishes", topic), message)

    def call(self, topic: str, request: Any) -> Any:
        """Command the part of a service; its answer, as a message.

        Raises:
            LookupError: it is not in the table.
        """
        return as_message(self._command(self.table.entry("calls", topic), request)) or RosMessage()

    def send_goal(self, topic: str, goal: Any) -> None:
        """Command the part of an action.

        Raises:
            LookupError: it is not in the table.
        """
        entry = self.table.entry("acts", topic)
        feedback = self._sample(entry.feedback) if entry.feedback else None
        self._goals[plain_topic(topic)] = _Goal(self._sample(entry.result), feedback)
        self._command(entry, goal)

    def _command(self, entry: Any, message: Any) -> Any:
        if self.ctx is None:
            return None
        part = self.ctx.part(entry.part)
        method = getattr(part, entry.command, None)
        if method is None:
            raise LookupError(f"the part {entry.part!r} has no method {entry.command!r}")
        if entry.fields:
            given = entry.fields.items()
            return method(**{name: as_command(_at(message, path)) for name, path in given})
        if isinstance(message, RosMessage) and not full(message):
            return method()
        return method(as_command(message))

    # -- goals ---------------------------------------------------------------------------------

    def has_result(self, topic: str) -> bool:
        """Whether a goal has ended, and its result was not removed."""
        goal = self._goals.get(plain_topic(topic))
        return goal is not None and not goal.taken and self._result(topic) is not None

    def result(self, topic: str) -> Any:
        """The result of a goal, as a message; None before."""
        found = self._result(topic)
        return None if found is None else as_message(found.value) or RosMessage()

    def take_result(self, topic: str) -> None:
        """Count the result as removed."""
        if plain_topic(topic) in self._goals:
            self._goals[plain_topic(topic)].taken = True

    def feedback(self, topic: str) -> Any:
        """The newest feedback on a goal, as a message; None without one."""
        goal, signal = self._goals.get(plain_topic(topic)), self.table.entry("acts", topic).feedback
        newest = self._sample(signal) if signal else None
        if goal is None or newest is None or newest is goal.feedback_before:
            return None
        return as_message(newest.value)

    def status(self, topic: str) -> int:
        """The state of a goal, numbered as in the version of ROS that the state was written for."""
        goal, found = self._goals.get(plain_topic(topic)), self._result(topic)
        if goal is None:
            return 0
        if goal.cancelled:
            return 5 if self.is_ros_2 else 2
        if found is None:
            return 2 if self.is_ros_2 else 1
        failed = found.value is None or found.value is False
        return (6 if failed else 4) if self.is_ros_2 else (4 if failed else 3)

    def cancel(self, topic: str) -> None:
        """Give a goal up, unless it has ended."""
        goal, entry = self._goals.get(plain_topic(topic)), self.table.entry("acts", topic)
        if self.ctx is None or goal is None or goal.cancelled or self._result(topic) is not None:
            return
        goal.cancelled = True
        getattr(self.ctx.part(entry.part), entry.cancel)()

    def is_active(self, topic: str) -> bool:
        """Whether a goal goes on."""
        goal = self._goals.get(plain_topic(topic))
        return goal is not None and not goal.cancelled and self._result(topic) is None

    def _result(self, topic: str) -> Stamped | None:
        goal = self._goals.get(plain_topic(topic))
        newest = self._sample(self.table.entry("acts", topic).result)
        return None if goal is None or newest is goal.before else newest


class Blocks(RuntimeError):
    """A state would hold up the run."""


def refuse_to_wait(what: str) -> None:
    """What blocks is refused.

    Raises:
        Blocks: always.
    """
    raise Blocks(f"{what} would hold up the whole run; return None from execute, and look again")


def current_bridge() -> Bridge:
    """The bridge of the state whose hook runs; one without a run where none does."""
    return getattr(_thread, "bridge", None) or Bridge()


def now_ns() -> int:
    """The present instant of the run, ns of chart time."""
    ctx = current_bridge().ctx
    return 0 if ctx is None else ctx.now


def _at(value: Any, path: str) -> Any:
    """What is at a dotted path of attributes; "" is the value itself."""
    for step in filter(None, path.split(".")):
        value = value[step] if isinstance(value, dict) else getattr(value, step)
    return value
