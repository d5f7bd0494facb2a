"""Every code of engine/CODES.md: its wrong example has it, its mend has no finding at all."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import engine
from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.finding import Finding
from engine.files.source import read
from engine.interfaces import interface
from engine.machine.named_values import NamedValues
from engine.state import Action, Monitor, State

ENGINE = Path(engine.__file__).parent
PAGE = (ENGINE / "CODES.md").read_text(encoding="utf-8")
FENCED = r"^### ([A-Z]\d\d) .*?^```yaml\n(.*?)^```$"
EXAMPLES: dict[str, str] = dict(re.findall(FENCED, PAGE, re.MULTILINE | re.DOTALL))


def states() -> dict[str, Any]:
    """The interfaces of the states that the page shows."""
    shown = re.search(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert shown is not None
    namespace: dict[str, Any] = {"__name__": __name__}
    exec(compile(shown[1], "CODES.md", "exec", dont_inherit=True), namespace)
    found = [c for c in namespace.values() if isinstance(c, type) and issubclass(c, State)]
    return {c.__name__: interface(c) for c in found if c not in (Action, Monitor)}


INTERFACES = states()


def texts(example: str, without: str) -> list[str]:
    """The files of an example without the lines that end with a mark."""
    kept = [line for line in example.splitlines() if not line.rstrip().endswith(f"# {without}")]
    files = re.split(r"^# file.*\n", "\n".join(kept), flags=re.MULTILINE)
    return [text for text in files if text.strip()]


def findings(example: str, without: str) -> list[Finding]:
    """What is found in an example without the lines that end with a mark."""
    library = Library()
    for number, text in enumerate(texts(example, without)):
        library.add(read(text.encode(), f"{number}"))
    around = NamedValues(named={"place": {"dock": None}})
    return check(library, INTERFACES, signals=["user.distance"], parts=["base"], around=around)


@pytest.mark.parametrize("code", sorted(EXAMPLES))
def test_the_wrong_example_has_its_code_and_no_other(code: str) -> None:
    assert {finding.code for finding in findings(EXAMPLES[code], without="right")} == {code}


@pytest.mark.parametrize("code", sorted(EXAMPLES))
def test_the_mended_example_has_no_finding(code: str) -> None:
    assert findings(EXAMPLES[code], without="wrong") == []


@pytest.mark.parametrize("code", [code for code in sorted(EXAMPLES) if code[0] in "YCN"])
def test_mistakes_of_a_line_are_found_in_that_line(code: str) -> None:
    files = texts(EXAMPLES[code], without="right")
    for finding in findings(EXAMPLES[code], without="right"):
        line = files[int(finding.place.file)].splitlines()[finding.place.line - 1]
        assert line.endswith("# wrong"), finding


def test_the_list_has_every_code_of_the_source() -> None:
    files = [
        *ENGINE.glob("check/**/*.py"),
        ENGINE / "files" / "source.py",
        ENGINE / "chart" / "load.py",
    ]
    source = "".join(file.read_text(encoding="utf-8") for file in files)
    assert set(re.findall(r'"([YCNFS]\d\d)"', source)) == set(EXAMPLES)


def test_the_severities_are_as_the_list_says() -> None:
    warned = {
        code
        for code, title in re.findall(r"^### ([A-Z]\d\d) (.*)$", PAGE, re.MULTILINE)
        if title.endswith("(warning)")
    }
    for code, example in EXAMPLES.items():
        wanted = "warning" if code in warned else "error"
        found = findings(example, without="right")
        assert {finding.severity for finding in found} == {wanted}, code
