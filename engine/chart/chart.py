"""A chart as data: what the YAML says, checked for shape only.

Names are not resolved here: `engine.check` looks them up, `engine.machine.machine` binds them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from engine.files import Map, Mark, Place, SourceFile
from engine.literals import Reference as Reference

Form = Literal["do", "watch", "use", "states", "any", "all"]
LEAVES = ("do", "watch")
CONTAINERS = ("states", "any", "all")
AUTONOMY = {"off": 0, "low": 1, "high": 2, "full": 3, "inherit": -1}


class Rule(NamedTuple):
    """One item of `when`: the container ends with `outcome` once all of `conditions` hold.

    `conditions` maps children to their outcomes; empty means that all children have ended.
    """

    outcome: str
    conditions: Mapping[str, str]
    at: Mark


class Retry(NamedTuple):
    """Up to `times` further tries after one of the outcomes `on`, `wait` apart."""

    times: Any
    on: tuple[str, ...]
    wait: Any = 0


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """One node of a chart. `raw` is its YAML mapping, with source positions.

    Of `inputs`, text is a data key; anything else is a value, or a `Reference` to one. `breaks`: a
    breakpoint stands at it.
    """

    name: str
    form: Form
    at: Mark
    raw: Map
    target: str = ""
    children: tuple[Node, ...] = ()
    next: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    when: tuple[Rule, ...] = ()
    timeout: Any = None
    retry: Retry | None = None
    autonomy: Mapping[str, str] = field(default_factory=dict)
    priority: int = 0
    breaks: bool = False
    about: str = ""

    @property
    def reads(self) -> dict[str, str]:
        """The data keys that inputs and parameters are read from, by their names."""
        return {name: key for name, key in self.inputs.items() if _is_key(key)}

    @property
    def given(self) -> dict[str, Any]:
        """The values of inputs that stand in the chart, by their names."""
        return {name: value for name, value in self.inputs.items() if not _is_key(value)}

    @property
    def keeps(self) -> bool:
        """Whether the outcomes of the children are kept until a rule decides."""
        return bool(self.when) or self.form == "all"

    @property
    def rules(self) -> tuple[Rule, ...]:
        """The rules of `when`; `all` without `when` has one, `done` once every child has ended."""
        if self.form == "all" and not self.when:
            return (Rule("done", {}, self.at),)
        return self.when

    def walk(self) -> Iterator[Node]:
        """This node and all below it, in document order."""
        yield self
        for child in self.children:
            yield from child.walk()


def _is_key(value: Any) -> bool:
    """Whether an entry of `in` names a data key; text that begins as numbers do is `2 m`."""
    return type(value) is str and value[:1] not in {*"+-.0123456789"}


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a chart: `type` by name; without `default` it must be given.

    `origin`: what the default was taken from, if not from the chart's file.
    """

    name: str
    type: str
    default: Any
    required: bool
    about: str
    at: Mark
    origin: str = ""


@dataclass(frozen=True, slots=True)
class DataKey:
    """A key of a chart's data, one of its inputs, or one of its outputs.

    `initial` is the `default` of an input. `optional`: declared with `initial: none`, or
    `default: none`, it may be empty until a node writes it.
    """

    name: str
    type: str
    initial: Any
    has_initial: bool
    at: Mark
    is_input: bool = False
    optional: bool = False
    about: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """One chart file."""

    name: str
    source: SourceFile
    root: Node
    about: str = ""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    outcomes: tuple[str, ...] = ()
    outputs: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    keys: Mapping[str, DataKey] = field(default_factory=dict)

    @property
    def file(self) -> str:
        """The file that the chart is in."""
        return self.source.file

    @property
    def inputs(self) -> dict[str, DataKey]:
        """The keys that are filled by the chart or program that uses this one."""
        return {name: key for name, key in self.keys.items() if key.is_input}

    def declared_mark(self, section: str, name: str, entry: str) -> Mark:
        """Position of an `entry` of a declaration; of the declaration if it has no such entry."""
        raw = self.root.raw
        inside = raw.get(section)
        item = inside.get(name) if isinstance(inside, Map) else None
        if isinstance(item, Map) and entry in item:
            return mark_of(item, entry)
        return (mark_of if isinstance(item, str) else key_mark_of)(raw, section, name)

    def place(self, mark: Mark) -> Place:
        """The place of a mark in the chart's file."""
        return self.source.place(mark)


def mark_of(raw: Map, key: str, entry: str | None = None) -> Mark:
    """Position of the value of `key` in `raw`, or of the value of `entry` inside it."""
    at = raw.values_at.get(key, raw.at)
    if entry is None:
        return at
    inside = raw.get(key)
    return inside.values_at.get(entry, at) if isinstance(inside, Map) else at


def key_mark_of(raw: Map, key: str, entry: str | None = None) -> Mark:
    """Position of `key` itself in `raw`, or of the key `entry` of the mapping inside it."""
    at = raw.keys_at.get(key, raw.at)
    if entry is None:
        return at
    inside = raw.get(key)
    return inside.keys_at.get(entry, at) if isinstance(inside, Map) else at


def nodes_by_path(chart: Chart, library: Mapping[str, Chart]) -> Iterator[tuple[str, Node]]:
    """All nodes of a chart but its root, and those of the charts that it uses, by path.

    In document order. A chart that uses itself is not entered again, nor one that is unknown.
    """
    yield from _below(chart.root, "", library, (chart.name,))


def _below(
    node: Node, path: str, library: Mapping[str, Chart], inside: tuple[str, ...]
) -> Iterator[tuple[str, Node]]:
    for child in node.children:
        below = f"{path}/{child.name}" if path else child.name
        yield below, child
        used = library.get(child.target) if child.form == "use" else None
        if used is None:
            yield from _below(child, below, library, inside)
        elif used.name not in inside:
            yield from _below(used.root, below, library, (*inside, used.name))
