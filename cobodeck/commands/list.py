"""List what there is: states, signals, charts, kinds of files, scenes, users, robots and the like.

A table; on a terminal too narrow for it, one entry after the other. With a name all that is known
of it: of a state, signal, chart or kind of file its entry in the pages of `cobodeck docs`.
"""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cobodeck.setup import PROFILE
from cobodeck.terminal import (
    OK,
    Problem,
    json_options,
    profile,
    show,
    show_json,
    table,
    terminal_width,
)
from engine.draw import value_text
from engine.files import did_you_mean

if TYPE_CHECKING:
    from cobodeck.manual import ManualPage
    from engine import Argument
    from engine.chart import Chart, DataKey, Parameter

LONGEST = 100
"""Columns of the entry of a single thing where there is no terminal."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("kind", choices=tuple(_LISTS), metavar="KIND", help=", ".join(_LISTS))
    parser.add_argument("name", nargs="?", metavar="NAME", help="only what has this name")
    profile(parser, PROFILE)
    json_options(parser)


def run(args: argparse.Namespace) -> int:
    """Print the list."""
    if args.name is not None and args.kind in _PAGES and not args.json:
        show(_told(args))
        return OK
    found = _LISTS[args.kind](args)
    if args.name is not None:
        found = _named(args, found)
    if args.json:
        show_json({args.kind: found})
    elif args.name is not None:
        show("\n".join(_entry(item, terminal_width() or LONGEST) for item in found))
    elif found:
        show(listing(found, terminal_width()))
    return OK


def _named(args: argparse.Namespace, found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The item of this name, which is the first field of each."""
    items = {next(iter(item.values())): item for item in found}
    _require_known(args, items)
    return [items[args.name]]


def _require_known(args: argparse.Namespace, known: Iterable[str]) -> None:
    if args.name in (names := list(known)):
        return
    why = _why_no_state(args) if args.kind == "states" else None
    what = f"no {args.name!r} among the {args.kind}"
    raise Problem(f"{what}; {did_you_mean(args.name, names)}" if why is None else f"{what}: {why}")


def _why_no_state(args: argparse.Namespace) -> str | None:
    """Why something of this name that projects have, or that there was, is no state."""
    from cobodeck.project import catalogue

    return catalogue(own=args.own).strangers.get(args.name)


def _told(args: argparse.Namespace) -> str:
    """The entry of a page."""
    from cobodeck.manual import terminal_text

    entries = {entry.name: entry for entry in _PAGES[args.kind](args).entries}
    _require_known(args, entries)
    return terminal_text(entries[args.name], terminal_width() or LONGEST)


def listing(items: Sequence[Mapping[str, Any]], width: int | None) -> str:
    """A table; where that is wider than `width` columns, a wrapped entry for each item."""
    heads = [*(key for key in items[0] if key != "about"), "about"]
    rows = [[_shown(item[key]) for key in heads] for item in items]
    found = table([heads, *rows])
    if width is None or max(map(len, found.splitlines())) <= width:
        return found
    return "\n".join(_entry(item, width) for item in items)


def _entry(item: Mapping[str, Any], width: int) -> str:
    """Name and description, then each non-empty field on its own lines, wrapped to `width`."""
    name, *more = ((key, value) for key, value in item.items() if key != "about")
    column = max(len(key) for key, _ in more) + 2 if more else 0
    lines = [name[1], *_wrapped(item["about"], "    ", "    ", width)]
    for key, value in more:
        first = f"    {key:{column}}"
        for text in _lines(value) if isinstance(value, Mapping) else filter(None, [_shown(value)]):
            lines += _wrapped(text, first, " " * (column + 4), width)
            first = " " * (column + 4)
    return "\n".join(lines)


def _wrapped(text: str, first: str, other: str, width: int) -> list[str]:
    return textwrap.wrap(
        text, max(width, 40), initial_indent=first, subsequent_indent=other, break_on_hyphens=False
    )


def _shown(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(_lines(value))
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _lines(parameters: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """`name: value (where it comes from)`; `name (type)` for one that has to be given."""
    return [
        f"{name} ({one['type']})"
        if one["required"]
        else f"{name}: {one['value']}" + (f" ({one['origin']})" if one["origin"] else "")
        for name, one in parameters.items()
    ]


def _first_line(text: str) -> str:
    return text.strip().partition("\n")[0]


def _states(args: argparse.Namespace) -> list[dict[str, Any]]:
    from cobodeck.project import catalogue

    known = catalogue(own=args.own)
    return [
        {
            "state": name,
            "kind": "monitor" if state.monitor else "action",
            "outcomes": list(state.outcomes),
            "parameters": [_argument(key, value) for key, value in state.parameters.items()],
            "inputs": [_argument(key, value) for key, value in state.inputs.items()],
            "reads": list(state.reads),
            "commands": list(state.commands),
            "module": known.module_of(name),
            "about": _first_line(state.about),
        }
        for name, state in sorted(known.interfaces.items())
    ]


def _argument(name: str, argument: Argument) -> str:
    """A parameter or input of a state with its type, and its default if it has one."""
    from engine.files import quantity_text, written_text

    shown = f"{name}: {argument.type}"
    if argument.required:
        return shown
    value = argument.default
    if value is None:
        return f"{shown} = none"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{shown} = {quantity_text(value, argument.type.name)}"
    return f"{shown} = {written_text(value)}"


def _signals(args: argparse.Namespace) -> list[dict[str, Any]]:
    from cobodeck.project import catalogue
    from cobodeck.setup import open_setup
    from engine.signals import types_of

    declared = open_setup(known=catalogue(own=args.own)).signals
    kinds = types_of(declared)
    return [
        {
            "signal": signal.name,
            "kind": type(signal).__name__.lower(),
            "type": str(kinds[signal.name]).removesuffix(" | none"),
            "of": list(getattr(signal, "of", ())),
            "about": _first_line(signal.about),
        }
        for signal in declared.values()
    ]


def _library(args: argparse.Namespace) -> dict[str, Chart]:
    """All charts, with the values of the profile that is asked for."""
    from cobodeck.project import catalogue, chart_names
    from cobodeck.setup import profile_with, with_values
    from engine.chart import load_files

    library = load_files(chart_names(catalogue(own=args.own)).values())
    return with_values(profile_with(args.profile, args.sets), library, ())


def _charts(args: argparse.Namespace) -> list[dict[str, Any]]:
    charts = _library(args)
    return [
        {
            "chart": name,
            "inputs": [_input(key) for key in chart.inputs.values()],
            "parameters": {p.name: _parameter(p) for p in chart.parameters.values()},
            "outcomes": list(chart.outcomes),
            "file": chart.file,
            "about": chart.about,
        }
        for name, chart in charts.items()
    ]


def _input(key: DataKey) -> str:
    """An input with its type, and its default if it has one."""
    from engine.files import written_text

    default = "none" if key.initial is None else written_text(key.initial)
    has_default = key.has_initial or key.optional
    return f"{key.name}: {key.type}" + (f" = {default}" if has_default else "")


def _parameter(parameter: Parameter) -> dict[str, Any]:
    """A parameter of a chart with the value that a run uses, and where that comes from."""
    return {
        "type": parameter.type,
        "required": parameter.required,
        "value": None if parameter.required else value_text(parameter.default, {}),
        "origin": parameter.origin,
        "about": parameter.about,
    }


def _scenes(_args: argparse.Namespace) -> list[dict[str, Any]]:
    from hw.scene import load_scene, scene_names

    return [
        {
            "scene": scene.name,
            "robot": scene.robot,
            "user": scene.user,
            "places": list(scene.places),
            "about": scene.about,
        }
        for scene in map(load_scene, scene_names())
    ]


def _users(_args: argparse.Namespace) -> list[dict[str, Any]]:
    from hw.people.walking import MANNERS, load_script, route, script_names, wanderer

    scripts = [{"user": name, "about": load_script(name).about} for name in script_names()]
    kinds = [
        {"user": f"{wanderer.NAME}:{name}", "about": manner.about}
        for name, manner in MANNERS.items()
    ]
    chance = [{"user": source.NAME, "about": source.ABOUT} for source in (route, wanderer)]
    return [*scripts, *chance, *kinds]


def _profiles(_args: argparse.Namespace) -> list[dict[str, Any]]:
    from behaviors.profile import load_profile, profile_names

    found = map(load_profile, profile_names())
    return [
        {"profile": p.name, "policy": p.policy, "chart": p.chart, "about": p.about} for p in found
    ]


def _robots(_args: argparse.Namespace) -> list[dict[str, Any]]:
    from hw.model import load_robot, robot_names

    return [{"robot": name, "about": load_robot(name).about} for name in robot_names()]


def _arms(_args: argparse.Namespace) -> list[dict[str, Any]]:
    from hw.model import arm_names, load_arm

    return [
        {"arm": found.name, "payload_kg": found.payload, "about": found.about}
        for found in map(load_arm, arm_names())
    ]


def _connections(_args: argparse.Namespace) -> list[dict[str, Any]]:
    from hw.connection import connection_names, load_connection

    return [
        {
            "connection": found.name,
            "model": found.model or "the scene's",
            "real": "yes" if found.real else "no",
            "parts": list(found.parts) or "all",
            "about": found.about,
        }
        for found in map(load_connection, connection_names())
    ]


def _campaigns(_args: argparse.Namespace) -> list[dict[str, Any]]:
    from cobodeck.campaign import campaign_names, cells_of, load_campaign

    return [
        {"campaign": found.campaign, "cells": len(cells_of(found)), "about": found.about}
        for found in map(load_campaign, campaign_names())
    ]


def _files(_args: argparse.Namespace) -> list[dict[str, Any]]:
    from cobodeck.manual import ABOUTS

    return [{"file": kind, "about": about} for kind, about in ABOUTS.items()]


def _page(args: argparse.Namespace) -> ManualPage:
    from cobodeck.manual import manual_page
    from cobodeck.project import catalogue

    return manual_page(args.kind, catalogue(own=args.own))


def _chart_page(args: argparse.Namespace) -> ManualPage:
    from cobodeck.manual import chart_page
    from cobodeck.project import catalogue

    return chart_page(catalogue(own=args.own), _library(args))


_PAGES: dict[str, Callable[[argparse.Namespace], ManualPage]] = {
    "states": _page,
    "signals": _page,
    "charts": _chart_page,
    "files": _page,
}
_LISTS: dict[str, Callable[[argparse.Namespace], list[dict[str, Any]]]] = {
    "states": _states,
    "signals": _signals,
    "charts": _charts,
    "scenes": _scenes,
    "users": _users,
    "profiles": _profiles,
    "robots": _robots,
    "arms": _arms,
    "connections": _connections,
    "campaigns": _campaigns,
    "files": _files,
}
