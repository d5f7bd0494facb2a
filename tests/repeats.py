"""How often tests repeat what they do: by default, in CI, and in `make slow`."""

import os
from collections.abc import Sequence

import pytest

SHORT = bool(os.environ.get("CI"))
THOROUGH = bool(os.environ.get("THOROUGH")) and not SHORT
"""Set by `make slow`."""
TIMES = 2 if SHORT else 20
"""How often each fault is injected."""
long_form = pytest.mark.skipif(SHORT, reason="left out of the short form")
"""For tests that cost more than they add to the others."""


def fewer(seeds: Sequence[int], of: int = 4) -> Sequence[int]:
    """All seeds; in CI one `of` so many."""
    return seeds[::of] if SHORT else seeds


def examples(count: int, least: int = 10, of: int = 4) -> int:
    """The number of random examples of a property: `count` in `make slow`, else one `of` them."""
    return count if THOROUGH else max(count // of, least)
