"""Makes the state of charts of a FlexBE class: its names, types, signals and parts."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import ModuleType
from typing import Any, Literal

from cobodeck.flexbe_states.adapted import LINKS, AdaptedState
from cobodeck.flexbe_states.chart_names import key_name, outcome_name
from cobodeck.flexbe_states.class_reading import FlexbeClass, FlexbeParameter
from cobodeck.flexbe_states.ros import Bridge, FlexbeState, TopicTable
from engine import StateError, python_name

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


def adapted(
    flexbe: type[FlexbeState], read: FlexbeClass, module: ModuleType, table: TopicTable
) -> type[AdaptedState]:
    """The state of charts that is made of a FlexBE class.

    Raises:
        NotAState: its keys or outcomes depend on arguments in a way that no chart can give, or a
            topic is not in the table.
        StateError: two of its keys or outcomes have one name in charts.
    """
    for use in read.topics:
        if use.topic and use.topic[0] != "$" and table.find(use.link, use.topic) is None:
            raise NotAState(table.missing(use.link, use.topic))
    names = {kind: _names(flexbe, read, kind) for kind in read.templates}
    inputs, output_keys, outcomes = (
        _in_charts(names[kind], kind) for kind in ("input_keys", "output_keys", "outcomes")
    )
    outputs = dict.fromkeys(output_keys, Any)
    attributes: dict[str, Any] = {
        "__doc__": read.about.as_text or f"{read.name}, a state written for FlexBE.",
        "__module__": module.__name__,
        "__qualname__": flexbe.__qualname__,
        "__init__": _init(read),
        "flexbe": flexbe,
        "table": table,
        "is_ros_2": bool({"rclpy", "action_msgs"} & set(read.imports)),
        "outcomes": tuple(outcomes),
        "inputs": dict.fromkeys(inputs, Any),
        "input_keys": {python_name(name): key for name, key in inputs.items()},
        "output_keys": output_keys,
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


def _in_charts(names: Iterable[str], kind: str) -> dict[str, str]:
    """Outcomes or keys by their names in charts.

    Raises:
        StateError: two have the same name there.
    """
    found: dict[str, str] = {}
    rename = outcome_name if kind == "outcomes" else key_name
    for name in dict.fromkeys(names):
        shown = name if name[:1] == "$" else rename(name)
        if found.setdefault(shown, name) != name:
            what = kind.replace("_", " ")
            raise StateError(
                f"its {what} {found[shown]!r} and {name!r} are both {shown!r} in a chart; "
                "name one of them otherwise"
            )
    return found


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
        if use.link not in LINKS[what]:
            continue
        if use.topic is None:
            yield from (name for topic in table.topics(use.link) for name in find(use.link, topic))
        elif use.topic[:1] == "$":
            yield use.topic
        else:
            yield from find(use.link, use.topic)
