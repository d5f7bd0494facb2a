"""What the schema says of nodes by the state class or chart that they name."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from engine.chart import AUTONOMY, Chart
from engine.files.declared import Schema, said, with_article
from engine.interfaces import Argument, Interface
from engine.schema.value_schemas import READ, shown, value_schema, written
from engine.types import ANY, Type

_ALWAYS: dict[str, Schema] = {
    "error": said("Where to go when something failed that should not; handed on if not given."),
    "timeout": {"doNotSuggest": True},
}


@dataclass(frozen=True, slots=True)
class Target:
    """The interface of a state class or chart, as nodes that name it see it.

    `outcomes` that a parameter names begin with `$`. `bindable`: the parameters that may be read
    from data, too. The meanings are of outcomes and outputs, by name.
    """

    form: str
    name: str
    about: str
    outcomes: tuple[str, ...]
    parameters: Mapping[str, Argument]
    inputs: Mapping[str, Argument]
    outputs: Mapping[str, Type]
    bindable: Collection[str] = field(default=())
    meanings: Mapping[str, str] = field(default_factory=dict)
    output_meanings: Mapping[str, str] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """The name of its definition in the schema."""
        return f"{self.form}.{self.name}"

    @property
    def sure(self) -> list[str]:
        """The outcomes that do not depend on a parameter."""
        return sorted(outcome for outcome in self.outcomes if outcome[0] != "$")

    def when_named(self, then: Schema) -> Schema:
        """A schema that applies `then` to the nodes that name this."""
        named = {"properties": {self.form: {"const": self.name}}, "required": [self.form]}
        return {"if": named, "then": then}

    def mapped(self) -> Schema:
        """Requires every outcome in `next`."""
        return self.when_named(_requiring("next", self.sure))

    def narrowed(self) -> Schema:
        """The properties of a node that names this; it does not require any outcome in `next`."""
        inputs = {name: _input(argument) for name, argument in self.inputs.items()}
        properties = {
            self.form: {"title": self.name, **said(self.about)},
            "with": _closed({n: _parameter(a) for n, a in self.parameters.items()}),
            "in": _closed({**self._bindings(), **inputs}),
            "out": _closed(
                {
                    n: _written_to(t, self.output_meanings.get(n, ""))
                    for n, t in self.outputs.items()
                }
            ),
            **self._endings(),
        }
        required = list(self._required())
        return {**narrowing(properties), **({"allOf": required} if required else {})}

    def _required(self) -> Iterator[Schema]:
        """What has to be given; apart from the properties, so that editors offer these once."""
        needed = _required(self.parameters)
        given = [name for name in needed if name not in self.bindable]
        either = [name for name in needed if name in self.bindable]
        if given:
            yield _requiring("with", given)
        if either:
            yield _given_or_read(either)
        if fed := _required(self.inputs):
            yield _requiring("in", fed)

    def _bindings(self) -> dict[str, Schema]:
        """Parameters under `in`; editors offer inputs only."""
        return {
            name: {"$ref": "#/definitions/read", "doNotSuggest": True} for name in self.bindable
        }

    def _endings(self) -> dict[str, Schema]:
        """Where outcomes are named; those that a parameter names may have any name."""
        sure = self.sure
        told = {outcome: _meaning(self.meanings.get(outcome, "")).rstrip() for outcome in sure}
        ways = {
            **{outcome: said(text) if text else {} for outcome, text in told.items()},
            **_ALWAYS,
        }
        if len(sure) < len(self.outcomes):
            return {"next": {"properties": ways}}
        endings = [*sure, "error"]
        on = {"if": {"type": "array"}, "else": {"enum": endings}, "items": {"enum": endings}}
        return {
            "next": _closed(ways),
            "autonomy": _closed({outcome: {"enum": [*AUTONOMY]} for outcome in sure}),
            "retry": {"properties": {"on": on}},
        }


def of_class(of: Interface) -> Target:
    """A state class; what its parameters name has to be known before the run."""
    form = "watch" if of.monitor else "do"
    outputs = {key: kind for named in of.outputs.values() for key, kind in named.items()}
    bindable = sorted(of.parameters.keys() - of.named_by - of.inputs.keys())
    target = Target(form, of.name, of.about, of.outcomes, of.parameters, of.inputs, outputs)
    return replace(
        target, bindable=bindable, meanings=of.meanings, output_meanings=of.output_meanings
    )


def of_chart(chart: Chart, types: Mapping[str, Type]) -> Target:
    """A chart; `types` by name."""
    parameters = {
        name: _argument(p.type, types, p.about, *([] if p.required else [p.default]))
        for name, p in chart.parameters.items()
    }
    inputs = {
        name: _argument(
            k.type, types, k.about, *([k.initial] if k.has_initial or k.optional else [])
        )
        for name, k in chart.inputs.items()
    }
    outputs = {
        key: types.get(kind, ANY) for named in chart.outputs.values() for key, kind in named.items()
    }
    about = chart.about or f"The chart {chart.name}."
    return Target("use", chart.name, about, chart.outcomes, parameters, inputs, outputs)


def _argument(type_name: str, types: Mapping[str, Type], about: str, *default: Any) -> Argument:
    kind = types.get(type_name, ANY)
    kind = replace(kind, optional=True) if default == (None,) else kind
    return replace(Argument(kind, *default), about=about)


def _input(argument: Argument) -> Schema:
    kind = argument.type
    held = with_article(written(kind) if kind.name in ("any", "choice") else kind)
    literal = f": {written(kind)}" if kind.python is not None else ""
    text = f"A data key that holds {held}, or the value itself{literal}.{_default(argument)}"
    return {**said(_meaning(argument.about) + text), **value_schema(kind, READ)}


def _written_to(kind: Type, about: str) -> Schema:
    return said(f"{_meaning(about)}The data key to write to, {with_article(written(kind))}.")


def _parameter(argument: Argument) -> Schema:
    text = with_article(written(argument.type))
    about = f"{text[0].upper()}{text[1:]}.{_default(argument)}"
    return {**said(_meaning(argument.about) + about), **value_schema(argument.type)}


def _meaning(text: str) -> str:
    """A meaning as sentences of their own, with a space after them."""
    return f"{text[0].upper()}{text[1:].removesuffix('.')}. " if text else ""


def _default(argument: Argument) -> str:
    return "" if argument.required else f" Default: {shown(argument.default, argument.type)}."


def _requiring(section: str, names: list[str]) -> Schema:
    return {"required": [section], "properties": {section: {"required": names}}}


def _given_or_read(names: list[str]) -> Schema:
    """Require parameters under `with`, but for those that `in` reads from data."""
    unless = [
        {"if": _requiring("in", [name]), "else": _requiring("with", [name])} for name in names
    ]
    return {
        "if": {"required": ["in"]},
        "then": {"allOf": unless},
        "else": _requiring("with", names),
    }


def _required(arguments: Mapping[str, Argument]) -> list[str]:
    return sorted(name for name, argument in arguments.items() if argument.required)


def _closed(properties: Mapping[str, Schema]) -> Schema:
    ordered = {name: properties[name] for name in sorted(properties)}
    return {"properties": ordered, "additionalProperties": False}


def narrowing(properties: Mapping[str, Schema]) -> Schema:
    """Properties that are described elsewhere too, and must not be offered twice."""
    return {"properties": {key: {**s, "doNotSuggest": True} for key, s in properties.items()}}
