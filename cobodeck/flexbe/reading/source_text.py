"""The text of a generated module: its tree, its manual blocks, the comments of the drawing."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from cobodeck.flexbe.behaviour import Comment, ManualBlock
from cobodeck.flexbe_states import python_tree
from engine.files import FileError

_MANUAL = re.compile(r"^[ \t]*#[ \t]*\[(/?)(MANUAL_\w+)\]")
_COMMENT = re.compile(r"^\s*#\s+([!OoX?])\s+-?\d+\s+-?\d+(?:\s+(/.*?))?\s*$")
_ARGUMENT = re.compile(r"(?<=[(,\s])(\w+)=([^()\n]+?)(?=,\s*\w+=|\))")


def tree_of(text: str, file: str) -> ast.Module:
    """The tree; where it is no Python 3, that without manual blocks, with texts in quotes.

    Raises:
        FileError: it is no Python; the message names the place in the text as it is.
    """
    try:
        return python_tree(text, file)[0]
    except FileError as error:
        generated = _without_manual_blocks(text)
        for mended in (generated, _with_quotes(generated)):
            try:
                return python_tree(mended, file)[0]
            except FileError:
                continue
        raise error from None


def _with_quotes(text: str) -> str:
    """The text with quotes around arguments that FlexBE of 2016 wrote as they were typed."""

    def quoted(argument: re.Match[str]) -> str:
        try:
            ast.parse(argument[2].strip(), mode="eval")
        except (SyntaxError, ValueError):
            return f"{argument[1]}={argument[2]!r}"
        return argument[0]

    return _ARGUMENT.sub(quoted, text)


def manual_blocks(text: str) -> Iterator[ManualBlock]:
    """The blocks that hold code."""
    tag, begin, lines = "", 0, text.splitlines()
    for number, line in enumerate(lines, 1):
        found = _MANUAL.match(line)
        if found is None:
            continue
        if found[1] and found[2] == tag:
            code = "\n".join(lines[begin : number - 1])
            if code.strip():
                yield ManualBlock(tag, code.rstrip(), begin + 1)
            tag = ""
        elif not found[1]:
            tag, begin = found[2], number


def _without_manual_blocks(text: str) -> str:
    """The text with the lines of manual blocks left empty."""
    lines, tag = [], ""
    for line in text.splitlines():
        found = _MANUAL.match(line)
        if found is not None:
            tag = "" if found[1] else found[2]
        lines.append("" if tag and found is None else line)
    return "\n".join(lines) + "\n"


def comments_in(text: str) -> Iterator[Comment]:
    """The comments of the drawing, which stand in `__init__`: a head, then lines of text."""
    head: re.Match[str] | None = None
    found: list[str] = []
    for line in [*text.splitlines(), ""]:
        following = _COMMENT.match(line)
        is_text = line.strip().startswith("#") and following is None
        if head is not None and is_text and not _MANUAL.match(line):
            found += line.strip()[1:].strip().split("|n")
            continue
        if head is not None and found:
            yield Comment((head[2] or "").strip("/"), "\n".join(found), head[1] == "!")
        head, found = following, []
