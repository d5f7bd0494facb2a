"""Switches for all tests."""

import os

import pytest
from hypothesis import settings

pytest_plugins = ["cobodeck.pytest_plugin"]

# a red build must repeat
settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--hardware", action="store_true", help="run tests that move a real robot")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--hardware"):
        return
    skip = pytest.mark.skip(reason="moves a real robot; run it with --hardware")
    for item in items:
        if item.get_closest_marker("hardware"):
            item.add_marker(skip)
