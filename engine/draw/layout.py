"""Renders DOT text as a picture file."""

from __future__ import annotations

from typing import Literal, get_args

FileForm = Literal["svg", "png", "pdf"]
FILE_FORMS: tuple[FileForm, ...] = get_args(FileForm)


class CannotRender(RuntimeError):
    """Graphviz is missing or has failed; the message says what to do."""


def render(text: str, form: FileForm = "svg") -> bytes:
    """DOT text laid out by Graphviz, as the content of a file.

    Raises:
        CannotRender: there is neither `pygraphviz` (which includes Graphviz) nor a `dot` program,
            or that has failed.
    """
    try:
        import pygraphviz
    except ImportError:
        return _by_program(text, form)
    return bytes(pygraphviz.AGraph(string=text).draw(format=form, prog="dot"))


def _by_program(text: str, form: FileForm) -> bytes:
    import graphviz

    try:
        return bytes(graphviz.Source(text).pipe(form))
    except graphviz.ExecutableNotFound:
        how = "`pip install pygraphviz` (Linux), or install Graphviz so that `dot` is on the PATH"
        hint = f"no Graphviz here: {how}; DOT and Mermaid text need none"
        raise CannotRender(hint) from None
    except graphviz.CalledProcessError as error:
        raise CannotRender(f"dot: {error.stderr.decode(errors='replace').strip()}") from None
