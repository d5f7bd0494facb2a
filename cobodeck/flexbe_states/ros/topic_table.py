"""The table of a project that says what stands for ROS topics, services and actions here.

    topics: rover
    hears:
      /odom: {signal: base.pose}
      /battery: {signal: battery.level, fields: {percentage: ""}}
    publishes:
      /cmd_vel: {part: base, command: drive}
    calls:
      /lamp: {part: lamp, command: light}
    acts:
      /dock: {part: dock, command: go, result: dock.ended, feedback: dock.distance}
    parameters: {/speed: 0.5}

`fields` puts a message together, or takes it apart: `{field of the message: attribute of the
value}`, where "" is the value itself. Without them, `plain_values` says what becomes what.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from engine.files import Duration, FileError, Finding, did_you_mean, plain
from engine.files.declared import Item, Name, Written, load_yaml, record


def _anything(item: Item) -> Any:
    return plain(item.value)


@dataclass(frozen=True, slots=True)
class HeardTopic:
    """A topic that states subscribe to."""

    signal: str
    """The signal whose values are its messages."""
    fields: Mapping[str, str] = field(default_factory=dict)
    """By field of the message, dotted: the attribute of the value, dotted; "" is the value."""
    type: str = ""
    """Its type, as `std_msgs/String`: the driver `RosTopics` subscribes to it."""
    within: Duration | None = None
    """With a type: after so much silence it is a fault; without: never."""


@dataclass(frozen=True, slots=True)
class SentTopic:
    """A topic that states publish to, or a service that they call."""

    part: str
    """The part that is commanded."""
    command: str
    """Its method; it returns at once, and what it returns is the answer of a service."""
    fields: Mapping[str, str] = field(default_factory=dict)
    """By argument of the method: the field of the message, dotted; without, all of it."""
    type: str = ""
    """Of a topic, its type, as `std_msgs/String`: the driver `RosTopics` publishes it."""


@dataclass(frozen=True, slots=True)
class ActedTopic:
    """An action that states send goals to."""

    part: str
    """The part that carries it out."""
    command: str
    """Its method that begins it and returns at once."""
    result: str
    """The signal that tells the end: a value after the goal; None or false: it has failed."""
    feedback: str | None = None
    """The signal with its progress."""
    cancel: str = "stop"
    """The method of the part that gives it up."""
    fields: Mapping[str, str] = field(default_factory=dict)
    """By argument of the method: the field of the goal, dotted; without, it takes the goal."""


@dataclass(frozen=True, slots=True)
class TopicFile:
    """What stands for the topics, services and actions that FlexBE states use."""

    topics: Name
    """Its name."""
    about: str = ""
    """What it is."""
    hears: Mapping[str, HeardTopic] = field(default_factory=dict)
    """By topic that states subscribe to."""
    publishes: Mapping[str, SentTopic] = field(default_factory=dict)
    """By topic that states publish to."""
    calls: Mapping[str, SentTopic] = field(default_factory=dict)
    """By service."""
    acts: Mapping[str, ActedTopic] = field(default_factory=dict)
    """By action."""
    parameters: Mapping[str, Annotated[Any, _anything, Written(str | float | bool)]] = field(
        default_factory=dict
    )
    """Values of the parameter server, by name."""


_LINES = {
    "hears": "{signal: NAME}",
    "publishes": "{part: NAME, command: METHOD}",
    "calls": "{part: NAME, command: METHOD}",
    "acts": "{part: NAME, command: METHOD, result: SIGNAL}",
}


class TopicTable:
    """The tables of a project together; names of topics with or without the first `/`.

    `parameters` are as states have set them, until `forget` is called at the end of a run.
    """

    def __init__(self, files: Iterable[TopicFile] = (), place: str = "topics.yaml") -> None:
        self.place = place
        self._entries: dict[tuple[str, str], Any] = {}
        self.parameters: dict[str, Any] = {}
        for file in files:
            for link in _LINES:
                for topic, entry in getattr(file, link).items():
                    self._entries[link, plain_topic(topic)] = entry
            for name, value in file.parameters.items():
                self.parameters[plain_topic(name)] = value
        self._written = dict(self.parameters)

    def forget(self) -> None:
        """Have the parameters as they are written again."""
        self.parameters = dict(self._written)

    def find(self, link: str, topic: str) -> Any:
        """The entry of a topic; None if there is none."""
        return self._entries.get((link, plain_topic(topic)))

    def entry(self, link: str, topic: str) -> Any:
        """The entry of a topic.

        Raises:
            LookupError: there is none; the message has the line that is missing.
        """
        found = self.find(link, topic)
        if found is None:
            raise LookupError(self.missing(link, topic))
        return found

    def missing(self, link: str, topic: str) -> str:
        """The message about a topic that is not in the table, with the line to be added."""
        known = [name for kind, name in self._entries if kind == link]
        near = did_you_mean(plain_topic(topic), known) if known else ""
        line = f"add to {self.place}, under `{link}`: `{topic}: {_LINES[link]}`"
        return f"no topic {topic!r}; {line}" + (f"; {near}" if near.startswith("did") else "")

    def signals(self, link: str, topic: str) -> tuple[str, ...]:
        """The signals that a state reads for a topic."""
        found = self.find(link, topic)
        names = (getattr(found, key, None) for key in ("signal", "result", "feedback"))
        return tuple(name for name in names if name)

    def parts(self, link: str, topic: str) -> tuple[str, ...]:
        """The parts that a state commands for a topic."""
        part = getattr(self.find(link, topic), "part", None)
        return (part,) if part else ()

    def topics(self, link: str) -> Iterator[str]:
        """The topics of a kind."""
        return (topic for kind, topic in self._entries if kind == link)


def plain_topic(topic: str) -> str:
    """A name of a topic with the first `/` and without a last one."""
    return f"/{str(topic).strip('/')}"


def topics_from(item: Item) -> TopicFile:
    """A table of topics.

    Raises:
        FileError: every mistake in it.
    """
    return record(item, TopicFile)


def load_topics(files: Iterable[Path]) -> TopicTable:
    """The tables in these files together; one with mistakes is left out, `validate` tells them."""
    found, place = [], "topics.yaml"
    for file in files:
        try:
            found.append(load_yaml(file, topics_from))
            place = file.name
        except FileError:
            continue
    return TopicTable(found, place)


def names_in_table(item: Item, signals: Iterable[str], parts: Mapping[str, Any]) -> None:
    """Check that the signals, parts and commands of a table exist.

    Args:
        item: the table.
        signals: the names of all signals.
        parts: all parts by name: an object or a class with its methods; None if they are not known.

    Raises:
        FileError: every mistake in it.
    """
    table = topics_from(item)
    known = {"signal": list(signals), "part": list(parts)}
    findings: list[Finding] = []
    for link in _LINES:
        for topic, entry in getattr(table, link).items():
            at = item.mapping()[link].mapping()[topic].mapping()
            for key in ("signal", "result", "feedback", "part"):
                name, what = getattr(entry, key, None), "part" if key == "part" else "signal"
                if name is not None and name not in known[what]:
                    hint = did_you_mean(name, known[what])
                    findings += at[key].error(f"there is no {what} {name!r}", hint).findings
            findings += _wrong_commands(entry, at, parts.get(getattr(entry, "part", "")))
    if findings:
        raise FileError(findings)


def _wrong_commands(entry: Any, at: Mapping[str, Item], part: Any) -> Iterator[Finding]:
    for key in ("command", "cancel") if part is not None else ():
        name = getattr(entry, key, None)
        if name is not None and not callable(getattr(part, name, None)):
            told = f"the part {entry.part!r} has no method {name!r}"
            hint = did_you_mean(name, _methods(part))
            yield from at.get(key, at["part"]).error(told, hint).findings


def _methods(part: Any) -> list[str]:
    return [name for name in dir(part) if name[0] != "_" and callable(getattr(part, name, None))]
