"""A chart under check: its nodes, resolved, and the findings so far."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from engine.chart import CONTAINERS, Chart, DataKey, Node, Rule, key_mark_of, mark_of
from engine.check.callee import Callee, KnownNames
from engine.files import Finding, Map, Mark, Severity, did_you_mean
from engine.types import ANY, Type

EFFORT = 10_000  # maximum number of names compared for the suggestions of one chart

Origin = tuple[Node, str] | Mark  # an entry of a node's `next`, or a place


class PlacedNode:
    """A node of a chart with what its names refer to, and what the checks find out about it.

    Attributes:
        callee: the class or chart that it names; `None` for containers and for unknown names.
        names: the chart's data key that each name refers to here, `None` if unknown.
        ends: the outcomes it may end with besides `error`, and where in the text they come from.
        produced: those of `ends` that can actually occur.
        reached: the children that can be entered.
        routes: the targets of its outcomes, a sibling or `.x`.
        rules: the items of `when` that can match.
        commands: the parts that it, or any node inside it, commands.
        instant: the outcomes it can end with in the tick of its entry.
        needs: the keys that must be written before its entry, as bits.
        gives: the keys written between its entry and each outcome, as bits, by outcome.
        entry: the keys written between its parent's entry and its own; `None` if never entered.
        inner, final: the keys that it writes while it runs, and at its end.
    """

    __slots__ = (
        "callee",
        "children",
        "commands",
        "ends",
        "entry",
        "final",
        "form",
        "gives",
        "inner",
        "instant",
        "is_container",
        "names",
        "needs",
        "node",
        "parent",
        "produced",
        "reached",
        "routes",
        "rules",
    )  # fmt: skip

    def __init__(
        self, node: Node, parent: PlacedNode | None, names: Mapping[str, str | None]
    ) -> None:
        self.node = node
        self.form = node.form
        self.parent = parent
        self.names = names
        self.is_container = node.form in CONTAINERS
        self.callee: Callee | None = None
        self.children: list[PlacedNode] = []
        self.ends: Mapping[str, Sequence[Origin]] = {}
        self.produced: Mapping[str, object] = {}
        self.reached: dict[PlacedNode, None] = {}
        self.routes: list[tuple[str, str]] = []
        self.rules: Sequence[Rule] = node.rules
        self.commands: frozenset[str] = frozenset()
        self.instant: frozenset[str] = frozenset()
        self.needs = 0
        self.gives: dict[str, int] = {}
        self.entry: int | None = None
        self.inner = self.final = 0

    @property
    def guard(self) -> bool:
        """True for a monitor directly inside `any` or `all`."""
        return self.form == "watch" and self.parent is not None and self.parent.form != "states"

    def kept(self) -> list[str]:
        """The outcomes that its parent keeps, if that is a container that keeps outcomes."""
        routes = self.node.next
        return [outcome for outcome in self.ends if outcome not in routes]


class Data:
    """The keys of a chart, each with its own bit in the masks of `PlacedNode`.

    Masks: `start`, set before the first node; `read`, `written`, by any node.
    """

    __slots__ = ("bits", "keys", "kinds", "nullable", "read", "start", "written")

    def __init__(self, keys: Mapping[str, DataKey], types: Mapping[str, Type]) -> None:
        self.keys = list(keys.values())
        self.bits = {name: 1 << index for index, name in enumerate(keys)}
        self.kinds = {name: types.get(key.type, ANY) for name, key in keys.items()}
        self.start = 0
        for key in self.keys:
            if key.has_initial or (key.is_input and not key.optional):
                self.start |= self.bits[key.name]
        self.read = self.written = 0
        self.nullable = 0  # keys that may be written with none

    def within(self, mask: int) -> Iterator[DataKey]:
        """The keys of these bits."""
        while mask:
            lowest = mask & -mask
            yield self.keys[lowest.bit_length() - 1]
            mask ^= lowest


@dataclass(slots=True, eq=False)
class CheckedChart:
    """A chart under check, and the findings in it."""

    chart: Chart
    scope: KnownNames
    data: Data = field(init=False)
    nodes: list[PlacedNode] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    parameters_used: set[str] = field(default_factory=set)
    limits: dict[str, Type] = field(default_factory=dict)
    dead_ends: list[PlacedNode] = field(default_factory=list)
    beside: dict[tuple[str, str], tuple[PlacedNode, PlacedNode]] = field(default_factory=dict)
    effort: int = EFFORT

    def __post_init__(self) -> None:
        self.data = Data(self.chart.keys, self.scope.types)

    @property
    def root(self) -> PlacedNode:
        """The root of the chart."""
        return self.nodes[0]

    @property
    def sound(self) -> bool:
        """True if there is no error so far, so that checks of paths make sense."""
        findings = (*self.chart.source.findings, *self.findings)
        return not any(finding.severity == "error" for finding in findings)

    def error(
        self, code: str, message: str, mark: Mark, hint: str = "", *related: tuple[Mark, str]
    ) -> None:
        """Add an error at `mark`; `related`: other places that it involves, each with a note."""
        self._add("error", code, message, mark, hint, related)

    def warning(
        self, code: str, message: str, mark: Mark, hint: str = "", *related: tuple[Mark, str]
    ) -> None:
        """Add a warning about something that can run but is hardly intended."""
        self._add("warning", code, message, mark, hint, related)

    def _add(
        self,
        severity: Severity,
        code: str,
        message: str,
        mark: Mark,
        hint: str,
        related: Iterable[tuple[Mark, str]],
    ) -> None:
        place, notes = self.chart.place, tuple((self.chart.place(m), note) for m, note in related)
        self.findings.append(Finding(code, message, place(mark), hint, severity, notes))

    def limit(self, parameter: str, kind: Type) -> None:
        """Note that values of a parameter have to be in the range of a type."""
        if kind.within is None:
            return
        before = self.limits.get(parameter, kind).within or kind.within
        self.limits[parameter] = replace(kind, within=kind.within.narrowed(before))

    def near(self, word: str, *known: Iterable[str]) -> str:
        """A suggestion for an unknown `word`; empty once the chart's `effort` is used up."""
        if self.effort <= 0:
            return ""
        names = [name for names in known for name in names]
        self.effort -= 1 + len(names)
        return did_you_mean(word, names)


def resolve_names(checked: CheckedChart) -> None:
    """Resolve the classes and charts (N01, N02, N04) and the data keys (N11) that nodes name."""
    names: dict[str, str | None] = {name: name for name in checked.chart.keys}
    _resolve(checked, checked.chart.root, None, names)


def _resolve(
    checked: CheckedChart, node: Node, parent: PlacedNode | None, names: Mapping[str, str | None]
) -> PlacedNode:
    placed = PlacedNode(node, parent, names)
    checked.nodes.append(placed)
    if placed.is_container:
        if node.raw.keys() & {"in", "out"}:
            placed.names = names = _aliases(checked, placed)
        placed.children = [_resolve(checked, child, placed, names) for child in node.children]
    elif node.form == "use":
        placed.callee = _used_chart(checked, node)
    else:
        placed.callee = _state_class(checked, placed)
    return placed


def _aliases(checked: CheckedChart, placed: PlacedNode) -> Mapping[str, str | None]:
    """The chart's keys by name inside a container, whose `in` and `out` may rename them."""
    names = placed.names
    for section, entries in (("in", placed.node.reads), ("out", placed.node.outputs)):
        for inner, outer in entries.items():
            if outer not in names:
                unknown_key(checked, placed, section, inner, outer, names)
        inside = placed.node.raw.get(section)
        if isinstance(inside, Map) and inside:  # those that are no words were reported on loading
            own = dict.fromkeys(inside) | {i: names.get(outer) for i, outer in entries.items()}
            names = ChainMap(own, names)  # type: ignore[arg-type]  # nobody writes to it
    return names


def unknown_key(
    checked: CheckedChart,
    placed: PlacedNode,
    section: str,
    entry: str,
    key: str,
    known: Iterable[str],
    hint: str = "",
) -> None:
    """Report N11: `in` or `out` names a key that does not exist."""
    hint = hint or checked.near(key, known)
    checked.error("N11", f"no data key {key!r}", mark_of(placed.node.raw, section, entry), hint)


def _state_class(checked: CheckedChart, placed: PlacedNode) -> Callee | None:
    node, scope = placed.node, checked.scope
    at = mark_of(node.raw, node.form)
    found = scope.state_class(node.target)
    if found is None:
        if node.raw[node.form] == node.target:  # otherwise reported on loading
            is_chart = node.target in scope.library
            hint = f"`use: {node.target}`, it is a chart" if is_chart else ""
            hint = hint or scope.strangers.get(node.target, "")
            hint = hint or checked.near(node.target, scope.interfaces)
            checked.error("N01", f"no state class {node.target!r}", at, hint)
        return None
    if found.monitor != (node.form == "watch"):
        what, hint = ("a monitor", "watch") if found.monitor else ("an action", "do")
        key_at = key_mark_of(node.raw, node.form)
        checked.error("N04", f"{node.target} is {what}", key_at, f"`{hint}: {node.target}`")
    return found


def _used_chart(checked: CheckedChart, node: Node) -> Callee | None:
    found = checked.scope.chart(node.target)
    told = node.raw[node.form] != node.target or node.target in checked.scope.unread
    if found is None and not told:
        named = checked.scope.interfaces.get(node.target)
        form = "watch" if named is not None and named.monitor else "do"
        hint = f"`{form}: {node.target}`, it is a state class" if named is not None else ""
        hint = hint or checked.scope.strangers.get(node.target, "")
        hint = hint or checked.near(node.target, checked.scope.library)
        checked.error("N02", f"no chart {node.target!r}", mark_of(node.raw, node.form), hint)
    return found
