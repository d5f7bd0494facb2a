"""The command line: `cobodeck COMMAND …`.

A command is a module of `cobodeck.commands` with `arguments(parser)` and `run(args)`; only the one
that is asked for is imported, so that `validate` starts fast.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import shlex
import sys
from collections.abc import Sequence
from typing import NoReturn

from cobodeck.project import own_files_around
from cobodeck.setup import keep_compiled_code
from cobodeck.shadowed import explained, shadows
from cobodeck.terminal import FAILED, OK, USAGE, Problem, complain, show, show_what_can_be_shown
from engine.files import FileError, NotFound, did_you_mean, noting, quantity, visible
from engine.files.declared import no_files, with_own_files

COMMANDS = {
    "validate": "check charts, scenes, robots and profiles",
    "schema": "write the JSON Schema with which editors complete a kind of file",
    "list": "list states, charts, scenes, users, profiles, robots and all other names",
    "render": "draw a chart, a recorded run or a room",
    "watch": "see charts while you edit them, recorded runs, and runs that go on",
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
    "evaluate": "tell statistics of recorded runs, or repeat the paper's evaluation",
    "campaign": "run all combinations of settings, people and seeds",
    "bench": "measure run time against error",
    "doctor": "tell whether this machine is fit",
}
VALUED = ("--in", "--set")
"""Options whose value is YAML, which shells split unless it is in quotes."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    show_what_can_be_shown()
    given = list(sys.argv[1:] if argv is None else argv)
    try:
        return _dispatch(given)
    except Problem as problem:
        complain(str(problem))
        return problem.code
    except KeyboardInterrupt:
        complain("stopped")
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK
    except ImportError as error:
        told = explained(shadows()) or _needed(error)
        if told is None:
            raise
        complain(told)
        return USAGE
    except OSError as error:
        complain(f"{error.filename or 'file'}: {error.strerror or error}")
        return USAGE if isinstance(error, FileNotFoundError) else FAILED
    except FileError as error:
        complain(str(error))
        return USAGE if isinstance(error, NotFound) else FAILED


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
    module = importlib.import_module(f"cobodeck.commands.{name.replace('-', '_')}")
    parser = _Parser(f"cobodeck {name}", description=module.__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    module.arguments(parser)
    about = "import no code of projects, neither from this folder nor installed"
    parser.add_argument("--no-project", dest="own", action="store_false", help=about)
    try:
        args = parser.parse_args(_joined(rest))
    except SystemExit as end:  # argparse has said what is wrong
        return int(end.code or OK)
    own = own_files_around() if args.own else no_files
    not_kept = keep_compiled_code()
    with noting(), with_own_files(own):
        code = module.run(args)
    if not_kept and "numba" in sys.modules:
        complain(not_kept)
    return FAILED if code is None else int(code)


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


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        super().error(visible(message))


def _overview() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {about}" for name, about in COMMANDS.items()]
    return "\n".join(
        ["usage: cobodeck COMMAND …", "", *lines, "", "cobodeck COMMAND --help tells more."]
    )


if __name__ == "__main__":
    sys.exit(main())
