"""Modules of FlexBE states as the catalogue takes them: with states of charts in their place."""

from __future__ import annotations

import inspect
from pathlib import Path
from types import ModuleType
from typing import Any

from cobodeck.flexbe_states.adapted import AdaptedState
from cobodeck.flexbe_states.adapting import NotAState, adapted
from cobodeck.flexbe_states.class_reading import FlexbeClass, read_state_classes
from cobodeck.flexbe_states.imported_names import LARGEST
from cobodeck.flexbe_states.importing import import_flexbe, module_text
from cobodeck.flexbe_states.ros import FlexbeState, TopicTable
from engine import Action, Monitor, StateError, interface
from engine.files import FileError, read_text

_TABLES = ("SIGNALS", "TYPES", "PARTS")


def state_module(name: str, table: TopicTable) -> ModuleType:
    """A module with a state of charts for each FlexBE state of the module of this name.

    What else a catalogue looks for in a module is in it, too. `STRANGERS` says of the FlexBE states
    that cannot be had why not, by name.

    Raises:
        Exception: whatever the module raises when it is imported.
    """
    module = import_flexbe(name)
    made = ModuleType(name, module.__doc__)
    made.__file__ = module.__file__
    kept = {key: value for key, value in vars(module).items() if key in _TABLES or _is_ours(value)}
    strangers: dict[str, str] = {}
    doubts: list[str] = []
    for read in _read(module):
        flexbe = getattr(module, read.name, None)
        if not isinstance(flexbe, type) or not issubclass(flexbe, FlexbeState):
            continue
        if flexbe.__module__ != name or read.name.startswith("_"):
            continue
        try:
            cls = adapted(flexbe, read, module, table)
            interface(cls)  # type: ignore[arg-type]  # classes can be hashed
            kept[read.name] = cls
        except (NotAState, StateError) as error:
            strangers[read.name] = f"{read.file}:{read.line}: {error}"
            if isinstance(error, StateError):
                doubts.append(f"{strangers[read.name]}; it is left out")
    vars(made).update(kept, STRANGERS=strangers, DOUBTS=tuple(doubts))
    return made


def leave_out(cls: type, module: ModuleType, why: str) -> bool:
    """Take a class out of the module that `state_module` has made of it; False: it was not made."""
    if not issubclass(cls, AdaptedState):
        return False
    del vars(module)[cls.__name__]
    vars(module)["STRANGERS"][cls.__name__] = why
    vars(module)["DOUBTS"] = (*module.DOUBTS, f"{why}; it is left out")
    return True


def broken_module(name: str, why: str) -> ModuleType:
    """What stands for a module of FlexBE states that cannot be imported: all are strangers."""
    made = ModuleType(name)
    file = found[1] if (found := module_text(name)) else ""
    made.__file__ = file
    try:
        reads = read_state_classes(found[0], file) if found else ()
    except FileError:
        reads = ()
    strangers = {read.name: f"it cannot be imported: {why}" for read in reads}
    vars(made).update(STRANGERS=strangers, DOUBTS=(f"{why}; its states are left out",))
    return made


def _is_ours(value: Any) -> bool:
    return isinstance(value, type) and issubclass(value, Action | Monitor)


def _read(module: ModuleType) -> tuple[FlexbeClass, ...]:
    """The state classes in the text of a module, after those that they derive from elsewhere."""
    bases = {
        inspect.getmodule(base)
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, FlexbeState)
        for base in value.__mro__
        if base.__module__ not in (module.__name__, FlexbeState.__module__, "builtins")
    }
    others = [read for base in bases if base is not None for read in _read(base)]
    file = str(module.__file__)
    return read_state_classes(read_text(Path(file), LARGEST), file, others)
