"""The pytest plugin for authors of charts and states.

Fixtures: `sim` runs charts in virtual time (cobodeck.testing.testing), `parts` are stubs of the
robot's parts, `golden` compares text with a file. A test that leaves a part moving fails.
Options: `--update-golden` writes the files that `golden` compares with, `--requirements` lists
which R numbers the collected tests cover.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from cobodeck.testing import ChartTester, Parts

REQUIREMENTS = range(1, 151)
_MARKER = "requirement(*numbers): the R numbers of the requirements that a test covers"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the options."""
    group = parser.getgroup("cobodeck")
    group.addoption("--update-golden", action="store_true", help="write the golden files anew")
    group.addoption("--requirements", action="store_true", help="list which R numbers are covered")


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker."""
    config.addinivalue_line("markers", _MARKER)


@pytest.fixture
def parts() -> Iterator[Parts]:
    """Stub parts by name, `parts["base"]`; the test fails if one is left moving."""
    from cobodeck.testing import Parts

    found = Parts()
    yield found
    if found.moving:
        pytest.fail(f"left moving: {', '.join(found.moving)}; stop what was started, in finally")


@pytest.fixture
def sim(request: pytest.FixtureRequest, parts: Parts) -> Iterator[ChartTester]:
    """Runs charts in virtual time; see `cobodeck.testing.testing`."""
    from cobodeck.shadowed import explained, shadows

    if hidden := shadows():
        pytest.fail(explained(hidden), pytrace=False)
    from cobodeck.project import own_files_around
    from cobodeck.testing import ChartTester
    from engine.files.declared import with_own_files

    root = request.config.rootpath
    tester = ChartTester(request.path.parent, root, parts)
    with with_own_files(own_files_around(root)):
        yield tester
    tester.finish()


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """`golden("name.txt", text)`: compare with that file in the folder `golden` beside the test."""

    def compare(name: str, text: str) -> None:
        file = Path(request.path).parent / "golden" / name
        if request.config.getoption("--update-golden"):
            file.parent.mkdir(exist_ok=True)
            file.write_text(text, encoding="utf-8")
            return
        assert file.is_file(), f"{file} is missing; write it with --update-golden and look at it"
        assert text == file.read_text(encoding="utf-8"), f"differs from {file}; see --update-golden"

    return compare


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Note which requirements the collected tests cover."""
    covered = {
        number
        for item in items
        for mark in item.iter_markers("requirement")
        for number in mark.args
    }
    config.stash[_COVERED] = covered


_COVERED = pytest.StashKey[set[int]]()


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """List covered and open requirements if `--requirements` is given."""
    if not config.getoption("--requirements"):
        return
    covered = config.stash.get(_COVERED, set())
    open_ = [number for number in REQUIREMENTS if number not in covered]
    terminalreporter.section("requirements")
    terminalreporter.write_line(f"covered {len(REQUIREMENTS) - len(open_)} of {len(REQUIREMENTS)}")
    terminalreporter.write_line(f"covered: {ranges(sorted(covered))}")
    terminalreporter.write_line(f"open:    {ranges(open_)}")


def ranges(numbers: list[int]) -> str:
    """`R1-R3 R7` for 1, 2, 3, 7."""
    found: list[list[int]] = []
    for number in numbers:
        if found and number == found[-1][-1] + 1:
            found[-1].append(number)
        else:
            found.append([number])
    return " ".join(f"R{r[0]}-R{r[-1]}" if len(r) > 1 else f"R{r[0]}" for r in found) or "none"
