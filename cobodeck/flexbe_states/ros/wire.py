"""Topics of a table with a `type`, for a driver that carries them over rosbridge."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import partial
from typing import Any

from cobodeck.flexbe_states.ros.messages import RosMessage, full, message_class
from cobodeck.flexbe_states.ros.plain_values import PlainRecord, as_command, as_message
from cobodeck.flexbe_states.ros.topic_table import HeardTopic, SentTopic, TopicTable
from hw.connection import HeardWire, SentWire, WiredTopics


def wired_topics(table: TopicTable) -> WiredTopics:
    """The topics of a table that have a type."""
    hears = ((topic, table.entry("hears", topic)) for topic in table.topics("hears"))
    sends = ((topic, table.entry("publishes", topic)) for topic in table.topics("publishes"))
    return WiredTopics(
        tuple(
            HeardWire(topic, of.type, of.signal, partial(value_of, of), of.within)
            for topic, of in hears
            if of.type
        ),
        tuple(
            SentWire(topic, of.type, of.part, of.command, partial(message_of, of))
            for topic, of in sends
            if of.type
        ),
    )


def value_of(of: HeardTopic, message: Mapping[str, Any]) -> Any:
    """The value of a signal that is made of a message in JSON.

    Raises:
        KeyError, TypeError, ValueError: the message has no such fields.
    """
    if not of.fields:
        return as_command(as_message(message, _class(of.type)))
    plain = {attribute: _plain(_at(message, field)) for field, attribute in of.fields.items()}
    return plain[""] if "" in plain else PlainRecord("dict", tuple(plain.items()))


def message_of(of: SentTopic, *values: Any, **named: Any) -> dict[str, Any]:
    """The message in JSON that is made of the arguments of a command."""
    if not of.fields:
        value = next(iter((*values, *named.values())), None)
        made = as_message(value, _class(of.type))
        return {} if made is None else {key: as_json(inner) for key, inner in full(made).items()}
    given = dict(zip(of.fields, values, strict=False)) | named
    message: dict[str, Any] = {}
    for name, value in given.items():
        if not of.fields[name]:
            return message_of(replace(of, fields={}), value)
        *steps, last = _path(of.fields[name])
        inner = message
        for step in steps:
            inner = inner.setdefault(step, {})
        inner[last] = as_json(value)
    return message


def as_json(value: Any) -> Any:
    """A value, message or record as JSON has it."""
    if isinstance(value, RosMessage):
        return as_json(full(value))
    if isinstance(value, PlainRecord):
        return {str(key): as_json(inner) for key, inner in value.pairs}
    if isinstance(value, Mapping):
        return {str(key): as_json(inner) for key, inner in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {item.name: as_json(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, list | tuple | set | frozenset):
        return [as_json(inner) for inner in value]
    return value


def _class(kind: str) -> Any:
    package, _, name = kind.rpartition("/")
    return message_class(name, f"{package}.msg")


def _plain(value: Any) -> Any:
    return as_command(as_message(value) if isinstance(value, Mapping) else value)


def _at(message: Mapping[str, Any], path: str) -> Any:
    found: Any = message
    for step in _path(path):
        found = found[step]
    return found


def _path(path: str) -> Iterable[str]:
    return filter(None, path.split("."))
