"""Python 2 that Python 3 cannot read, put into Python 3 line by line, so far as this is plain."""

from __future__ import annotations

import ast
import re
import warnings

from engine.files import mistake

_PLAIN = (
    (re.compile(r"^(\s*)print\s+(?![=(.\[])(.*?)(,?)\s*$"), r"\1print(\2)"),
    (re.compile(r"^(\s*)print\s*$"), r"\1print()"),
    (re.compile(r"^(\s*except\b.*?),\s*(\w+)\s*:"), r"\1 as \2:"),
    (re.compile(r"^(\s*)raise\s+([\w.]+)\s*,\s*(.+?)\s*$"), r"\1raise \2(\3)"),
    (re.compile(r"`([^`]+)`"), r"repr(\1)"),
    (re.compile(r"<>"), "!="),
    (re.compile(r"\bur(?=['\"])"), "r"),
    (re.compile(r"\b(\d+)[lL]\b"), r"\1"),
    (re.compile(r"(?<![\w.'\"])0+(\d+)(?![\w.])"), r"0o\1"),
)


def python_tree(text: str, file: str) -> tuple[ast.Module, int]:
    """The syntax tree of a module; and the first line that only Python 2 reads, or 0.

    Raises:
        FileError: it is not Python, even with what is common in Python 2 put right.
    """
    try:
        return _parsed(text), 0
    except (SyntaxError, ValueError) as error:
        first, first_line = str(getattr(error, "msg", error)), getattr(error, "lineno", None) or 1
    try:
        return _parsed(in_python_3(text)), first_line
    except (SyntaxError, ValueError, RecursionError):
        hint = "correct it; if it is Python 2, put it into Python 3 first"
        raise mistake(file, f"this is not Python 3: {first}", first_line, hint) from None


def in_python_3(text: str) -> str:
    """The text with statements of Python 2 put into Python 3, on the same lines."""
    lines = [line.expandtabs(8) for line in text.splitlines()]
    for old, new in _PLAIN:
        lines = [old.sub(new, line) for line in lines]
    return "\n".join(lines) + "\n"


def _parsed(text: str) -> ast.Module:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "\d" in texts of others
        return ast.parse(text)
