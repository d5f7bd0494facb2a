"""What names in the values of a chart stand for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from engine.chart import Reference
from engine.files import did_you_mean
from engine.files.declared import Mismatch
from engine.literals import Constant, OpenName, Resolver, constant_of, convert
from engine.types import ANY, Type, fits


@dataclass(frozen=True)
class NamedValues:
    """What names in values stand for: `$profile.x` in `constants`, `{place: x}` in `named`.

    `constants` go by their whole names; `named` are values by kind and name. Where `named` is None,
    names stay open (`engine.literals.OpenName`). `signals`: the types of signals.
    """

    constants: Mapping[str, Constant] = field(default_factory=dict)
    signals: Mapping[str, Type] = field(default_factory=dict)
    named: Mapping[str, Mapping[str, Any]] | None = None


@dataclass(frozen=True)
class ParameterValues(Resolver):
    """The values of a chart's parameters, `known` by name, and of names of its surroundings."""

    known: Mapping[str, Any]
    around: NamedValues

    def reference(self, reference: Reference, wanted: Type) -> Any:
        """The value of a parameter, or of a constant."""
        if reference.is_constant:
            constants = self.around.constants
            if reference.name not in constants:
                near = did_you_mean(reference.name, constants)
                raise Mismatch(f"there is no value ${reference.name}; {near}")
            return constant_of(reference.name, constants, wanted, self)
        if reference.name not in self.known:
            return super().reference(reference, wanted)
        return convert(self.known[reference.name], wanted, self)

    def signal(self, name: str, wanted: Type) -> str:
        """The name of a signal; where signals are known, it is one of the wanted type."""
        held = self.around.signals.get(name) if self.around.signals else ANY
        if held is None:
            near = did_you_mean(name, self.around.signals)
            raise Mismatch(f"there is no signal {name!r}; {near}")
        if wanted.item is not None and not fits(held, replace(wanted.item, optional=True)):
            raise Mismatch(f"{name} is a signal of {held}; wanted: a {wanted}")
        return name

    def named(self, kind: str, name: str) -> Any:
        """The value of a name."""
        if self.around.named is None:
            return OpenName(kind, name)
        known = self.around.named.get(kind, {})
        if name not in known:
            near = f"; {did_you_mean(name, known)}" if known else ""
            raise Mismatch(f"there is no {kind} {name!r} here{near}")
        return known[name]
