"""The Python module of a project's states: translated ones, and stubs of those nobody has."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from cobodeck.flexbe.converting import StateClass, code_of
from engine import Action, Argument, Type, python_name

_HEAD = '''\
"""{about}"""

from __future__ import annotations

from typing import Any

from engine import {names}
'''
_NOT_WRITTEN = """

def _not_written(state: Action) -> Any:
    name = type(state).__name__
    raise NotImplementedError(f"{name} is a stub; write its `run`, or script it in a test")
"""
_STUB_BODY = ("yield", "return _not_written(self)")


@dataclass(frozen=True, slots=True)
class _FlexbeState:
    """A state that everybody has: the parameters and keys it needs, and its `run`."""

    parameters: frozenset[str]
    inputs: frozenset[str]
    body: tuple[str, ...]
    outputs: tuple[str, ...] = ()


_FLEXBE_STATES = {
    "WaitState": _FlexbeState(
        frozenset(("wait_time",)),
        frozenset(),
        (
            "end = ctx.after(float(self.wait_time))",
            "while ctx.now < end:",
            "    yield Until(end)",
            'return "done"',
        ),
    ),
    "LogState": _FlexbeState(
        frozenset(("text",)),
        frozenset(),
        ("ctx.note(str(self.text))", "yield", 'return "done"'),
    ),
    "LogKeyState": _FlexbeState(
        frozenset(("text",)),
        frozenset(("data",)),
        ("ctx.note(str(self.text).format(data))", "yield", 'return "done"'),
    ),
    "SetKey": _FlexbeState(
        frozenset(("Value",)),
        frozenset(),
        ("yield", 'return "done", {"Key": self.Value}'),
        ("Key",),
    ),
}
_PYTHON = {"number": "float", "boolean": "bool", "text": "str"}
ABOUT_STUBS = "States that still have to be written: each is a stub that ends with an error."
ABOUT_READY = "States that FlexBE brings along, and code of the behaviours, translated."


def is_written(cls: StateClass) -> bool:
    """Whether the module of ready states has the class: a translation, or a state of FlexBE."""
    if cls.ready is not None:
        return True
    known, face = _FLEXBE_STATES.get(cls.flexbe), cls.interface()
    return (
        known is not None
        and not cls.code
        and known.parameters <= face.parameters.keys()
        and face.inputs.keys() == known.inputs
        and (face.outcomes, tuple(cls.outputs())) == (("done",), known.outputs)
    )


def stub_module(classes: Iterable[StateClass]) -> str:
    """The text of the module of stubs."""
    head = _HEAD.format(about=ABOUT_STUBS, names="Action, Context, Run") + _NOT_WRITTEN
    return "\n\n".join([head, *("\n".join(_class(cls, _STUB_BODY)) + "\n" for cls in classes)])


def ready_module(classes: Iterable[StateClass]) -> str:
    """The text of the module of translated states."""
    texts = []
    for cls in classes:
        if cls.ready is not None:
            texts.append(code_of(cls.name, cls.ready, _docstring(cls)) + "\n")
        else:
            body = _FLEXBE_STATES[cls.flexbe].body
            texts.append("\n".join(_class(cls, body)) + "\n")
    all_names = ("Action", "Context", "Outcome", "Run", "Until", "freeze")
    names = [name for name in all_names if re.search(rf"\b{name}\b", "".join(texts))]
    return "\n\n".join([_HEAD.format(about=ABOUT_READY, names=", ".join(names)), *texts])


def _class(cls: StateClass, body: Iterable[str]) -> Iterator[str]:
    yield f"class {cls.name}(Action):"
    yield textwrap.indent(_docstring(cls), "    ")
    yield ""
    interface = cls.interface()
    outcomes = "".join(f"{json.dumps(outcome)}, " for outcome in interface.outcomes)
    yield f"    outcomes = ({outcomes.rstrip()})" if outcomes else "    outcomes = ()"
    if cls.outputs():
        keys = ", ".join(f"{json.dumps(key)}: Any" for key in cls.outputs())
        yield f"    outputs = {{outcome: {{{keys}}} for outcome in outcomes}}"
    if interface.parameters:
        given = ", ".join(_argument(name, arg) for name, arg in interface.parameters.items())
        yield ""
        yield f"    def __init__(self, *, {given}) -> None:"
        for name in map(python_name, interface.parameters):
            own = f"{name}_" if hasattr(Action, name) else name
            yield f"        self.{own} = {name}"
    inputs = "".join(f", {python_name(key)}: Any = None" for key in cls.inputs())
    yield ""
    yield f"    def run(self, ctx: Context{inputs}) -> Run:"
    yield from (f"        {line}" for line in body)


def _argument(name: str, argument: Argument) -> str:
    kind = _annotation(argument.type)
    if argument.required:
        return f"{python_name(name)}: {kind}"
    return f"{python_name(name)}: {kind if kind == 'Any' else f'{kind} | None'} = None"


def _annotation(kind: Type) -> str:
    return "tuple[str, ...]" if kind.name == "list" else _PYTHON.get(kind.name, "Any")


def _docstring(cls: StateClass) -> str:
    """What the class was, where it is used first, and the code that it replaces."""
    lines = [f"{cls.flexbe} of FlexBE."]
    if not is_written(cls):
        lines = [f"In place of {cls.flexbe} of FlexBE; still to be written."]
    about: Any = cls.known.about.about if cls.known is not None else ""
    lines += ["", *str(about).splitlines()] if about else []
    lines += ["", f"First used by {cls.state}."] if cls.state else []
    for code in cls.code:
        what = "Translated from" if cls.ready is not None else "It is to do what this did"
        lines += ["", f"{what}: {code}"]
    text = "\n".join(lines).replace("\\", "\\\\").replace('"', "'")
    return f'"""{text}\n"""' if len(lines) > 1 else f'"""{text}"""'
