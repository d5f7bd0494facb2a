"""The command line: `cobodeck COMMAND …`.

A command is a module of `cobodeck.commands` with `arguments(parser)` and `run(args)`; only the one
that is asked for is imported, so that `validate` starts fast.
"""

from __future__ import annotations

import importlib
import os
import re
import shlex
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from types import ModuleType

from cobodeck.project import own_files_around
from cobodeck.setup import keep_compiled_code
from cobodeck.shadowed import explained, shadows
from cobodeck.terminal import (
    FAILED,
    OK,
    USAGE,
    CommandParser,
    Problem,
    WrongArguments,
    answering,
    complain,
    place_of,
    show,
    show_failure,
    show_traceback,
    show_what_can_be_shown,
    traced,
)
from engine.files import FileError, NotFound, did_you_mean, noting, quantity
from engine.files.declared import no_files, with_own_files

COMMANDS = {
    "validate": "check charts, scenes, robots and profiles",
    "schema": "write the JSON Schema that editors complete a kind of file by",
    "list": "list states, charts, scenes, users, profiles, robots and more",
    "docs": "write reference pages of states, signals, charts and files",
    "render": "draw a chart, a recorded run or a room",
    "watch": "see charts as you edit them, recorded runs, and running ones",
    "simulate": "run a chart on the simulated robot",
    "run": "run a chart on a robot",
    "observe": "watch a real robot, and stop it",
    "replay": "do a recorded run again, and check it",
    "recover": "save what is whole of a record that was cut off",
    "case": "write a test that plays a moment of a recorded run",
    "compare": "tell how two recorded runs differ",
    "space": "measure how much of a room or map the robot can use",
    "reach": "tell how high the arm reaches",
    "localize": "run the localization on a recorded log",
    "calibrate": "find where tracking, trackers and scanners are, from a log",
    "new": "begin a project of your own",
    "import-flexbe": "make a project of behaviours of FlexBE",
    "evaluate": "tell figures of recorded runs, or repeat the paper's evaluation",
    "campaign": "run all combinations of settings, people and seeds",
    "bench": "measure run time against error",
    "completion": "complete commands, options and names in bash, zsh or fish",
    "doctor": "tell whether this machine is fit",
}
TRACEBACK = "--traceback"
VALUED = ("--in", "--set")
"""Options whose value is YAML, which shells split unless it is in quotes."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    show_what_can_be_shown()
    given = list(sys.argv[1:] if argv is None else argv)
    try:
        with answering(given[1:]):
            return _ended(given, alone=argv is None)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK


def _ended(given: list[str], *, alone: bool) -> int:
    """The exit code, after what is wrong has been told; `alone`: nobody else sees exceptions."""
    try:
        return _dispatch(given)
    except BrokenPipeError:
        raise
    except WrongArguments as wrong:  # the parser has told of it
        show_failure(wrong.message, USAGE)
        return USAGE
    except (Exception, KeyboardInterrupt) as error:
        message, code = _told(error)
        if message is None and alone and TRACEBACK not in given:
            message = f"{place_of(error)}; {TRACEBACK} shows how it came to this"
        if message is None:
            raise
        if TRACEBACK in given:
            show_traceback(error)
        complain(message)
        show_failure(message, code)
        return code


def _told(error: BaseException) -> tuple[str | None, int]:
    """What a user is told of an exception, and the exit code; None if nobody expected it."""
    if isinstance(error, Problem):
        return str(error), error.code
    if isinstance(error, KeyboardInterrupt):
        return "stopped", 130
    if isinstance(error, ImportError):
        return explained(shadows()) or _needed(error), USAGE
    if isinstance(error, OSError):
        code = USAGE if isinstance(error, FileNotFoundError) else FAILED
        return f"{error.filename or 'file'}: {error.strerror or error}", code
    if isinstance(error, FileError):
        return str(error), USAGE if isinstance(error, NotFound) else FAILED
    return None, FAILED


def _needed(error: ImportError) -> str | None:
    from hw import missing  # `hw` may be hidden

    needs = missing(error)
    return needs and f"this {needs}"


def _dispatch(given: list[str]) -> int:
    if not given or given[0] in ("-h", "--help"):
        show(_overview())
        return OK if given else USAGE
    if "\0" in "".join(given):
        raise Problem("an argument has the character NUL in it, which no name has")
    if given[0] == "--version":
        from importlib.metadata import version

        show(f"cobodeck {version('cobodeck')}")
        return OK
    name, *rest = given
    if name not in COMMANDS:
        raise Problem(f"no command {name!r}; {did_you_mean(name, COMMANDS)}")
    if meant := _torn_value(rest):
        raise Problem(f"put KEY=VALUE in quotes: {meant}")
    module, parser = command_parser(name)
    try:
        args = parser.parse_args(_joined(rest))
    except SystemExit as end:
        if isinstance(end, WrongArguments):
            raise
        return OK  # after help
    own = own_files_around() if args.own else no_files
    not_kept = keep_compiled_code()
    with noting(), with_own_files(own), traced() if args.traceback else nullcontext():
        code = module.run(args)
    if not_kept and "numba" in sys.modules:
        complain(not_kept)
    return FAILED if code is None else int(code)


def command_parser(name: str) -> tuple[ModuleType, CommandParser]:
    """The module of a command, and the parser of its arguments."""
    module = importlib.import_module(f"cobodeck.commands.{name.replace('-', '_')}")
    parser = CommandParser(f"cobodeck {name}", module.__doc__)
    module.arguments(parser)
    about = "import no code of projects, neither from this folder nor installed"
    parser.add_argument("--no-project", dest="own", action="store_false", help=about)
    about = "with an error, tell also the calls that led to it"
    parser.add_argument(TRACEBACK, action="store_true", help=about)
    if name == "completion":
        parser.set_defaults(commands=COMMANDS, parser_of=lambda one: command_parser(one)[1])
    return module, parser


def _joined(given: Sequence[str]) -> list[str]:
    """The arguments, with `--start -1,2,0` as `--start=-1,2,0`: argparse would see an option."""
    found: list[str] = []
    for one in given:
        if found and re.fullmatch(r"--[a-z][a-z-]*", found[-1]) and re.match(r"-\.?\d", one):
            found[-1] += f"={one}"
        else:
            found.append(one)
    return found


def _torn_value(given: Sequence[str]) -> str:
    """The option of a value that the shell has split, in brackets or before a unit; or empty."""
    for n, option in enumerate(given[:-1]):
        value, *after = given[n + 1 :]
        if option not in VALUED:
            continue
        if after and quantity(f"{value.partition('=')[2]} {after[0]}"):
            return f"{option} {shlex.quote(f'{value} {after[0]}')}"
        if not _is_open(value):
            continue
        for word in after:
            if word.startswith("--"):
                break
            value += f" {word}"
            if not _is_open(value):
                return f"{option} {shlex.quote(value)}"
    return ""


def _is_open(text: str) -> bool:
    return sum(map(text.count, "[{")) > sum(map(text.count, "]}"))


def _overview() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {about}" for name, about in COMMANDS.items()]
    return "\n".join(
        ["usage: cobodeck COMMAND …", "", *lines, "", "cobodeck COMMAND --help tells more."]
    )


if __name__ == "__main__":
    sys.exit(main())
