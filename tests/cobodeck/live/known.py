"""What charts of these tests can name: looked up once."""

from __future__ import annotations

from functools import cache

from cobodeck.project.state_catalogue import Catalogue, catalogue


@cache
def known() -> Catalogue:
    """Of what is shipped."""
    return catalogue(own=False)
