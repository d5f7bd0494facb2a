"""The docstring of a FlexBE state: free text, then one marked line for each thing it names.

-- name   type   text      a parameter
># name   type   text      an input
#> name   type   text      an output
<= name          text      an outcome
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field

from cobodeck.flexbe_states.chart_names import key_name, outcome_name

_MARKS = {
    "--": "parameters",
    ">#": "inputs",
    "#<": "inputs",  # so some write them
    "#>": "outputs",
    "<#": "outputs",
    "<=": "outcomes",
}
_CHART_NAMES = {"inputs": key_name, "outputs": key_name, "outcomes": outcome_name}
_KINDS = tuple(dict.fromkeys(_MARKS.values()))


@dataclass(frozen=True, slots=True)
class Described:
    """What a docstring says of a name; `type` is as it was written, and empty for outcomes."""

    type: str
    text: str


@dataclass(frozen=True, slots=True)
class ReadDocstring:
    """A docstring in parts; `about` is the text before the first marked line."""

    about: str = ""
    parameters: Mapping[str, Described] = field(default_factory=dict)
    inputs: Mapping[str, Described] = field(default_factory=dict)
    outputs: Mapping[str, Described] = field(default_factory=dict)
    outcomes: Mapping[str, Described] = field(default_factory=dict)

    @property
    def as_text(self) -> str:
        """The text, then what each name of the chart means, for lists and editors."""
        lines = [self.about] if self.about else []
        for kind in _KINDS:
            named: Mapping[str, Described] = getattr(self, kind)
            told = [
                f"{_CHART_NAMES.get(kind, str)(name)}: {said.text}"
                for name, said in named.items()
                if said.text
            ]
            if told:
                lines += ["", f"{kind.capitalize()}:", *(f"    {line}" for line in told)]
        return "\n".join(lines).strip()


def read_docstring(text: str | None) -> ReadDocstring:
    """The parts of a docstring; a line without a mark goes on with what stands above it."""
    about: list[str] = []
    found: dict[str, dict[str, Described]] = {kind: {} for kind in _KINDS}
    last: tuple[str, str] | None = None
    for raw in inspect.cleandoc((text or "").expandtabs(4)).splitlines():
        line = raw.strip()
        kind = _MARKS.get(line[:2])
        if kind is not None and (words := line[2:].split()):
            name = words[0].rstrip(":")
            found[kind][name] = _described(words[1:], has_type=kind != "outcomes")
            last = (kind, name)
        elif last is None:
            about.append(line)
        elif line:
            held = found[last[0]][last[1]]
            found[last[0]][last[1]] = Described(held.type, f"{held.text} {line}".strip())
    return ReadDocstring("\n".join(about).strip(), **found)


def _described(words: list[str], *, has_type: bool) -> Described:
    if not has_type:
        return Described("", " ".join(words))
    return Described(words[0] if words else "", " ".join(words[1:]))
