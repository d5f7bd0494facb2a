"""The answer of a command to a program: one JSON object on standard output, and nothing else there.

One compact line where the output goes on to a program or a file; indented on a terminal and with
`--pretty`. A command that fails before it has an answer answers with `error` and `exit_code`.
Whatever else is printed meanwhile, also by states, goes to standard error.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from contextvars import ContextVar
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TextIO

from cobodeck.terminal.console import show

PRETTY = "--pretty"
_ASKING = {"--json": 4, PRETTY: 5, "--format=json": 13}
"""Options, and the least number of their letters with which they may be abbreviated."""
_HELP = {"-h", "--help"}


@dataclass
class _Answer:
    """Where the object goes, whether on several lines, and whether it has been given."""

    stream: TextIO
    indented: bool
    given: bool = False


_asked: ContextVar[_Answer | None] = ContextVar("_asked", default=None)


def json_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--json` and `--pretty`; either sets `json`."""
    parser.add_argument("--json", action="store_true", help="one JSON object, for programs")
    parser.add_argument(
        PRETTY, dest="json", action="store_true", help="the same, always on indented lines"
    )


@contextmanager
def answering(words: Sequence[str]) -> Iterator[None]:
    """Keep standard output for the JSON object, if these arguments of a command ask for one."""
    options = {word for word in words if word in _HELP or word.startswith("--")}
    as_format = ("--format", "json") in pairwise(words)
    if options & _HELP or not (as_format or any(map(_asks, options))):
        yield
        return
    pretty = any(len(word) >= _ASKING[PRETTY] and PRETTY.startswith(word) for word in options)
    before = _asked.set(_Answer(sys.stdout, pretty or sys.stdout.isatty()))
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _asked.reset(before)


def _asks(word: str) -> bool:
    return any(len(word) >= least and name.startswith(word) for name, least in _ASKING.items())


def show_json(value: Mapping[str, Any]) -> None:
    """Print the answer."""
    answer = _asked.get() or _Answer(sys.stdout, sys.stdout.isatty())
    answer.given = True
    if answer.indented:
        text = json.dumps(value, indent=2, ensure_ascii=False)
    else:
        text = json.dumps(value, separators=(",", ":"), ensure_ascii=False)
    with redirect_stdout(answer.stream):
        show(text)


def show_failure(message: str, code: int) -> None:
    """Answer that there is no other answer, if JSON was asked for and none was given."""
    answer = _asked.get()
    if answer is not None and not answer.given:
        show_json({"error": message, "exit_code": code})
