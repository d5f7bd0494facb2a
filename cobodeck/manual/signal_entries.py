"""The page of signals: what each tells, how it comes, who gives it, and who reads it."""

from __future__ import annotations

import dataclasses
import inspect
import typing
from collections.abc import Iterator, Mapping
from typing import Any

from cobodeck.manual.page import ManualPage, PageBlock, PageEntry, PageTable, sentence, table_of
from cobodeck.manual.wording import type_text
from cobodeck.project import Catalogue
from engine.files import si_unit
from engine.signals import Derived, Estimated, Measured, Signal, types_of
from hw.model import RobotModel

_ABOUT = (
    "Named values that states read and that `Above`, `WaitFor` and the like watch. A *level* has "
    "a value at any time, or none; of an *event* each reader gets every sample once. A *measured* "
    "signal is given by a part of the robot or of its surroundings, a *derived* one is computed "
    "of others when it is read, and an *estimated* one by a filter that gets every sample.",
    "Each value has a stamp, the time at which it was measured. A state says for each signal that "
    "it reads how old the value may be; an older one counts as none. A derived signal has the "
    "stamp of the oldest of those that it is computed of. Constant signals do not age. "
    "Only what a run reads is computed.",
)


def signal_page(known: Catalogue, signals: Mapping[str, Signal], robot: RobotModel) -> ManualPage:
    """The page of all signals; `robot`: the one whose rates are told."""
    types = types_of(signals)
    rates = dict(_rates(robot))
    own = {signal.name for signal in known.own_signals}
    entries = [
        PageEntry(
            name,
            (*_blocks(signal, type_text(types[name]), rates, robot), *_readers(known, name)),
            name in own,
        )
        for name, signal in signals.items()
    ]
    return ManualPage("signals", "Signals", _ABOUT, tuple(entries))


def _blocks(
    signal: Signal, kind: str, rates: Mapping[str, str], robot: RobotModel
) -> Iterator[PageBlock]:
    if signal.about:
        yield sentence(signal.about)
    how = "event" if isinstance(signal, Measured) and signal.event else "level"
    yield f"{type(signal).__name__}, {how}; value: {kind}."
    if isinstance(signal, Measured):
        yield from _measured(signal, rates, robot)
    else:
        yield from _computed(signal)
    yield from _fields(signal.type)


def _measured(signal: Measured, rates: Mapping[str, str], robot: RobotModel) -> Iterator[str]:
    giver = f"the part `{signal.part}`" if signal.part else ""
    if signal.constant:
        giver = "the run"
    comes = ", ".join(filter(None, (giver, signal.comes)))
    if signal.name in rates:
        comes += f": {rates[signal.name]} with `{robot.name}`"
    ages = " It does not age." if signal.constant else ""
    if comes:
        yield (f"Given by {comes}." if giver else sentence(f"it comes {signal.comes}")) + ages


def _computed(signal: Derived | Estimated) -> Iterator[str]:
    of = ", ".join(f"`{name}`" for name in signal.of)
    verb = "Computed" if isinstance(signal, Derived) else "Estimated"
    needs = ""
    if isinstance(signal, Estimated) and signal.needed != signal.of:
        named = " and ".join(f"`{name}`" for name in signal.needed)
        needs = f"; it needs {named}" if named else "; it needs none of them"
    yield f"{verb} of {of}{needs}."


def _fields(kind: Any) -> Iterator[PageBlock]:
    """The fields of a value type, and what its docstring says of them, with their units."""
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        return
    fields = [field for field in dataclasses.fields(kind) if not field.name.startswith("_")]
    if len(fields) > _MOST:  # of the whole environment nobody writes a field
        return
    hints = _hints(kind)
    rows = [(field.name, _python_text(hints.get(field.name, field.type))) for field in fields]
    about = inspect.cleandoc(kind.__doc__ or "")
    if about and not about.startswith(f"{kind.__name__}("):
        yield f"`{kind.__name__}`: {about.partition(chr(10) * 2)[0]}"
        rest = about.partition("\n\n")[2]
        if rest:
            yield rest
    yield from table_of(("field", "type"), rows)


_MOST = 12


def _hints(kind: type) -> dict[str, Any]:
    try:
        return typing.get_type_hints(kind)
    except NameError:  # names that only type checkers know
        return {}


def _python_text(hint: Any) -> str:
    """A type of Python as charts would name it."""
    if isinstance(hint, str):
        return hint
    names = {float: "number", int: "integer", str: "text", bool: "boolean", type(None): "none"}
    if hint in names:
        return names[hint]
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin is typing.Literal:
        return f"one of {', '.join(map(str, inner))}"
    if origin is tuple:
        return _tuple_text(inner)
    if inner:
        return " or ".join(map(_python_text, inner))
    return str(getattr(hint, "__name__", hint))


def _tuple_text(inner: tuple[Any, ...]) -> str:
    if inner[-1] is Ellipsis:
        return f"list of {_python_text(inner[0])}"
    if len(set(inner)) == 1:
        return f"list of {len(inner)} {_python_text(inner[0])}s"
    return f"list of {', '.join(map(_python_text, inner))}"


def _rates(robot: RobotModel) -> Iterator[tuple[str, str]]:
    """How often a robot's sensors measure, by signal."""
    sensing = robot.sensing
    told = {
        "base.scan": [lidar.rate for lidar in sensing.lidars.values()],
        "rover.tracker": [tracker.rate for tracker in sensing.trackers.values()],
        "base.odometry": [sensing.odometry.rate] if sensing.odometry else [],
        "base.imu": [sensing.imu.rate] if sensing.imu else [],
    }
    unit = si_unit("frequency")
    for signal, rates in told.items():
        if rates:
            each = " each" if len(rates) > 1 and len(set(rates)) == 1 else ""
            values = ", ".join(f"{rate:g}" for rate in dict.fromkeys(rates))
            yield signal, f"{values} {unit}{each}"


def _readers(known: Catalogue, name: str) -> tuple[PageTable | str, ...]:
    """The states that read it."""
    readers = [f"`{of.name}`" for _, of in sorted(known.interfaces.items()) if name in of.reads]
    return (f"Read by {', '.join(readers)}.",) if readers else ()
