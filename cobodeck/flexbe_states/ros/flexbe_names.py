"""The names of `flexbe_core`: the base class of states, the logger, the proxies of topics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from cobodeck.flexbe_states.ros.bridge import current_bridge
from cobodeck.flexbe_states.ros.ros_names import RosNode
from cobodeck.flexbe_states.ros.ros_time import RosDuration, RosRate


class FlexbeState:
    """What `EventState` and the classes above it are here."""

    _node: ClassVar[RosNode] = RosNode()
    preempt = False
    is_controlled = False

    def __init__(self, *given: Any, **more: Any) -> None:
        names = dict(zip(("outcomes", "input_keys", "output_keys"), given, strict=False)) | more
        self._outcomes = list(names.get("outcomes") or ())
        self._input_keys = list(names.get("input_keys") or ())
        self._output_keys = list(names.get("output_keys") or ())
        self._name = current_bridge().name
        self._rate = RosRate()
        self.period_s = 0.0
        if (rate := more.get("desired_rate")) is not None:
            self.set_rate(rate)

    @property
    def name(self) -> str:
        """The name of the state in its chart."""
        return self._name

    @property
    def path(self) -> str:
        """The name of the state in its chart."""
        return f"/{self._name}"

    @property
    def outcomes(self) -> list[str]:
        """Its outcomes."""
        return self._outcomes

    @property
    def input_keys(self) -> list[str]:
        """The keys that it reads."""
        return self._input_keys

    @property
    def output_keys(self) -> list[str]:
        """The keys that it writes."""
        return self._output_keys

    @property
    def sleep_duration(self) -> float:
        """Nothing has to wait for it."""
        return 0.0

    def set_rate(self, desired_rate: float) -> None:
        """Execute it so many times per second; otherwise in every tick."""
        self._rate = RosRate(desired_rate)
        self.period_s = 1.0 / desired_rate

    def get_registered_input_keys(self) -> list[str]:
        """The keys that it reads."""
        return self._input_keys

    def get_registered_output_keys(self) -> list[str]:
        """The keys that it writes."""
        return self._output_keys

    def on_start(self) -> None:
        """Called once in a run, before the first `on_enter`."""

    def on_stop(self) -> None:
        """Called once when the run is over."""

    def on_pause(self, userdata: Any) -> None:
        """Called when the run is paused."""

    def on_resume(self, userdata: Any) -> None:
        """Called when the run goes on."""

    def on_enter(self, userdata: Any) -> None:
        """Called before the first `execute` of each entry."""

    def on_exit(self, userdata: Any) -> None:
        """Called once for each entry, whatever ends it."""

    def execute(self, userdata: Any) -> str | None:
        """Called in every tick."""
        raise NotImplementedError(f"{type(self).__name__}.execute")


class FlexbeLogger:
    """`Logger`: what it is told becomes notes in the trace."""

    REPORT_INFO, REPORT_WARN, REPORT_HINT, REPORT_ERROR, REPORT_DEBUG = range(5)
    LOCAL = 0

    @staticmethod
    def log(text: Any, severity: int = 0) -> None:
        """A note of this severity."""
        _note(
            ("", "warning: ", "hint: ", "error: ", "")[severity if 0 <= severity < 5 else 0], text
        )

    @staticmethod
    def loginfo(text: Any, *values: Any) -> None:
        """A note."""
        _note("", text, *values)

    @staticmethod
    def logwarn(text: Any, *values: Any) -> None:
        """A warning."""
        _note("warning: ", text, *values)

    @staticmethod
    def logerr(text: Any, *values: Any) -> None:
        """An error."""
        _note("error: ", text, *values)

    @staticmethod
    def loghint(text: Any, *values: Any) -> None:
        """A hint for the operator."""
        _note("hint: ", text, *values)

    @staticmethod
    def loginfo_throttle(_period: float, text: Any, *values: Any) -> None:
        """A note."""
        _note("", text, *values)

    @classmethod
    def initialize(cls, *_node: Any) -> None:
        """Nothing has to be done."""

    logdebug = localinfo = localdebug = local = info = debug = loginfo
    localwarn = warning = warn = logwarn
    localerr = error = logerr
    hint = loghint
    localinfo_throttle = loginfo_throttle


def _note(kind: str, text: Any, *values: Any) -> None:
    shown = str(text)
    if values:
        try:
            shown = shown % values
        except (TypeError, ValueError):
            shown = f"{shown} {values}"
    current_bridge().note(f"{kind}{shown}")


class _Proxy:
    """What all proxies share."""

    def __init__(self, topics: Mapping[str, Any] | None = None, *_more: Any, **_named: Any) -> None:
        for topic, kind in (topics or {}).items():
            self.open_topic(topic, kind)

    @classmethod
    def open_topic(cls, topic: str, kind: Any) -> None:
        """Get a topic ready."""

    @classmethod
    def initialize(cls, *_node: Any, **_named: Any) -> None:
        """Nothing has to be done."""

    @classmethod
    def shutdown(cls, *_any: Any) -> None:
        """Nothing has to be done."""

    @classmethod
    def is_available(cls, topic: str, *_any: Any, **_named: Any) -> bool:
        """Whether the table has it."""
        return True


class PublisherProxy(_Proxy):
    """`ProxyPublisher`."""

    @classmethod
    def open_topic(cls, topic: str, kind: Any = None, **_named: Any) -> None:
        """Require it in the table.

        Raises:
            LookupError: it is not there.
        """
        current_bridge().table.entry("publishes", topic)

    createPublisher = create_publisher = open_topic

    @classmethod
    def publish(cls, topic: str, msg: Any) -> None:
        """Send a message."""
        current_bridge().publish(topic, msg)

    @classmethod
    def wait_for_any(cls, topic: str, timeout: float = 0.0) -> bool:
        """Somebody hears it, as the table says."""
        return True

    @classmethod
    def remove_publisher(cls, topic: str) -> None:
        """Nothing has to be done."""

    @classmethod
    def number_of_subscribers(cls, topic: str) -> int:
        """The part of the table hears it."""
        return 1


class SubscriberProxy(_Proxy):
    """`ProxySubscriberCached`."""

    @classmethod
    def open_topic(cls, topic: str, kind: Any = None) -> None:
        """Hear it."""
        current_bridge().subscribe(topic, kind)

    @classmethod
    def subscribe(
        cls,
        topic: str,
        msg_type: Any = None,
        callback: Any = None,
        buffered: bool = False,
        **_: Any,
    ) -> None:
        """Hear it, and have what comes delivered or kept."""
        current_bridge().subscribe(topic, msg_type, callback)
        if buffered:
            current_bridge().buffer(topic, on=True)

    @classmethod
    def set_callback(cls, topic: str, callback: Any, **_named: Any) -> None:
        """Have what comes delivered."""
        current_bridge().set_callback(topic, callback)

    add_callback = set_callback

    @classmethod
    def remove_callback(cls, topic: str, *_any: Any) -> None:
        """Have it delivered no more."""
        current_bridge().set_callback(topic, None)

    @classmethod
    def enable_buffer(cls, topic: str) -> None:
        """Keep all that comes."""
        current_bridge().buffer(topic, on=True)

    @classmethod
    def disable_buffer(cls, topic: str) -> None:
        """Keep the newest only."""
        current_bridge().buffer(topic, on=False)

    @classmethod
    def get_from_buffer(cls, topic: str) -> Any:
        """The oldest message that is kept."""
        return current_bridge().from_buffer(topic)

    @classmethod
    def has_buffer(cls, topic: str) -> bool:
        """Whether a message is kept."""
        return current_bridge().has_buffer(topic)

    has_buffered = has_buffer

    @classmethod
    def has_msg(cls, topic: str) -> bool:
        """Whether there is a message."""
        return current_bridge().has_message(topic)

    @classmethod
    def get_last_msg(cls, topic: str) -> Any:
        """The newest message; None without one."""
        return current_bridge().last_message(topic)

    peek_at_last_msg = get_last_msg

    @classmethod
    def remove_last_msg(cls, topic: str, clear_buffer: bool = False) -> None:
        """Count the newest message as old."""
        current_bridge().remove_message(topic)
        if clear_buffer:
            current_bridge().buffer(topic, on=True)

    @classmethod
    def unsubscribe_topic(cls, topic: str, *_any: Any, **_named: Any) -> None:
        """Hear it no more."""
        current_bridge().unsubscribe(topic)


class ServiceProxy(_Proxy):
    """`ProxyServiceCaller`: an answer comes at once."""

    @classmethod
    def open_topic(cls, topic: str, kind: Any = None, *_any: Any, **_named: Any) -> None:
        """Require it in the table.

        Raises:
            LookupError: it is not there.
        """
        current_bridge().table.entry("calls", topic)

    setupService = setup_service = open_topic

    @classmethod
    def call(cls, topic: str, request: Any = None, *_any: Any, **_named: Any) -> Any:
        """Call it, and return the answer."""
        return current_bridge().call(topic, request)

    @classmethod
    def call_async(cls, topic: str, request: Any = None, *_any: Any, **_named: Any) -> None:
        """Call it, and keep the answer."""
        current_bridge().answers[topic] = current_bridge().call(topic, request)

    @classmethod
    def done(cls, topic: str) -> bool:
        """Whether it has answered."""
        return topic in current_bridge().answers

    @classmethod
    def result(cls, topic: str) -> Any:
        """The answer."""
        return current_bridge().answers.pop(topic, None)

    @classmethod
    def remove_client(cls, topic: str) -> None:
        """Forget an answer."""
        current_bridge().answers.pop(topic, None)


class ActionProxy(_Proxy):
    """`ProxyActionClient`."""

    @classmethod
    def open_topic(cls, topic: str, kind: Any = None, *_any: Any, **_named: Any) -> None:
        """Require it in the table.

        Raises:
            LookupError: it is not there.
        """
        current_bridge().table.entry("acts", topic)

    setupClient = setup_action_client = setup_client = open_topic

    @classmethod
    def send_goal(cls, topic: str, goal: Any, *_any: Any, **_named: Any) -> None:
        """Send a goal."""
        current_bridge().send_goal(topic, goal)

    @classmethod
    def has_result(cls, topic: str) -> bool:
        """Whether the goal has ended."""
        return current_bridge().has_result(topic)

    @classmethod
    def get_result(cls, topic: str, clear: bool = False) -> Any:
        """Its result."""
        found = current_bridge().result(topic)
        if clear:
            current_bridge().take_result(topic)
        return found

    @classmethod
    def remove_result(cls, topic: str) -> None:
        """Remove the result."""
        current_bridge().take_result(topic)

    @classmethod
    def has_feedback(cls, topic: str) -> bool:
        """Whether there is feedback."""
        return current_bridge().feedback(topic) is not None

    @classmethod
    def get_feedback(cls, topic: str, clear: bool = False) -> Any:
        """The newest feedback."""
        return current_bridge().feedback(topic)

    @classmethod
    def remove_feedback(cls, topic: str) -> None:
        """Nothing has to be done: only the newest counts."""

    @classmethod
    def get_state(cls, topic: str) -> int:
        """The state of the goal."""
        return current_bridge().status(topic)

    get_status = get_state

    @classmethod
    def is_active(cls, topic: str) -> bool:
        """Whether the goal goes on."""
        return current_bridge().is_active(topic)

    @classmethod
    def cancel(cls, topic: str) -> None:
        """Give the goal up."""
        current_bridge().cancel(topic)

    @classmethod
    def remove_client(cls, topic: str) -> None:
        """Nothing has to be done."""


class FlexbeError(Exception):
    """The errors of `flexbe_core`."""


NAMES: Mapping[str, Any] = {
    **dict.fromkeys(
        (
            "EventState",
            "OperatableState",
            "PreemptableState",
            "LockableState",
            "ManuallyTransitionableState",
            "RosState",
            "State",
            "MonitoringState",
            "LoopbackState",
        ),
        FlexbeState,
    ),
    **dict.fromkeys(
        ("FlexBEError", "StateError", "StateMachineError", "UserDataError"), FlexbeError
    ),
    "Logger": FlexbeLogger,
    "ProxyPublisher": PublisherProxy,
    "ProxySubscriberCached": SubscriberProxy,
    "ProxyServiceCaller": ServiceProxy,
    "ProxyActionClient": ActionProxy,
    "MIN_UI_VERSION": "4.0.0",
    "Duration": RosDuration,
}
"""What every module of `flexbe_core` has."""
