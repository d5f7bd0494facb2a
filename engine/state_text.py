"""What the docstring of a state class says: of the state, and of each outcome, argument and output.

The sections are those of Google's style: `Args` for parameters and inputs alike, and, written the
same way, `Outcomes` and `Outputs`, each with entries like `opened: somebody has opened the door.`
What a class does not say is said by the classes that it is derived from.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

_SECTION = re.compile(r"^(Args|Outcomes|Outputs):$")
_ENTRY = re.compile(r"^    (\$?\w+): *(.*)$")


@dataclass(frozen=True, slots=True)
class StateText:
    """A docstring without its sections, and the meanings in these, by name.

    The outcomes that a parameter names are told under its name with a `$`: `$cases`.
    """

    about: str
    arguments: Mapping[str, str] = field(default_factory=dict)
    outcomes: Mapping[str, str] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)


def text_of_class(cls: type) -> StateText:
    """What the docstrings of a class and of its bases say."""
    found: dict[str, dict[str, str]] = {"Args": {}, "Outcomes": {}, "Outputs": {}}
    about = ""
    for of in reversed(cls.__mro__[:-1]):
        about, sections = docstring_parts(vars(of).get("__doc__") or "")
        for section, meanings in sections.items():
            found[section] |= meanings
    return StateText(about, found["Args"], found["Outcomes"], found["Outputs"])


def docstring_parts(docstring: str) -> tuple[str, dict[str, dict[str, str]]]:
    """The text before the sections and after them, and the entries of each section."""
    prose: list[str] = []
    sections: dict[str, dict[str, str]] = {}
    section, name = "", ""
    for line in inspect.cleandoc(docstring).splitlines():
        if heading := _SECTION.match(line):
            section, name = heading[1], ""
            sections.setdefault(section, {})
        elif section and (entry := _ENTRY.match(line)):
            name = entry[1]
            sections[section][name] = entry[2]
        elif section and name and line.startswith("     "):
            sections[section][name] += f" {line.strip()}"
        elif line or not section:
            section = ""
            prose.append(line)
    return "\n".join(prose).strip(), sections
