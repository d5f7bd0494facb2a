"""Loads charts from YAML files. Errors of shape become findings; all that is readable is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

from engine.chart.chart import (
    AUTONOMY,
    CONTAINERS,
    Chart,
    DataKey,
    Node,
    Parameter,
    Reference,
    Retry,
    Rule,
    key_mark_of,
    mark_of,
)
from engine.chart.grammar import (
    CHART,
    DATA,
    FORMS,
    INPUT,
    KEYS_OF,
    NODE,
    PARAMETER,
    RETRY,
    RULE,
    Keys,
)
from engine.files import (
    Finding,
    Map,
    Mark,
    Seq,
    SourceFile,
    did_you_mean,
    help_with_name,
    read,
    read_file,
)
from engine.files.declared import is_name, shown
from engine.state_class import RESERVED_OUTCOMES

GUESSES = 100  # with more findings than this in a file, unknown keys get no suggestion


class Library(dict[str, Chart]):
    """Charts by name, with the findings and sources of their files."""

    def __init__(self) -> None:
        super().__init__()
        self.findings: list[Finding] = []
        self.sources: dict[str, SourceFile] = {}

    def add(self, source: SourceFile) -> Chart | None:
        """Read the chart in `source`; `None` if it is unusable."""
        self.sources[source.file] = source
        chart = _Reader(source).chart()
        self.findings += source.findings
        if chart is None:
            return None
        if chart.name in self:
            message = f"a chart {chart.name!r} is also in {self[chart.name].file}"
            at = mark_of(source.value, "chart")
            self.findings.append(Finding("N02", message, source.place(at), "give it another name"))
            return None
        self[chart.name] = chart
        return chart


def load_files(files: Iterable[Path]) -> Library:
    """Read chart files; unreadable ones become findings."""
    library = Library()
    for file in files:
        library.add(read_file(file))
    return library


def load_text(text: str, file: str = "<text>") -> Library:
    """Read one chart from text."""
    library = Library()
    library.add(read(text.encode(), file))
    return library


def chart_value(written: Any) -> Any:
    """A value as written in a chart: `$name`, also inside of it, stands for a value."""
    if type(written) is str and written.startswith("$"):
        return Reference(written[1:])
    if isinstance(written, list):
        items = copy(written)
        items[:] = map(chart_value, written)
        return items
    if isinstance(written, dict):
        inside = copy(written)
        inside.update((entry, chart_value(item)) for entry, item in written.items())
        return inside
    return written


def start_value(written: Any) -> Any:
    """A value as written that a data key or an input starts with: `none` leaves it empty."""
    return None if type(written) is str and written == "none" else chart_value(written)


class _Reader:
    """Reads one file."""

    def __init__(self, source: SourceFile) -> None:
        self.source = source
        self.report = source.report

    def chart(self) -> Chart | None:
        raw = self.source.value
        if not isinstance(raw, Map):
            if not self.source.findings:
                self.report("C03", "a chart is a mapping", (1, 1, 2), "begin with `chart: NAME`")
            return None
        self.unknown_keys(raw, CHART, "a chart")
        name = self.text(raw, "chart")
        if raw.get("chart") in (None, ""):
            at = raw.keys_at.get("chart", raw.at)
            self.report("C02", "'chart' is missing", at, "`chart: NAME`")
        if name and not is_name(name):
            self.report(
                "C06", f"{name!r} is not a name", mark_of(raw, "chart"), help_with_name(name)
            )
        root = self.root(raw)
        if root is None or not name:
            return None
        outputs = self.outputs(raw)
        declared = self.keys(raw, "inputs") | self.keys(raw, "data")
        return Chart(
            name=name,
            source=self.source,
            root=root,
            about=self.text(raw, "about") or "",
            parameters=self.parameters(raw),
            outcomes=self.outcomes(raw),
            outputs=outputs,
            keys=self.output_keys(raw, outputs) | declared,
        )

    def root(self, raw: Map) -> Node | None:
        forms = [form for form in CONTAINERS if form in raw]
        if len(forms) != 1:
            what = f"{forms[0]!r} and {forms[1]!r}" if forms else "none of them"
            hint = "a chart has exactly one of states, any, all"
            at = raw.keys_at[forms[1]] if forms else raw.at
            self.report("C04", f"{what} at the top of the chart", at, hint)
            return None
        form: Any = forms[0]
        children = self.children(raw, form)
        when = self.rules(raw, "when")
        return Node("", form, raw.keys_at[form], raw, children=children, when=when)

    def children(self, raw: Map, form: str) -> tuple[Node, ...]:
        inside = raw[form]
        if not isinstance(inside, Map) or not inside:
            hint = "`name: {do: X}`" + (", without the `- `" if isinstance(inside, Seq) else "")
            self.report("C03", f"{form!r} holds named nodes", mark_of(raw, form), hint)
            return ()
        nodes = []
        for name, value in inside.items():
            at = inside.keys_at[name]
            if not is_name(name):
                self.report("C06", f"{name!r} is not a name", at, help_with_name(name))
            if not isinstance(value, Map):
                self.report("C03", f"node {name!r} is a mapping", at, "`name: {do: X}`")
                continue
            node = self.node(name, value, at)
            if node is not None:
                nodes.append(node)
        return tuple(nodes)

    def node(self, name: str, raw: Map, at: Mark) -> Node | None:
        forms = [form for form in FORMS if form in raw]
        if len(forms) != 1:
            self.unknown_keys(raw, NODE, f"node {name!r}")
            what = f"{forms[0]!r} and {forms[1]!r}" if forms else "none of them"
            hint = "a node has exactly one of do, watch, use, states, any, all"
            if name in NODE and not forms:
                hint = f"{name!r} belongs to a node: indent it as far as that node's other keys"
            self.report(
                "C04", f"{what} in node {name!r}", raw.keys_at[forms[1]] if forms else at, hint
            )
            return None
        form = forms[0]
        if not raw.keys() <= KEYS_OF[form]:
            self.foreign_keys(name, raw, form)
        children: tuple[Node, ...] = ()
        target = ""
        if form in CONTAINERS:
            children = self.children(raw, form)
        else:
            target = self.text(raw, form) or ""
            if not target and raw[form] is None:
                self.report("C02", f"{form!r} names nothing", raw.keys_at[form], "`do: CLASS`")
        given = {}
        for key in raw:
            if key in _FIELDS:
                field, read = _FIELDS[key]
                given[field] = read(self, raw, key)
        return Node(name, form, at, raw, target, children, **given)

    def foreign_keys(self, name: str, raw: Map, form: str) -> None:
        self.unknown_keys(raw, NODE, f"node {name!r}")
        for key in raw.keys() & NODE.keys() - KEYS_OF[form]:
            owners = ", ".join(sorted(NODE[key].on))
            message = f"{key!r} has no meaning on a {form!r} node"
            self.report("C05", message, raw.keys_at[key], f"it belongs to: {owners}")

    def unknown_keys(self, raw: Map, known: Keys, where: str) -> None:
        for key in raw:
            if key not in known:
                hint = did_you_mean(key, known) if len(self.source.findings) < GUESSES else ""
                self.report("C01", f"unknown key {key!r} in {where}", raw.keys_at[key], hint)

    def text(self, raw: Map, key: str) -> str | None:
        value = raw.get(key)
        if value is None or isinstance(value, str):
            return value
        self.report("C03", f"{key!r} is a word or a sentence", mark_of(raw, key))
        return None

    def mapping(self, raw: Map, key: str, example: str) -> Map:
        value = raw.get(key)
        if isinstance(value, Map):
            return value
        if key in raw:
            hint = f"`{key}: {{{example}}}`"
            self.report("C03", f"{key!r} is a mapping", mark_of(raw, key), hint)
        return Map(raw.at)

    def words(self, raw: Map, key: str) -> Mapping[str, str]:
        inside = self.mapping(raw, key, "a: b")
        for entry, value in inside.items():
            if type(value) is not str:
                self.not_a_word(key, entry, value, inside)
                return {k: v for k, v in inside.items() if type(v) is str}
        return inside

    def not_a_word(self, section: str, entry: str, value: Any, inside: Map) -> None:
        first, gap, last = entry.partition(" ")
        if value is None and gap and last:  # {a b}, which YAML takes for one long key
            hint = f"write `{first}: {last.strip()}`, with a `:`"
            self.report("C03", f"no `:` in {entry!r}", inside.keys_at[entry], hint)
            return
        at = inside.values_at.get(entry, inside.at)
        hint = _A_KEY if section in ("in", "out") else ""
        self.report("C03", f"{section}.{entry} is a name, not {shown(value)}", at, hint)

    def values(self, raw: Map, key: str) -> Mapping[str, Any]:
        inside = self.mapping(raw, key, "parameter: value")
        return {entry: chart_value(value) for entry, value in inside.items()}

    def bindings(self, raw: Map, key: str) -> Mapping[str, Any]:
        """What inputs are read from: data keys; on leaves and `use`, values as well."""
        if not raw.keys() & {*NODE["with"].on}:
            return self.words(raw, key)
        inside = self.mapping(raw, key, "a: b")
        for entry, value in inside.items():
            if value is None and " " in entry:
                self.not_a_word(key, entry, value, inside)
                return {}
        return {entry: chart_value(value) for entry, value in inside.items()}

    def rules(self, raw: Map, key: str) -> tuple[Rule, ...]:
        items = raw.get(key)
        if items is None:
            if key in raw:
                self.report("C03", f"{key!r} is a list", mark_of(raw, key), _A_RULE)
            return ()
        if not isinstance(items, Seq) or not raw.keys() & {*NODE[key].on}:
            self.report("C03", f"{key!r} is a list, on any or all", mark_of(raw, key), _A_RULE)
            return ()
        rules = []
        for item, at in zip(items, items.values_at, strict=True):
            if not isinstance(item, Map):
                self.report("C03", "an item of 'when' is a mapping", at, _A_RULE)
                continue
            self.unknown_keys(item, RULE, "an item of 'when'")
            outcome, conditions = self.text(item, "outcome"), self.words(item, "if")
            if not outcome or not conditions:
                self.report("C02", "an item of 'when' has an outcome and conditions", at, _A_RULE)
                continue
            rules.append(Rule(outcome, conditions, at))
        return tuple(rules)

    def retry(self, raw: Map, key: str) -> Retry | None:
        inside = self.mapping(raw, key, _TRIES)
        times, on = inside.get("times"), inside.get("on")
        more = [entry for entry, value in inside.items() if value is None and entry not in RETRY]
        if isinstance(on, str) and ("," in on or more):
            hint = f"several stand in brackets: `on: [{', '.join((on, *more))}]`"
            self.report("C03", "'on' names outcomes", mark_of(raw, key, "on"), hint)
            return None
        self.unknown_keys(inside, RETRY, f"{key!r}")
        times = chart_value(times)
        if not isinstance(times, Reference) and (type(times) is not int or times < 1):
            self.report(
                "C03", "'times' is a whole number from 1", mark_of(raw, key, "times"), _A_RETRY
            )
            return None
        names = [on] if isinstance(on, str) else on
        if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
            self.report("C03", "'on' names outcomes", mark_of(raw, key, "on"), _A_RETRY)
            return None
        return Retry(times, tuple(names), chart_value(inside.get("wait", 0)))

    def levels(self, raw: Map, key: str) -> Mapping[str, str]:
        levels = self.words(raw, key)
        for outcome, level in levels.items():
            if level not in AUTONOMY:
                at = mark_of(raw, key, outcome)
                self.report("C03", f"unknown level {level!r}", at, did_you_mean(level, AUTONOMY))
        return {outcome: level for outcome, level in levels.items() if level in AUTONOMY}

    def integer(self, raw: Map, key: str) -> int:
        value = raw[key]
        if type(value) is int:
            return value
        self.report("C03", f"{key!r} is a whole number", mark_of(raw, key), "higher wins")
        return 0

    def flag(self, raw: Map, key: str) -> bool:
        value = raw[key]
        if type(value) is bool:
            return value
        self.report("C03", f"{key!r} is true or false", mark_of(raw, key), f"`{key}: true`")
        return False

    def outcomes(self, raw: Map) -> tuple[str, ...]:
        value = raw.get("outcomes", Seq(raw.at))
        if isinstance(value, Seq) and all(isinstance(item, str) for item in value):
            seen: set[str] = set()
            for item, at in zip(value, value.values_at, strict=True):
                if item in seen:
                    self.report("C06", f"outcome {item!r} is there already", at, "keep one of them")
                elif not is_name(item):
                    self.report("C06", f"{item!r} is not a name", at, help_with_name(item))
                elif item in RESERVED_OUTCOMES:
                    message = f"{item!r} is a reserved outcome"
                    self.report("C06", message, at, "use a name of your own, such as `failed`")
                seen.add(item)
            return tuple(dict.fromkeys(value))
        self.report(
            "C03", "'outcomes' is a list of names", mark_of(raw, "outcomes"), "`[done, failed]`"
        )
        return ()

    def outputs(self, raw: Map) -> dict[str, Mapping[str, str]]:
        inside = self.mapping(raw, "outputs", "outcome: {key: Type}")
        found: dict[str, Mapping[str, str]] = {}
        for outcome in inside:
            found[outcome] = self.words(inside, outcome)
        return found

    def output_keys(self, raw: Map, outputs: Mapping[str, Mapping[str, str]]) -> dict[str, DataKey]:
        """The keys that `outputs` declares; each is a key of the chart even if not under `data`."""
        found: dict[str, DataKey] = {}
        for outcome, named in outputs.items():
            for name, kind in named.items():
                at = key_mark_of(raw["outputs"], outcome, name)
                if not is_name(name):
                    self.report("C06", f"{name!r} is not a name", at, help_with_name(name))
                found.setdefault(name, DataKey(name, kind, None, False, at))
        return found

    def parameters(self, raw: Map) -> dict[str, Parameter]:
        return self.declared(raw, "parameters", PARAMETER, self.parameter)

    def parameter(self, name: str, item: Map, at: Mark) -> Parameter:
        kind, about = self.type_name(item), self.text(item, "about") or ""
        own = kind == "text"  # to which `none` is a word like any
        default = (chart_value if own else start_value)(item.get("default"))
        return Parameter(name, kind, default, "default" not in item, about, at)

    def keys(self, raw: Map, section: str) -> dict[str, DataKey]:
        is_input = section == "inputs"
        start = "default" if is_input else "initial"

        def key(name: str, item: Map, at: Mark) -> DataKey:
            given = start in item
            initial = start_value(item.get(start))
            nothing = given and initial is None
            kind, about = self.type_name(item), self.text(item, "about") or ""
            found = DataKey(name, kind, initial, given and not nothing, at, is_input, nothing)
            return replace(found, about=about)

        return self.declared(raw, section, INPUT if is_input else DATA, key)

    def type_name(self, item: Map) -> str:
        value = item.get("type")
        if isinstance(value, Seq) and len(value) == 1 and isinstance(value[0], str):
            meant = f"list of {value[0]}"
            self.report("C03", "'type' is a word", mark_of(item, "type"), f"write `{meant}`")
            return meant
        return self.text(item, "type") or "any"

    def declared(
        self, raw: Map, section: str, allowed: Keys, make: Callable[[str, Map, Mark], Any]
    ) -> dict[str, Any]:
        inside = self.mapping(raw, section, "name: {type: number}")
        found = {}
        for name, value in inside.items():
            at = inside.keys_at[name]
            item = value
            if isinstance(value, str) or (isinstance(value, Seq) and value):  # `name: Type`
                item = Map(at)
                item["type"] = value
                item.values_at["type"] = inside.values_at.get(name, at)
            if not isinstance(item, Map):
                self.report(
                    "C03", f"{section}.{name} is a type or a mapping", at, "`{type: number}`"
                )
                continue
            if not is_name(name):
                self.report("C06", f"{name!r} is not a name", at, help_with_name(name))
            self.unknown_keys(item, allowed, f"{section}.{name}")
            found[name] = make(name, item, at)
        return found


_READERS: Mapping[str, Callable[[_Reader, Map, str], Any]] = {
    "bindings": _Reader.bindings,
    "words": _Reader.words,
    "values": _Reader.values,
    "rules": _Reader.rules,
    "period": lambda _, raw, key: chart_value(raw[key]),
    "retry": _Reader.retry,
    "levels": _Reader.levels,
    "integer": _Reader.integer,
    "flag": _Reader.flag,
    "text": lambda reader, raw, key: reader.text(raw, key) or "",
}
"""How each kind of value on nodes is read, but for what gives a node its form."""
_FIELDS = {
    name: (key.field or name, _READERS[key.value])
    for name, key in NODE.items()
    if key.value in _READERS
}
_A_RULE = "`when: [{outcome: x, if: {child: outcome}}]`"
_A_KEY = "a data key; values stand under `with` and `in` of what is done, watched or used"
_TRIES = "times: 2, on: failed, wait: 1 s"
_A_RETRY = f"`retry: {{{_TRIES}}}`"
