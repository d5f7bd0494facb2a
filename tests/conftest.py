"""Switches for all tests."""

import gc
import importlib
import os
import signal
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings

from tests.fake_context import FakeContext
from tests.repeats import examples

pytest_plugins = ["cobodeck.pytest_plugin"]

# what depends on how busy the machine is, or on luck, fails no test
CALM = settings(
    deadline=None,
    max_examples=examples(100),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
settings.register_profile("calm", CALM)
# a red build must repeat, and soon: minimal examples are looked for by whoever repeats it
CI_PHASES = (Phase.explicit, Phase.reuse, Phase.generate, Phase.target)
settings.register_profile("ci", CALM, derandomize=True, phases=CI_PHASES)
settings.load_profile("ci" if os.environ.get("CI") else "calm")

# a job in the background of a shell ignores Ctrl-C, and so would the programs that tests start
signal.signal(signal.SIGINT, signal.default_int_handler)

# before each run the collector looks at all there is, at thousands of collected tests, too: what is
# alive then stays frozen here
gc.unfreeze = lambda: None
gc.set_threshold(100_000, 10, 50)

HERE = Path(__file__).parent
KEPT = HERE / "cobodeck" / "project" / "kept"
REAL_TIME = [
    *(HERE / "hw" / folder for folder in ("drivers", "fakes", "ipc")),
    *(
        HERE / "cobodeck" / f"{folder}/test_{name}.py"
        for folder, names in {
            "commands": ("observe",),
            "loop": ("loop",),
            "real": (
                "chain_connection", "connected", "dummy_run", "fakes_run", "hosted", "kairos_run",
                "whole_robot",
            ),
        }.items()
        for name in names
    ),
]  # fmt: skip
"""Folders and files whose tests have processes or threads that must not wait for a processor."""
VIRTUAL_TIME = [
    HERE / "hw" / "drivers" / f"{file}.py"
    for file in (
        "can/test_can_frames", "can/test_can_mecanum", "sick/test_sick_telegram",
        "test_clock_offsets", "unity/test_unity_messages", "unity/test_unity_wire",
        "ur/test_ur_course",
    )
]  # fmt: skip
"""Files in these folders that have neither."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--hardware", action="store_true", help="run tests that move a real robot")


@cache
def in_real_time(path: Path) -> bool:
    return path not in VIRTUAL_TIME and any(path.is_relative_to(place) for place in REAL_TIME)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Of runs in real time, or of all others, only their own files are loaded.

    Projects that are kept as people wrote them have tests of their own, run in their folder.
    """
    if KEPT in collection_path.parents:
        return True
    chosen = config.option.markexpr
    if collection_path.suffix != ".py" or "realtime" not in chosen:
        return None
    if "not realtime" in chosen:
        return in_real_time(collection_path) or None
    return not (in_real_time(collection_path) or "mark.realtime" in collection_path.read_text())


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Assertions are rewritten once on a fresh clone: every second worker begins at the end."""
    gc.disable()  # what is loaded stays
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    if session.config.args_source == pytest.Config.ArgsSource.TESTPATHS and int(worker[2:]) % 2:
        for path in sorted(HERE.rglob("test_*.py"), reverse=True):
            if not pytest_ignore_collect(path, session.config):
                with suppress(Exception, pytest.skip.Exception):  # collecting it will tell
                    importlib.import_module(
                        ".".join(path.relative_to(HERE.parent).with_suffix("").parts)
                    )


def of_few(items: list[pytest.Item]) -> dict[str, list[pytest.Item]]:
    """The cases of each test that is marked `few`, in their order."""
    found: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("few"):
            found.setdefault(item.nodeid.partition("[")[0], []).append(item)
    return found


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if in_real_time(item.path):
            item.add_marker(pytest.mark.realtime)
        if item.get_closest_marker("realtime"):
            item.add_marker(pytest.mark.flaky(reruns=2))  # told as RERUN in the summary
    for cases in of_few(items).values():
        keep = cases[0].get_closest_marker("few").args[0]
        kept = {n * len(cases) // keep for n in range(keep)}
        for number, item in enumerate(cases):
            if number not in kept:
                item.add_marker(pytest.mark.slow)
    if config.getoption("--hardware"):
        return
    skip = pytest.mark.skip(reason="moves a real robot; run it with --hardware")
    for item in items:
        if item.get_closest_marker("hardware"):
            item.add_marker(skip)


def pytest_collection_finish(session: pytest.Session) -> None:
    gc.enable()
    gc.collect()
    gc.freeze()


@pytest.fixture
def context() -> type[FakeContext]:
    return FakeContext


@pytest.fixture
def without_shipped_charts(monkeypatch: pytest.MonkeyPatch) -> None:
    """There are the charts of the test alone: to check those, too, takes most of the time."""
    monkeypatch.setattr("cobodeck.project.chart_files.shipped_charts", lambda: ())
