"""JSON Schema (draft-07) of chart files, for editors: completion, hovers, marked mistakes.

A node is the union of all properties, narrowed by `if do is X, then …`. `oneOf` and `anyOf` are not
used: with them editors offer each key several times and report false mistakes.
The schema knows classes and charts; only `engine.check` knows which names exist inside a file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from engine.chart import AUTONOMY, CHART, CONTAINERS, FORMS, KEYS_OF, NODE, Chart, Keys, Parameter
from engine.files.declared import DRAFT, NAME, Schema, said, text_of
from engine.interfaces import Argument, Interface
from engine.schema.keys import CHART_SNIPPETS, NODE_SNIPPETS, key_schema
from engine.schema.value_schemas import ANY_VALUE, value_schema, written
from engine.types import ANY, Type, known_types


def schema_text(
    interfaces: Mapping[str, Interface],
    charts: Mapping[str, Chart],
    types: Mapping[str, Type] | None = None,
) -> str:
    """The schema as JSON text; it does not depend on the order of the classes and charts."""
    return text_of(chart_schema(interfaces, charts, types))


def chart_schema(
    interfaces: Mapping[str, Interface],
    charts: Mapping[str, Chart],
    types: Mapping[str, Type] | None = None,
) -> Schema:
    """The schema of chart files.

    Args:
        interfaces: the state classes, by name.
        charts: the charts that `use` may name.
        types: types beyond the built-in ones, by name.
    """
    known = known_types(types or {})
    targets = [_class(interfaces[name]) for name in sorted(interfaces)]
    targets += [_chart(charts[name], known) for name in sorted(charts)]
    return {
        "$schema": DRAFT,
        **said("A state chart: what to do and what to watch for."),
        "type": "object",
        "defaultSnippets": CHART_SNIPPETS,
        "properties": _properties(CHART),
        "required": ["chart"],
        "additionalProperties": False,
        "allOf": [*_forms(CONTAINERS, CHART, "states"), _ANY],
        "definitions": _definitions(targets, known),
    }


def _definitions(targets: list[_Target], types: Mapping[str, Type]) -> Schema:
    return {
        "value": ANY_VALUE,
        "type": {"type": ["string", "null"], "examples": sorted(types)},
        "node-in-states": _all("known", "mapped", "child-of-states"),
        "node-in-any": _all("known", "mapped", "child-of-any"),
        "node-in-when": _all("known", "child-of-any"),
        "child-of-states": {"properties": {"next": _TO_SIBLING_OR_OUT}},
        "child-of-any": {"properties": {"next": _TO_OUT}, **_NO_CONSENT},
        "mapped": {"allOf": [*(t.mapped() for t in targets if t.outcomes), _TIMED_OUT]},
        # classes come first: of several descriptions, an editor shows the first one
        "known": {"allOf": [*(t.when_named(_ref_to(t.key)) for t in targets), _ref_to("node")]},
        "node": _node(targets),
        **{target.key: target.narrowed() for target in targets},
    }


@dataclass(frozen=True, slots=True)
class _Target:
    """The interface of a state class or chart, as nodes that name it see it."""

    form: str
    name: str
    about: str
    outcomes: tuple[str, ...]
    parameters: Mapping[str, Argument]
    inputs: Mapping[str, Argument]
    outputs: Mapping[str, Type]

    @property
    def key(self) -> str:
        """The name of its definition in the schema."""
        return f"{self.form}.{self.name}"

    def when_named(self, then: Schema) -> Schema:
        """A schema that applies `then` to the nodes that name this."""
        named = {"properties": {self.form: {"const": self.name}}, "required": [self.form]}
        return {"if": named, "then": then}

    def mapped(self) -> Schema:
        """Requires every outcome in `next`."""
        required = {"next": {"required": sorted(self.outcomes)}}
        return self.when_named({"required": ["next"], "properties": required})

    def narrowed(self) -> Schema:
        """The properties of a node that names this; it does not require any outcome in `next`."""
        endings = [*sorted(self.outcomes), "error"]
        on = {"if": {"type": "array"}, "else": {"enum": endings}, "items": {"enum": endings}}
        required = {"with": _required(self.parameters), "in": _required(self.inputs)}
        properties = {
            self.form: {"title": self.name, **said(self.about)},
            "with": _closed(
                {n: _parameter(a) for n, a in self.parameters.items()}, required["with"]
            ),
            "in": _closed(
                {n: _key("to read from", a.type) for n, a in self.inputs.items()}, required["in"]
            ),
            "out": _closed(
                {name: _key("to write to", kind) for name, kind in self.outputs.items()}
            ),
            "next": _closed({**{outcome: {} for outcome in self.outcomes}, **_ALWAYS}),
            "autonomy": _closed({outcome: {"enum": [*AUTONOMY]} for outcome in self.outcomes}),
            "retry": {"properties": {"on": on}},
        }
        needed = [key for key, names in required.items() if names]
        return {**_narrowing(properties), "required": needed}


def _class(of: Interface) -> _Target:
    form = "watch" if of.monitor else "do"
    outputs = {key: kind for named in of.outputs.values() for key, kind in named.items()}
    return _Target(form, of.name, of.about, of.outcomes, of.parameters, of.inputs, outputs)


def _chart(chart: Chart, types: Mapping[str, Type]) -> _Target:
    parameters = {
        name: Argument(_optional(types.get(p.type, ANY), p), *([] if p.required else [p.default]))
        for name, p in chart.parameters.items()
    }
    inputs = {name: Argument(types.get(key.type, ANY)) for name, key in chart.inputs.items()}
    outputs = {
        key: types.get(kind, ANY) for named in chart.outputs.values() for key, kind in named.items()
    }
    about = chart.about or f"The chart {chart.name}."
    return _Target("use", chart.name, about, chart.outcomes, parameters, inputs, outputs)


def _optional(kind: Type, parameter: Parameter) -> Type:
    nothing = not parameter.required and parameter.default is None
    return replace(kind, optional=True) if nothing else kind


def _key(way: str, kind: Type) -> Schema:
    return said(f"The data key {way}, a {kind}.")


def _parameter(argument: Argument) -> Schema:
    default = "" if argument.required else f" Default: {argument.default}."
    return {**said(f"A {written(argument.type)}.{default}"), **value_schema(argument.type)}


def _required(arguments: Mapping[str, Argument]) -> list[str]:
    return sorted(name for name, argument in arguments.items() if argument.required)


def _closed(properties: Mapping[str, Schema], required: Iterable[str] = ()) -> Schema:
    return {
        "properties": {name: properties[name] for name in sorted(properties)},
        "required": list(required),
        "additionalProperties": False,
    }


def _node(targets: list[_Target]) -> Schema:
    """The properties of every node, regardless of what it names."""
    properties = _properties(NODE)
    for form in ("do", "watch", "use"):
        named = [target for target in targets if target.form == form]
        properties[form] |= {
            "enum": [target.name for target in named],
            "enumDescriptions": [target.about.split("\n\n")[0] for target in named],
        }
    return {
        "type": "object",
        "defaultSnippets": NODE_SNIPPETS,
        "properties": properties,
        "additionalProperties": False,
        "allOf": [*_forms(FORMS, NODE, "do"), _ANY, _TIMEOUT],
    }


def _properties(keys: Keys) -> dict[str, Schema]:
    found = {name: key_schema(keys[name]) for name in sorted(keys)}
    found["states"] |= _inside("states")
    found["all"] |= _inside("when")
    return found


def _forms(forms: Iterable[str], known: Keys, usual: str) -> Iterable[Schema]:
    """Require exactly one of `forms`, and allow only the keys that belong to it."""
    for form in forms:
        foreign = sorted(known.keys() & NODE.keys() - KEYS_OF[form] - {"about"})
        closed = {"properties": dict.fromkeys(foreign, False)}
        yield {"if": {"required": [form]}, "then": closed}
    none = {"properties": dict.fromkeys(forms, False)}
    yield {"if": none, "then": {"required": [usual]}}


def _inside(context: str) -> Schema:
    return {"additionalProperties": _ref_to(f"node-in-{context}")}


def _all(*names: str) -> Schema:
    return {"allOf": [_ref_to(name) for name in names]}


def _ref_to(name: str) -> Schema:
    return {"$ref": f"#/definitions/{name}"}


def _narrowing(properties: Mapping[str, Schema]) -> Schema:
    """Properties that are described elsewhere too, and must not be offered twice."""
    return {"properties": {key: {**s, "doNotSuggest": True} for key, s in properties.items()}}


def _targets(pattern: str, wanted: str) -> Schema:
    target = {"type": "string", "pattern": pattern, "patternErrorMessage": f"Wanted: {wanted}."}
    return {"doNotSuggest": True, "additionalProperties": target}


_TO_OUT = _targets(rf"^\.{NAME}$", "`.x`, which ends the container with x")
_TO_SIBLING_OR_OUT = _targets(
    rf"^\.?{NAME}$", "a node beside this one, or `.x`, which ends the container with x"
)
_ALWAYS: dict[str, Schema] = {
    "error": said("Where to go when something failed that should not; handed on if not given."),
    "timeout": {"doNotSuggest": True},
}
_ANY: Schema = {
    "if": {"required": ["when"], "properties": {"when": {"minItems": 1}}},
    "then": _narrowing({"any": _inside("when")}),
    "else": _narrowing({"any": _inside("any")}),
}
_NO_CONSENT: Schema = {  # guards never wait for it
    "if": {
        "required": ["watch", "autonomy"],
        "properties": {"autonomy": {"minProperties": 1}},
    },
    "then": {"properties": {"autonomy": False}},
}
_OVER = said("Where to go when the time given by `timeout` is over.")
_TIMEOUT: Schema = {
    "if": {"required": ["timeout"]},
    "then": _narrowing({"next": {"properties": {"timeout": _OVER}}}),
    "else": _narrowing({"next": {"properties": {"timeout": False}}}),
}
_TIMED_OUT: Schema = {
    "if": {"required": ["timeout"]},
    "then": {"required": ["next"], "properties": {"next": {"required": ["timeout"]}}},
}
