"""What a chart deals with, which is what the summary of a run of it tells."""

from __future__ import annotations

from cobodeck.project import behaviour_of, reached
from cobodeck.setup import Setup

COMPANY, REQUESTS, ESCAPES = "company", "requests", "escapes"
TOPICS = frozenset((COMPANY, REQUESTS, ESCAPES))
"""A person who is there, touches that they ask for, and getting out of their way."""


def topics_of(setup: Setup) -> frozenset[str]:
    """Those of the `TOPICS` with which the chart deals."""
    uses = setup.uses()
    is_told = {
        COMPANY: uses.person,
        REQUESTS: "vr.haptic_request" in uses.signals | uses.welcome,
        ESCAPES: "escape" in map(behaviour_of, reached({setup.chart.name}, setup.library)),
    }
    return frozenset(topic for topic, told in is_told.items() if told)
