"""State classes of FlexBE as states of charts.

The class that a chart names has the outcomes, keys and parameters of the FlexBE class, and reads
and commands what the table has for its topics. Each node of a run has one object of the FlexBE
class, which lives from its first entry to the end of the run.
"""

from __future__ import annotations

import inspect
import weakref
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from cobodeck.flexbe_states.chart_names import outcome_name
from cobodeck.flexbe_states.ros import Bridge, FlexbeState, TopicTable, frozen, thawed
from engine import Action, Context, Run, RunNews, Until, UserData

LINKS = {"signal": ("hears", "acts"), "part": ("publishes", "calls", "acts")}


@dataclass(eq=False)
class _Living:
    """The object of a FlexBE class at one node of a run."""

    state: FlexbeState
    bridge: Bridge
    userdata: UserData | None = None
    given: dict[str, Any] = field(default_factory=dict)

    def hook(self, name: str, *arguments: Any) -> Any:
        """Call a hook."""
        with self.bridge.current():
            hook = getattr(self.state, name)
            return hook(*arguments[: _taken(hook)])

    def hear(self, news: RunNews) -> None:
        """What becomes of the run: pauses count for a running state only."""
        if news == "over":
            try:
                self.hook("on_stop")
            finally:
                self.bridge.table.forget()
        elif self.userdata is not None:
            self.hook("on_pause" if news == "paused" else "on_resume", self.userdata)


class AdaptedState(Action):
    """The base of all states made of FlexBE classes."""

    flexbe: ClassVar[type[FlexbeState]]
    table: ClassVar[TopicTable]
    is_ros_2: ClassVar[bool] = False
    input_keys: ClassVar[Mapping[str, str]] = {}  # by their name in `run`
    output_keys: ClassVar[Mapping[str, str]] = {}  # by their name in charts
    links: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    defaults: ClassVar[Mapping[str, Any]] = {}
    _all_living: ClassVar[weakref.WeakKeyDictionary[Any, _Living]] = weakref.WeakKeyDictionary()

    def __init__(self, **given: Any) -> None:
        self._given = given

    @classmethod
    def stands_for(cls, name: str, what: Literal["signal", "part"]) -> tuple[str, ...]:
        """The signals or parts of a topic that a parameter names."""
        find = cls.table.signals if what == "signal" else cls.table.parts
        links = [link for link in LINKS[what] if link in cls.links]
        return tuple(found for link in links for found in find(link, name))

    @classmethod
    def faults(cls, *_given: Any, **parameters: Any) -> Iterator[tuple[str, str]]:
        """Topics that are not in the table."""
        parameters = {**cls.defaults, **parameters}
        for link, named in cls.links.items():
            for parameter in named:
                topic = parameters.get(parameter)
                if isinstance(topic, str) and topic and cls.table.find(link, topic) is None:
                    yield parameter, cls.table.missing(link, topic)

    def run(self, ctx: Context, **inputs: Any) -> Run:
        """The hooks of FlexBE, in order."""
        living = self._living(ctx)
        given = {self.input_keys[name]: thawed(value) for name, value in inputs.items()}
        userdata = UserData(given, self.output_keys.values())
        living.hook("on_enter", userdata)
        living.userdata = userdata
        try:
            if living.bridge.asleep_s:
                yield Until(ctx.after(living.bridge.waited()))
            while True:
                with living.bridge.current():
                    living.bridge.deliver()
                if (outcome := living.hook("execute", userdata)) is not None:
                    break
                pause_s = max(living.bridge.waited(), living.state.period_s)
                yield Until(ctx.after(pause_s)) if pause_s else None
        finally:
            living.userdata = None
            living.hook("on_exit", userdata)
        name = outcome_name(str(outcome))
        if not self.output_keys:
            return name
        living.given |= {
            key: _kept(key, userdata[key]) for key in self.output_keys.values() if key in userdata
        }
        return name, {shown: living.given.get(key) for shown, key in self.output_keys.items()}

    def _living(self, ctx: Context) -> _Living:
        """The object of this node; made, and told that the run starts, at its first entry."""
        found = self._all_living.get(ctx)
        if found is None:
            node = getattr(ctx, "node", None)
            name = str(getattr(node, "path", type(self).__name__)).rpartition("/")[2]
            bridge = Bridge(weakref.ref(ctx), self.table, name, self.is_ros_2)
            given = {key: thawed(held) for key, held in self._given.items()}
            with bridge.current():  # a default that is not known here is the class's own affair
                state = self.flexbe(
                    **{k: v for k, v in given.items() if v is not None or k in self.defaults}
                )
            found = self._all_living[ctx] = _Living(state, bridge)
            ctx.hear_run(found.hear)
            found.hook("on_start")
        return found


def _kept(key: str, value: Any) -> Any:
    try:
        return frozen(value)
    except TypeError as error:
        raise TypeError(f"userdata.{key}: {error}") from None


def _taken(hook: Callable[..., Any]) -> int | None:
    """How many arguments a hook takes; None: as many as there are."""
    code = getattr(hook, "__code__", None)
    if code is None or code.co_flags & inspect.CO_VARARGS:
        return None
    return int(code.co_argcount) - 1
