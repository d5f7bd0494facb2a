"""DOT text as a picture file."""

from __future__ import annotations

import shutil
import subprocess
from typing import Literal, get_args

FileForm = Literal["svg", "png", "pdf"]
FILE_FORMS: tuple[FileForm, ...] = get_args(FileForm)


class CannotRender(RuntimeError):
    """No Graphviz is here, or it refused; the message says what to do."""


def render(text: str, form: FileForm = "svg") -> bytes:
    """DOT text laid out by Graphviz.

    Raises:
        CannotRender: with neither `pygraphviz` (which brings Graphviz along) nor a `dot` program.
    """
    try:
        import pygraphviz
    except ImportError:
        return _by_program(text, form)
    return bytes(pygraphviz.AGraph(string=text).draw(format=form, prog="dot"))


def _by_program(text: str, form: FileForm) -> bytes:
    program = shutil.which("dot")
    if program is None:
        how = "`pip install pygraphviz` (Linux), or install Graphviz so that `dot` is on the PATH"
        raise CannotRender(f"no Graphviz here: {how}; DOT and Mermaid text need none")
    done = subprocess.run([program, f"-T{form}"], input=text.encode(), capture_output=True)
    if done.returncode:
        raise CannotRender(f"{program}: {done.stderr.decode(errors='replace').strip()}")
    return done.stdout
