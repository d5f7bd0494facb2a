"""The pytest plugin for authors of charts and states.

Fixtures: `sim` runs charts in virtual time (cobodeck.testing.testing), `parts` are stubs of the
robot's parts, `golden` compares text with a file, `recorded_case` plays a moment of a recorded run
(`cobodeck case` writes such tests). A test that leaves a part moving fails.
Options: `--update-golden` writes the files that `golden` compares with, `--chart-coverage` tells
which edges of the project's charts no run of a `sim` has taken (`--chart-coverage-fail-under=90`
fails below 90 %), `--requirements` lists which R numbers the collected tests cover.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from cobodeck.testing import ChartTester, EdgeCoverage, Parts

REQUIREMENTS = range(1, 151)
_COVERED = pytest.StashKey[set[int]]()
_EDGES = pytest.StashKey["EdgeCoverage"]()
_SENT = "edges of charts"
_MARKER = "requirement(*numbers): the R numbers of the requirements that a test covers"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the options."""
    group = parser.getgroup("cobodeck")
    group.addoption("--update-golden", action="store_true", help="write the golden files anew")
    group.addoption(
        "--chart-coverage", action="store_true", help="tell which edges of charts no test takes"
    )
    group.addoption(
        "--chart-coverage-fail-under",
        type=float,
        metavar="PERCENT",
        help="like --chart-coverage; fail if fewer edges are taken",
    )
    group.addoption("--requirements", action="store_true", help="list which R numbers are covered")


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker, and begin to count edges if that is asked for."""
    config.addinivalue_line("markers", _MARKER)
    least = config.getoption("--chart-coverage-fail-under")
    if config.getoption("--chart-coverage") or least is not None:
        from cobodeck.testing import EdgeCoverage

        config.stash[_EDGES] = EdgeCoverage()


@pytest.fixture
def parts() -> Iterator[Parts]:
    """Stub parts by name, `parts["base"]`; the test fails if one is left moving."""
    from cobodeck.testing import Parts

    found = Parts()
    yield found
    if found.moving:
        moving = ", ".join(found.moving)
        pytest.fail(f"left moving: {moving}; stop what was started, in finally", pytrace=False)


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
    tester = ChartTester(request.path.parent, root, parts, request.config.stash.get(_EDGES, None))
    with with_own_files(own_files_around(root)):
        yield tester
    tester.finish()


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """`golden("name.txt", text)`: compare with that file in the folder `golden` beside the test."""

    def compare(name: str, text: str) -> None:
        __tracebackhide__ = True
        file = Path(request.path).parent / "golden" / name
        if request.config.getoption("--update-golden"):
            file.parent.mkdir(exist_ok=True)
            file.write_text(text, encoding="utf-8")
            return
        assert file.is_file(), f"{file} is missing; write it with --update-golden and look at it"
        assert text == file.read_text(encoding="utf-8"), f"differs from {file}; see --update-golden"

    return compare


@pytest.fixture
def recorded_case(request: pytest.FixtureRequest) -> Callable[[str, list[str]], None]:
    """`recorded_case("x.mcap", lines)`: what the case in that file beside the test decides."""
    from cobodeck.testing import RecordedCase

    def compare(name: str, followed: list[str]) -> None:
        __tracebackhide__ = True
        RecordedCase(request.path.parent / name, request.config.rootpath).assert_followed(followed)

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


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Pass the edges taken on to the process that reports them; fail if they are too few."""
    config = session.config
    edges = config.stash.get(_EDGES, None)
    if edges is None:
        return
    if hasattr(config, "workeroutput"):
        config.workeroutput[_SENT] = edges.rows()
    elif _is_too_little(config, edges) and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Take over the edges that a worker of pytest-xdist has counted."""
    edges = node.config.stash.get(_EDGES, None)
    if edges is not None:
        edges.merge(getattr(node, "workeroutput", {}).get(_SENT, ()))


def _is_too_little(config: pytest.Config, edges: EdgeCoverage) -> bool:
    least = config.getoption("--chart-coverage-fail-under")
    return least is not None and 100.0 * edges.share(config.rootpath) < least


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Report edges of charts if they were counted, and requirements with `--requirements`."""
    edges = config.stash.get(_EDGES, None)
    if edges is not None:
        _report_edges(terminalreporter, config, edges)
    if config.getoption("--requirements"):
        _report_requirements(terminalreporter, config)


def _report_edges(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config, edges: EdgeCoverage
) -> None:
    terminalreporter.section("edges of charts taken")
    for line in edges.report(config.rootpath):
        terminalreporter.write_line(line)
    if _is_too_little(config, edges):
        least = config.getoption("--chart-coverage-fail-under")
        share = 100.0 * edges.share(config.rootpath)
        terminalreporter.write_line(f"FAILED: {share:.1f} % of all edges; wanted: {least:g} %")


def _report_requirements(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
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
