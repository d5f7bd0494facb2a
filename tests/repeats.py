"""What the short form of the tests does less of, or not at all: that is what CI runs."""

import os
from collections.abc import Sequence

import pytest

SHORT = bool(os.environ.get("CI"))
TIMES = 2 if SHORT else 20
"""So often is each fault brought about."""
long_form = pytest.mark.skipif(SHORT, reason="left out of the short form")
"""Of a test that costs more than it adds to what else runs."""


def fewer(seeds: Sequence[int]) -> Sequence[int]:
    """All of them, and every fourth in the short form."""
    return seeds[::4] if SHORT else seeds
