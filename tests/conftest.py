"""Switches for all tests."""

import os

import pytest
from hypothesis import HealthCheck, settings

pytest_plugins = ["cobodeck.pytest_plugin"]

# what depends on how busy the machine is, or on luck, fails no test
CALM = settings(
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
settings.register_profile("calm", CALM)
# a red build must repeat
settings.register_profile("ci", CALM, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "calm")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--hardware", action="store_true", help="run tests that move a real robot")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--hardware"):
        return
    skip = pytest.mark.skip(reason="moves a real robot; run it with --hardware")
    for item in items:
        if item.get_closest_marker("hardware"):
            item.add_marker(skip)
