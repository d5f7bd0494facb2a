"""Every block of figures in a page, and what makes it from committed results.

`python -m cobodeck.pages` (`make figures`) writes all of them anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from cobodeck.bench import (
    curves_block,
    engine_block,
    missed_block,
    plans_block,
    reference_block,
    runs_block,
    tiers_in_short,
)
from cobodeck.bench.system import disturbed_block, keys_block, precision_block
from cobodeck.campaign import campaigns_block, campaigns_in_short
from cobodeck.markdown import with_blocks
from cobodeck.paper import paper_block, paper_in_short
from cobodeck.terminal import show

ROOT = Path(__file__).parents[1]


def measured_block() -> str:
    """What the first page says: the paper's table, many people, the tiers."""
    parts = [paper_in_short(), campaigns_in_short(), tiers_in_short()]
    return "\n\n".join(filter(None, parts))


PAGES: Mapping[str, Mapping[str, Callable[[], str]]] = {
    "README.md": {"measured": measured_block},
    "cobodeck/FIGURES.md": {
        "bench simulation": runs_block,
        "bench curves": curves_block,
        "bench missed": missed_block,
        "bench engine": engine_block,
    },
    "cobodeck/campaign/PRECISION.md": {
        "precision": precision_block,
        "disturbed": disturbed_block,
    },
    "cobodeck/campaign/KEYS.md": {"keys": keys_block},
    "cobodeck/campaign/README.md": {"campaigns": campaigns_block},
    "cobodeck/paper/README.md": {"evaluate paper": paper_block},
    "hw/sim/physics/README.md": {"bench reference": reference_block},
    "states/arm/README.md": {"bench arm": plans_block},
}
"""The blocks of each page, in their order."""


def renewed(page: str) -> str:
    """The text of a page as it should be.

    Raises:
        ValueError: the page has other markers than its blocks.
    """
    text = (ROOT / page).read_text(encoding="utf-8")
    return with_blocks(text, {name: block() for name, block in PAGES[page].items()})


def main() -> None:
    """Write all pages that are not as they should be."""
    for page in PAGES:
        file, text = ROOT / page, renewed(page)
        if file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")
            show(page)


if __name__ == "__main__":
    main()
