"""One chart under check: its nodes with what their names stand for, and what was found."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from engine.chart import CONTAINERS, Chart, DataKey, Node, Rule, key_mark_of, mark_of
from engine.check.callee import Callee, KnownNames
from engine.files.finding import Finding, Place, Severity, did_you_mean
from engine.files.source import Mark
from engine.types import ANY, Type

EFFORT = 10_000  # names and nodes looked at for the hints of one chart; then there are no more

Origin = tuple[Node, str] | Mark  # an entry of a node's `next`, or a place


class NodeInPlace:
    """A node in its place.

    Attributes:
        callee: what a leaf or `use` names; `None` for boxes and for unknown names.
        names: the key of the chart that each data name stands for here, `None` if unknown.
        ends: the outcomes it may end with besides `error`, and where in the text they come from.
        produced: those of `ends` that can come to pass.
        reached: the children that can be entered.
        routes: where outcomes lead, a sibling or `.x`.
        rules: the items of `when` that can match.
        commands: the parts that it or something in it commands.
        instant: the outcomes it can end with in the tick of its entry.
        needs: the keys that must have been written before it, as bits.
        gives: the keys that have been written since its entry, as bits, by outcome.
        entry: the keys that have been written before it since its parent's entry; `None` if it is
            never entered.
        inner, final: the keys that it writes while it runs, and at its end.
    """

    __slots__ = (
        "box", "callee", "children", "commands", "ends", "entry", "final", "form", "gives", "inner",
        "instant", "names", "needs", "node", "parent", "produced", "reached", "routes",
        "rules",
    )  # fmt: skip

    def __init__(
        self, node: Node, parent: NodeInPlace | None, names: Mapping[str, str | None]
    ) -> None:
        self.node = node
        self.form = node.form
        self.parent = parent
        self.names = names
        self.box = node.form in CONTAINERS
        self.callee: Callee | None = None
        self.children: list[NodeInPlace] = []
        self.ends: Mapping[str, Sequence[Origin]] = {}
        self.produced: Mapping[str, object] = {}
        self.reached: dict[NodeInPlace, None] = {}
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
        """Whether this is a monitor directly inside `any` or `all`."""
        return self.form == "watch" and self.parent is not None and self.parent.form != "states"

    def kept(self) -> list[str]:
        """The outcomes that a parent which keeps outcomes will keep."""
        routes = self.node.next
        return [outcome for outcome in self.ends if outcome not in routes]


class Data:
    """The keys of a chart, each with a bit of its own."""

    __slots__ = ("bits", "keys", "kinds", "nullable", "read", "start", "written")

    def __init__(self, keys: Mapping[str, DataKey], types: Mapping[str, Type]) -> None:
        self.keys = list(keys.values())
        self.bits = {name: 1 << index for index, name in enumerate(keys)}
        self.kinds = {name: types.get(key.type, ANY) for name, key in keys.items()}
        self.start = 0
        for key in self.keys:
            if key.has_initial or key.is_input:
                self.start |= self.bits[key.name]
        self.read = self.written = 0
        self.nullable = 0  # keys into which somebody may write nothing

    def within(self, mask: int) -> Iterator[DataKey]:
        """The keys of these bits."""
        while mask:
            lowest = mask & -mask
            yield self.keys[lowest.bit_length() - 1]
            mask ^= lowest


@dataclass(slots=True, eq=False)
class Subject:
    """A chart under check, and what was found in it."""

    chart: Chart
    world: KnownNames
    data: Data = field(init=False)
    sites: list[NodeInPlace] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    parameters_used: set[str] = field(default_factory=set)
    deadlines: dict[str, bool] = field(default_factory=dict)
    dead_ends: list[NodeInPlace] = field(default_factory=list)
    effort: int = EFFORT

    def __post_init__(self) -> None:
        self.data = Data(self.chart.keys, self.world.types)

    @property
    def root(self) -> NodeInPlace:
        """The site of the chart's root."""
        return self.sites[0]

    @property
    def sound(self) -> bool:
        """Whether all names are known, so that paths through the chart mean something."""
        findings = (*self.chart.source.findings, *self.findings)
        return not any(finding.severity == "error" for finding in findings)

    def error(
        self,
        code: str,
        message: str,
        mark: Mark,
        hint: str = "",
        first: tuple[Mark, str] | None = None,
    ) -> None:
        """Note a mistake at `mark`; `first` is another place that has to do with it."""
        self._add("error", code, message, mark, hint, first)

    def warning(
        self,
        code: str,
        message: str,
        mark: Mark,
        hint: str = "",
        first: tuple[Mark, str] | None = None,
    ) -> None:
        """Note something that can run but is hardly meant."""
        self._add("warning", code, message, mark, hint, first)

    def _add(
        self,
        severity: Severity,
        code: str,
        message: str,
        mark: Mark,
        hint: str,
        first: tuple[Mark, str] | None,
    ) -> None:
        related: tuple[tuple[Place, str], ...] = ()
        if first is not None:
            related = ((self.chart.place(first[0]), first[1]),)
        place = self.chart.place(mark)
        self.findings.append(Finding(code, message, place, hint, severity, related))

    def near(self, word: str, *known: Iterable[str]) -> str:
        """What may have been meant by `word`, while there are few mistakes."""
        if self.effort <= 0:
            return ""
        names = [name for names in known for name in names]
        self.effort -= 1 + len(names)
        return did_you_mean(word, names)


def grow(subject: Subject) -> None:
    """Look up what the nodes name (N01, N02, N04) and what data names stand for (N11)."""
    names: dict[str, str | None] = {name: name for name in subject.chart.keys}
    _grow(subject, subject.chart.root, None, names)


def _grow(
    subject: Subject, node: Node, parent: NodeInPlace | None, names: Mapping[str, str | None]
) -> NodeInPlace:
    site = NodeInPlace(node, parent, names)
    subject.sites.append(site)
    if site.box:
        if node.inputs or node.outputs:
            site.names = names = _aliases(subject, site)
        site.children = [_grow(subject, child, site, names) for child in node.children]
    elif node.form == "use":
        site.callee = _used_chart(subject, node)
    else:
        site.callee = _state_class(subject, node)
    return site


def _aliases(subject: Subject, site: NodeInPlace) -> Mapping[str, str | None]:
    """`in` and `out` of a box: other names for outer keys."""
    names = site.names
    for section, entries in (("in", site.node.inputs), ("out", site.node.outputs)):
        for inner, outer in entries.items():
            if outer not in names:
                unknown_key(subject, site, section, inner, outer, names)
        if entries:
            own = {inner: names.get(outer) for inner, outer in entries.items()}
            names = ChainMap(own, names)  # type: ignore[arg-type]  # nobody writes to it
    return names


def unknown_key(
    subject: Subject, site: NodeInPlace, section: str, entry: str, key: str, known: Iterable[str]
) -> None:
    """N11: `in` or `out` names a key that there is not."""
    hint = subject.near(key, known)
    subject.error("N11", f"no data key {key!r}", mark_of(site.node.raw, section, entry), hint)


def _state_class(subject: Subject, node: Node) -> Callee | None:
    world, at = subject.world, mark_of(node.raw, node.form)
    found = world.state_class(node.target)
    if found is None:
        if node.raw[node.form] == node.target:  # else its shape has been complained about
            is_chart = node.target in world.library
            hint = f"`use: {node.target}`, it is a chart" if is_chart else ""
            hint = hint or subject.near(node.target, world.interfaces)
            subject.error("N01", f"no state class {node.target!r}", at, hint)
        return None
    if found.monitor != (node.form == "watch"):
        what, hint = ("a monitor", "watch") if found.monitor else ("an action", "do")
        key_at = key_mark_of(node.raw, node.form)
        subject.error("N04", f"{node.target} is {what}", key_at, f"`{hint}: {node.target}`")
    return found


def _used_chart(subject: Subject, node: Node) -> Callee | None:
    found = subject.world.chart(node.target)
    told = node.raw[node.form] != node.target or node.target in subject.world.unread
    if found is None and not told:
        named = subject.world.interfaces.get(node.target)
        form = "watch" if named is not None and named.monitor else "do"
        hint = f"`{form}: {node.target}`, it is a state class" if named is not None else ""
        hint = hint or subject.near(node.target, subject.world.library)
        subject.error("N02", f"no chart {node.target!r}", mark_of(node.raw, node.form), hint)
    return found
