"""The messages of a record other than samples: calls, commands, errors, cycles, truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

from cobodeck.project import reached
from cobodeck.record.format import value_codec as values
from cobodeck.record.format.class_names import Unknown, class_of, name_of
from cobodeck.record.format.record_header import label
from cobodeck.record.format.schemas import time_of
from cobodeck.record.format.value_codec import text
from engine.chart import Chart, load_text
from engine.files import quoted
from engine.machine import Machine
from engine.operator import Replace, commands
from engine.run import Command, Raised, TraceRecord
from hw import Truth, Twist2, is_finite
from hw.safety import SafetyRecord

Replaced = Callable[[Mapping[str, Any]], Machine]
ERROR_LEVEL = 4
"""The level of errors in foxglove.Log."""
DETAILS = {"outcome": 1, "exit": 1, "move": 3, "data": 2, "error": 1, "note": 1}
"""Least number of details of a trace record by kind; see `engine.run.trace.TraceRecord`."""


def call_text(part: str, what: str, args: str, answer: object, raised: object) -> str:
    """A call of a part as JSON; `args` is JSON already."""
    told = f'{{"part":{quoted(part)},"what":{quoted(what)},"args":{args}'
    if answer is not None:
        told += f',"answer":{text(answer)}'
    if raised is not None:
        told += f',"raised":{raised_text(raised)}'
    return told + "}"


def arguments_text(args: tuple[Any, ...], named: Mapping[str, Any]) -> str:
    """The arguments of a call as JSON."""
    return text((*args, dict(named)) if named else args)


def raised_text(error: Any) -> str:
    """An exception as JSON: its class and its arguments."""
    return f'{{"class":{quoted(name_of(type(error)))},"args":{text(error.args)}}}'


def raised_again(found: Mapping[str, Any]) -> Exception:
    """The recorded exception; if its class is gone, one of a new class of the same name."""
    try:
        args = values.value(found["args"])
        kind = class_of(found["class"])
        if not issubclass(kind, Exception):
            raise Unknown(found["class"])
        make: Any = kind.__new__  # its __init__ may want other arguments
        made: Exception = make(kind, *args)
        made.args = args
    except (Unknown, TypeError):
        name = str(found["class"]).rpartition(".")[2]
        return _made_up(name)(*map(str, found["args"]))
    return made


def _made_up(name: str) -> type[Exception]:
    return type(name, (Exception,), {})


def failure_text(part: str, error: BaseException) -> str:
    """An exception that a part raised outside of any call, as JSON."""
    return f'{{"part":{quoted(part)},"raised":{raised_text(error)}}}'


def log_text(error: Raised) -> str:
    """An error as foxglove.Log."""
    e = error
    told = f'"timestamp":{time_of(e.time)},"level":{ERROR_LEVEL},"message":{quoted(str(e))}'
    return f'{{{told},"name":{quoted(e.path)},"file":{quoted(e.file)},"line":{e.line}}}'


def trace_line(found: Mapping[str, Any]) -> list[Any]:
    """A record of the trace: time in ns, kind, subject, details.

    Raises:
        ValueError: the message is no trace record.
    """
    line: list[Any] = found["line"]
    time_ns, kind, subject, *detail = line
    right = type(time_ns) is int and isinstance(kind, str) and isinstance(subject, str)
    if not right or len(detail) < DETAILS.get(kind, 0):
        raise ValueError(f"{line} is no record of a trace")
    return line


def trace_record(found: Mapping[str, Any]) -> TraceRecord:
    """As `trace_line`, with names."""
    time_ns, kind, subject, *detail = trace_line(found)
    return TraceRecord(time_ns, kind, subject, tuple(detail))


def command_text(command: Command) -> str:
    """An operator's command as JSON; a change of the chart has the texts of the new charts.

    `by`, who issued it, stands beside its arguments, if that is known.
    """
    if isinstance(command, Replace):
        arguments = text(replacement(command))
    else:
        named = [f.name for f in fields(command) if f.name != "by"]
        arguments = text({name: getattr(command, name) for name in named})
    by = f',"by":{quoted(command.by)}' if command.by else ""
    return f'{{"command":"{type(command).__name__}","arguments":{arguments}{by}}}'


def replacement(command: Replace) -> dict[str, Any]:
    """A new machine as values: charts, with their parameters' defaults, and what it was given."""
    machine = command.machine
    charts = {}
    for name in sorted(reached({machine.chart.name}, machine.library)):
        chart = machine.library[name]
        charts[name] = (label(Path(chart.file)), chart.source.text, defaults(chart))
    return {
        "chart": machine.chart.name,
        "charts": charts,
        "parameters": dict(machine.given),
        "inputs": machine.inputs,
    }


def defaults(chart: Chart) -> dict[str, Any]:
    """The defaults of a chart's parameters."""
    return {p.name: p.default for p in chart.parameters.values() if not p.required}


def command_again(
    name: str, arguments: Mapping[str, Any], replaced: Replaced, by: str = ""
) -> Command:
    """The recorded command; `replaced` makes the machine for a change of the chart.

    Raises:
        Unknown: there is no such command.
    """
    if name == Replace.__name__:
        return Replace(replaced(arguments), by=by)
    kind = getattr(commands, name, None)
    if not (isinstance(kind, type) and issubclass(kind, Command)):
        raise Unknown(f"no command {name}")
    return kind(**arguments, by=by)


def charts_again(arguments: Mapping[str, Any]) -> dict[str, Chart]:
    """The charts of a change of the chart, by name, with the recorded defaults of parameters."""
    found = {}
    for name, (file, written, given) in arguments["charts"].items():
        chart = load_text(written, file)[name]
        parameters = {
            key: replace(parameter, default=given.get(key), required=key not in given)
            for key, parameter in chart.parameters.items()
        }
        found[name] = replace(chart, parameters=parameters)
    return found


def cycle_text(cycle: SafetyRecord) -> str:
    """A cycle of the safety chain as JSON; `admitted` only if it differs from the command."""
    c, number = cycle, values.number
    admitted = "" if c.admitted is c.command else f'"admitted":{_twist(c.admitted)},'
    return (
        f'{{"stamp":{c.stamp_ns},"command":{_twist(c.command)},{admitted}'
        f'"separation":{text(c.separation)},"needed":{number(c.needed)},'
        f'"allowed":{number(c.allowed)},"user_speed":{text(c.user_speed)},'
        f'"user_age":{text(c.user_age)},"reasons":{text(c.reasons)}}}'
    )


def _twist(twist: Twist2) -> str:
    return f"[{twist.vx!r},{twist.vy!r},{twist.wz!r}]"


def cycle_again(found: Mapping[str, Any]) -> SafetyRecord:
    """The recorded cycle of the safety chain.

    Raises:
        TypeError: the message is no cycle.
    """
    command = Twist2(*found["command"])
    given = {key: values.value(found[key]) for key in _CYCLE}
    admitted = Twist2(*found["admitted"]) if "admitted" in found else command
    given |= {"stamp_ns": found["stamp"], "command": command, "admitted": admitted}
    return SafetyRecord(**_fitting(SafetyRecord, given))


_CYCLE = ("separation", "needed", "allowed", "user_speed", "user_age", "reasons")


class TruthWriter:
    """Writes the ground truth, all fields each time; encodes only those that have changed."""

    def __init__(self) -> None:
        self._held: tuple[object, ...] = (self,) * len(Truth._fields)  # no truth has it
        self._members = [""] * len(Truth._fields)

    def write(self, truth: Truth) -> str:
        """The message as JSON."""
        for n, (held, last) in enumerate(zip(truth, self._held, strict=True)):
            if held is not last:
                self._members[n] = f'"{Truth._fields[n]}":{text(held)}'
        self._held = truth
        return f"{{{','.join(self._members)}}}"


LATER = ("hits", "tracked_since_ns")
"""Fields of a truth that older records do not have."""


def truth_again(found: Mapping[str, Any], before: Truth | None) -> Truth:
    """The recorded truth; fields equal to those of `before` are the same objects.

    Raises:
        TypeError: the message is no truth.
    """
    found = dict.fromkeys(LATER) | dict(found)
    held = _fitting(Truth, {name: values.value(found[name]) for name in Truth._fields})
    if before is not None:
        held = {k: old if old == held[k] else held[k] for k, old in before._asdict().items()}
    return Truth(**held)


def _fitting(kind: type, held: dict[str, Any]) -> dict[str, Any]:
    """The fields of a class, after checking their types.

    Raises:
        TypeError: a field is of a wrong type, or has a number that is NaN or infinite.
    """
    for name, types in _types_of(kind).items():
        found = held[name]
        is_number = float in types and type(found) in (int, float)  # a bound may be infinite
        if not is_number and not (type(found) in types and is_finite(found)):
            raise TypeError(f"{name} of a {kind.__name__} is {found!r}")
    return held


@cache
def _types_of(kind: type) -> dict[str, set[Any]]:
    hints = get_type_hints(kind).items()
    some = ((name, get_args(h) if isinstance(h, UnionType) else (h,)) for name, h in hints)
    return {name: {get_origin(one) or one for one in types} for name, types in some}
