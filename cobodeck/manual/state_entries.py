"""The page of states: what each does, how it ends, and what it takes, reads and commands."""

from __future__ import annotations

from cobodeck.manual.example_nodes import example_node, node_text
from cobodeck.manual.page import (
    ManualPage,
    PageBlock,
    PageEntry,
    PageTable,
    YamlCode,
    sentence,
    table_of,
)
from cobodeck.manual.wording import arguments_table, type_text
from cobodeck.project import Catalogue
from engine import Interface

_ABOUT = (
    "What a chart can name with `do` (actions, which may command the robot) and `watch` "
    "(monitors, which only watch). Numbers may have units (`20 cm`, `30 deg`); bare ones are in SI "
    "units, angles in rad. Parameters are given under `with`, inputs under `in`: a data key or a "
    "value. Every state can also end with `error` and, if the node has a `timeout`, with "
    "`timeout`.",
)


def state_page(known: Catalogue) -> ManualPage:
    """The page of all states that charts can name."""
    entries = tuple(_entry(of, known) for _, of in sorted(known.interfaces.items()))
    return ManualPage("states", "States", _ABOUT, entries)


def _entry(of: Interface, known: Catalogue) -> PageEntry:
    blocks: list[PageBlock] = [*of.about.split("\n\n"), YamlCode(node_text(example_node(of)))]
    blocks += _outcomes(of)
    blocks += arguments_table("parameter", of.parameters)
    blocks += arguments_table("input", of.inputs)
    blocks += _outputs(of)
    blocks += _surroundings(of, known)
    module = known.module_of(of.name)
    is_own = module in {own.__name__ for own in known.modules}
    return PageEntry(of.name, tuple(blocks), is_own)


def _outcomes(of: Interface) -> tuple[PageTable | str, ...]:
    if not of.outcomes:
        return ("It has no outcomes: it goes on until something else ends it.",)
    rows = [(name, sentence(of.meanings.get(name, ""))) for name in of.outcomes]
    return table_of(("outcome", "meaning"), rows)


def _outputs(of: Interface) -> tuple[PageTable, ...]:
    """Each output once, with the outcomes that give it."""
    given_by: dict[str, list[str]] = {}
    types = {}
    for outcome, named in of.outputs.items():
        for name, kind in named.items():
            given_by.setdefault(name, []).append(outcome)
            types[name] = kind
    rows = [
        (
            name,
            type_text(types[name]),
            ", ".join(outcomes),
            sentence(of.output_meanings.get(name, "")),
        )
        for name, outcomes in given_by.items()
    ]
    return table_of(("output", "type", "with", "meaning"), rows)


def _surroundings(of: Interface, known: Catalogue) -> list[PageBlock]:
    kind = "Monitor" if of.monitor else "Action"
    policy = getattr(known.classes[of.name], "policy", None)
    told = [f"{kind} of `{known.module_of(of.name)}`."]
    if of.commands:
        told.append(f"Commands {_named(of.commands)}.")
    if policy is not None:
        told.append(f"For profiles of the policy `{policy}`.")
    if of.reads:
        told.append(f"Reads {', '.join(_read(of, name, age) for name, age in of.reads.items())}.")
    return [" ".join(told)]


def _named(names: tuple[str, ...]) -> str:
    return " and ".join(f"`{name}`" for name in names)


def _read(of: Interface, name: str, age: float | str | None) -> str:
    """A signal with the greatest age that is accepted, and whether it may be missing."""
    notes = []
    if isinstance(age, str):
        notes.append(f"up to `{age}` old")
    elif age is not None:
        notes.append(f"up to {age:g} s old")
    if name in of.optional:
        notes.append("if there is one")
    return f"`{name}`" + (f" ({', '.join(notes)})" if notes else "")
