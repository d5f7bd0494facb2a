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
from types import ModuleType
from typing import Any, ClassVar, Literal

from cobodeck.flexbe_states.chart_names import outcome_name
from cobodeck.flexbe_states.class_reading import FlexbeClass, FlexbeParameter
from cobodeck.flexbe_states.ros import Bridge, FlexbeState, TopicTable, frozen, thawed
from engine import Action, Context, Run, RunNews, Until, UserData

_LINKS = {"signal": ("hears", "acts"), "part": ("publishes", "calls", "acts")}
_TYPES: Mapping[str, type] = {
    "float": float,
    "double": float,
    "float64": float,
    "int": int,
    "uint8": int,
    "int32": int,
    "bool": bool,
    "boolean": bool,
    "string": str,
    "str": str,
}


class NotAState(TypeError):
    """A FlexBE class of which no state can be made; the message says what to write."""


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
            self.hook("on_stop")
        elif self.userdata is not None:
            self.hook("on_pause" if news == "paused" else "on_resume", self.userdata)


class AdaptedState(Action):
    """The base of all states made of FlexBE classes."""

    flexbe: ClassVar[type[FlexbeState]]
    table: ClassVar[TopicTable]
    is_ros_2: ClassVar[bool] = False
    output_keys: ClassVar[tuple[str, ...]] = ()
    links: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    defaults: ClassVar[Mapping[str, Any]] = {}
    _all_living: ClassVar[weakref.WeakKeyDictionary[Any, _Living]] = weakref.WeakKeyDictionary()

    def __init__(self, **given: Any) -> None:
        self._given = given

    @classmethod
    def stands_for(cls, name: str, what: Literal["signal", "part"]) -> tuple[str, ...]:
        """The signals or parts of a topic that a parameter names."""
        find = cls.table.signals if what == "signal" else cls.table.parts
        links = [link for link in _LINKS[what] if link in cls.links]
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
        userdata = UserData({key: thawed(value) for key, value in inputs.items()}, self.output_keys)
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
            key: _kept(key, userdata[key]) for key in self.output_keys if key in userdata
        }
        return name, {key: living.given.get(key) for key in self.output_keys}

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


def adapted(
    flexbe: type[FlexbeState], read: FlexbeClass, module: ModuleType, table: TopicTable
) -> type[AdaptedState]:
    """The state of charts that is made of a FlexBE class.

    Raises:
        NotAState: its keys or outcomes depend on arguments in a way that no chart can give.
    """
    for use in read.topics:
        if use.topic and use.topic[0] != "$" and table.find(use.link, use.topic) is None:
            raise NotAState(table.missing(use.link, use.topic))
    names = {kind: _names(flexbe, read, kind) for kind in read.templates}
    outputs = dict.fromkeys(names["output_keys"], Any)
    outcomes = tuple(name if name[:1] == "$" else outcome_name(name) for name in names["outcomes"])
    attributes: dict[str, Any] = {
        "__doc__": read.about.as_text or f"{read.name}, a state written for FlexBE.",
        "__module__": module.__name__,
        "__qualname__": flexbe.__qualname__,
        "__init__": _init(read),
        "flexbe": flexbe,
        "table": table,
        "is_ros_2": bool({"rclpy", "action_msgs"} & set(read.imports)),
        "outcomes": outcomes,
        "inputs": dict.fromkeys(names["input_keys"], Any),
        "output_keys": names["output_keys"],
        "outputs": dict.fromkeys(outcomes, outputs) if outputs else {},
        "links": _links(read),
        "defaults": {
            known.name: _default(known)
            for known in read.parameters
            if known.is_known and not known.required
        },
        "reads": dict.fromkeys(_used(read, table, "signal")),
        "commands": tuple(dict.fromkeys(_used(read, table, "part"))),
    }
    return type(flexbe.__name__, (AdaptedState,), attributes)


def _names(flexbe: type[FlexbeState], read: FlexbeClass, kind: str) -> tuple[str, ...]:
    """Outcomes or keys, with `$parameter` for those that a parameter gives.

    Raises:
        NotAState: they are not known before an object is made.
    """
    names = read.templates[kind]
    if names is not None and (kind == "outcomes" or not any(name[:1] == "$" for name in names)):
        return names
    if names is not None or any(parameter.required for parameter in read.parameters):
        what = kind.replace("_", " ")
        raise NotAState(
            f"its {what} depend on arguments; derive a class from it that gives them, "
            f"`class Mine({read.name}): def __init__(self): super().__init__(…)`"
        )
    try:
        with Bridge().current():
            made = flexbe()
    except Exception as error:  # noqa: BLE001  it may raise anything
        raise NotAState(
            f"made without arguments it raised {type(error).__name__}: {error}"
        ) from None
    found: list[str] = getattr(made, f"_{kind}")
    return tuple(found)


def _init(read: FlexbeClass) -> Callable[..., None]:
    """An `__init__` with the parameters and types that charts see."""

    def __init__(self: AdaptedState, **given: Any) -> None:
        AdaptedState.__init__(self, **given)

    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    annotations = {parameter.name: _type(read, parameter) for parameter in read.parameters}
    parameters = [
        inspect.Parameter(
            parameter.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if parameter.required else _default(parameter),
        )
        for parameter in read.parameters
    ]
    __init__.__signature__ = inspect.Signature([own, *parameters])  # type: ignore[attr-defined]
    __init__.__annotations__ = annotations
    return __init__


def _default(parameter: FlexbeParameter) -> Any:
    value = parameter.default
    return tuple(value) if isinstance(value, list) else value


def _type(read: FlexbeClass, parameter: FlexbeParameter) -> Any:
    """The type of a parameter: what its docstring says, unless its default is of another one."""
    if parameter.name in _outcome_parameters(read):
        return tuple[str, ...]
    said = read.about.parameters.get(parameter.name)
    kind = _TYPES.get(said.type.lower().rstrip(":,")) if said else None
    if kind is None:
        return Any
    if parameter.required:
        return kind
    if parameter.default is None:
        return kind | None if parameter.written == "None" else Any
    fits = isinstance(parameter.default, (int, float) if kind is float else kind)
    return kind if fits else Any


def _outcome_parameters(read: FlexbeClass) -> list[str]:
    return [name[1:] for name in read.templates["outcomes"] or () if name[:1] == "$"]


def _links(read: FlexbeClass) -> dict[str, tuple[str, ...]]:
    """The parameters that name topics, by what is done with those."""
    found: dict[str, tuple[str, ...]] = {}
    for use in read.topics:
        known = found.setdefault(use.link, ())
        if use.topic is not None and use.topic[:1] == "$":
            found[use.link] = (*known, use.topic[1:])
    return found


def _used(read: FlexbeClass, table: TopicTable, what: Literal["signal", "part"]) -> Iterator[str]:
    """The signals or parts that a class uses, `$parameter` for those of a parameter's topic."""
    find = table.signals if what == "signal" else table.parts
    for use in read.topics:
        if use.link not in _LINKS[what]:
            continue
        if use.topic is None:
            yield from (name for topic in table.topics(use.link) for name in find(use.link, topic))
        elif use.topic[:1] == "$":
            yield use.topic
        else:
            yield from find(use.link, use.topic)
