"""The parser of a command's arguments: says what was meant by a wrong one, help in 80 columns."""

from __future__ import annotations

import argparse
import shutil
import sys
import textwrap
from collections.abc import Sequence
from typing import Any, NoReturn

from cobodeck.terminal.console import USAGE
from engine.files import did_you_mean, nearest, visible

WIDEST = 80
"""Columns of help, also on a wider terminal."""


class WrongArguments(SystemExit):
    """Arguments that were refused; the user has been told."""

    def __init__(self, message: str) -> None:
        super().__init__(USAGE)
        self.message = message


class CommandParser(argparse.ArgumentParser):
    """`argparse`, with a suggestion for unknown options and choices."""

    def __init__(self, prog: str, description: str | None) -> None:
        super().__init__(prog, description=description, formatter_class=_Formatter)

    @property
    def options(self) -> dict[str, argparse.Action]:
        """The long options that help shows, by name."""
        return {
            name: action
            for name, action in self._option_string_actions.items()
            if name.startswith("--") and action.help != argparse.SUPPRESS
        }

    @property
    def positionals(self) -> list[argparse.Action]:
        """The positional arguments in their order."""
        return self._get_positional_actions()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; an unknown option is refused first, before an argument that it left missing."""
        words = list(sys.argv[1:] if args is None else args)
        if wrong := next(filter(self._is_unknown, _until_end(words)), None):
            self.error(f"unrecognized arguments: {wrong}; {self._meant(wrong)}")
        return super().parse_known_args(words, namespace)

    def error(self, message: str) -> NoReturn:
        """Tell usage and message on standard error.

        Raises:
            WrongArguments: always.
        """
        told = visible(message)
        self.print_usage(sys.stderr)
        print(f"{self.prog}: error: {told}", file=sys.stderr)
        raise WrongArguments(told)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            assert action.choices is not None
            advice = did_you_mean(value, map(str, action.choices))
            if advice.startswith("did you mean"):
                raise argparse.ArgumentError(action, f"{error.message}; {advice}") from None
            raise

    def _is_unknown(self, word: str) -> bool:
        name = word.partition("=")[0]
        return len(name) > 2 and not any(
            known.startswith(name) for known in self._option_string_actions
        )

    def _meant(self, word: str) -> str:
        names = {option.lstrip("-"): option for option in self.options}
        near = nearest(word.partition("=")[0].lstrip("-"), names)
        return f"see {self.prog} --help" if near is None else f"did you mean {names[near]!r}?"


def _until_end(words: Sequence[str]) -> list[str]:
    """The words that begin with `--`, before one that is nothing else."""
    end = words.index("--") if "--" in words else len(words)
    return [word for word in words[:end] if word.startswith("--")]


class _Formatter(argparse.HelpFormatter):
    """At most `WIDEST` columns; paragraphs of a description are filled, indented lines kept."""

    def __init__(self, prog: str) -> None:
        width = min(shutil.get_terminal_size().columns, WIDEST)
        super().__init__(prog, max_help_position=26, width=width)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n\n".join(
            part
            if part.startswith(" ")
            else textwrap.fill(
                part, width, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False
            )
            for part in text.strip().split("\n\n")
        )

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)
