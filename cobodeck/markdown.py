"""Tables in pages, and the blocks of pages that are made from committed results.

A block stands between `<!-- NAME -->` and `<!-- NAME end -->`, each in a line of its own.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence

_MARKER = re.compile(r"^<!-- (.+?) -->$", flags=re.M)
_END = " end"
_WIDTH = 118


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table without a line break at its end."""
    lines = [f"| {' | '.join(row)} |" for row in (head, *rows)]
    return "\n".join([lines[0], "|---" * len(head) + "|", *lines[1:]])


def with_blocks(page: str, blocks: Mapping[str, str]) -> str:
    """The page's text with the text of each of its blocks replaced.

    Raises:
        ValueError: its markers are not those of the blocks, in the blocks' order.
    """
    markers = _MARKER.findall(page)
    wanted = [marker for name in blocks for marker in (name, name + _END)]
    if markers != wanted:
        raise ValueError(f"the markers are {markers}, and should be {wanted}")
    for name, text in blocks.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- {name}{_END} -->"
        before, _, rest = page.partition(begin)
        page = f"{before}{begin}{_wrapped(text)}\n{rest[rest.index(end) :]}"
    return page


def _wrapped(text: str) -> str:
    """Prose in lines of a common length; tables as they are."""
    parts = text.strip().split("\n\n")
    return "\n\n".join(
        part if part.startswith("|") else textwrap.fill(part, _WIDTH) for part in parts
    )
