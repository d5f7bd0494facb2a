"""The pages for authors: their blocks, and a project that has all files shown in them."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from cobodeck.__main__ import main

DOCS = Path(__file__).resolve().parents[3] / "cobodeck" / "docs"
AUTHOR_PAGES = (
    "chart-language.md",
    "testing.md",
    "cookbook.md",
    "cookbook/waiting.md",
    "cookbook/together.md",
    "cookbook/own.md",
    "cookbook/records.md",
    "edit-charts.md",
    "robot.md",
    "library.md",
    "from-flexbe.md",
    "from-behaviortree.md",
    "from-smach.md",
)
PACKAGE = "my_project"
_PLACE = re.compile(r"# (\S+\.\w+)(, at its end)?\n")
"""The first line of a block that is a file, or stands at the end of one."""
_NAMED = re.compile(r"(?:#.*\n)*\w+: (\w+)")


class Block(NamedTuple):
    """A fenced block: its page, the line of its first line, its language, its text."""

    page: str
    line: int
    language: str
    text: str

    @property
    def file(self) -> str | None:
        """Where it stands in a project; None: nowhere.

        A YAML file without a place is in the package, by the name in its first line.
        """
        if place := _PLACE.match(self.text):
            return place[1]
        if self.language == "yaml" and (named := _NAMED.match(self.text)):
            return f"{PACKAGE}/{named[1]}.yaml"
        return None

    @property
    def at_the_end(self) -> bool:
        """Whether it is the end of a file that is there already."""
        place = _PLACE.match(self.text)
        return place is not None and place[2] is not None


def blocks(*pages: str) -> list[Block]:
    """The blocks of these pages, by default of all, in order."""
    found = []
    for page in pages or AUTHOR_PAGES:
        text = (DOCS / page).read_text(encoding="utf-8")
        for match in re.finditer(r"^```(\w+)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL):
            line = text.count("\n", 0, match.start()) + 2
            found.append(Block(page, line, match[1], match[2]))
    return found


def write_blocks(root: Path, *pages: str) -> list[Path]:
    """Write the files of these pages into a project; where they are."""
    written = []
    for block in blocks(*pages):
        if block.file is None:
            continue
        file = root / block.file
        assert file.exists() is block.at_the_end, f"{block.page}:{block.line} {file}"
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("a", encoding="utf-8") as stream:
            stream.write(block.text)
        written.append(file)
    return written


def shown_charts(root: Path) -> list[Path]:
    """The charts of all pages, in the project that has them."""
    shown = (block for block in blocks() if block.text.startswith("chart: "))
    return [root / str(block.file) for block in shown]


def new_project(folder: Path) -> Path:
    """A project as `cobodeck new my_project` makes it; nothing of it stays imported."""
    assert main(["new", str(folder / PACKAGE)]) == 0
    forget_modules()
    return folder / PACKAGE


def forget_modules() -> None:
    """Let the package of the project be imported anew."""
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]


class PageTest(NamedTuple):
    """A test that a page shows: its block and the name of its function."""

    block: Block
    name: str

    @property
    def slow(self) -> bool:
        """Whether it simulates a robot, or plays a record."""
        tree = ast.parse(self.block.text)
        (found,) = (item for item in ast.walk(tree) if getattr(item, "name", "") == self.name)
        return re.search(r"(scene|robot)=|recorded_case", ast.unparse(found)) is not None


def page_tests() -> Iterator[PageTest]:
    """The tests of all pages."""
    for block in blocks():
        if block.language == "python" and (block.file or "").startswith("tests/"):
            for item in ast.parse(block.text).body:
                if isinstance(item, ast.FunctionDef) and item.name.startswith("test_"):
                    yield PageTest(block, item.name)
