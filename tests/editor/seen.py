"""Charts in a running editor's server, as tests see them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.editor.language_server import LanguageServer

PLACE = Path(os.environ.get("EDITOR_TRIAL", Path(__file__).parents[2] / "out" / "editor"))
PROGRAM = PLACE / "node_modules" / "yaml-language-server" / "bin" / "yaml-language-server"
HEAD = "# yaml-language-server: $schema=chart.schema.json\nchart: main\noutcomes: [done]\n"


def running_server(folder: Path, schema: str) -> Iterator[LanguageServer]:
    """A server for a folder with this schema of charts; without one, tests are skipped."""
    if shutil.which("node") is None:
        pytest.skip("no `node` on the PATH")
    if not PROGRAM.is_file():
        pytest.skip(
            f"no yaml-language-server in {PLACE}; tests/editor/README.md says how to get it"
        )
    (folder / "chart.schema.json").write_text(schema, encoding="utf-8")
    with LanguageServer(PROGRAM, folder) as running:
        yield running


class Seen:
    """A chart in the editor; `‸` in it is where the cursor stands."""

    def __init__(self, server: LanguageServer, name: str, body: str) -> None:
        text = HEAD + body
        before = text.split("‸", maxsplit=1)[0]
        self.server, self.name = server, name
        self.line, self.column = before.count("\n"), len(before) - before.rfind("\n") - 1
        self.lines = text.replace("‸", "").splitlines()
        self.diagnostics = server.open(name, text.replace("‸", ""))

    @property
    def offered(self) -> dict[str, dict[str, Any]]:
        """What is offered at the cursor, by label."""
        items = self.server.complete(self.name, self.line, self.column)
        labels = [item["label"] for item in items]
        assert len(set(labels)) == len(labels), f"offered twice: {sorted(labels)}"
        return {item["label"]: item for item in items}

    @property
    def hover(self) -> str:
        return self.server.hover(self.name, self.line, self.column)

    @property
    def underlined(self) -> list[tuple[str, str]]:
        """The underlined words and what is said about them."""
        found = []
        for diagnostic in self.diagnostics:
            start, end = diagnostic["range"]["start"], diagnostic["range"]["end"]
            word = self.lines[start["line"]][start["character"] : end["character"]]
            found.append((word, diagnostic["message"]))
        return found
